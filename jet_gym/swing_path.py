"""The path of the swing sole: an arc of a circle, as the paper's swing trajectories are.

Plain functions, so that a :class:`~jet_gym.step.Step` can call them without loading a compiler; the environments
compile those of scalars.
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeVar

import numpy as np

from jet_gym.leg import Vector
from jet_gym.utils.arrays import Array

PATH_CHECKS = 60  # places along an arc, at least, at which the feet are held against each other
_VERTICAL = 1e-9  # [m] a chord with a shorter shadow is vertical

Edges = tuple[float, float, float, float]  # [m] x_min, x_max, y_min, y_max of a sole, from its frame
Distances = TypeVar("Distances", float, Array)


class Arc(NamedTuple):
    """An arc of a circle in a vertical plane. World frame."""

    start: Vector  # [m]
    landing: Vector  # [m]
    center: Vector  # [m] of the circle
    along: Vector  # [m] radius along the chord
    up: Vector  # [m] radius towards the arc's middle
    half_angle: float  # [rad] half of the angle that the arc spans


def arc_of(start: Vector, landing: Vector, apex: float, side: float) -> Arc:
    """Return the arc from start to landing that rises ``apex`` above the chord between them.

    Args:
        start: Where it begins [m].
        landing: Where it ends [m].
        apex: Distance from the chord's middle to the arc's [m].
        side: +1 or -1: a vertical chord's arc bulges towards +y or -y.
    """
    cx, cy, cz = landing[0] - start[0], landing[1] - start[1], landing[2] - start[2]
    half_chord = 0.5 * math.sqrt(cx * cx + cy * cy + cz * cz)
    radius = (half_chord * half_chord + apex * apex) / (2.0 * apex)
    half_angle = math.atan2(half_chord, radius - apex)
    shadow_squared = cx * cx + cy * cy
    if shadow_squared < _VERTICAL * _VERTICAL:
        ux, uy, uz = 0.0, side, 0.0
    else:
        scale = 1.0 / (2.0 * half_chord * math.sqrt(shadow_squared))
        ux, uy, uz = -cx * cz * scale, -cy * cz * scale, shadow_squared * scale
    scale = radius / (2.0 * half_chord)
    below = apex - radius
    center = (
        0.5 * (start[0] + landing[0]) + below * ux,
        0.5 * (start[1] + landing[1]) + below * uy,
        0.5 * (start[2] + landing[2]) + below * uz,
    )
    along = (cx * scale, cy * scale, cz * scale)
    return Arc(start, landing, center, along, (radius * ux, radius * uy, radius * uz), half_angle)


def arc_points(arc: Arc, fractions: Array) -> Array:
    """Return the points (N, 3) [m] at fractions (N,) of the arc's angle; 0 is exactly the start, 1 the landing."""
    angles = arc.half_angle * (2.0 * fractions - 1.0)
    points: Array = arc.center + np.outer(np.sin(angles), arc.along) + np.outer(np.cos(angles), arc.up)
    points[fractions <= 0.0], points[fractions >= 1.0] = arc.start, arc.landing
    return points


def feet_apart(swing: Edges, support: Edges, dx: Distances, dy: Distances) -> Distances:
    """Return how far the soles are apart along x or y, whichever is more [m]; negative where they overlap.

    Args:
        swing: The swing sole.
        support: The support sole.
        dx: From the support sole's frame to the swing sole's, along x [m].
        dy: Likewise along y [m].
    """
    apart_x = np.maximum(support[0] - (dx + swing[1]), dx + swing[0] - support[1])
    apart_y = np.maximum(support[2] - (dy + swing[3]), dy + swing[2] - support[3])
    apart: Distances = np.maximum(apart_x, apart_y)
    return apart


def nominal_pelvis(start: Vector, support: Vector, hip_offset: float, standing_height: float) -> Vector:
    """Return a pelvis [m] between the soles from which a first search sets out, the support leg upright.

    From the support sole it lies half a hip's width towards the swing sole, but at most half way: a robot that
    is about to stand on one foot has its weight near it, however wide its stance.

    Args:
        start: The swing sole before the step [m].
        support: The support sole [m].
        hip_offset: Horizontal distance from the pelvis origin to a hip [m].
        standing_height: Height of the pelvis above the soles [m].
    """
    dx, dy = start[0] - support[0], start[1] - support[1]
    share = min(hip_offset / max(math.sqrt(dx * dx + dy * dy), _VERTICAL), 0.5)
    height = 0.5 * (start[2] + support[2]) + standing_height
    return (support[0] + share * dx, support[1] + share * dy, height)
