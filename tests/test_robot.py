"""Jet-HR1 has the stated numbers, and the same file gives the same robot everywhere."""

from __future__ import annotations

import copy
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from jet_gym import jet_hr1, load_robot
from jet_gym.kinematics import forward_kinematics
from jet_gym.leg import SIDES
from jet_gym.robot import Robot


def test_jet_hr1_has_the_stated_size(robot: Robot) -> None:
    assert robot.name == "jet_hr1"
    assert robot.height == pytest.approx(0.608, abs=1e-12)
    assert robot.leg_length == pytest.approx(0.460, abs=1e-12)
    assert len(robot.joint_names) == 12


def test_joint_names_run_from_left_hip_yaw_to_right_ankle_roll(robot: Robot) -> None:
    leg = ("hip_yaw", "hip_roll", "hip_pitch", "knee_pitch", "ankle_pitch", "ankle_roll")
    assert robot.joint_names == tuple(f"{side}_{name}" for side in SIDES for name in leg)


def test_limits_stand_in_the_order_of_the_joints(robot: Robot) -> None:
    lower, upper = [-110, -60, -110, 0, -90, -60], [110, 60, 60, 140, 90, 60]
    np.testing.assert_allclose(np.degrees(robot.lower), 2 * lower, atol=1e-6)
    np.testing.assert_allclose(np.degrees(robot.upper), 2 * upper, atol=1e-6)
    np.testing.assert_array_equal(robot.effort, 2 * [7.8, 18.95, 15.6, 15.6, 15.6, 18.95])
    with pytest.raises(ValueError, match="read-only"):
        robot.lower[0] = 0.0


@pytest.mark.parametrize(("side", "outward"), [("left", 1.0), ("right", -1.0)])
def test_legs_have_the_lengths_of_the_table(robot: Robot, side: str, outward: float) -> None:
    leg = robot.leg(side)
    assert leg.hip == (0.0, outward * 0.1125, 0.0)
    assert leg.thigh == (0.0, 0.0, -0.2)
    assert leg.shank == (0.0, 0.0, -0.2)
    assert leg.sole == (0.0, 0.0, -0.06)
    assert leg.fan[:2] == (0.0, outward * 0.06)
    assert leg.sole_rectangle == pytest.approx((-0.07, 0.10, -0.05, 0.05), abs=1e-12)
    assert leg.knee_direction == 1.0


def test_fans_are_the_stated_ones(robot: Robot) -> None:
    assert [fan.frame for fan in robot.fans] == ["left_fan", "right_fan"]
    assert [fan.max_thrust for fan in robot.fans] == [23.0, 23.0]
    assert [fan.time_constant for fan in robot.fans] == [0.15, 0.15]
    assert robot.max_thrust == 23.0


def test_feet_stand_225_mm_apart_on_straight_legs(robot: Robot) -> None:
    left, right = forward_kinematics(robot, np.zeros(12)).soles
    np.testing.assert_allclose(left - right, [0.0, 0.225, 0.0], atol=1e-12)
    assert left[2] == pytest.approx(-0.46, abs=1e-12)


def test_the_same_file_gives_the_same_robot(robot: Robot) -> None:
    assert load_robot(robot.urdf_path) is robot
    assert jet_hr1() is robot


def test_an_edited_file_is_read_again(robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    text = robot.urdf_path.read_text(encoding="utf-8")
    path.write_text(text, encoding="utf-8")
    assert load_robot(path).max_thrust == 23.0
    path.write_text(text.replace('max_thrust="23"', 'max_thrust="30"'), encoding="utf-8")
    os.utime(path, ns=(0, 1_000_000_000))
    assert load_robot(path).max_thrust == 30.0


def test_a_robot_in_use_stays_the_same_object_however_many_others_are_read(robot: Robot, tmp_path: Path) -> None:
    text = robot.urdf_path.read_text(encoding="utf-8")
    for number in range(40):
        (tmp_path / f"{number}.urdf").write_text(text, encoding="utf-8")
        load_robot(tmp_path / f"{number}.urdf")
    assert load_robot(robot.urdf_path) is robot


@pytest.mark.parametrize("duplicate", [copy.copy, copy.deepcopy, lambda robot: pickle.loads(pickle.dumps(robot))])
def test_a_copy_is_the_same_robot(robot: Robot, duplicate: Callable[[Robot], Robot]) -> None:
    assert duplicate(robot) is robot


def test_another_process_unpickles_an_equal_robot(robot: Robot) -> None:
    code = """
import pickle, sys
robot = pickle.load(sys.stdin.buffer)
print([robot.names, robot.left, robot.right, robot.trunk, robot.fans, robot.servos, robot.lower.tolist()])
"""
    path = os.pathsep.join(filter(None, sys.path))
    answer = subprocess.run(
        [sys.executable, "-c", code],
        input=pickle.dumps(robot),
        capture_output=True,
        check=True,
        env=os.environ | {"PYTHONPATH": path},
    )
    mine = [robot.names, robot.left, robot.right, robot.trunk, robot.fans, robot.servos, robot.lower.tolist()]
    assert answer.stdout.decode().strip() == str(mine)
