"""What a world is told, and what it refuses: commands, settings, meshes that are missing."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from stepping import begin, fingerprint, follow, replace_thrust

from jet_gym import Robot, load_robot
from jet_gym.courses import PAPER
from jet_gym.errors import RobotError, SettingsError
from jet_gym.simulation import SimulationSettings, World
from jet_gym.simulation.motion import CommandBlend, FanLag

pytest.importorskip("pybullet")


class TestCommands:
    def test_whole_simulation_steps_do_not_add_up_to_a_wrong_time(self, world, side_plan):
        begin(world, side_plan)
        for _ in range(10):
            measured = world.hold(0.0187)
        assert measured.time == pytest.approx(0.187, abs=0.5 / 240.0)

    def test_the_fan_reaches_63_percent_after_one_time_constant(self, world, side_plan, robot):
        begin(world, replace_thrust(side_plan, 0.0))
        world.advance(side_plan.joint_positions[0], 6.0, world.settings.time_step)
        after = world.hold(robot.fans[0].time_constant - world.settings.time_step)
        assert after.thrust == pytest.approx(6.0 * (1.0 - math.exp(-1.0)), rel=1e-6)
        assert world.hold(2.0).thrust == pytest.approx(6.0, rel=1e-5)

    def test_a_fan_gives_no_more_than_it_can_and_never_pulls(self, robot):
        fan = FanLag(robot.fans[0], 0.01)
        assert max(fan.step(100.0) for _ in range(500)) == pytest.approx(robot.fans[0].max_thrust)
        assert min(fan.step(-100.0) for _ in range(500)) >= 0.0

    def test_a_blend_goes_in_a_straight_line_and_arrives_half_its_width_late(self):
        blend = CommandBlend(11)
        blend.reset(np.array([1.0]))
        path = np.concatenate([blend.advance(np.array([3.0]), 40), blend.advance(np.array([3.0]), 20)])[:, 0]
        assert path[24] == pytest.approx(1.0 + 2.0 * 20 / 40)  # row 24 is step 25, the command of step 20
        assert np.all(np.diff(path) >= -1e-15)
        assert path[-1] == pytest.approx(3.0, abs=1e-15)
        assert np.abs(np.diff(path, n=2)).max() < 2.0 / 40 * 2.0 / 11

    def test_a_blend_does_not_depend_on_how_the_way_is_divided(self):
        once, twice = CommandBlend(9), CommandBlend(9)
        for blend in (once, twice):
            blend.reset(np.zeros(2))
        whole = once.advance(np.array([1.0, -2.0]), 20)
        parts = [twice.advance(np.array([0.5, -1.0]), 10), twice.advance(np.array([1.0, -2.0]), 10)]
        assert whole == pytest.approx(np.concatenate(parts), abs=1e-14)

    def test_servos_stay_below_their_speed_limits(self, world, side_plan, robot):
        begin(world, side_plan)
        speeds = []
        for _ in range(30):  # a knee told to jump
            target = side_plan.joint_positions[0].copy()
            target[3] += 0.5
            measured = world.advance(target, 0.0, 0.005, stop_on_fall=False)
            speeds.append(np.abs(measured.joint_velocities))
        assert np.all(np.max(speeds, axis=0) < 1.15 * robot.velocity)

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"joint_positions": np.zeros(11)}, "joint_positions"),
            ({"joint_positions": np.full(12, math.nan)}, "joint_positions"),
            ({"thrust": math.inf}, "thrust"),
            ({"duration": 0.0}, "duration"),
            ({"duration": math.nan}, "duration"),
        ],
    )
    def test_commands_that_make_no_sense_are_refused(self, world, side_plan, change, message):
        begin(world, side_plan)
        command: dict[str, Any] = {"joint_positions": side_plan.joint_positions[0], "thrust": 0.0, "duration": 0.1}
        before = fingerprint(world)
        with pytest.raises(ValueError, match=message):
            world.advance(**{**command, **change})
        assert fingerprint(world) == before

    def test_a_step_of_another_robot_is_refused(self, world, tmp_path, robot, side_plan):
        other_file = tmp_path / "other.urdf"
        other_file.write_text(robot.urdf_path.read_text())
        step = replace(PAPER.side, robot=load_robot(other_file))
        with pytest.raises(ValueError, match="not of that of"):
            world.reset(step, side_plan.joint_positions[0], side_plan.pelvis[0], 0.0)


class TestSettings:
    @pytest.mark.parametrize(
        "change",
        [
            {"rate": 0.0},
            {"rate": math.nan},
            {"position_gain": 1.5},
            {"sole_friction": -0.1},
            {"solver_iterations": 0},
            {"solver_iterations": 50.0},
            {"sample_every": True},
            {"gravity": "9.81"},
        ],
    )
    def test_settings_that_make_no_sense_are_refused(self, change):
        with pytest.raises(SettingsError, match=next(iter(change))):
            SimulationSettings(**change)

    @pytest.mark.parametrize(
        "settings",
        [
            SimulationSettings(position_gain=0.2),
            SimulationSettings(position_gain=0.8),
            SimulationSettings(solver_iterations=25),
            SimulationSettings(solver_iterations=100),
            SimulationSettings(sole_friction=0.4),
            SimulationSettings(contact_stiffness=1e5),
            SimulationSettings(contact_stiffness=1e6),
            SimulationSettings(rate=480.0),
        ],
    )
    def test_the_estimated_settings_do_not_decide_whether_the_robot_stands(self, settings, side_plan):
        with World(settings=settings) as world:
            begin(world, side_plan)
            measured = follow(world, side_plan)
        assert not measured[-1].fallen
        assert np.percentile([m.support_sole_margin for m in measured], 5) > 8e-3


def test_robot_whose_meshes_are_missing_is_refused(robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / "mine.urdf"
    path.write_bytes(robot.urdf_path.read_bytes())
    with pytest.raises(RobotError, match=r"PyBullet cannot load .*mine\.urdf; the meshes"):
        World(load_robot(path))
