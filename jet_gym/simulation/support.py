"""How far a point is inside the soles that carry the robot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np

from jet_gym.ground import sole_corners
from jet_gym.leg import Leg, Side
from jet_gym.robot import Robot
from jet_gym.simulation.body import Pose
from jet_gym.utils.arrays import Array

Edge = Literal["front", "rear", "inner", "outer"]


def support_margin(point: Array, soles: Sequence[tuple[Leg, Pose]]) -> float:
    """Return the distance [m] of a point (2,) from the edge of the convex hull of soles, negative outside.

    Outside of a corner it is the distance from the nearer of the two edges' lines. NaN without a sole or a point.
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
    x, y = point - position[:2]
    x_min, x_max, y_min, y_max = robot.leg(side).sole_rectangle
    edges: tuple[Edge, Edge, Edge, Edge] = ("rear", "front", "inner", "outer")
    to_right, to_left = y - y_min, y_max - y
    inner, outer = (to_right, to_left) if side == "left" else (to_left, to_right)
    return edges[int(np.argmin([x - x_min, x_max - x, inner, outer]))]
