"""Postures of a leg, its mirror, and where its sole is: what tests of kinematics share."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from hypothesis import strategies as st

from jet_gym.kinematics import BodyPoints, forward_kinematics
from jet_gym.leg import SIDES
from jet_gym.robot import Robot, jet_hr1
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    pass

LEG = {"left": slice(0, 6), "right": slice(6, 12)}
MIRRORED_JOINTS = np.array([-1.0, -1.0, 1.0, 1.0, 1.0, -1.0])  # of a leg, in the mirror of the x-z plane
MIRROR = np.array([1.0, -1.0, 1.0])


def random_postures(robot: Robot, rng: np.random.Generator, count: int) -> Array:
    return rng.uniform(robot.lower, robot.upper, (count, 12))


@st.composite
def leg_postures(draw: st.DrawFn) -> Array:
    """Joint positions (6,) of a leg within its limits, often right at them."""
    robot = jet_hr1()
    ranges = zip(robot.lower[:6], robot.upper[:6], strict=True)
    return np.array([draw(st.floats(float(low), float(high))) for low, high in ranges])


def foot_of(robot: Robot, side: str, leg_joints: Array) -> tuple[Array, Array, BodyPoints]:
    """Return a sole's position and axes for the joints (..., 6) of its leg, and all points."""
    joints = np.zeros((*leg_joints.shape[:-1], 12))
    joints[..., LEG[side]] = leg_joints
    body = forward_kinematics(robot, joints)
    index = SIDES.index(side)
    return body.soles[..., index, :], body.foot_rotations[..., index, :, :], body


def height_over_foot(body: BodyPoints, side: str, ankle_roll: Array) -> Array:
    """Return how far the hip is from the ankle along the shank side's z axis, before ankle roll."""
    index = SIDES.index(side)
    up = body.hips[..., index, :] - body.ankles[..., index, :]
    in_foot = np.einsum("...ji,...j->...i", body.foot_rotations[..., index, :, :], up)
    return np.cos(ankle_roll) * in_foot[..., 2] + np.sin(ankle_roll) * in_foot[..., 1]


def assert_sole_is_placed(robot: Robot, side: str, joints: Array, position: Array, axes: Array) -> None:
    found_position, found_axes, _ = foot_of(robot, side, joints)
    np.testing.assert_allclose(found_position, position, atol=1e-9)
    np.testing.assert_allclose(found_axes, axes, atol=1e-9)
