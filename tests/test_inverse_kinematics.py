"""Inverse kinematics of a leg whose sole is in reach undoes the forward one."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from legs import (
    LEG,
    MIRROR,
    MIRRORED_JOINTS,
    assert_sole_is_placed,
    foot_of,
    height_over_foot,
    leg_postures,
    random_postures,
)

from jet_gym.kinematics import inverse_kinematics
from jet_gym.leg import SIDES
from jet_gym.robot import Robot, jet_hr1
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    pass

sides = st.sampled_from(SIDES)


@pytest.mark.parametrize("side", SIDES)
def test_inverse_undoes_forward_on_random_postures(robot: Robot, rng: np.random.Generator, side: str) -> None:
    joints = random_postures(robot, rng, 5000)[:, LEG[side]]
    position, axes, body = foot_of(robot, side, joints)
    found, out_of_reach = inverse_kinematics(robot, side, position, axes)
    np.testing.assert_array_less(out_of_reach, 1e-12)
    assert_sole_is_placed(robot, side, found, position, axes)
    # Of two solutions whose ankle rolls are half a turn apart, inverse kinematics takes the hip above the foot.
    same_branch = (joints[:, 3] > 1e-3) & (height_over_foot(body, side, joints[:, 5]) > 1e-3)
    assert same_branch.mean() > 0.5
    np.testing.assert_allclose(found[same_branch], joints[same_branch], atol=1e-6)


@given(sides, leg_postures())
@example("left", np.zeros(6))  # on a straight leg
@example("left", np.array([0.0, 0.0, -math.pi / 2.0, 0.0, math.pi / 2.0, 0.0]))  # hip on the ankle's roll axis
@example("right", np.array([1.9, 1.0, -1.9, 2.44, -0.5, 1.0]))
def test_inverse_undoes_forward(side: str, joints: Array) -> None:
    robot = jet_hr1()
    position, axes, body = foot_of(robot, side, joints)
    found, out_of_reach = inverse_kinematics(robot, side, position, axes)
    height = height_over_foot(body, side, joints[5])
    assert out_of_reach < 1e-12
    assert_sole_is_placed(robot, side, found, position, axes)
    if joints[3] > 1e-3 and height > 1e-3:
        np.testing.assert_allclose(found, joints, atol=1e-6)


@given(leg_postures())
def test_mirrored_feet_need_mirrored_joints(joints: Array) -> None:
    robot = jet_hr1()
    position, axes, body = foot_of(robot, "left", joints)
    if abs(height_over_foot(body, "left", joints[5])) < 1e-6:
        return
    left, left_missing = inverse_kinematics(robot, "left", position, axes)
    right, right_missing = inverse_kinematics(robot, "right", position * MIRROR, axes * np.outer(MIRROR, MIRROR))
    assert right_missing == pytest.approx(left_missing, abs=1e-15)
    difference = right - left * MIRRORED_JOINTS
    np.testing.assert_allclose(np.exp(1j * difference), 1.0, atol=1e-12)  # half a turn either way is the same


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("knee", [0.0, 1e-12, 1e-9, 1e-7, 1e-6, 1e-4])
def test_a_leg_that_is_almost_straight_is_placed(
    robot: Robot, rng: np.random.Generator, side: str, knee: float
) -> None:
    joints = 0.5 * random_postures(robot, rng, 200)[:, LEG[side]]
    joints[:, 3] = knee
    position, axes, _ = foot_of(robot, side, joints)
    found, out_of_reach = inverse_kinematics(robot, side, position, axes)
    np.testing.assert_array_less(out_of_reach, 1e-12)
    assert_sole_is_placed(robot, side, found, position, axes)
    np.testing.assert_allclose(found[:, 3], knee, atol=1e-7)


@pytest.mark.parametrize("side", SIDES)
def test_a_leg_folded_to_its_limit_is_placed(robot: Robot, rng: np.random.Generator, side: str) -> None:
    joints = random_postures(robot, rng, 200)[:, LEG[side]]
    joints[:, 3] = robot.upper[LEG[side]][3]
    joints[:, 4] = rng.uniform(-1.5, -0.9, 200)  # the hip stays above the foot
    position, axes, _ = foot_of(robot, side, joints)
    found, out_of_reach = inverse_kinematics(robot, side, position, axes)
    np.testing.assert_array_equal(out_of_reach, 0.0)
    assert_sole_is_placed(robot, side, found, position, axes)
    np.testing.assert_allclose(found, joints, atol=1e-9)


@pytest.mark.parametrize("side", SIDES)
def test_hips_yaw_beyond_a_quarter_turn(robot: Robot, rng: np.random.Generator, side: str) -> None:
    joints = random_postures(robot, rng, 200)[:, LEG[side]]
    joints[:, 0] = rng.choice([-1.0, 1.0], 200) * rng.uniform(math.radians(90.0), math.radians(110.0), 200)
    joints[:, 3:5] = rng.uniform([0.2, -1.0], [1.2, 0.2], (200, 2))
    position, axes, _ = foot_of(robot, side, joints)
    found, _ = inverse_kinematics(robot, side, position, axes)
    np.testing.assert_allclose(found, joints, atol=1e-9)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("height", [0.46, 0.45, 0.3, 0.2])
def test_an_ankle_right_under_its_hip_bends_the_leg_evenly(robot: Robot, side: str, height: float) -> None:
    leg = robot.leg(side)
    found, out_of_reach = inverse_kinematics(robot, side, [leg.hip[0], leg.hip[1], -height])
    half_knee = math.acos((height - 0.06) / 0.4)  # thigh and shank are equally long
    assert out_of_reach == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(found, [0.0, 0.0, -half_knee, 2.0 * half_knee, -half_knee, 0.0], atol=1e-7)


@pytest.mark.parametrize("side", SIDES)
def test_a_batch_of_soles_gives_what_they_give_one_by_one(
    robot: Robot, rng: np.random.Generator, side: str
) -> None:
    joints = random_postures(robot, rng, 60)[:, LEG[side]].reshape(3, 20, 6)
    position, axes, _ = foot_of(robot, side, joints)
    position[0] *= 1.5  # some are out of reach
    found, out_of_reach = inverse_kinematics(robot, side, position, axes)
    assert found.shape == (3, 20, 6)
    assert out_of_reach.shape == (3, 20)
    assert 0 < np.count_nonzero(out_of_reach > 1e-3) < 60
    for index in np.ndindex(3, 20):
        single, missing = inverse_kinematics(robot, side, position[index], axes[index])
        np.testing.assert_array_equal(single, found[index])
        assert missing == out_of_reach[index]


def test_a_sole_is_level_where_no_axes_are_given(robot: Robot) -> None:
    position = [[0.05, 0.15, -0.4], [-0.1, 0.1, -0.3]]
    found = inverse_kinematics(robot, "left", position)
    explicit = inverse_kinematics(robot, "left", position, np.eye(3))
    np.testing.assert_array_equal(found[0], explicit[0])
    assert_sole_is_placed(robot, "left", found[0], np.array(position), np.broadcast_to(np.eye(3), (2, 3, 3)))


def test_inverse_refuses_wrong_shapes(robot: Robot) -> None:
    with pytest.raises(ValueError, match=r"sole_position must have shape \(\.\.\., 3\), not \(2,\)"):
        inverse_kinematics(robot, "left", [0.0, 1.0])
    with pytest.raises(ValueError, match=r"sole_rotation must be finite with shape \(\.\.\., 3, 3\), not \(3,\)"):
        inverse_kinematics(robot, "left", [0.0, 0.1, -0.4], np.ones(3))
    for shape in ((3, 4), (4, 3), (2, 2, 3)):
        with pytest.raises(ValueError, match="sole_rotation must be finite with shape"):
            inverse_kinematics(robot, "left", [0.0, 0.1, -0.4], np.ones(shape))


def test_inverse_refuses_what_is_not_finite(robot: Robot) -> None:
    with pytest.raises(ValueError, match="sole_position must be finite"):
        inverse_kinematics(robot, "left", [0.0, math.nan, -0.4])
    with pytest.raises(ValueError, match="sole_rotation must be finite"):
        inverse_kinematics(robot, "left", [0.0, 0.1, -0.4], np.full((3, 3), math.inf))
