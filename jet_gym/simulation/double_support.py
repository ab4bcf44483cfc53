"""Postures with both soles flat on their cartons and the pelvis level, between the steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jet_gym.kinematics import inverse_kinematics
from jet_gym.leg import SIDES, Side, opposite
from jet_gym.robot import Robot
from jet_gym.step import Step
from jet_gym.utils.arrays import Array

_HEIGHT_STEP = 0.005  # [m] by which a pelvis is lowered or raised until both legs reach


def double_support_joints(
    robot: Robot, soles: dict[Side, ArrayLike], pelvis: ArrayLike, pelvis_yaw: ArrayLike
) -> tuple[Array, Array]:
    """Return the joints of a level pelvis over two planted soles that point forward.

    Args:
        robot: The robot.
        soles: Where the soles stand (..., 3) [m], world, by leg.
        pelvis: Pelvis origin (..., 3) [m], world.
        pelvis_yaw: Yaw of the pelvis (...) [rad].

    Returns:
        Joint positions (..., 12) [rad] and by how much a sole is out of reach (...) [m].
    """
    yaw = np.asarray(pelvis_yaw, dtype=np.float64)
    cos, sin, zero, one = np.cos(yaw), np.sin(yaw), np.zeros_like(yaw), np.ones_like(yaw)
    to_pelvis = np.stack(
        [np.stack([cos, sin, zero], -1), np.stack([-sin, cos, zero], -1), np.stack([zero, zero, one], -1)], -2
    )
    legs, missing = [], np.zeros(yaw.shape)
    for side in SIDES:
        from_pelvis = np.asarray(soles[side]) - np.asarray(pelvis)
        position = np.einsum("...ij,...j->...i", to_pelvis, from_pelvis)
        joints, out_of_reach = inverse_kinematics(robot, side, position, to_pelvis)
        legs.append(joints)
        missing = np.maximum(missing, out_of_reach)
    return np.concatenate(legs, axis=-1), missing


def reachable_pelvis(robot: Robot, soles: dict[Side, ArrayLike], pelvis: ArrayLike, pelvis_yaw: float) -> Array:
    """Lower a pelvis (3,) [m] until both legs reach their soles within the joints' ranges.

    Where no height within 0.3 m does, the pelvis is returned as it was given.
    """
    lowered = np.asarray(pelvis) - _HEIGHT_STEP * np.arange(60)[:, None] * [0.0, 0.0, 1.0]
    within = _stands(robot, soles, lowered, pelvis_yaw)
    return np.array(lowered[int(np.argmax(within))] if within.any() else lowered[0])


def reachable_target(
    robot: Robot, soles: dict[Side, ArrayLike], pelvis: ArrayLike, target: ArrayLike, pelvis_yaw: float
) -> Array:
    """Return how far a pelvis (3,) [m] can go straight towards a target (3,) [m] over planted soles.

    The target's height may change by 0.1 m; of those that take the pelvis equally far, the one that changes least
    is taken. Where there is no way at all, the pelvis stays.
    """
    start, goal = np.asarray(pelvis, dtype=np.float64), np.asarray(target, dtype=np.float64)
    rises = sorted(_HEIGHT_STEP * np.arange(-20, 21), key=abs)
    for share in np.linspace(1.0, 0.0, 21)[:-1]:
        ends = start + share * (goal - start) + np.array(rises)[:, None] * [0.0, 0.0, 1.0]
        ways = start + np.linspace(0.1, 1.0, 10)[:, None, None] * (ends - start)
        stands = _stands(robot, soles, ways, pelvis_yaw).all(axis=0)
        if stands.any():
            return np.array(ends[int(np.argmax(stands))])
    return np.array(start)


def _stands(robot: Robot, soles: dict[Side, ArrayLike], pelvis: Array, pelvis_yaw: float) -> NDArray[np.bool_]:
    """Tell which pelvis positions (..., 3) [m] both legs can carry within the joints' ranges."""
    joints, missing = double_support_joints(robot, soles, pelvis, np.full(pelvis.shape[:-1], pelvis_yaw))
    within = ((joints >= robot.lower) & (joints <= robot.upper)).all(axis=-1)
    return np.asarray(within & (missing == 0.0))


def soles_before(step: Step) -> dict[Side, ArrayLike]:
    """Return where the soles stand before a step, by leg."""
    return soles_with(step, step.start)


def soles_after(step: Step) -> dict[Side, ArrayLike]:
    """Return where the soles stand after a step, by leg."""
    return soles_with(step, step.landing)


def soles_with(step: Step, swing_sole: ArrayLike) -> dict[Side, ArrayLike]:
    """Return where the soles are, by leg, with the swing sole somewhere (..., 3) [m]."""
    return {step.swing: swing_sole, opposite(step.swing): step.support}
