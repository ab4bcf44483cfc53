"""Robots with other estimates, and the ditches that they cross."""

from __future__ import annotations

import math

import numpy as np
import pytest

from agents.studies.estimates import greatest_ditch, with_fan_offset, with_foot_length, with_pelvis_mass
from jet_gym import Robot
from jet_gym.balance import BalanceSettings
from jet_gym.courses import PAPER
from jet_gym.kinematics import forward_kinematics
from jet_gym.posture import evaluate_postures


def test_a_heavier_pelvis_keeps_the_sum_and_lifts_the_center_of_mass(robot: Robot) -> None:
    heights = []
    for mass in (2.0, 2.8, 3.6):
        other = with_pelvis_mass(robot, mass)
        legs = math.fsum((*other.left.masses, *other.right.masses))
        assert legs + mass == pytest.approx(robot.mass)
        assert other.mass == robot.mass
        heights.append(forward_kinematics(other, np.zeros(12)).center_of_mass[2])
    assert heights == sorted(heights)
    same = forward_kinematics(with_pelvis_mass(robot, 2.8), np.zeros(12)).center_of_mass
    np.testing.assert_allclose(same, forward_kinematics(robot, np.zeros(12)).center_of_mass, atol=1e-12)


def test_fans_move_outward_on_both_sides(robot: Robot) -> None:
    fans = forward_kinematics(with_fan_offset(robot, 0.1), np.zeros(12)).fans
    ankles = forward_kinematics(robot, np.zeros(12)).ankles
    np.testing.assert_allclose(fans[:, 1] - ankles[:, 1], (0.1, -0.1))


def test_soles_grow_in_proportion(robot: Robot) -> None:
    longer = with_foot_length(robot, 0.34)
    for before, after in ((robot.left, longer.left), (robot.right, longer.right)):
        np.testing.assert_allclose(after.sole_rectangle[:2], 2.0 * np.array(before.sole_rectangle[:2]))
        assert after.sole_rectangle[2:] == before.sole_rectangle[2:]


def test_an_outer_fan_needs_less_thrust_to_the_side(robot: Robot) -> None:
    step = PAPER.side
    pelvis = step.nominal_pelvis + np.array([0.0, 0.1, -0.05])
    thrusts = [
        float(evaluate_postures(with_fan_offset(robot, offset), "left", step.landing, step.support, pelvis).thrust)
        for offset in (0.0, 0.06, 0.12)
    ]
    assert thrusts[0] > thrusts[1] > thrusts[2] > 0.0


def test_more_thrust_crosses_a_wider_ditch(robot: Robot) -> None:
    thrusts = (0.5 * robot.max_thrust, robot.max_thrust)
    weak, strong = (greatest_ditch(robot, BalanceSettings(max_thrust=thrust), (0,)) for thrust in thrusts)
    assert 0.0 < weak < strong
    assert strong >= 0.45
    assert math.isnan(greatest_ditch(robot, BalanceSettings(max_thrust=0.0), (0,)))
