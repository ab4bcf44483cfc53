"""The constraints of a posture, by name and as flags that compiled code can combine, and the search ranges."""

from __future__ import annotations

import functools

REACH = 1  # a sole is out of its leg's reach; then eqs (8) to (11) count as violated too
JOINT_LIMITS = 2  # eq. (8)
THRUST = 4  # eq. (9)
EDGE_POLYGON = 8  # eq. (10)
ZMP = 16  # eq. (11)
SEARCH_RANGE = 32  # eq. (13)

FIRST_RANGE = 0.150
"""Largest distance of the pelvis from the nominal one at the first swing point, per axis [m], Table 2."""
LATER_RANGE = 0.025
"""Largest move of the pelvis between two swing points, per axis [m], delta of eq. (13), which Table 3 gives."""

CONSTRAINT_NAMES = {
    REACH: "reach",
    JOINT_LIMITS: "joint_limits",
    THRUST: "thrust",
    EDGE_POLYGON: "edge_polygon",
    ZMP: "zmp",
    SEARCH_RANGE: "search_range",
}


@functools.cache
def violation_names(flags: int) -> tuple[str, ...]:
    """Return the names of the constraints whose flags are set."""
    return tuple(name for flag, name in CONSTRAINT_NAMES.items() if flags & flag)
