"""What an agent sees: seen from the support sole, mirrored so that the swing leg is always the left one."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jet_gym.balance import BalanceParameters, edge_undefined, stance_of
from jet_gym.compilation import entry_point, inlined
from jet_gym.envs.lanes import Lanes, lane_arc, lane_sole
from jet_gym.envs.packing import unpack
from jet_gym.posture_block import (
    BLOCK,
    COM,
    EDGE,
    FOUND_ROWS,
    FOUND_THRUST,
    GIVEN_ROWS,
    evaluate_blocks,
    put,
)
from jet_gym.robot import Leg, Vector
from jet_gym.urdf import Array


class Component(NamedTuple):
    """One component of the observation."""

    name: str
    low: float
    high: float


_POSITION = 2.0  # [m]
_AHEAD = 0.1  # [m] unit of the path ahead

COMPONENTS = (
    Component("progress", 0.0, 1.0),
    Component("first_point", 0.0, 1.0),
    *(Component(f"pelvis_{axis}", -_POSITION, _POSITION) for axis in "xyz"),
    *(Component(f"swing_sole_{axis}", -_POSITION, _POSITION) for axis in "xyz"),
    *(Component(f"one_point_ahead_{axis}", -10.0, 10.0) for axis in "xyz"),
    *(Component(f"three_points_ahead_{axis}", -10.0, 10.0) for axis in "xyz"),
    *(Component(f"landing_{axis}", -_POSITION, _POSITION) for axis in "xyz"),
    Component("com_if_staying_x", -_POSITION, _POSITION),
    Component("com_if_staying_y", -_POSITION, _POSITION),
    Component("thrust_if_staying", -3.0, 3.0),
    Component("edge_angle_if_staying", -10.0, 10.0),
    Component("swing_leg_extension", 0.0, 3.0),
    Component("support_leg_extension", 0.0, 3.0),
    Component("points_to_go", 0.0, 10.0),
    Component("last_thrust", 0.0, 1.0),
    Component("roll", -math.pi, math.pi),
    Component("pitch", -math.pi, math.pi),
)
"""Components of the observation, in order; the environment's documentation says what they mean."""

LOW = np.array([component.low for component in COMPONENTS], dtype=np.float32)
HIGH = np.array([component.high for component in COMPONENTS], dtype=np.float32)

_POINTS_UNIT = 30.0
_ROLL, _PITCH = len(COMPONENTS) - 2, len(COMPONENTS) - 1


@entry_point
def observe(
    numbers: Array,
    lanes: Lanes,
    attitude: Array,
    selected: NDArray[np.int64],
    observations: NDArray[np.float32],
) -> None:
    """Observe some lanes, all of one swing leg, before their next action.

    Args:
        numbers: The task with this swing leg, packed.
        lanes: The lanes, N of them.
        attitude: Measured roll and pitch of the pelvis (N, 2) [rad], about its own forward and left axes.
        selected: Which lanes.
        observations: Receives their observations (N, len(COMPONENTS)), each in its lane's row.
    """
    swing_leg, support_leg, trunk, side, balance, _, _ = unpack(numbers)
    givens, founds = np.zeros((1, GIVEN_ROWS, BLOCK)), np.empty((1, FOUND_ROWS, BLOCK))
    flags = np.empty((1, BLOCK), np.int64)
    given, found = givens[0], founds[0]
    for start in range(0, len(selected), BLOCK):
        size = min(BLOCK, len(selected) - start)
        for column in range(size):
            lane = selected[start + column]
            row = observations[lane]
            sole = _observe_path(lanes, lane, side, row)
            support = (lanes.support[lane, 0], lanes.support[lane, 1], lanes.support[lane, 2])
            stance = stance_of(swing_leg, support_leg, side, balance.zmp_margin, sole, support)
            pelvis = (lanes.pelvis[lane, 0], lanes.pelvis[lane, 1], lanes.pelvis[lane, 2])
            put(given, column, stance, pelvis)
            row[21] = _extension(swing_leg, pelvis, stance.cos_yaw, stance.sin_yaw, stance.swing_ankle)
            row[22] = _extension(support_leg, pelvis, stance.cos_yaw, stance.sin_yaw, stance.support_ankle)
            row[24] = min(max(lanes.thrust[lane] / balance.max_thrust, 0.0), 1.0)
            row[_ROLL] = _clip(side * attitude[lane, 0], math.pi)
            row[_PITCH] = _clip(attitude[lane, 1], math.pi)
        evaluate_blocks(swing_leg, support_leg, trunk, balance, givens, founds, flags)
        for column in range(size):
            lane = selected[start + column]
            _observe_balance(balance, lanes, lane, side, found, column, observations[lane])


@inlined
def _observe_path(lanes: Lanes, lane: int, side: float, row: NDArray[np.float32]) -> Vector:
    """Write what concerns the path; return the swing sole at the coming swing point."""
    last = lanes.points[lane] - 1
    point = min(lanes.point[lane], last)
    support = (lanes.support[lane, 0], lanes.support[lane, 1], lanes.support[lane, 2])
    pelvis = (lanes.pelvis[lane, 0], lanes.pelvis[lane, 1], lanes.pelvis[lane, 2])
    landing = (lanes.landing[lane, 0], lanes.landing[lane, 1], lanes.landing[lane, 2])
    arc = lane_arc(lanes, lane)
    sole = lane_sole(lanes, lane, arc, point)
    row[0] = point / last
    row[1] = 1.0 if lanes.point[lane] == 0 else 0.0
    _write(row, 2, pelvis, support, side, 1.0, _POSITION)
    _write(row, 5, sole, support, side, 1.0, _POSITION)
    _write(row, 8, lane_sole(lanes, lane, arc, min(point + 1, last)), sole, side, _AHEAD, 10.0)
    _write(row, 11, lane_sole(lanes, lane, arc, min(point + 3, last)), sole, side, _AHEAD, 10.0)
    _write(row, 14, landing, support, side, 1.0, _POSITION)
    row[23] = min((last - point) / _POINTS_UNIT, 10.0)
    return sole


@inlined
def _observe_balance(
    balance: BalanceParameters,
    lanes: Lanes,
    lane: int,
    side: float,
    found: Array,
    column: int,
    row: NDArray[np.float32],
) -> None:
    """Write what the balance would be if the pelvis stayed."""
    row[17] = _clip(found[COM, column] - lanes.support[lane, 0], _POSITION)
    row[18] = _clip(side * (found[COM + 1, column] - lanes.support[lane, 1]), _POSITION)
    row[19] = _clip(found[FOUND_THRUST, column] / balance.max_thrust, 3.0)
    undefined = edge_undefined(found[EDGE + 2, column])
    edge_angle = 0.0 if undefined else math.atan2(found[EDGE, column], found[EDGE + 1, column])
    row[20] = _clip(side * edge_angle / math.atan(balance.edge_slope), 10.0)


@inlined
def _clip(value: float, bound: float) -> float:
    return min(max(value, -bound), bound)


@inlined
def _write(
    row: NDArray[np.float32], column: int, point: Vector, origin: Vector, side: float, unit: float, bound: float
) -> None:
    """Write a mirrored, clipped difference of two points."""
    row[column] = _clip((point[0] - origin[0]) / unit, bound)
    row[column + 1] = _clip(side * (point[1] - origin[1]) / unit, bound)
    row[column + 2] = _clip((point[2] - origin[2]) / unit, bound)


@inlined
def _extension(leg: Leg, pelvis: Vector, cos_yaw: float, sin_yaw: float, ankle: Vector) -> float:
    """Return the distance from hip to ankle over the length of the straight leg."""
    dx = pelvis[0] + cos_yaw * leg.hip[0] - sin_yaw * leg.hip[1] - ankle[0]
    dy = pelvis[1] + sin_yaw * leg.hip[0] + cos_yaw * leg.hip[1] - ankle[1]
    dz = pelvis[2] + leg.hip[2] - ankle[2]
    thigh = math.sqrt(leg.thigh[0] ** 2 + leg.thigh[1] ** 2 + leg.thigh[2] ** 2)
    shank = math.sqrt(leg.shank[0] ** 2 + leg.shank[1] ** 2 + leg.shank[2] ** 2)
    return min(math.sqrt(dx * dx + dy * dy + dz * dz) / (thigh + shank), 3.0)
