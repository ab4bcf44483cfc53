"""Inverse kinematics where a sole is out of reach, or where a joint has no definite angle."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from legs import (
    LEG,
    assert_sole_is_placed,
    foot_of,
    random_postures,
)

from jet_gym.kinematics import inverse_kinematics, leg_inverse
from jet_gym.leg import SIDES, Leg
from jet_gym.robot import Robot, jet_hr1
from jet_gym.urdf import rotation_from_rpy
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    pass


@pytest.mark.parametrize("side", SIDES)
def test_a_sole_out_of_reach_stretches_the_leg_towards_it(
    robot: Robot, rng: np.random.Generator, side: str
) -> None:
    hip = np.array(robot.leg(side).hip)
    for _ in range(200):
        axes = rotation_from_rpy(*rng.uniform(-0.5, 0.5, 3))
        direction = rng.normal(0.0, [0.5, 0.5, 0.2]) - [0.0, 0.0, 1.0]
        direction /= np.linalg.norm(direction)
        distance = 0.4 + 10.0 ** rng.uniform(-6.0, 2.0)
        ankle_to_sole = axes @ [0.0, 0.0, -0.06]
        found, out_of_reach = inverse_kinematics(robot, side, hip + distance * direction + ankle_to_sole, axes)
        assert out_of_reach == pytest.approx(distance - 0.4, rel=1e-9)
        assert np.isfinite(found).all()
        assert found[3] == pytest.approx(0.0, abs=1e-7)
        assert_sole_is_placed(robot, side, found, hip + 0.4 * direction + ankle_to_sole, axes)


def test_a_sole_too_near_folds_a_leg_of_unequal_halves(robot: Robot, rng: np.random.Generator) -> None:
    """A leg with a short shank cannot bring its ankle to its hip; Jet-HR1's own could."""
    short = replace(robot, left=robot.left._replace(shank=(0.0, 0.0, -0.15)))
    hip = np.array(short.left.hip)
    for distance in (0.04, 0.01, 1e-3):
        direction = rng.normal(size=3)
        direction[2] = -abs(direction[2])
        direction /= np.linalg.norm(direction)
        found, out_of_reach = inverse_kinematics(short, "left", hip + distance * direction + [0.0, 0.0, -0.06])
        assert out_of_reach == pytest.approx(0.05 - distance, abs=1e-12)
        assert_sole_is_placed(short, "left", found, hip + 0.05 * direction + [0.0, 0.0, -0.06], np.eye(3))


def test_a_hip_too_near_to_the_roll_axis_of_an_ankle_beside_it_is_out_of_reach(robot: Robot) -> None:
    """With the ankle 30 mm beside the hip, no ankle roll brings the hip closer than that to the roll axis."""
    offset = replace(robot, left=robot.left._replace(shank=(0.0, 0.03, -0.2)))
    hip = np.array(offset.left.hip)
    for away in (0.0301, 0.03, 0.02, 0.01):
        sole = hip + np.array([0.3, 0.6 * away, -0.8 * away - 0.06])
        _, out_of_reach = inverse_kinematics(offset, "left", sole)
        assert out_of_reach == pytest.approx(max(0.03 - away, 0.0), abs=1e-12)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(
    "offset", [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (1e9, 0.0, 0.0), (0.0, 0.0, 1e9)]
)
def test_angles_are_finite_even_where_no_leg_could_go(robot: Robot, side: str, offset: tuple[float, ...]) -> None:
    ankle_on_hip = np.array(robot.leg(side).hip) + np.array(robot.leg(side).sole)
    found, out_of_reach = inverse_kinematics(robot, side, ankle_on_hip + offset)
    assert np.isfinite(found).all()
    assert np.isfinite(out_of_reach)


SINGULAR: dict[str, tuple[Array, Array]] = {  # ankle from hip, foot axes
    "hip on the ankle's roll axis": (np.array([0.3, 0.0, 0.0]), np.eye(3)),
    "hip roll of a quarter turn": (np.array([0.0, 0.3, 0.0]), np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])),
    "hip at the ankle": (np.zeros(3), np.eye(3)),
}


@pytest.mark.parametrize(("ankle_from_hip", "axes"), SINGULAR.values(), ids=SINGULAR)
def test_a_sole_in_reach_is_placed_where_a_joint_has_no_definite_angle(
    robot: Robot, ankle_from_hip: Array, axes: Array
) -> None:
    sole = np.array(robot.left.hip) + ankle_from_hip - 0.06 * axes[:, 2]
    found, out_of_reach = inverse_kinematics(robot, "left", sole, axes)
    assert out_of_reach == 0.0
    assert_sole_is_placed(robot, "left", found, sole, axes)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("ahead", [0.3, -0.3, 0.0])
def test_a_sole_turned_anyhow_is_placed_with_the_hip_on_the_axis_of_ankle_roll(
    robot: Robot, rng: np.random.Generator, side: str, ahead: float
) -> None:
    for _ in range(50):
        axes = rotation_from_rpy(*rng.uniform(-3.0, 3.0, 3))
        sole = robot.leg(side).hip - axes @ [ahead, 0.0, 0.06]
        found, out_of_reach = inverse_kinematics(robot, side, sole, axes)
        assert out_of_reach == 0.0
        assert_sole_is_placed(robot, side, found, sole, axes)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("quarter", [-0.5 * math.pi, 0.5 * math.pi])
def test_with_hip_roll_of_a_quarter_turn_hip_pitch_does_what_yaw_does(
    robot: Robot, rng: np.random.Generator, side: str, quarter: float
) -> None:
    joints = random_postures(robot, rng, 200)[:, LEG[side]]
    joints[:, 1] = quarter
    position, axes, _ = foot_of(robot, side, joints)
    found, out_of_reach = inverse_kinematics(robot, side, position, axes)
    np.testing.assert_allclose(out_of_reach, 0.0, atol=1e-12)
    assert_sole_is_placed(robot, side, found, position, axes)
    np.testing.assert_array_equal(found[:, 0], 0.0)


UNLIKE = {"thigh": (0.03, 0.0, -0.17), "shank": (-0.02, 0.04, -0.22), "knee_direction": -1.0}


@pytest.mark.parametrize("leg", [jet_hr1().left, jet_hr1().left._replace(**UNLIKE)], ids=["ours", "unlike"])
@pytest.mark.parametrize("where", ["anywhere", "hip on the axis of ankle roll", "hip at the ankle", "hip roll"])
def test_cosines_and_sines_are_those_of_an_angle(rng: np.random.Generator, leg: Leg, where: str) -> None:
    """Planning asks a leg for them, never for its angles."""
    checked = 0
    for _ in range(100):
        axes, hip = rotation_from_rpy(*rng.uniform(-3.0, 3.0, 3)), rng.normal(0.0, 0.25, 3)
        if where == "hip on the axis of ankle roll":
            hip[1:] = 0.0
        elif where == "hip at the ankle":
            hip[:] = 0.0
        elif where == "hip roll":  # a quarter turn of it: the y axis behind ankle roll is the pelvis' z axis
            lateral, y, z = leg.shank[1], hip[1], hip[2]
            roll = math.atan2(y, z) + math.asin(min(max(lateral / math.hypot(y, z), -1.0), 1.0))
            axes = rotation_from_rpy(0.0, 0.0, rng.uniform(-3.0, 3.0)) @ rotation_from_rpy(
                0.5 * math.pi + roll, 0, 0
            )
        cosines, sines, _ = leg_inverse(leg, tuple(hip.tolist()), tuple(axes.ravel().tolist()))
        if math.hypot(hip[1], hip[2]) < abs(leg.shank[1]):
            continue  # no ankle roll brings the ankle below its hip
        np.testing.assert_allclose(np.square(cosines) + np.square(sines), 1.0, atol=1e-9)
        assert cosines[1] >= 0.0
        assert where != "hip roll" or cosines[1] < 1e-9
        checked += 1
    assert checked > 50 or (leg.shank[1] != 0.0 and where in ("hip on the axis of ankle roll", "hip at the ankle"))
