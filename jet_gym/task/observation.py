"""What an agent sees: seen from the support sole, mirrored so that the swing leg is always the left one."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jet_gym.balance import Stance, edge_undefined
from jet_gym.leg import Leg, Vector
from jet_gym.posture_block import (
    BLOCK,
    COM,
    EDGE,
    FOUND_THRUST,
    Block,
    evaluate_block,
    new_block,
    put,
    stance_in,
)
from jet_gym.single_support import SingleSupport, hip_from_ankle, stance_between, straight_length
from jet_gym.task.lanes import (
    ATTITUDE,
    LANDING,
    LANE_WIDTH,
    PELVIS,
    POINT,
    POINTS,
    SUPPORT,
    THRUST,
    gather,
    lanes_of_side,
    swing_sole,
    three,
)
from jet_gym.task.packing import unpack
from jet_gym.trigonometry import arctangent
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined


class Component(NamedTuple):
    """One component of the observation."""

    name: str
    low: float
    high: float


_POSITION = 2.0  # [m]
_AHEAD = 0.1  # [m] unit of the path ahead
_OFFSET = 0.01  # [m] unit of where the centre of mass is: the corridor of eq. (10) is millimetres wide
_MOST_OFFSET = 20.0  # of that unit

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
    *(Component(f"com_from_zmp_if_staying_{axis}", -_MOST_OFFSET, _MOST_OFFSET) for axis in "xy"),
    *(Component(f"com_to_line_if_staying_{axis}", -_MOST_OFFSET, _MOST_OFFSET) for axis in "xy"),
    Component("roll", -math.pi, math.pi),
    Component("pitch", -math.pi, math.pi),
)
"""Components of the observation, in order; the environment's documentation says what they mean."""


def _place_of(name: str) -> int:
    """Return where a component stands in the observation."""
    return [component.name for component in COMPONENTS].index(name)


# Where the components are; of those with axes where the first is.
_PROGRESS, FIRST_POINT = _place_of("progress"), _place_of("first_point")
OBSERVED_PELVIS, OBSERVED_SWING_SOLE = _place_of("pelvis_x"), _place_of("swing_sole_x")
_ONE_AHEAD, _THREE_AHEAD = _place_of("one_point_ahead_x"), _place_of("three_points_ahead_x")
_OBSERVED_LANDING, _OBSERVED_COM = _place_of("landing_x"), _place_of("com_if_staying_x")
_OBSERVED_THRUST, _OBSERVED_EDGE_ANGLE = _place_of("thrust_if_staying"), _place_of("edge_angle_if_staying")
_SWING_EXTENSION, _SUPPORT_EXTENSION = _place_of("swing_leg_extension"), _place_of("support_leg_extension")
_POINTS_TO_GO, _LAST_THRUST = _place_of("points_to_go"), _place_of("last_thrust")
_FROM_ZMP, _TO_LINE = _place_of("com_from_zmp_if_staying_x"), _place_of("com_to_line_if_staying_x")
_ROLL, _PITCH = _place_of("roll"), _place_of("pitch")

LOW = np.array([component.low for component in COMPONENTS], dtype=np.float32)
HIGH = np.array([component.high for component in COMPONENTS], dtype=np.float32)

_POINTS_UNIT = 30.0
_WIDTH = len(COMPONENTS)


@entry_point
def observe(numbers: Array, lanes: Array, selected: NDArray[np.int64], observations: NDArray[np.float32]) -> None:
    """Observe some lanes before their next action.

    Args:
        numbers: The task with left and with right swing, each packed (2, ...).
        lanes: The lanes (N, LANE_WIDTH).
        selected: Which lanes.
        observations: Receives their observations (N, len(COMPONENTS)), each in its lane's row.
    """
    state, rows = np.zeros((LANE_WIDTH, BLOCK)), np.zeros((_WIDTH, BLOCK))
    block = new_block()
    for which in range(2):
        robot = unpack(numbers[which]).robot
        chosen = lanes_of_side(lanes, selected, robot.side)
        for start in range(0, len(chosen), BLOCK):
            count = min(BLOCK, len(chosen) - start)
            gather(lanes, chosen, start, count, state)
            for i in range(BLOCK):
                lane, row = state[:, i], rows[:, i]
                stance = stance_between(robot, _observe_path(lane, robot.side, row), three(lane, SUPPORT))
                put(block.given, i, stance, three(lane, PELVIS))
                _observe_robot(robot, stance, lane, row)
            evaluate_block(robot, block)
            _observe_balance(robot, state, block, rows)
            for column in range(count):
                lane_index = chosen[start + column]
                for component in range(_WIDTH):
                    observations[lane_index, component] = rows[component, column]


@inlined
def _observe_path(lane: Array, side: float, row: Array) -> Vector:
    """Write what concerns the path; return the swing sole at the coming swing point."""
    last = lane[POINTS] - 1.0
    point = min(lane[POINT], last)
    support = three(lane, SUPPORT)
    sole = swing_sole(lane, point / last)
    row[_PROGRESS] = point / last
    row[FIRST_POINT] = 1.0 if lane[POINT] == 0.0 else 0.0
    _write(row, OBSERVED_PELVIS, three(lane, PELVIS), support, side, 1.0, _POSITION)
    _write(row, OBSERVED_SWING_SOLE, sole, support, side, 1.0, _POSITION)
    _write(row, _ONE_AHEAD, swing_sole(lane, (point + 1.0) / last), sole, side, _AHEAD, 10.0)
    _write(row, _THREE_AHEAD, swing_sole(lane, (point + 3.0) / last), sole, side, _AHEAD, 10.0)
    _write(row, _OBSERVED_LANDING, three(lane, LANDING), support, side, 1.0, _POSITION)
    row[_POINTS_TO_GO] = min((last - point) / _POINTS_UNIT, 10.0)
    return sole


@inlined
def _observe_robot(robot: SingleSupport, stance: Stance, lane: Array, row: Array) -> None:
    """Write how far the legs stretch, the last thrust and how the pelvis is inclined."""
    pelvis = three(lane, PELVIS)
    row[_SWING_EXTENSION] = _extension(robot.swing_leg, stance, stance.swing_ankle, pelvis)
    row[_SUPPORT_EXTENSION] = _extension(robot.support_leg, stance, stance.support_ankle, pelvis)
    row[_LAST_THRUST] = min(max(lane[THRUST] / robot.balance.max_thrust, 0.0), 1.0)
    row[_ROLL] = _clip(robot.side * lane[ATTITUDE], math.pi)
    row[_PITCH] = _clip(lane[ATTITUDE + 1], math.pi)


@inlined
def _observe_balance(robot: SingleSupport, state: Array, block: Block, rows: Array) -> None:
    """Write what the balance would be if the pelvis stayed."""
    balance, side, found = robot.balance, robot.side, block.found
    edge_tolerance = math.atan(balance.edge_slope)
    for i in range(BLOCK):
        rows[_OBSERVED_COM, i] = _clip(found[COM, i] - state[SUPPORT, i], _POSITION)
        rows[_OBSERVED_COM + 1, i] = _clip(side * (found[COM + 1, i] - state[SUPPORT + 1, i]), _POSITION)
        rows[_OBSERVED_THRUST, i] = _clip(found[FOUND_THRUST, i] / balance.max_thrust, 3.0)
        edge_angle = arctangent(found[EDGE, i], found[EDGE + 1, i])
        edge_angle = 0.0 if edge_undefined(found[EDGE + 2, i]) else edge_angle
        rows[_OBSERVED_EDGE_ANGLE, i] = _clip(side * edge_angle / edge_tolerance, 10.0)
        stance = stance_in(block.given, i)
        zmp_x, zmp_y = stance.assigned_zmp
        line_x, line_y = stance.swing_ankle[0] - zmp_x, stance.swing_ankle[1] - zmp_y
        from_zmp_x, from_zmp_y = found[COM, i] - zmp_x, found[COM + 1, i] - zmp_y
        along = (from_zmp_x * line_x + from_zmp_y * line_y) / max(line_x * line_x + line_y * line_y, 1e-9)
        rows[_FROM_ZMP, i] = _clip(from_zmp_x / _OFFSET, _MOST_OFFSET)
        rows[_FROM_ZMP + 1, i] = _clip(side * from_zmp_y / _OFFSET, _MOST_OFFSET)
        rows[_TO_LINE, i] = _clip((along * line_x - from_zmp_x) / _OFFSET, _MOST_OFFSET)
        rows[_TO_LINE + 1, i] = _clip(side * (along * line_y - from_zmp_y) / _OFFSET, _MOST_OFFSET)


@inlined
def _clip(value: float, bound: float) -> float:
    return min(max(value, -bound), bound)


@inlined
def _write(row: Array, column: int, point: Vector, origin: Vector, side: float, unit: float, bound: float) -> None:
    """Write a mirrored, clipped difference of two points."""
    row[column] = _clip((point[0] - origin[0]) / unit, bound)
    row[column + 1] = _clip(side * (point[1] - origin[1]) / unit, bound)
    row[column + 2] = _clip((point[2] - origin[2]) / unit, bound)


@inlined
def _extension(leg: Leg, stance: Stance, ankle: Vector, pelvis: Vector) -> float:
    """Return the distance from hip to ankle over the length of the straight leg."""
    dx, dy, dz = hip_from_ankle(leg, stance, ankle, pelvis)
    return min(math.sqrt(dx * dx + dy * dy + dz * dz) / straight_length(leg), 3.0)
