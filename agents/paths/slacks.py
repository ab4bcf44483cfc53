"""What is left of each constraint at a swing point, smooth in the pelvis, and its derivatives.

A slack is positive while its constraint holds. The unknowns of a swing point are the pelvis and a bound ``t`` on
its thrust, which is what is minimised. So the least thrust, which has kinks, needs no gradient: it is the smallest
``t`` that brings the ZMP into the sole. Slacks are differentiated numerically; of their curvature what is positive
is kept, so that the Hessian of the logarithms' sum is positive definite.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.paths.cost import SearchModel
from agents.paths.linear_algebra import make_positive
from jet_gym.balance import Stance, edge_vectors, zmp_of
from jet_gym.kinematics import from_middle
from jet_gym.leg import Leg, Six, Vector
from jet_gym.posture_state import posture_at
from jet_gym.single_support import hip_from_ankle
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined

# Where the slacks of each kind begin, and how many slacks there are; behind them stands the centre of mass.
EDGE_SLACKS, THRUST_SLACKS, ZMP_SLACKS, REACH_SLACKS, JOINT_SLACKS, SLACKS = 0, 2, 5, 9, 11, 23
COM_X, COM_Y, FILLED = 23, 24, 25
UNKNOWNS = 4  # pelvis and bound on the thrust
_KNEE = 3
_SHORTEST_STEP, _LONGEST_STEP, _THRUST_STEP = 2e-9, 1e-6, 1e-6  # [m], [m], [N] of the differences


@entry_point  # too long to be inlined wherever it is called
def fill_slacks(model: SearchModel, stance: Stance, x: Array, slacks: Array) -> tuple[float, int]:
    """Compute what is left of each constraint, positive while it holds; then x and y of the centre of mass.

    Returns:
        The thrust that the posture takes [N], and the violated constraints as flags.
    """
    swing_leg, support_leg, _, _, balance = model.robot
    pelvis, bound = (x[0], x[1], x[2]), x[3]
    state = posture_at(model.robot, stance, pelvis)
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
    slacks[REACH_SLACKS] = _reach_left(swing_leg, stance, stance.swing_ankle, pelvis)
    slacks[REACH_SLACKS + 1] = _reach_left(support_leg, stance, stance.support_ankle, pelvis)
    _fill_joints(swing_leg, state.swing_cosines, state.swing_sines, slacks[JOINT_SLACKS:])
    _fill_joints(support_leg, state.support_cosines, state.support_sines, slacks[JOINT_SLACKS + 6 :])
    return state.thrust, state.violations


@inlined
def _fill_joints(leg: Leg, cosines: Six, sines: Six, slacks: Array) -> None:
    """Compute what is left of the ranges of a leg's joints, in cosines."""
    for joint in range(6):
        cosine, _ = from_middle(leg, joint, cosines[joint], sines[joint])
        slacks[joint] = cosine - leg.range_half_cosines[joint]
    slacks[_KNEE] = _knee_left(leg, cosines[_KNEE], sines[_KNEE])


@inlined
def _knee_left(leg: Leg, cosine: float, sine: float) -> float:
    """Return what is left of a knee's range, in cosines of its flexion from the straight leg.

    Where a leg becomes straight, its flexion is the square root of what is left of the reach; the cosine is smooth.
    """
    straight = math.atan2(
        leg.thigh[0] * leg.shank[2] - leg.thigh[2] * leg.shank[0],
        leg.thigh[0] * leg.shank[0] + leg.thigh[2] * leg.shank[2],
    )
    ends = leg.knee_direction * (leg.lower[_KNEE] - straight), leg.knee_direction * (leg.upper[_KNEE] - straight)
    least, most = min(ends[0], ends[1]), min(max(ends[0], ends[1]), math.pi)
    cos_flexion = cosine * math.cos(straight) + sine * math.sin(straight)
    left = cos_flexion - math.cos(most)
    return min(left, math.cos(least) - cos_flexion) if least > 1e-9 else left


@inlined
def _reach_left(leg: Leg, stance: Stance, ankle: Vector, pelvis: Vector) -> float:
    """Return how far a leg is from being straight, or its ankle from the hip's side, whichever is nearer [m]."""
    dx, dy, dz = hip_from_ankle(leg, stance, ankle, pelvis)
    lateral = leg.shank[1]
    aside = dy * dy + dz * dz - lateral * lateral
    thigh = math.sqrt(leg.thigh[0] ** 2 + leg.thigh[2] ** 2)
    shank = math.sqrt(leg.shank[0] ** 2 + leg.shank[2] ** 2)
    straight = thigh + shank
    distance_squared = dx * dx + aside
    left: float = min(straight * straight - distance_squared, aside) / straight
    return left


class Derivatives(NamedTuple):
    """What is left of the constraints at a swing point, and how it varies."""

    slacks: Array  # (FILLED,) the slacks, and the centre of mass's x and y
    jacobian: Array  # (FILLED, UNKNOWNS)
    curvature: Array  # (3, 3) that the logarithms of the slacks give the barrier, in the pelvis


@inlined
def differentiate_slacks(
    model: SearchModel,
    stance: Stance,
    weights: Array,
    active: NDArray[np.bool_],
    x: Array,
    found: Derivatives,
) -> None:
    """Compute the slacks and their derivatives, weighted as their logarithms are (SLACKS,) in the barrier.

    All by central differences. Where a leg is nearly straight, the centre of mass varies with the square root of
    what is left of its reach, so that the step of the differences has to be less than that.
    """
    slacks, jacobian, curvature = found
    fill_slacks(model, stance, x, slacks)
    left = min(slacks[REACH_SLACKS], slacks[REACH_SLACKS + 1]) if active[REACH_SLACKS] else _LONGEST_STEP
    size = min(max(0.02 * left, _SHORTEST_STEP), _LONGEST_STEP)
    there, shifted, pulls = np.empty(UNKNOWNS), np.empty(len(slacks)), np.zeros(SLACKS)
    middle = 0.0
    for i in range(SLACKS):
        if active[i]:
            pulls[i] = weights[i] / slacks[i]
            middle += weights[i]
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
                second += pulls[i] * shifted[i] if active[i] else 0.0
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
                    second += pulls[i] * shifted[i] if active[i] else 0.0
            there[a], there[b] = x[a], x[b]
            curvature[a, b] = 0.5 * (-second / (size * size) - curvature[a, a] - curvature[b, b])
            curvature[b, a] = curvature[a, b]
    make_positive(curvature)
