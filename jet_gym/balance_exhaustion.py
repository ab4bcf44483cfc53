"""The compiled loops behind the balance space: every pelvis position of a grid, at swing foot after swing foot."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jet_gym.balance import Point, Stance, least_thrust, zmp_of
from jet_gym.constraints import JOINT_LIMITS, REACH
from jet_gym.joint_torques import largest_share, leg_torques
from jet_gym.leg import Leg, Six, Vector
from jet_gym.posture_state import posture_at
from jet_gym.single_support import SingleSupport, pelvis_over, stance_between
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined

NEVER = 1e300  # [N] thrust where no posture balances; compiled code may not use infinity
_BLOCK = 64  # postures side by side in SIMD lanes
_ROUNDING = 1e-9  # [m] by which the leg's reach is taken too long; each posture is then judged by itself


class Exploration(NamedTuple):
    """What is explored, in numbers that compiled code takes by value."""

    robot: SingleSupport
    swing_effort: Six  # [N m] largest torques of the swing leg
    support_effort: Six  # [N m] likewise of the support leg
    support_sole: Vector  # [m] and the origin of the pelvis grid
    spacing: float  # [m] of that grid
    fan_off_counts: bool  # whether a posture counts that balances only with the fan off


class _Block(NamedTuple):
    """Postures that are judged side by side, a column each."""

    candidates: Array  # (3, _BLOCK) [m] pelvis positions
    asked: Array  # (_BLOCK,) [N] thrust that balances
    free: Array  # (_BLOCK,) [N] least thrust; 0 where the robot balances with the fan off
    com: Array  # (2, _BLOCK) [m] centre of mass
    violations: NDArray[np.int64]  # (_BLOCK,) flags


@entry_point
def explore_columns(
    exploration: Exploration,
    columns: Array,
    heights: Array,
    thrust: Array,
    thrust_within_torque: Array,
    torque_share: Array,
) -> None:
    """Find the least thrust with which some posture balances, above each of some places of the swing foot.

    Args:
        exploration: The robot, its support sole and the grid.
        columns: Places of the swing sole (C, 2) [m], x and y.
        heights: Its heights (H,) [m].
        thrust: Receives the least thrust (C, H) [N]: 0 where a posture balances without, NEVER where none does.
        thrust_within_torque: Receives the same of the postures whose static torques the servos can hold.
        torque_share: Receives the least share (C, H) of the servos' torque with which some posture balances.
    """
    block = _Block(
        np.empty((3, _BLOCK)), np.empty(_BLOCK), np.empty(_BLOCK), np.empty((2, _BLOCK)), np.empty(_BLOCK, np.int64)
    )
    for column in range(len(columns)):
        for level in range(len(heights)):
            swing_sole = (columns[column, 0], columns[column, 1], heights[level])
            least, least_held, share = _explore(exploration, swing_sole, block)
            thrust[column, level] = least
            thrust_within_torque[column, level] = least_held
            torque_share[column, level] = share


@inlined
def _explore(exploration: Exploration, swing_sole: Vector, block: _Block) -> Vector:
    """Go through the pelvis positions from which both feet are in reach; return what :func:`_judge` found."""
    robot, origin, spacing = exploration.robot, exploration.support_sole, exploration.spacing
    swing_leg, support_leg, candidates = robot.swing_leg, robot.support_leg, block.candidates
    stance, lowest = stance_between(robot, swing_sole, origin), max(swing_sole[2], origin[2])
    ax, ay, az = pelvis_over(swing_leg, stance, stance.swing_ankle)
    bx, by, bz = pelvis_over(support_leg, stance, stance.support_ankle)
    swing_reach, support_reach = _squared_reach(swing_leg), _squared_reach(support_leg)
    a, b = math.sqrt(swing_reach), math.sqrt(support_reach)
    found = np.full(3, NEVER)
    count = 0
    first_x, after_x = _between(max(ax - a, bx - b), min(ax + a, bx + b), origin[0], spacing)
    first_y, after_y = _between(max(ay - a, by - b), min(ay + a, by + b), origin[1], spacing)
    for i in range(first_x, after_x):
        x = origin[0] + spacing * i
        for j in range(first_y, after_y):
            y = origin[1] + spacing * j
            over_a = swing_reach - (x - ax) * (x - ax) - (y - ay) * (y - ay)
            over_b = support_reach - (x - bx) * (x - bx) - (y - by) * (y - by)
            if over_a < 0.0 or over_b < 0.0:
                continue
            over_a, over_b = math.sqrt(over_a), math.sqrt(over_b)
            low, high = max(lowest, az - over_a, bz - over_b), min(az + over_a, bz + over_b)
            first_z, after_z = _between(low, high, origin[2], spacing)
            for k in range(first_z, after_z):
                candidates[0, count], candidates[1, count], candidates[2, count] = x, y, origin[2] + spacing * k
                count += 1
                if count == _BLOCK:
                    _judge(exploration, stance, block, count, found)
                    count = 0
    for i in range(count, _BLOCK):  # the lanes that are left get what was looked at before
        for axis in range(3):
            candidates[axis, i] = candidates[axis, 0]
    if count > 0:
        _judge(exploration, stance, block, count, found)
    return found[0], found[1], found[2]


@inlined
def _squared_reach(leg: Leg) -> float:
    """Return the square of the farthest that the hip gets from the ankle [m^2]."""
    thigh = math.sqrt(leg.thigh[0] * leg.thigh[0] + leg.thigh[2] * leg.thigh[2])
    shank = math.sqrt(leg.shank[0] * leg.shank[0] + leg.shank[2] * leg.shank[2])
    straight = thigh + shank + _ROUNDING
    return straight * straight + leg.shank[1] * leg.shank[1]


@inlined
def _between(low: float, high: float, origin: float, spacing: float) -> tuple[int, int]:
    """Return the index of a grid's first place at or after ``low``, and that after its last up to ``high``."""
    first = math.ceil((low - origin - _ROUNDING) / spacing)
    return first, math.floor((high - origin + _ROUNDING) / spacing) + 1


@entry_point
def _judge(exploration: Exploration, stance: Stance, block: _Block, count: int, found: Array) -> None:
    """Lower what was found by the first ``count`` postures of a block.

    That is the least thrust [N] with which a posture balances, the least with which one does that the servos can
    hold, and the least share of their torque.
    """
    candidates, asked, free, com, violations = block
    robot, balance = exploration.robot, exploration.robot.balance
    for i in range(_BLOCK):
        pelvis = (candidates[0, i], candidates[1, i], candidates[2, i])
        state = posture_at(robot, stance, pelvis)
        x, y, _ = state.center_of_mass
        com[0, i], com[1, i], asked[i], violations[i] = x, y, state.thrust, state.violations
        free[i] = least_thrust(balance.weight, x, y, stance.fan, stance.support, balance.zmp_margin)
    for i in range(count):
        pelvis = (candidates[0, i], candidates[1, i], candidates[2, i])
        for without in (True, False):
            if without:
                stands = (free[i] <= 0.0) & (violations[i] & (REACH | JOINT_LIMITS) == 0)
                balances, thrust = exploration.fan_off_counts & stands, 0.0
            else:
                balances, thrust = violations[i] == 0, asked[i]
            if balances:
                share = _torque_share(exploration, stance, pelvis, (com[0, i], com[1, i]), thrust)
                found[0] = min(found[0], thrust)
                found[1] = min(found[1], thrust) if share <= 1.0 else found[1]
                found[2] = min(found[2], share)


@entry_point
def _torque_share(exploration: Exploration, stance: Stance, pelvis: Vector, com: Point, thrust: float) -> float:
    """Return the largest share of its torque that any joint needs to hold a posture under a thrust [N]."""
    swing_leg, support_leg, _, _, balance = exploration.robot
    state = posture_at(exploration.robot, stance, pelvis)
    c, s = stance.cos_yaw, stance.sin_yaw
    fan_x, fan_y = stance.fan[0] - pelvis[0], stance.fan[1] - pelvis[1]
    zmp = zmp_of(balance.weight, com[0], com[1], stance.fan, thrust)
    zmp_x, zmp_y = zmp[0] - pelvis[0], zmp[1] - pelvis[1]
    of_swing = leg_torques(
        swing_leg, state.swing_cosines, state.swing_sines, thrust, (c * fan_x + s * fan_y, c * fan_y - s * fan_x)
    )
    of_support = leg_torques(
        support_leg, state.support_cosines, state.support_sines, balance.weight - thrust,
        (c * zmp_x + s * zmp_y, c * zmp_y - s * zmp_x),
    )  # fmt: skip
    share_of_swing = largest_share(of_swing, exploration.swing_effort)
    return max(share_of_swing, largest_share(of_support, exploration.support_effort))
