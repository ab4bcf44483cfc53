"""A robot that stands on one foot and swings the other, in numbers that compiled code takes by value."""

from __future__ import annotations

import math
from typing import NamedTuple

from jet_gym.balance import BalanceParameters, BalanceSettings, Stance, stance_of
from jet_gym.leg import Leg, Side, Vector
from jet_gym.robot import Robot, Trunk
from jet_gym.utils.compilation import inlined


class SingleSupport(NamedTuple):
    """A robot in single support: its legs by what they do, and what counts as balanced."""

    swing_leg: Leg
    support_leg: Leg
    trunk: Trunk
    side: float  # +1 where the left leg swings, -1 where the right one does
    balance: BalanceParameters


def single_support(robot: Robot, swing: Side, settings: BalanceSettings | None = None) -> SingleSupport:
    """Return a robot whose one leg swings.

    Args:
        robot: The robot.
        swing: The leg that swings, ``"left"`` or ``"right"``.
        settings: What counts as balanced; the defaults where omitted.

    Raises:
        ValueError: If there is no such leg.
        SettingsError: If the settings do not fit the robot's feet.
    """
    swing_leg, support_leg, side = swing_and_support(robot, swing)
    balance = (settings or BalanceSettings()).parameters(robot)
    return SingleSupport(swing_leg, support_leg, robot.trunk, side, balance)


def swing_and_support(robot: Robot, swing: Side) -> tuple[Leg, Leg, float]:
    """Return the swing leg, the support leg, and +1 or -1 for a left or right swing."""
    if swing == "left":
        return robot.left, robot.right, 1.0
    if swing == "right":
        return robot.right, robot.left, -1.0
    raise ValueError(f"swing must be 'left' or 'right', not {swing!r}")


@inlined
def stance_between(robot: SingleSupport, swing_sole: Vector, support_sole: Vector) -> Stance:
    """Describe the swing point at which the soles are at these places [m]."""
    zmp_margin = robot.balance.zmp_margin
    return stance_of(robot.swing_leg, robot.support_leg, robot.side, zmp_margin, swing_sole, support_sole)


@inlined
def hip_from_ankle(leg: Leg, stance: Stance, ankle: Vector, pelvis: Vector) -> Vector:
    """Return the vector from an ankle to the hip of its leg [m], the pelvis being where it is; world axes."""
    c, s, hip = stance.cos_yaw, stance.sin_yaw, leg.hip
    return (
        pelvis[0] + c * hip[0] - s * hip[1] - ankle[0],
        pelvis[1] + s * hip[0] + c * hip[1] - ankle[1],
        pelvis[2] + hip[2] - ankle[2],
    )


@inlined
def pelvis_over(leg: Leg, stance: Stance, ankle: Vector) -> Vector:
    """Return where the pelvis is [m] when the hip of a leg is at its ankle; world axes."""
    c, s, hip = stance.cos_yaw, stance.sin_yaw, leg.hip
    return (
        ankle[0] - (c * hip[0] - s * hip[1]),
        ankle[1] - (s * hip[0] + c * hip[1]),
        ankle[2] - hip[2],
    )


@inlined
def straight_length(leg: Leg) -> float:
    """Return the distance from hip to ankle of a straight leg [m], whose knee is not aside."""
    thigh = math.sqrt(leg.thigh[0] ** 2 + leg.thigh[1] ** 2 + leg.thigh[2] ** 2)
    shank = math.sqrt(leg.shank[0] ** 2 + leg.shank[1] ** 2 + leg.shank[2] ** 2)
    return thigh + shank
