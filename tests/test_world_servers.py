"""Worlds beside each other, each with a server of its own, and the same to the last bit each time."""

from __future__ import annotations

import subprocess
import sys

import pytest
from stepping import begin, fingerprint, go_to, trace

from jet_gym import JetGymError
from jet_gym.simulation import BulletMissingError, DisplayMissingError, World, WorldStateError

pytest.importorskip("pybullet")


def run_python(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout


class TestServers:
    def test_two_worlds_do_not_disturb_each_other(self, side_plan, forward_plan):
        with World() as alone:
            expected = trace(alone, side_plan, 5), trace(alone, forward_plan, 5)
        with World() as first, World() as second:
            begin(first, side_plan)
            begin(second, forward_plan)
            for point in range(1, 5):
                go_to(first, side_plan, point)
                go_to(second, forward_plan, point)
                assert fingerprint(first) == expected[0][point]
                assert fingerprint(second) == expected[1][point]

    def test_closing_a_world_leaves_the_others(self, side_plan):
        first, second = World(), World()
        begin(second, side_plan)
        first.close()
        with World() as third:  # gets the number of the first one's server
            first.close()
            del first
            begin(third, side_plan)
            assert not go_to(third, side_plan, 1).fallen
        assert not go_to(second, side_plan, 1).fallen
        second.close()

    def test_a_closed_world_says_so(self, side_plan):
        world = World()
        begin(world, side_plan)
        world.close()
        world.close()
        posture = side_plan.joint_positions[0], side_plan.pelvis[0], 0.0
        for use in (
            lambda: world.hold(0.1),
            lambda: world.reset(side_plan.step, *posture),
            lambda: world.pose(*posture),
        ):
            with pytest.raises(WorldStateError, match="closed"):
                use()

    def test_moving_before_a_reset_is_refused(self, side_plan):
        with World() as world:
            with pytest.raises(WorldStateError, match="reset"):
                world.hold(0.1)
            world.place_cartons(side_plan.step)
            world.pose(side_plan.joint_positions[5], side_plan.pelvis[5], side_plan.pelvis_yaw[5])
            with pytest.raises(WorldStateError, match="reset"):
                world.hold(0.1)

    def test_without_pybullet_one_sentence_says_what_to_install(self, monkeypatch):
        monkeypatch.setitem(sys.modules, "pybullet", None)
        with pytest.raises(BulletMissingError, match=r"pip install 'jet-gym\[bullet\]'") as caught:
            World()
        assert isinstance(caught.value, JetGymError)

    @pytest.mark.skipif(not sys.platform.startswith("linux"), reason="DISPLAY is a matter of X11")
    def test_without_a_display_a_window_is_refused(self, monkeypatch):
        monkeypatch.delenv("DISPLAY", raising=False)
        with pytest.raises(DisplayMissingError, match="display"):
            World(gui=True)

    def test_importing_the_package_imports_no_pybullet_and_prints_nothing(self):
        code = "import sys, jet_gym.simulation; assert 'pybullet' not in sys.modules"
        assert run_python(code) == ""
        assert run_python("from jet_gym.simulation import World; World().close()") == ""


class TestRepeatability:
    def test_the_same_commands_give_the_same_states_after_other_episodes(self, world, side_plan, forward_plan):
        first = trace(world, side_plan)
        trace(world, forward_plan, 3)
        begin(world, forward_plan)
        world.hold(1.0, stop_on_fall=False)
        posture, thrust = side_plan.joint_positions[40], world.robot.max_thrust  # which throw it over
        world.advance(posture, thrust, 0.3, stop_on_fall=False)
        world.hold(1.0, stop_on_fall=False)
        begin(world, side_plan, point=59)
        world.next_step(forward_plan.step)  # gives the cartons other parts to play
        world.hold(0.2)
        assert trace(world, side_plan) == first

    def test_two_worlds_give_the_same_states(self, world, forward_plan):
        with World() as other:
            assert trace(other, forward_plan) == trace(world, forward_plan)

    def test_memory_stays_flat_over_resets(self):
        code = """
import resource
from jet_gym.courses import PAPER
from jet_gym.posture import evaluate_postures
from jet_gym.simulation import SimulationSettings, World
step = PAPER.side
p = evaluate_postures(step.robot, step.swing, step.start, step.support, step.nominal_pelvis)
world = World(settings=SimulationSettings(settle_time=0.02))
for episode in range(300):
    world.reset(step, p.joint_positions, p.pelvis, float(p.pelvis_yaw))
    world.hold(0.05)
    if episode == 99:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / before)
"""
        assert float(run_python(code)) < 1.005
