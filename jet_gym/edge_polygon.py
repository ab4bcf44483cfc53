r"""The edge polygon of eq. (10) in coordinates of its own: along its axis, and aside from it.

The axis leads from the assigned ZMP, where the thrust is nil, to the swing ankle, over a length :math:`L`. With the
centre of mass at :math:`s` along it and :math:`a` aside, sine and cosine of the angle of eq. (10), times both
lengths, are :math:`L a` and :math:`s (L - s) - a^2`. So the polygon is a lens with a tip at either end, and half as
wide as

.. math:: w(s) = \frac{\tan \rho \; s (L - s)}{L}

but for what is of the order of :math:`\tan^3 \rho`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from jet_gym.balance import Point, Stance
from jet_gym.utils.compilation import inlined

_SHORTEST = 1e-6  # [m]


class EdgeAxis(NamedTuple):
    """The axis of the edge polygon at a swing point. World frame."""

    tip: Point  # [m] the assigned ZMP
    x: float  # of the direction, a unit vector, from there to the swing ankle
    y: float
    length: float  # [m]


@inlined
def edge_axis(stance: Stance) -> EdgeAxis:
    """Return the axis of the edge polygon."""
    tip_x, tip_y = stance.assigned_zmp
    x, y = stance.swing_ankle[0] - tip_x, stance.swing_ankle[1] - tip_y
    length = max(math.sqrt(x * x + y * y), _SHORTEST)
    return EdgeAxis((tip_x, tip_y), x / length, y / length, length)


@inlined
def along_and_aside(axis: EdgeAxis, com_x: float, com_y: float) -> tuple[float, float]:
    """Return how far along the axis, and how far to its left, a centre of mass is [m]."""
    dx, dy = com_x - axis.tip[0], com_y - axis.tip[1]
    return dx * axis.x + dy * axis.y, dy * axis.x - dx * axis.y


@inlined
def point_in_world(axis: EdgeAxis, along: float, aside: float) -> Point:
    """Return the point [m] that is so far along the axis and to its left [m]."""
    return axis.tip[0] + along * axis.x - aside * axis.y, axis.tip[1] + along * axis.y + aside * axis.x


@inlined
def half_width(edge_slope: float, axis: EdgeAxis, along: float) -> float:
    """Return half the width of the edge polygon [m], or a share of it; ``edge_slope`` is tan(rho), or a share."""
    return edge_slope * along * (axis.length - along) / axis.length
