"""What the task of choosing postures consists of: search ranges, scales of the reward, how steps are drawn."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from jet_gym.constraints import FIRST_RANGE, LATER_RANGE
from jet_gym.utils.settings import require_within

FITNESS_TERMS = ("f1", "f2", "f3", "f4")
"""Names of the terms of the fitness, eq. (15), which is their sum."""

REWARD_TERMS = (
    "thrust",
    "smoothness",
    "reach",
    "joint_limits",
    "thrust_limits",
    "edge_polygon",
    "zmp",
    "tilt",
    "fall",
)
"""Names of the reward's terms; each is zero or negative, and the reward is their sum."""


@dataclass(frozen=True)
class TaskSettings:
    """The task of ``JetHR1Step-v0``.

    Attributes:
        first_range: Half the edge of the cube that the first action spans [m], Table 2.
        later_range: Half the edge of the cube that a later action spans [m], Table 3, eq. (13).
        violation_cost: What a violated constraint costs at least, in units of a point at full thrust.
        largest_cost: What it costs at most.
        reach_scale: Distance out of reach [m] that costs one unit more.
        angle_scale: Angle beyond a joint limit [rad] that costs one unit more.
        edge_scale: Distance of the centre of mass outside of the edge polygon [m] that costs one unit more. The
            angle of eq. (10) itself says little: near the polygon's tips, where the thrust is least, a hair's
            breadth is tens of degrees.
        zmp_scale: Distance of the ZMP outside of the sole [m] that costs one unit more.
        difficulty: How far drawn steps may go, from 0 (landings one stance, 0.225 m, from the support foot) to 1
            (the edge of feasibility).
    """

    first_range: float = FIRST_RANGE
    later_range: float = LATER_RANGE
    violation_cost: float = 2.0
    largest_cost: float = 6.0
    reach_scale: float = 0.05
    angle_scale: float = math.radians(20.0)
    edge_scale: float = 0.01
    zmp_scale: float = 0.05
    difficulty: float = 1.0

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed."""
        for name in ("first_range", "later_range", "reach_scale", "angle_scale", "edge_scale", "zmp_scale"):
            require_within(name, getattr(self, name), above=True)
        require_within("largest_cost", self.largest_cost)
        require_within("violation_cost", self.violation_cost, 0.0, self.largest_cost)
        require_within("difficulty", self.difficulty, 0.0, 1.0)

    def parameters(self) -> TaskParameters:
        """Return the numbers for compiled code."""
        return TaskParameters(
            self.first_range,
            self.later_range,
            self.violation_cost,
            self.largest_cost,
            self.reach_scale,
            self.angle_scale,
            self.edge_scale,
            self.zmp_scale,
        )


class TaskParameters(NamedTuple):
    """Task settings in numbers that compiled code takes by value."""

    first_range: float  # [m]
    later_range: float  # [m]
    violation_cost: float
    largest_cost: float
    reach_scale: float  # [m]
    angle_scale: float  # [rad]
    edge_scale: float  # [m]
    zmp_scale: float  # [m]
