"""Many episodes side by side, each a lane of a few arrays: the state of the task and its transition.

The single environment is one lane, the batch is thousands; both run the functions of this file, so that they
agree to the last bit.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jet_gym.balance import BalanceParameters, Rectangle, Stance, edge_undefined, stance_of
from jet_gym.compilation import entry_point, inlined
from jet_gym.constraints import EDGE_POLYGON, JOINT_LIMITS, REACH, THRUST, ZMP
from jet_gym.envs.packing import unpack
from jet_gym.envs.settings import REWARD_TERMS, TaskParameters
from jet_gym.fitness import FitnessParameters, fitness_terms
from jet_gym.posture_block import (
    BLOCK,
    COM,
    COSINES,
    EDGE,
    FOUND_ROWS,
    FOUND_THRUST,
    FOUND_ZMP,
    GIVEN_ROWS,
    OUT_OF_REACH,
    SINES,
    evaluate_blocks,
    joint_from_middle,
    put,
    stance_in,
)
from jet_gym.robot import Leg, Robot, Vector
from jet_gym.step import Step
from jet_gym.swing_path import Arc, arc_of, arc_point
from jet_gym.urdf import Array

compiled_arc_of, compiled_arc_point = inlined(arc_of), inlined(arc_point)


class Lanes(NamedTuple):
    """State of the lanes; N of them. World frame."""

    swing_is_left: NDArray[np.bool_]  # (N,)
    start: Array  # (N, 3) [m]
    landing: Array  # (N, 3) [m]
    support: Array  # (N, 3) [m]
    apex: Array  # (N,) [m]
    points: NDArray[np.int64]  # (N,)
    point: NDArray[np.int64]  # (N,) the swing point that the next action chooses a posture for
    pelvis: Array  # (N, 3) [m] the last pelvis; the nominal one before the first action
    thrust: Array  # (N,) [N] the last thrust asked for
    violated: NDArray[np.bool_]  # (N,) whether a constraint was violated at any point so far


class Transition(NamedTuple):
    """What one action led to in each lane; N of them. World frame."""

    joint_positions: Array  # (N, 12) [rad]
    joint_cosines: Array  # (N, 12) of the joints' angles as counted from the middles of their ranges
    joint_sines: Array  # (N, 12) likewise
    pelvis: Array  # (N, 3) [m]
    pelvis_yaw: Array  # (N,) [rad]
    com: Array  # (N, 3) [m]
    fan: Array  # (N, 2) [m]
    zmp: Array  # (N, 2) [m]
    assigned_zmp: Array  # (N, 2) [m]
    edge_angle: Array  # (N,) [rad]
    thrust: Array  # (N,) [N]
    fitness_terms: Array  # (N, 4)
    fitness: Array  # (N,) eq. (15), the sum of its terms
    reward_terms: Array  # (N, len(REWARD_TERMS)), graded, of the model
    graded: Array  # (N,) the sum of the reward's terms
    violations: NDArray[np.int64]  # (N,) flags


def empty_lanes(count: int) -> Lanes:
    """Return lanes without an episode."""
    return Lanes(
        swing_is_left=np.ones(count, dtype=np.bool_),
        start=np.zeros((count, 3)),
        landing=np.zeros((count, 3)),
        support=np.zeros((count, 3)),
        apex=np.zeros(count),
        points=np.zeros(count, dtype=np.int64),
        point=np.zeros(count, dtype=np.int64),
        pelvis=np.zeros((count, 3)),
        thrust=np.zeros(count),
        violated=np.zeros(count, dtype=np.bool_),
    )


def empty_transition(count: int) -> Transition:
    """Return fresh arrays for a transition."""
    return Transition(
        joint_positions=np.empty((count, 12)),
        joint_cosines=np.empty((count, 12)),
        joint_sines=np.empty((count, 12)),
        pelvis=np.empty((count, 3)),
        pelvis_yaw=np.empty(count),
        com=np.empty((count, 3)),
        fan=np.empty((count, 2)),
        zmp=np.empty((count, 2)),
        assigned_zmp=np.empty((count, 2)),
        edge_angle=np.empty(count),
        thrust=np.empty(count),
        fitness_terms=np.empty((count, 4)),
        fitness=np.empty(count),
        reward_terms=np.zeros((count, len(REWARD_TERMS))),
        graded=np.empty(count),
        violations=np.empty(count, dtype=np.int64),
    )


def begin(lanes: Lanes, lane: int, step: Step) -> None:
    """Set a lane to the beginning of a step."""
    lanes.swing_is_left[lane] = step.swing == "left"
    lanes.start[lane], lanes.landing[lane], lanes.support[lane] = step.start, step.landing, step.support
    lanes.apex[lane], lanes.points[lane], lanes.point[lane] = step.apex, step.points, 0
    lanes.pelvis[lane] = step.nominal_pelvis
    lanes.thrust[lane], lanes.violated[lane] = 0.0, False


def step_of_lane(lanes: Lanes, lane: int, robot: Robot) -> Step:
    """Return the step of a lane."""
    start, landing, support = (
        (float(x), float(y), float(z)) for x, y, z in (lanes.start[lane], lanes.landing[lane], lanes.support[lane])
    )
    return Step(
        "left" if lanes.swing_is_left[lane] else "right",
        start,
        landing,
        support,
        apex=float(lanes.apex[lane]),
        points=int(lanes.points[lane]),
        robot=robot,
    )


@inlined
def lane_arc(lanes: Lanes, lane: int) -> Arc:
    """Return the arc of a lane's swing sole."""
    start, landing = lanes.start[lane], lanes.landing[lane]
    return compiled_arc_of(
        (start[0], start[1], start[2]),
        (landing[0], landing[1], landing[2]),
        lanes.apex[lane],
        1.0 if lanes.swing_is_left[lane] else -1.0,
    )


@inlined
def lane_sole(lanes: Lanes, lane: int, arc: Arc, point: int) -> Vector:
    """Return the swing sole of a lane at a swing point; beyond the last one it stays there."""
    return compiled_arc_point(arc, point / (lanes.points[lane] - 1))


@entry_point
def advance(numbers: Array, lanes: Lanes, actions: Array, selected: NDArray[np.int64], result: Transition) -> None:
    """Take one action (N, 3) in each selected lane, all of one swing leg, and judge it by the model.

    Args:
        numbers: The task with this swing leg, packed.
        lanes: The lanes, N of them.
        actions: Displacements of the pelvis (N, 3) over the search range.
        selected: Which lanes.
        result: Receives what the actions led to, each in its lane's row, but for the joint positions.
    """
    swing_leg, support_leg, trunk, side, balance, fitness, task = unpack(numbers)
    givens, founds = np.zeros((1, GIVEN_ROWS, BLOCK)), np.empty((1, FOUND_ROWS, BLOCK))
    flags, moved_squared = np.empty((1, BLOCK), np.int64), np.empty(BLOCK)
    given, found, violations = givens[0], founds[0], flags[0]
    for start in range(0, len(selected), BLOCK):
        size = min(BLOCK, len(selected) - start)
        for column in range(size):
            lane = selected[start + column]
            moved_squared[column] = _move(task, lanes, actions, side, lane)
            stance = lane_stance(swing_leg, support_leg, side, balance, lanes, lane, lanes.point[lane])
            pelvis = (lanes.pelvis[lane, 0], lanes.pelvis[lane, 1], lanes.pelvis[lane, 2])
            put(given, column, stance, pelvis)
        evaluate_blocks(swing_leg, support_leg, trunk, balance, givens, founds, flags)
        for column in range(size):
            lane = selected[start + column]
            stance = stance_in(given, column)
            _write_posture(side, stance, found, column, lanes, result, lane)
            _judge(
                swing_leg, support_leg, balance, fitness, task, stance, found, column,
                violations[column], moved_squared[column], result, lane,
            )  # fmt: skip
            lanes.thrust[lane] = found[FOUND_THRUST, column]
            lanes.point[lane] += 1
            lanes.violated[lane] = lanes.violated[lane] | (violations[column] != 0)


@inlined
def lane_stance(
    swing_leg: Leg,
    support_leg: Leg,
    side: float,
    balance: BalanceParameters,
    lanes: Lanes,
    lane: int,
    point: int,
) -> Stance:
    """Return a lane's swing point."""
    sole = lane_sole(lanes, lane, lane_arc(lanes, lane), point)
    support = (lanes.support[lane, 0], lanes.support[lane, 1], lanes.support[lane, 2])
    return stance_of(swing_leg, support_leg, side, balance.zmp_margin, sole, support)


@inlined
def _move(task: TaskParameters, lanes: Lanes, actions: Array, side: float, lane: int) -> float:
    """Move the pelvis by the action; return the squared distance [m^2] that f3 counts, zero at the first point."""
    half = task.first_range if lanes.point[lane] == 0 else task.later_range
    dx = half * min(max(actions[lane, 0], -1.0), 1.0)
    dy = side * half * min(max(actions[lane, 1], -1.0), 1.0)
    dz = half * min(max(actions[lane, 2], -1.0), 1.0)
    lanes.pelvis[lane, 0] += dx
    lanes.pelvis[lane, 1] += dy
    lanes.pelvis[lane, 2] += dz
    return dx * dx + dy * dy + dz * dz if lanes.point[lane] > 0 else 0.0


@inlined
def _write_posture(
    side: float, stance: Stance, found: Array, column: int, lanes: Lanes, result: Transition, lane: int
) -> None:
    for joint in range(12):
        result.joint_cosines[lane, joint], result.joint_sines[lane, joint] = joint_from_middle(
            found, column, side > 0.0, joint
        )
    for axis in range(3):
        result.pelvis[lane, axis] = lanes.pelvis[lane, axis]
        result.com[lane, axis] = found[COM + axis, column]
    for axis in range(2):
        result.fan[lane, axis] = stance.fan[axis]
        result.zmp[lane, axis] = found[FOUND_ZMP + axis, column]
        result.assigned_zmp[lane, axis] = stance.assigned_zmp[axis]
    result.pelvis_yaw[lane] = math.atan2(stance.sin_yaw, stance.cos_yaw)
    undefined = edge_undefined(found[EDGE + 2, column])
    result.edge_angle[lane] = 0.0 if undefined else math.atan2(found[EDGE, column], found[EDGE + 1, column])
    result.thrust[lane] = found[FOUND_THRUST, column]


@inlined
def _judge(
    swing_leg: Leg,
    support_leg: Leg,
    balance: BalanceParameters,
    fitness: FitnessParameters,
    task: TaskParameters,
    stance: Stance,
    found: Array,
    column: int,
    violations: int,
    moved_squared: float,
    result: Transition,
    lane: int,
) -> None:
    """Write fitness and graded reward of a lane, term by term and summed.

    The graded reward of a posture without violation is minus its fitness over that of full thrust.
    """
    thrust = found[FOUND_THRUST, column]
    f1, f2, f3, f4 = fitness_terms(fitness, violations, thrust, moved_squared)
    result.fitness_terms[lane, 0], result.fitness_terms[lane, 1] = f1, f2
    result.fitness_terms[lane, 2], result.fitness_terms[lane, 3] = f3, f4
    result.fitness[lane] = f1 + f2 + f3 + f4
    result.violations[lane] = violations

    terms = result.reward_terms[lane]
    terms[0] = -min(max(thrust, 0.0), balance.max_thrust) / balance.max_thrust
    terms[1] = -f3 / (fitness.thrust_weight * balance.max_thrust)
    for term in range(2, len(REWARD_TERMS)):
        terms[term] = 0.0
    if violations & REACH:
        terms[2] = _cost(task, found[OUT_OF_REACH, column] / task.reach_scale)
    if violations & JOINT_LIMITS:
        terms[3] = _cost(task, _joint_excess(swing_leg, support_leg, found, column) / task.angle_scale)
    if violations & THRUST:
        terms[4] = _cost(task, max(thrust - balance.max_thrust, -thrust) / balance.max_thrust)
    if violations & EDGE_POLYGON:
        edge_excess = abs(result.edge_angle[lane]) - math.atan(balance.edge_slope)
        terms[5] = _cost(task, edge_excess / task.angle_scale)
    if violations & ZMP:
        terms[6] = _cost(task, _outside(stance.support, found, column) / task.zmp_scale)
    graded = 0.0
    for term in range(len(REWARD_TERMS)):
        graded += terms[term]
    result.graded[lane] = graded


@inlined
def _joint_excess(swing_leg: Leg, support_leg: Leg, found: Array, column: int) -> float:
    """Return by how much the worst joint is beyond its limit [rad], or 0."""
    worst = 0.0
    for row in range(12):
        joint = row % 6
        leg = swing_leg if row < 6 else support_leg
        cosine = found[COSINES + row, column]
        if cosine < leg.range_half_cosines[joint]:
            angle = math.atan2(found[SINES + row, column], cosine)
            worst = max(worst, abs(angle) - 0.5 * (leg.upper[joint] - leg.lower[joint]))
    return worst


@inlined
def _outside(support: Rectangle, found: Array, column: int) -> float:
    """Return how far the ZMP is outside of the support sole [m]."""
    x: float = found[FOUND_ZMP, column]
    y: float = found[FOUND_ZMP + 1, column]
    return max(support[0] - x, x - support[1], support[2] - y, y - support[3])


@inlined
def _cost(task: TaskParameters, excess: float) -> float:
    """Return minus the cost of a violated constraint: a fixed part and one that grows with the excess."""
    return -min(task.violation_cost + max(excess, 0.0), task.largest_cost)
