"""Taking one action in many lanes: the posture, its fitness and its reward, in blocks that run in SIMD lanes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jet_gym import constraints
from jet_gym.balance import edge_undefined, outside_edge_polygon
from jet_gym.fitness import FitnessParameters, fitness_terms
from jet_gym.posture_block import (
    BLOCK,
    COM,
    COSINES,
    EDGE,
    FOUND_THRUST,
    FOUND_ZMP,
    OUT_OF_REACH,
    SINES,
    Block,
    evaluate_block,
    new_block,
    put,
    stance_in,
)
from jet_gym.single_support import SingleSupport, stance_between
from jet_gym.task.lanes import (
    LANE_WIDTH,
    PELVIS,
    POINT,
    POINTS,
    SUPPORT,
    THRUST,
    VIOLATED,
    gather,
    lanes_of_side,
    swing_sole,
    three,
)
from jet_gym.task.packing import unpack
from jet_gym.task.settings import TaskParameters
from jet_gym.task.transition import (
    ASKED_THRUST,
    ASSIGNED_ZMP,
    CENTER_OF_MASS,
    CHOSEN_PELVIS,
    EDGE_ANGLE,
    FIRST_FITNESS_TERM,
    FIRST_GRADED_TERM,
    FITNESS,
    GRADED,
    JOINTS,
    TRANSITION_ROWS,
    VIOLATIONS,
    YAW,
    ZMP,
)
from jet_gym.trigonometry import arctangent
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined


@entry_point
def advance(numbers: Array, lanes: Array, actions: Array, selected: NDArray[np.int64], transition: Array) -> None:
    """Take one action in each selected lane and judge it by the model.

    Args:
        numbers: The task with left and with right swing, each packed (2, ...).
        lanes: The lanes (N, LANE_WIDTH).
        actions: Displacements of the pelvis (N, 3) over the search range.
        selected: Which lanes.
        transition: Receives what the actions led to, each in its lane's column.
    """
    state, asked, moved_squared = np.zeros((LANE_WIDTH, BLOCK)), np.zeros((3, BLOCK)), np.empty(BLOCK)
    block, result = new_block(), np.zeros((TRANSITION_ROWS, BLOCK))
    for which in range(2):
        robot, fitness, task = unpack(numbers[which])
        chosen = lanes_of_side(lanes, selected, robot.side)
        for start in range(0, len(chosen), BLOCK):
            count = min(BLOCK, len(chosen) - start)
            gather(lanes, chosen, start, count, state)
            for column in range(count):
                for axis in range(3):
                    asked[axis, column] = actions[chosen[start + column], axis]
            _move(task, robot.side, asked, state, moved_squared)
            _place(robot, state, block)
            evaluate_block(robot, block)
            _describe(robot, state, block, result)
            _judge(robot, fitness, task, block, moved_squared, result)
            for row in range(TRANSITION_ROWS):
                for column in range(count):
                    transition[row, chosen[start + column]] = result[row, column]
            for column in range(count):
                lane = chosen[start + column]
                for axis in range(3):
                    lanes[lane, PELVIS + axis] = state[PELVIS + axis, column]
                lanes[lane, POINT] += 1.0
                lanes[lane, THRUST] = block.found[FOUND_THRUST, column]
                lanes[lane, VIOLATED] = 1.0 if block.violations[column] != 0 else lanes[lane, VIOLATED]


@inlined
def _move(task: TaskParameters, side: float, asked: Array, state: Array, moved_squared: Array) -> None:
    """Move the pelvis by the action; note the squared distance [m^2] that f3 counts, zero at the first point."""
    for i in range(BLOCK):
        first = state[POINT, i] == 0.0
        half = task.first_range if first else task.later_range
        dx = half * min(max(asked[0, i], -1.0), 1.0)
        dy = side * half * min(max(asked[1, i], -1.0), 1.0)
        dz = half * min(max(asked[2, i], -1.0), 1.0)
        state[PELVIS, i] += dx
        state[PELVIS + 1, i] += dy
        state[PELVIS + 2, i] += dz
        moved_squared[i] = 0.0 if first else dx * dx + dy * dy + dz * dz


@inlined
def _place(robot: SingleSupport, state: Array, block: Block) -> None:
    """Put the swing points and the pelvis positions into the block of postures."""
    for i in range(BLOCK):
        lane = state[:, i]
        sole = swing_sole(lane, lane[POINT] / (lane[POINTS] - 1.0))
        put(block.given, i, stance_between(robot, sole, three(lane, SUPPORT)), three(lane, PELVIS))


@inlined
def _describe(robot: SingleSupport, state: Array, block: Block, result: Array) -> None:
    """Write the postures."""
    angles, (given, found, violations) = np.empty(12 * BLOCK), block
    sines, cosines = (
        found[SINES : SINES + 12].reshape(12 * BLOCK),
        found[COSINES : COSINES + 12].reshape(12 * BLOCK),
    )
    for i in range(12 * BLOCK):
        angles[i] = arctangent(sines[i], cosines[i])
    for row in range(12):
        joint = row % 6
        leg = robot.swing_leg if row < 6 else robot.support_leg
        to = row if robot.side > 0.0 else (row + 6) % 12
        middle, sign = 0.5 * (leg.lower[joint] + leg.upper[joint]), leg.axis_signs[joint]
        for i in range(BLOCK):
            result[JOINTS + to, i] = sign * (middle + angles[row * BLOCK + i])
    for i in range(BLOCK):
        for axis in range(3):
            result[CHOSEN_PELVIS + axis, i] = state[PELVIS + axis, i]
            result[CENTER_OF_MASS + axis, i] = found[COM + axis, i]
        stance = stance_in(given, i)
        for axis in range(2):
            result[ZMP + axis, i] = found[FOUND_ZMP + axis, i]
            result[ASSIGNED_ZMP + axis, i] = stance.assigned_zmp[axis]
        result[YAW, i] = arctangent(stance.sin_yaw, stance.cos_yaw)
        edge_angle = arctangent(found[EDGE, i], found[EDGE + 1, i])
        result[EDGE_ANGLE, i] = 0.0 if edge_undefined(found[EDGE + 2, i]) else edge_angle
        result[ASKED_THRUST, i] = found[FOUND_THRUST, i]
        result[VIOLATIONS, i] = violations[i]


@inlined
def _judge(
    robot: SingleSupport,
    fitness: FitnessParameters,
    task: TaskParameters,
    block: Block,
    moved_squared: Array,
    result: Array,
) -> None:
    """Write fitness and graded reward, term by term and summed.

    The graded reward of a posture without violation is minus its fitness over that of full thrust.
    """
    balance, found = robot.balance, block.found
    joint_excess = np.zeros(BLOCK)  # [rad] of the worst joint beyond its limit
    for row in range(12):
        joint = row % 6
        leg = robot.swing_leg if row < 6 else robot.support_leg
        of = row if robot.side > 0.0 else (row + 6) % 12
        sign, lower, upper = leg.axis_signs[joint], leg.lower[joint], leg.upper[joint]
        for i in range(BLOCK):
            angle = sign * result[JOINTS + of, i]
            joint_excess[i] = max(joint_excess[i], lower - angle, angle - upper)
    for i in range(BLOCK):
        violations, thrust = block.violations[i], found[FOUND_THRUST, i]
        f1, f2, f3, f4 = fitness_terms(fitness, violations, thrust, moved_squared[i])
        result[FIRST_FITNESS_TERM, i], result[FIRST_FITNESS_TERM + 1, i] = f1, f2
        result[FIRST_FITNESS_TERM + 2, i], result[FIRST_FITNESS_TERM + 3, i] = f3, f4
        result[FITNESS, i] = f1 + f2 + f3 + f4

        stance = stance_in(block.given, i)
        x, y, support = found[FOUND_ZMP, i], found[FOUND_ZMP + 1, i], stance.support
        outside = max(support[0] - x, x - support[1], support[2] - y, y - support[3])
        over_thrust = max(thrust - balance.max_thrust, -thrust) / balance.max_thrust
        over_edge = outside_edge_polygon(stance, balance.edge_slope, found[EDGE, i], found[EDGE + 1, i])
        t0 = -min(max(thrust, 0.0), balance.max_thrust) / balance.max_thrust
        t1 = -f3 / (fitness.thrust_weight * balance.max_thrust)
        t2 = _cost(task, violations, constraints.REACH, found[OUT_OF_REACH, i] / task.reach_scale)
        t3 = _cost(task, violations, constraints.JOINT_LIMITS, joint_excess[i] / task.angle_scale)
        t4 = _cost(task, violations, constraints.THRUST, over_thrust)
        t5 = _cost(task, violations, constraints.EDGE_POLYGON, over_edge / task.edge_scale)
        t6 = _cost(task, violations, constraints.ZMP, outside / task.zmp_scale)
        result[FIRST_GRADED_TERM, i], result[FIRST_GRADED_TERM + 1, i] = t0, t1
        result[FIRST_GRADED_TERM + 2, i], result[FIRST_GRADED_TERM + 3, i] = t2, t3
        result[FIRST_GRADED_TERM + 4, i] = t4
        result[FIRST_GRADED_TERM + 5, i], result[FIRST_GRADED_TERM + 6, i] = t5, t6
        result[GRADED, i] = t0 + t1 + t2 + t3 + t4 + t5 + t6


@inlined
def _cost(task: TaskParameters, violations: int, constraint: int, excess: float) -> float:
    """Return minus the cost of a constraint, where violated: a fixed part and one that grows with the excess."""
    cost = min(task.violation_cost + max(excess, 0.0), task.largest_cost)
    return 0.0 if violations & constraint == 0 else -cost
