"""Many episodes side by side, each a lane of a few arrays: the state of the task and its transition.

The single environment is one lane, the batch is thousands; both run the functions of this file, so that they
agree to the last bit.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jet_gym.balance import BalanceParameters, Stance, edge_undefined, edge_vectors, stance_of
from jet_gym.compilation import entry_point, inlined
from jet_gym.constraints import EDGE_POLYGON, JOINT_LIMITS, REACH, THRUST, ZMP
from jet_gym.envs.settings import REWARD_TERMS, TaskParameters
from jet_gym.fitness import FitnessParameters, fitness_terms
from jet_gym.kinematics import joint_angle
from jet_gym.posture import PostureState, posture_at
from jet_gym.robot import Leg, Trunk, Vector
from jet_gym.step import Step
from jet_gym.swing_path import Arc, arc_of, arc_point
from jet_gym.urdf import Array

_arc_of, _arc_point = inlined(arc_of), inlined(arc_point)


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


@inlined
def lane_arc(lanes: Lanes, lane: int) -> Arc:
    """Return the arc of a lane's swing sole."""
    start, landing = lanes.start[lane], lanes.landing[lane]
    return _arc_of(
        (start[0], start[1], start[2]),
        (landing[0], landing[1], landing[2]),
        lanes.apex[lane],
        1.0 if lanes.swing_is_left[lane] else -1.0,
    )


@inlined
def lane_sole(lanes: Lanes, lane: int, arc: Arc, point: int) -> Vector:
    """Return the swing sole of a lane at a swing point; beyond the last one it stays there."""
    return _arc_point(arc, point / (lanes.points[lane] - 1))


@entry_point
def advance(
    left: Leg,
    right: Leg,
    trunk: Trunk,
    balance: BalanceParameters,
    fitness: FitnessParameters,
    task: TaskParameters,
    lanes: Lanes,
    actions: Array,
    result: Transition,
    first_lane: int,
    last_lane: int,
) -> None:
    """Take one action (N, 3) in each lane from ``first_lane`` up to ``last_lane``, and judge it by the model."""
    for lane in range(first_lane, last_lane):
        if lanes.swing_is_left[lane]:
            _advance_lane(left, right, 1.0, trunk, balance, fitness, task, lanes, actions, result, lane)
        else:
            _advance_lane(right, left, -1.0, trunk, balance, fitness, task, lanes, actions, result, lane)


@entry_point
def _advance_lane(
    swing_leg: Leg,
    support_leg: Leg,
    side: float,
    trunk: Trunk,
    balance: BalanceParameters,
    fitness: FitnessParameters,
    task: TaskParameters,
    lanes: Lanes,
    actions: Array,
    result: Transition,
    lane: int,
) -> None:
    point = lanes.point[lane]
    half = task.first_range if point == 0 else task.later_range
    dx = half * min(max(actions[lane, 0], -1.0), 1.0)
    dy = side * half * min(max(actions[lane, 1], -1.0), 1.0)
    dz = half * min(max(actions[lane, 2], -1.0), 1.0)
    pelvis = (lanes.pelvis[lane, 0] + dx, lanes.pelvis[lane, 1] + dy, lanes.pelvis[lane, 2] + dz)
    sole = lane_sole(lanes, lane, lane_arc(lanes, lane), point)
    support = (lanes.support[lane, 0], lanes.support[lane, 1], lanes.support[lane, 2])
    stance = stance_of(swing_leg, support_leg, side, balance.zmp_margin, sole, support)
    state = posture_at(swing_leg, support_leg, trunk, balance, stance, pelvis)
    moved_squared = dx * dx + dy * dy + dz * dz if point > 0 else 0.0
    f1, f2, f3, f4 = fitness_terms(fitness, state.violations, state.thrust, moved_squared)
    edge_angle = _write_balance(stance, state, pelvis, result, lane)
    joint_excess = _write_joints(swing_leg, support_leg, side, state, result, lane)
    _grade(balance, fitness, task, stance, state, f3, edge_angle, joint_excess, result.reward_terms[lane])
    result.fitness_terms[lane, 0], result.fitness_terms[lane, 1] = f1, f2
    result.fitness_terms[lane, 2], result.fitness_terms[lane, 3] = f3, f4
    result.fitness[lane] = f1 + f2 + f3 + f4
    graded = 0.0
    for term in range(len(REWARD_TERMS)):
        graded += result.reward_terms[lane, term]
    result.graded[lane] = graded
    lanes.pelvis[lane, 0], lanes.pelvis[lane, 1], lanes.pelvis[lane, 2] = pelvis
    lanes.thrust[lane] = state.thrust
    lanes.point[lane] = point + 1
    lanes.violated[lane] = lanes.violated[lane] | (state.violations != 0)


@inlined
def _write_joints(
    swing_leg: Leg, support_leg: Leg, side: float, state: PostureState, result: Transition, lane: int
) -> float:
    """Write the joint positions into the result; return by how much the worst is beyond its limit [rad]."""
    swing_joint = 0 if side > 0.0 else 6
    worst = 0.0
    for joint in range(6):
        angle = joint_angle(swing_leg, joint, state.swing_cosines[joint], state.swing_sines[joint])
        result.joint_positions[lane, swing_joint + joint] = angle
        worst = max(worst, _excess(swing_leg, joint, angle))
        angle = joint_angle(support_leg, joint, state.support_cosines[joint], state.support_sines[joint])
        result.joint_positions[lane, 6 - swing_joint + joint] = angle
        worst = max(worst, _excess(support_leg, joint, angle))
    return worst


@inlined
def _excess(leg: Leg, joint: int, angle: float) -> float:
    """Return by how much a joint's angle, in the URDF's direction, is beyond its limits; negative inside."""
    own = leg.axis_signs[joint] * angle
    return max(own - leg.upper[joint], leg.lower[joint] - own)


@inlined
def _write_balance(stance: Stance, state: PostureState, pelvis: Vector, result: Transition, lane: int) -> float:
    """Write all but the joints of a posture into the result and return its edge angle [rad]."""
    sine, cosine, length_squared = edge_vectors(stance, state.center_of_mass[0], state.center_of_mass[1])
    edge_angle = 0.0 if edge_undefined(length_squared) else math.atan2(sine, cosine)
    for axis in range(3):
        result.pelvis[lane, axis] = pelvis[axis]
        result.com[lane, axis] = state.center_of_mass[axis]
    for axis in range(2):
        result.fan[lane, axis] = stance.fan[axis]
        result.zmp[lane, axis] = state.zmp[axis]
        result.assigned_zmp[lane, axis] = stance.assigned_zmp[axis]
    result.pelvis_yaw[lane] = math.atan2(stance.sin_yaw, stance.cos_yaw)
    result.edge_angle[lane] = edge_angle
    result.thrust[lane] = state.thrust
    result.violations[lane] = state.violations
    return edge_angle


@inlined
def _grade(
    balance: BalanceParameters,
    fitness: FitnessParameters,
    task: TaskParameters,
    stance: Stance,
    state: PostureState,
    f3: float,
    edge_angle: float,
    joint_excess: float,
    terms: Array,
) -> None:
    """Write the graded reward's terms, in the order of REWARD_TERMS; tilt and fall are physics' alone.

    A posture without violation gets minus its fitness over that of full thrust.
    """
    scale = 1.0 / (fitness.thrust_weight * balance.max_thrust)
    violations, thrust = state.violations, state.thrust
    terms[0] = -min(max(thrust, 0.0), balance.max_thrust) / balance.max_thrust
    terms[1] = -f3 * scale
    terms[2] = _cost(task, violations & REACH, state.out_of_reach / task.reach_scale)
    terms[3] = _cost(task, violations & JOINT_LIMITS, joint_excess / task.angle_scale)
    beyond = max(thrust - balance.max_thrust, -thrust) / balance.max_thrust
    terms[4] = _cost(task, violations & THRUST, beyond)
    edge_excess = abs(edge_angle) - math.atan(balance.edge_slope)
    terms[5] = _cost(task, violations & EDGE_POLYGON, edge_excess / task.angle_scale)
    outside = max(
        stance.support[0] - state.zmp[0],
        state.zmp[0] - stance.support[1],
        stance.support[2] - state.zmp[1],
        state.zmp[1] - stance.support[3],
    )
    terms[6] = _cost(task, violations & ZMP, outside / task.zmp_scale)
    terms[7] = 0.0
    terms[8] = 0.0


@inlined
def _cost(task: TaskParameters, violated: int, excess: float) -> float:
    """Return minus the cost of a constraint: nothing, or a fixed part and one that grows with the excess."""
    cost = min(task.violation_cost + max(excess, 0.0), task.largest_cost)
    return -cost if violated != 0 else 0.0
