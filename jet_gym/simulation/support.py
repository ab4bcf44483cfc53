"""How far a point is inside the soles that carry the robot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np

from jet_gym.ground import edge_distances, sole_corners
from jet_gym.leg import Leg, Side
from jet_gym.robot import Robot
from jet_gym.simulation.body import Pose
from jet_gym.utils.arrays import Array

Edge = Literal["front", "rear", "inner", "outer"]


def zmp_of_feet(forces: Array, centers: Array) -> Array:
    """Return the robot's ZMP (2,) [m], the mean of its feet's weighted by their loads; NaN if none is loaded.

    Args:
        forces: Vertical forces of the ground on the feet (K,) [N]; a foot that is not pushed up does not count.
        centers: The feet's own ZMPs (K, 2) [m], NaN without contact.
    """
    loaded = np.isfinite(centers).all(axis=1) & (forces > 0.0)
    if not loaded.any():
        return np.full(2, math.nan)
    zmp: Array = forces[loaded] @ centers[loaded] / forces[loaded].sum()
    return zmp


def support_margin(point: Array, soles: Sequence[tuple[Leg, Pose]]) -> float:
    """Return the distance [m] of a point (2,) from the edge of the convex hull of soles, negative outside.

    Outside of a corner it is the distance from the farther of the two edges' lines. NaN without a sole or a point.
    """
    if not soles or not np.isfinite(point).all():
        return math.nan
    corners = np.concatenate([(sole.position + sole_corners(leg) @ sole.axes.T)[:, :2] for leg, sole in soles])
    if len(soles) == 1:
        edges = np.roll(corners, -1, axis=0) - corners
        offsets = point - corners
        return float(((edges[:, 0] * offsets[:, 1] - edges[:, 1] * offsets[:, 0]) / np.hypot(*edges.T)).min())
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(corners)
    except QhullError:  # soles on edge
        return math.nan
    return float(-(hull.equations[:, :2] @ point + hull.equations[:, 2]).max())


def nearest_edge(point: Array, robot: Robot, side: Side, position: Array) -> Edge:
    """Return which edge of a sole that points forward is nearest to a point (2,) [m].

    Args:
        point: The point, world.
        robot: The robot.
        side: Which foot.
        position: Where its sole is (3,) [m].
    """
    rear, front, right, left = edge_distances(robot.leg(side), point - position[:2])
    edges: tuple[Edge, Edge, Edge, Edge] = ("rear", "front", "inner", "outer")
    inner, outer = (right, left) if side == "left" else (left, right)
    return edges[int(np.argmin([rear, front, inner, outer]))]
