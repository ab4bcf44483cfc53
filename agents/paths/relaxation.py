"""Constraints relaxed by a distance: for lattices that are too coarse for the sets within their constraints.

A coarse lattice steps over feasible sets that are thinner than its spacing, such as the tip of the edge polygon,
where the thrust is least. So constraints that are missed by less than a distance count as met.
"""

from __future__ import annotations

import math

import numpy as np

from agents.paths.cost import FAR, SearchModel, SwingPoints, stance_at
from jet_gym.balance import Stance, edge_vectors
from jet_gym.kinematics import within_limits
from jet_gym.leg import Leg, Vector
from jet_gym.posture_state import posture_at
from jet_gym.single_support import pelvis_over, straight_length
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined

_BLOCK = 64  # postures whose relaxed cost is computed side by side
_JOINT_ARM = 0.15  # [m] a pelvis that is off by this times an angle turns some joint by about that angle


def with_wider_joints(model: SearchModel, relaxation: float) -> SearchModel:
    """Return a model whose joint limits are relaxed by a distance [m] of the pelvis."""
    angle = relaxation / _JOINT_ARM
    robot = model.robot
    swing_leg, support_leg = _widened(robot.swing_leg, angle), _widened(robot.support_leg, angle)
    return model._replace(robot=robot._replace(swing_leg=swing_leg, support_leg=support_leg))


def _widened(leg: Leg, angle: float) -> Leg:
    """Return a leg whose joints may pass their limits by an angle [rad]."""
    yaw, roll, pitch, knee, ankle_pitch, ankle_roll = (
        math.cos(min(math.acos(max(cosine, -1.0)) + angle, math.pi)) for cosine in leg.range_half_cosines
    )
    return leg._replace(range_half_cosines=(yaw, roll, pitch, knee, ankle_pitch, ankle_roll))


@entry_point
def relaxed_costs(model: SearchModel, stance: Stance, relaxation: float, candidates: Array, costs: Array) -> None:
    """Compute what postures cost if constraints missed by less than a distance count as met.

    The joint limits of the model are to be widened beforehand, by :func:`with_wider_joints`.
    """
    own, found = np.empty((3, _BLOCK)), np.empty(_BLOCK)
    count = len(costs)
    for start in range(0, count, _BLOCK):
        for axis in range(3):
            for i in range(_BLOCK):  # the last block is filled up with its last node
                own[axis, i] = candidates[axis, min(start + i, count - 1)]
        for i in range(_BLOCK):
            found[i] = _relaxed_cost(model, stance, relaxation, (own[0, i], own[1, i], own[2, i]))
        for i in range(min(_BLOCK, count - start)):
            costs[start + i] = found[i]


@inlined
def _relaxed_cost(model: SearchModel, stance: Stance, relaxation: float, pelvis: Vector) -> float:
    swing_leg, support_leg, _, _, balance = model.robot
    fitness, state = model.fitness, posture_at(model.robot, stance, pelvis)
    com_x, com_y, _ = state.center_of_mass
    zx, zy = stance.assigned_zmp
    sine, cosine, _ = edge_vectors(stance, com_x, com_y)
    wx, wy = stance.swing_ankle[0] - zx, stance.swing_ankle[1] - zy
    missing = relaxation * np.sqrt(wx * wx + wy * wy)
    in_polygon = (abs(sine) - balance.edge_slope * max(cosine, 0.0) <= missing) & (cosine >= -missing)

    fx, fy = stance.fan[0] - zx, stance.fan[1] - zy
    thrust_error = relaxation * balance.weight / max(np.sqrt(fx * fx + fy * fy), relaxation)
    thrust_given = (state.thrust >= -thrust_error) & (state.thrust <= balance.max_thrust + thrust_error)
    thrust = min(max(state.thrust, 0.0), balance.max_thrust)

    x_min, x_max, y_min, y_max = stance.support
    on_foot = (state.zmp[0] >= x_min - 2.0 * relaxation) & (state.zmp[0] <= x_max + 2.0 * relaxation)
    on_foot = on_foot & (state.zmp[1] >= y_min - 2.0 * relaxation) & (state.zmp[1] <= y_max + 2.0 * relaxation)

    reachable = state.out_of_reach <= relaxation
    in_limits = within_limits(swing_leg, state.swing_cosines, state.swing_sines)
    in_limits = in_limits & within_limits(support_leg, state.support_cosines, state.support_sines)
    f1 = 0.0 if reachable & in_limits else fitness.joint_limit_penalty
    f2 = 0.0 if reachable & in_polygon else fitness.edge_penalty
    f4 = fitness.thrust_weight * thrust if reachable & thrust_given else fitness.thrust_penalty
    f5 = 0.0 if reachable & on_foot else model.zmp_penalty
    return f1 + f2 + f4 + f5


@entry_point
def reach_boxes(model: SearchModel, points: SwingPoints, relaxation: float, boxes: Array) -> None:
    """Compute bounds of the pelvis positions at which both soles are within reach.

    Args:
        model: The robot.
        points: The swing points.
        relaxation: Distance [m] beyond the reach that is taken in.
        boxes: Receives the lowest and the highest position (N, 2, 3) [m]; lowest above highest if there is none.
    """
    for point in range(len(points.soles)):
        stance = stance_at(model, points, point)
        boxes[point, 0, :], boxes[point, 1, :] = -FAR, FAR
        _cut(boxes[point], model.robot.swing_leg, stance, stance.swing_ankle, relaxation)
        _cut(boxes[point], model.robot.support_leg, stance, stance.support_ankle, relaxation)


@inlined
def _cut(box: Array, leg: Leg, stance: Stance, ankle: Vector, relaxation: float) -> None:
    """Cut a box down to where a leg reaches its ankle, the hip above it."""
    centre = pelvis_over(leg, stance, ankle)
    reach = straight_length(leg) + relaxation
    for axis in range(3):
        box[0, axis] = max(box[0, axis], centre[axis] - (reach if axis < 2 else 0.0))
        box[1, axis] = min(box[1, axis], centre[axis] + reach)
