"""A robot on one foot: its legs by what they do, and where a hip is over its ankle."""

from __future__ import annotations

import numpy as np
import pytest

from jet_gym.balance import BalanceSettings
from jet_gym.errors import SettingsError
from jet_gym.kinematics import forward_kinematics
from jet_gym.leg import Side
from jet_gym.posture import evaluate_postures
from jet_gym.robot import Robot
from jet_gym.single_support import hip_from_ankle, single_support, stance_between, straight_length


@pytest.mark.parametrize("swing", ["left", "right"])
def test_legs_are_named_by_what_they_do(robot: Robot, swing: Side) -> None:
    numbers = single_support(robot, swing, BalanceSettings(thrust_model="least"))
    left, right = (numbers.swing_leg, numbers.support_leg)[:: 1 if swing == "left" else -1]
    assert (left, right, numbers.trunk) == (robot.left, robot.right, robot.trunk)
    assert numbers.side == (1.0 if swing == "left" else -1.0)
    assert numbers.balance.least_thrust


def test_no_other_leg_swings_and_no_margin_is_wider_than_the_foot(robot: Robot) -> None:
    with pytest.raises(ValueError, match="swing must be 'left' or 'right'"):
        single_support(robot, "middle")  # type: ignore[arg-type]
    with pytest.raises(SettingsError, match="zmp_margin"):
        single_support(robot, "left", BalanceSettings(zmp_margin=0.2))


@pytest.mark.parametrize("swing", ["left", "right"])
def test_the_hip_is_over_its_ankle_where_forward_kinematics_says(robot: Robot, swing: Side) -> None:
    sides = (1.0, -1.0) if swing == "left" else (-1.0, 1.0)
    swing_sole, support = (0.1, 0.15 * sides[0], 0.03), (0.0, 0.1125 * sides[1], 0.0)
    pelvis = np.array([0.03, 0.02, 0.42])
    posture = evaluate_postures(robot, swing, swing_sole, support, pelvis)
    assert posture.out_of_reach == 0.0
    body = forward_kinematics(robot, posture.joint_positions)
    yaw = float(posture.pelvis_yaw)
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    numbers = single_support(robot, swing)
    stance = stance_between(numbers, swing_sole, support)
    legs = (numbers.swing_leg, stance.swing_ankle), (numbers.support_leg, stance.support_ankle)
    for (leg, ankle), which in zip(legs, (0, 1) if swing == "left" else (1, 0), strict=True):
        expected = turn @ (body.hips[which] - body.ankles[which])
        np.testing.assert_allclose(hip_from_ankle(leg, stance, ankle, tuple(pelvis.tolist())), expected, atol=1e-9)


def test_a_straight_leg_is_as_long_as_it_stands_at_zero_posture(robot: Robot) -> None:
    body = forward_kinematics(robot, np.zeros(12))
    for leg, hip, ankle in zip((robot.left, robot.right), body.hips, body.ankles, strict=True):
        assert straight_length(leg) == pytest.approx(np.linalg.norm(hip - ankle), abs=1e-12)
