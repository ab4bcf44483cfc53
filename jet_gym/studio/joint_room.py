"""How much room joints have to the ends of their ranges, and which of them have little."""

from __future__ import annotations

import numpy as np

from jet_gym.robot import Robot
from jet_gym.utils.arrays import Array

NEAR_LIMIT = np.radians(12.0)  # [rad] from where on a joint is marked and named
AT_LIMIT = np.radians(3.0)  # [rad] from where on its mark is red


def room_to_limits(robot: Robot, joint_positions: Array) -> Array:
    """Return how far each joint is from the nearer end of its range (12,) [rad]; negative beyond it."""
    return np.minimum(joint_positions - robot.lower, robot.upper - joint_positions)


def joints_near_limits(robot: Robot, joint_positions: Array) -> list[tuple[str, float]]:
    """Return the joints near the end of their range, nearest first, each with the room that is left [rad]."""
    room = room_to_limits(robot, joint_positions)
    return [(robot.joint_names[k], float(room[k])) for k in np.argsort(room) if room[k] < NEAR_LIMIT]
