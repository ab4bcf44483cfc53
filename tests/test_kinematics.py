"""Forward kinematics of both legs, against other libraries, and the limits of their joints, eq. (8)."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError
from typing import TYPE_CHECKING

import numpy as np
import pytest
from legs import (
    MIRROR,
    MIRRORED_JOINTS,
    random_postures,
)

from jet_gym.kinematics import forward_kinematics, within_limits
from jet_gym.leg import SIDES, Leg
from jet_gym.robot import Robot
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from conftest import Oracle


def test_points_are_where_other_libraries_put_them(robot: Robot, oracle: Oracle, rng: np.random.Generator) -> None:
    postures = random_postures(robot, rng, 300)
    body = forward_kinematics(robot, postures)
    for i, joints in enumerate(postures):
        oracle.place(joints)
        for side, name in enumerate(SIDES):
            ankle, axes = oracle.pose(f"{name}_foot")
            np.testing.assert_allclose(body.hips[i, side], oracle.pose(f"{name}_hip_yaw_link")[0], atol=1e-9)
            np.testing.assert_allclose(body.knees[i, side], oracle.pose(f"{name}_shank")[0], atol=1e-9)
            np.testing.assert_allclose(body.ankles[i, side], ankle, atol=1e-9)
            np.testing.assert_allclose(body.soles[i, side], oracle.pose(f"{name}_sole")[0], atol=1e-9)
            np.testing.assert_allclose(body.fans[i, side], oracle.pose(f"{name}_fan")[0], atol=1e-9)
            np.testing.assert_allclose(body.foot_rotations[i, side], axes, atol=1e-9)


def test_center_of_mass_is_that_of_other_libraries(robot: Robot, oracle: Oracle, rng: np.random.Generator) -> None:
    postures = random_postures(robot, rng, 300)
    centers = forward_kinematics(robot, postures).center_of_mass
    for joints, center in zip(postures, centers, strict=True):
        oracle.place(joints)
        np.testing.assert_allclose(center, oracle.center_of_mass(), atol=1e-9)


def test_a_batch_gives_what_its_postures_give_one_by_one(robot: Robot, rng: np.random.Generator) -> None:
    postures = random_postures(robot, rng, 60).reshape(3, 20, 12)
    batch = forward_kinematics(robot, postures)
    assert batch.soles.shape == (3, 20, 2, 3)
    assert batch.foot_rotations.shape == (3, 20, 2, 3, 3)
    assert batch.center_of_mass.shape == (3, 20, 3)
    for index in np.ndindex(3, 20):
        single = forward_kinematics(robot, postures[index])
        for name in vars(batch):
            np.testing.assert_array_equal(getattr(batch, name)[index], getattr(single, name), err_msg=name)


def test_mirrored_joints_give_mirrored_points(robot: Robot, rng: np.random.Generator) -> None:
    postures = random_postures(robot, rng, 200)
    mirrored = np.concatenate([postures[:, 6:] * MIRRORED_JOINTS, postures[:, :6] * MIRRORED_JOINTS], axis=1)
    body, other = forward_kinematics(robot, postures), forward_kinematics(robot, mirrored)
    for name in ("hips", "knees", "ankles", "soles", "fans"):
        np.testing.assert_allclose(getattr(other, name), getattr(body, name)[:, ::-1] * MIRROR, atol=1e-12)
    np.testing.assert_allclose(other.center_of_mass, body.center_of_mass * MIRROR, atol=1e-12)


def test_points_stay_what_they_are_and_are_equal_to_themselves_alone(robot: Robot) -> None:
    body, other = (forward_kinematics(robot, np.zeros(12)) for _ in range(2))
    assert len({body, other, body}) == 2
    with pytest.raises(FrozenInstanceError):
        body.hips = other.hips


def leg_with_limits(leg: Leg, lower: Array, upper: Array) -> Leg:
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
    numbers = {
        "lower": lower,
        "upper": upper,
        "range_cosines": np.cos(middle),
        "range_sines": np.sin(middle),
        "range_half_cosines": np.cos(half),
    }
    return leg._replace(**{name: tuple(values.tolist()) for name, values in numbers.items()})


def is_within(leg: Leg, angles: Array) -> bool:
    return within_limits(leg, tuple(np.cos(angles).tolist()), tuple(np.sin(angles).tolist()))


def test_a_leg_is_within_its_limits_if_every_joint_is(robot: Robot, rng: np.random.Generator) -> None:
    for _ in range(30):
        lower = rng.uniform(-2.5, 1.5, 6)
        upper = lower + rng.uniform(0.2, 2.0, 6)
        leg = leg_with_limits(robot.left, lower, upper)
        inside = rng.uniform(lower, upper)
        assert is_within(leg, inside)
        for joint in range(6):
            one = np.arange(6) == joint
            assert is_within(leg, np.where(one, lower, inside))
            assert is_within(leg, np.where(one, upper, inside))
            assert not is_within(leg, np.where(one, lower - 1e-6, inside))
            assert not is_within(leg, np.where(one, upper + 1e-6, inside))
            assert not is_within(leg, np.where(one, lower - 0.5, inside))
            assert not is_within(leg, np.where(one, upper + 0.5, inside))


@pytest.mark.parametrize("joints", [np.zeros(11), np.zeros((2, 13)), 0.0])
def test_forward_refuses_another_number_of_joints(robot: Robot, joints: Array) -> None:
    with pytest.raises(ValueError, match=r"joint_positions must have shape \(\.\.\., 12\), not"):
        forward_kinematics(robot, joints)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_forward_refuses_what_is_not_finite(robot: Robot, bad: float) -> None:
    with pytest.raises(ValueError, match="joint_positions must be finite"):
        forward_kinematics(robot, [bad] + 11 * [0.0])
