"""What is left of each constraint at a swing point, smooth in the pelvis, and its derivatives.

A slack is positive while its constraint holds. The unknowns of a swing point are the pelvis and a bound ``t`` on
its thrust, which is what is minimised. So the least thrust, which has kinks, needs no gradient: it is the smallest
``t`` that brings the ZMP into the sole. Slacks are differentiated numerically; of their curvature what is positive
is kept, so that the Hessian of the logarithms' sum is positive definite.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from agents.linear_algebra import make_positive
from agents.path_cost import SearchModel
from jet_gym.arrays import Array
from jet_gym.balance import Stance, edge_vectors, zmp_of
from jet_gym.compilation import entry_point, inlined
from jet_gym.kinematics import from_middle
from jet_gym.leg import Leg, Vector
from jet_gym.posture_state import posture_at

# Where the slacks of each kind begin, and how many slacks there are; behind them stands the centre of mass.
EDGE_SLACKS, THRUST_SLACKS, ZMP_SLACKS, REACH_SLACKS, JOINT_SLACKS, SLACKS = 0, 2, 5, 9, 11, 23
COM_X, COM_Y, FILLED = 23, 24, 25
UNKNOWNS = 4  # pelvis and bound on the thrust
_SHORTEST_STEP, _LONGEST_STEP, _THRUST_STEP = 2e-9, 1e-6, 1e-6  # [m], [m], [N] of the differences


@entry_point  # too long to be inlined wherever it is called
def fill_slacks(model: SearchModel, stance: Stance, x: Array, slacks: Array) -> tuple[float, int]:
    """Compute what is left of each constraint, positive while it holds; then x and y of the centre of mass.

    Returns:
        The thrust that the posture takes [N], and the violated constraints as flags.
    """
    balance = model.balance
    bound = x[3]
    state = posture_at(model.swing_leg, model.support_leg, model.trunk, balance, stance, (x[0], x[1], x[2]))
    com_x, com_y, _ = state.center_of_mass
    slacks[COM_X], slacks[COM_Y] = com_x, com_y
    sine, cosine, _ = edge_vectors(stance, com_x, com_y)
    wx, wy = stance.swing_ankle[0] - stance.assigned_zmp[0], stance.swing_ankle[1] - stance.assigned_zmp[1]
    scale = 1.0 / max(math.sqrt(wx * wx + wy * wy), 1e-6)
    slacks[EDGE_SLACKS] = (balance.edge_slope * cosine - sine) * scale
    slacks[EDGE_SLACKS + 1] = (balance.edge_slope * cosine + sine) * scale
    thrust, margin = state.thrust, 0.0
    slacks[THRUST_SLACKS + 2] = bound - thrust
    if balance.least_thrust:
        thrust, margin = bound, balance.zmp_margin
        slacks[THRUST_SLACKS + 2] = 1.0  # it is the ZMP that bounds the thrust from below
    slacks[THRUST_SLACKS], slacks[THRUST_SLACKS + 1] = thrust, balance.max_thrust - thrust
    zmp_x, zmp_y = zmp_of(balance.weight, com_x, com_y, stance.fan, thrust)
    slacks[ZMP_SLACKS] = zmp_x - stance.support[0] - margin
    slacks[ZMP_SLACKS + 1] = stance.support[1] - margin - zmp_x
    slacks[ZMP_SLACKS + 2] = zmp_y - stance.support[2] - margin
    slacks[ZMP_SLACKS + 3] = stance.support[3] - margin - zmp_y
    slacks[REACH_SLACKS] = _reach_left(model.swing_leg, stance, stance.swing_ankle, x)
    slacks[REACH_SLACKS + 1] = _reach_left(model.support_leg, stance, stance.support_ankle, x)
    for joint in range(6):
        leg = model.swing_leg
        cosine, _ = from_middle(leg, joint, state.swing_cosines[joint], state.swing_sines[joint])
        slacks[JOINT_SLACKS + joint] = cosine - leg.range_half_cosines[joint]
        leg = model.support_leg
        cosine, _ = from_middle(leg, joint, state.support_cosines[joint], state.support_sines[joint])
        slacks[JOINT_SLACKS + 6 + joint] = cosine - leg.range_half_cosines[joint]
    knee = 3
    slacks[JOINT_SLACKS + knee] = _knee_left(model.swing_leg, state.swing_cosines[knee], state.swing_sines[knee])
    slacks[JOINT_SLACKS + 6 + knee] = _knee_left(
        model.support_leg, state.support_cosines[knee], state.support_sines[knee]
    )
    return state.thrust, state.violations


@inlined
def _knee_left(leg: Leg, cosine: float, sine: float) -> float:
    """Return what is left of a knee's range, in cosines of its flexion from the straight leg.

    Where a leg becomes straight, its flexion is the square root of what is left of the reach; the cosine is smooth.
    """
    straight = math.atan2(
        leg.thigh[0] * leg.shank[2] - leg.thigh[2] * leg.shank[0],
        leg.thigh[0] * leg.shank[0] + leg.thigh[2] * leg.shank[2],
    )
    ends = leg.knee_direction * (leg.lower[3] - straight), leg.knee_direction * (leg.upper[3] - straight)
    least, most = min(ends[0], ends[1]), min(max(ends[0], ends[1]), math.pi)
    cos_flexion = cosine * math.cos(straight) + sine * math.sin(straight)
    left = cos_flexion - math.cos(most)
    return min(left, math.cos(least) - cos_flexion) if least > 1e-9 else left


@inlined
def _reach_left(leg: Leg, stance: Stance, ankle: Vector, x: Array) -> float:
    """Return how far a leg is from being straight, or its ankle from the hip's side, whichever is nearer [m]."""
    dx = x[0] + stance.cos_yaw * leg.hip[0] - stance.sin_yaw * leg.hip[1] - ankle[0]
    dy = x[1] + stance.sin_yaw * leg.hip[0] + stance.cos_yaw * leg.hip[1] - ankle[1]
    dz = x[2] + leg.hip[2] - ankle[2]
    lateral = leg.shank[1]
    aside = dy * dy + dz * dz - lateral * lateral
    thigh = math.sqrt(leg.thigh[0] ** 2 + leg.thigh[2] ** 2)
    shank = math.sqrt(leg.shank[0] ** 2 + leg.shank[2] ** 2)
    straight = thigh + shank
    distance_squared = dx * dx + aside
    left: float = min(straight * straight - distance_squared, aside) / straight
    return left


@inlined
def fill_jacobian(
    model: SearchModel,
    stance: Stance,
    mu: float,
    shares: Array,
    active: NDArray[np.bool_],
    x: Array,
    slacks: Array,
    jacobian: Array,
    curvature: Array,
) -> None:
    """Compute the slacks, their derivatives (slack, unknown) and the curvature (3, 3) that they give the barrier.

    All by central differences. Where a leg is nearly straight, the centre of mass varies with the square root of
    what is left of its reach, so that the step of the differences has to be less than that.
    """
    fill_slacks(model, stance, x, slacks)
    left = min(slacks[REACH_SLACKS], slacks[REACH_SLACKS + 1]) if active[REACH_SLACKS] else _LONGEST_STEP
    size = min(max(0.02 * left, _SHORTEST_STEP), _LONGEST_STEP)
    there, shifted, weights = np.empty(UNKNOWNS), np.empty(len(slacks)), np.zeros(SLACKS)
    middle = 0.0
    for i in range(SLACKS):
        if active[i]:
            weights[i] = mu * shares[i] / slacks[i]
            middle += mu * shares[i]
    there[:] = x
    for a in range(UNKNOWNS):
        step = size if a < 3 else _THRUST_STEP
        second = -2.0 * middle
        for sign in (1.0, -1.0):
            there[a] = x[a] + sign * step
            fill_slacks(model, stance, there, shifted)
            for i in range(len(slacks)):
                jacobian[i, a] = (jacobian[i, a] if sign < 0.0 else 0.0) + sign * shifted[i] / (2.0 * step)
            for i in range(SLACKS):
                second += weights[i] * shifted[i] if active[i] else 0.0
        there[a] = x[a]
        if a < 3:
            curvature[a, a] = -second / (size * size)
    for a in range(3):
        for b in range(a):
            second = -2.0 * middle
            for sign in (1.0, -1.0):
                there[a], there[b] = x[a] + sign * size, x[b] + sign * size
                fill_slacks(model, stance, there, shifted)
                for i in range(SLACKS):
                    second += weights[i] * shifted[i] if active[i] else 0.0
            there[a], there[b] = x[a], x[b]
            curvature[a, b] = 0.5 * (-second / (size * size) - curvature[a, a] - curvature[b, b])
            curvature[b, a] = curvature[a, b]
    make_positive(curvature)
