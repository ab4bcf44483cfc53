"""Disturbances do in the world what physics says of them, and draws stay within their ranges."""

from __future__ import annotations

import dataclasses
import math

import gymnasium as gym
import numpy as np
import pytest

import jet_gym  # noqa: F401  (registers the environment)
from jet_gym.courses import PAPER
from jet_gym.errors import SettingsError
from jet_gym.plan import Plan
from jet_gym.simulation import Disturbance, DisturbanceRanges, SimulationSettings, World
from jet_gym.simulation.disturbances import LINKS, Push
from jet_gym.simulation.motion import FanLag

pytest.importorskip("pybullet")


@pytest.fixture(scope="module")
def plan(side_plan: Plan) -> Plan:
    return side_plan


def stand(world: World, plan: Plan, disturbance: Disturbance, point: int = 0, seconds: float = 0.4):
    """Let the robot hold a posture of a plan under a disturbance."""
    world.disturb(disturbance)
    posture = plan.joint_positions[point], plan.pelvis[point], float(plan.pelvis_yaw[point])
    world.reset(plan.step, *posture, thrust=float(plan.thrust[point]))
    return world.hold(seconds)


class TestWorld:
    def test_heavier_links_weigh_more(self, world, plan, robot):
        factors = (1.1, *(1.0,) * 6, *(1.05,) * 6)
        right_leg = sum(robot.right.masses)
        pelvis = robot.mass - right_leg - sum(robot.left.masses)
        held = stand(world, plan, Disturbance(mass_factors=factors))
        weight = 9.81 * (robot.mass + 0.1 * pelvis + 0.05 * right_leg)
        carried = held.support_force + held.swing_force + held.mean_thrust
        assert carried == pytest.approx(weight, rel=2e-3)

    def test_a_shifted_weight_moves_the_zmp_as_moments_say(self, world, plan, robot):
        """On one foot, in the middle of the step, where the ZMP is the robot's."""
        middle = 30
        pelvis = robot.mass - sum(robot.left.masses) - sum(robot.right.masses)
        zmp = [stand(world, plan, Disturbance(pelvis_com=(x, 0.0, 0.0)), middle).zmp for x in (0.0, 0.02)]
        shift = 0.02 * pelvis / (robot.mass - plan.thrust[middle] / 9.81)
        assert zmp[1] - zmp[0] == pytest.approx([shift, 0.0], abs=1.5e-3)

    def test_a_weak_fan_gives_less_and_a_strong_one_no_more_than_it_can(self, world, plan, robot):
        weak = stand(world, plan, Disturbance(thrust_gain=0.9), -1, 1.5)
        assert weak.thrust == pytest.approx(0.9 * plan.thrust[-1], rel=1e-3)
        for gain, thrust in ((1.1, robot.max_thrust), (0.9, 0.9 * 22.5)):
            fan = FanLag(robot.fans[0], 0.01, gain)
            assert max(fan.step(22.5) for _ in range(500)) == pytest.approx(thrust, rel=1e-3)

    def test_a_slower_fan_takes_longer(self, world, plan):
        slow = stand(world, plan, Disturbance(fan_lag=0.3), -1, 0.1)  # after half a second of settling
        assert slow.thrust == pytest.approx(plan.thrust[-1] * (1.0 - math.exp(-0.6 / 0.3)), rel=0.01)

    def test_a_soft_sole_sinks_in(self, world, plan):
        soft = stand(world, plan, Disturbance(contact_stiffness=2e4)).support_lift
        hard = stand(world, plan, Disturbance(contact_stiffness=1e6)).support_lift
        assert soft < hard - 3e-4

    def test_a_higher_carton_is_higher(self, world, plan):
        stand(world, plan, Disturbance(block_heights=(0.005,)))
        landing = world.client.getBasePositionAndOrientation(world.cartons.bodies["landing"])[0]
        assert landing[2] == pytest.approx(plan.step.landing[2] + 0.005)

    def test_no_carton_is_another_before_the_next_reset(self, world, plan, forward_plan):
        def height() -> float:
            return world.client.getBasePositionAndOrientation(world.cartons.bodies["landing"])[0][2]

        stand(world, plan, Disturbance(block_heights=(0.005, 0.006)))
        world.disturb(Disturbance(block_heights=(0.01, 0.02)))
        world.next_step(forward_plan.step)
        assert height() == pytest.approx(forward_plan.step.landing[2] + 0.006)
        world.place_cartons(plan.step)
        assert height() == pytest.approx(plan.step.landing[2] + 0.005)
        world.reset(plan.step, plan.joint_positions[0], plan.pelvis[0], float(plan.pelvis_yaw[0]))
        assert height() == pytest.approx(plan.step.landing[2] + 0.01)

    def test_a_push_gives_its_impulse_to_a_robot_in_the_air(self, world, plan, robot):
        world.disturb(Disturbance(pushes=(Push(0.05, 0.1, (4.0, 0.0, 0.0)),)))
        world.reset(plan.step, plan.joint_positions[0], plan.pelvis[0], 0.0)
        world.body.place(plan.joint_positions[0], world.body.pelvis().pose._replace(position=plan.pelvis[0] + 1.0))
        world.hold(0.2, stop_on_fall=False)
        links = [-1, *(link for side in ("left", "right") for link in world.body.leg(side))]
        momentum = np.zeros(3)
        for link in links:
            mass = world.client.getDynamicsInfo(world.body.id, link)[0]
            state = world.client.getLinkState(world.body.id, link, computeLinkVelocity=1) if link >= 0 else None
            velocity = state[6] if state else world.client.getBaseVelocity(world.body.id)[0]
            momentum += mass * np.array(velocity)
        assert momentum[:2] == pytest.approx([0.4, 0.0], abs=0.02)

    def test_afterwards_the_world_is_as_it_was(self, world, plan):
        before = stand(world, plan, Disturbance())
        generator = np.random.default_rng(0)
        stand(world, plan, DisturbanceRanges().draw(generator, 1.0))
        after = stand(world, plan, Disturbance())
        assert np.array_equal(before.joint_positions, after.joint_positions)
        assert np.array_equal(before.zmp, after.zmp)
        assert before.thrust == after.thrust


class TestRanges:
    def test_draws_stay_within_the_ranges_and_reach_their_ends(self):
        ranges = DisturbanceRanges()
        generator = np.random.default_rng(3)
        draws = [ranges.draw(generator, 20.0, 2) for _ in range(2000)]
        for name in ("friction", "contact_stiffness", "imu_noise", "imu_delay", "fan_lag"):
            low, high = getattr(ranges, name)
            values = np.array([getattr(draw, name) for draw in draws])
            assert low <= values.min() < low + 0.02 * (high - low)
            assert high >= values.max() > high - 0.02 * (high - low)
        masses = np.array([draw.mass_factors for draw in draws])
        assert masses.shape == (2000, LINKS)
        assert np.abs(masses - 1.0).max() == pytest.approx(0.05, rel=0.01)
        assert np.abs([draw.block_heights for draw in draws]).max() == pytest.approx(0.005, rel=0.01)
        pushes = [push for draw in draws for push in draw.pushes]
        impulses = [push.duration * math.hypot(*push.force) for push in pushes]
        assert max(impulses) == pytest.approx(ranges.push_impulse[1], rel=0.01)
        assert 0.0 <= min(push.time for push in pushes) <= max(push.time for push in pushes) <= 20.0
        directions = np.array([math.atan2(push.force[1], push.force[0]) for push in pushes])
        assert np.histogram(directions, 4, (-math.pi, math.pi))[0].min() > 800

    def test_scaled_ranges_reach_further_in_both_directions(self, robot):
        ranges = DisturbanceRanges()
        assert ranges.scaled(1.0).friction == pytest.approx(ranges.friction)
        doubled = ranges.scaled(2.0)
        assert (doubled.mass, doubled.thrust_gain) == pytest.approx((0.1, 0.2))
        assert doubled.friction[0] < ranges.friction[0]
        assert doubled.friction[1] > ranges.friction[1]
        none = ranges.scaled(0.0)
        assert none.friction == (SimulationSettings().sole_friction,) * 2
        assert none.fan_lag == (robot.fans[0].time_constant,) * 2

    @pytest.mark.parametrize(
        "change",
        [
            {"mass": 0.7},
            {"pelvis_com": -0.01},
            {"friction": (1.0, 0.4)},
            {"friction": 0.5},
            {"fan_lag": (0.0, 0.1)},
            {"imu_delay": (0.0, math.inf)},
            {"pushes": 1.5},
            {"push_duration": 0.0},
        ],
    )
    def test_ranges_that_make_no_sense_are_refused(self, change):
        with pytest.raises(SettingsError, match=next(iter(change))):
            DisturbanceRanges(**change)


class TestEnvironment:
    def test_each_reset_draws_anew_from_the_environments_own_seed(self):
        step = dataclasses.replace(PAPER.side, points=4)
        make = {"disturbances": DisturbanceRanges(), "step": step}
        drawn = []
        with gym.make("JetHR1Step-v0", **make) as env, gym.make("JetHR1Step-v0", **make) as other:
            drawn = [env.reset(seed=1)[1]["disturbance"], env.reset()[1]["disturbance"]]
            again = [other.reset(seed=1)[1]["disturbance"], other.reset()[1]["disturbance"]]
            assert drawn == again
            assert drawn[0] != drawn[1]
            disturbed = [env.step(np.zeros(3))[4]["joint_torques"] for _ in range(3)][-1]
            same = [other.step(np.zeros(3))[4]["joint_torques"] for _ in range(3)][-1]
        with gym.make("JetHR1Step-v0", step=step) as plain:
            assert "disturbance" not in plain.reset(seed=1)[1]
            undisturbed = [plain.step(np.zeros(3))[4]["joint_torques"] for _ in range(3)][-1]
        assert np.array_equal(disturbed, same)
        assert not np.array_equal(disturbed, undisturbed)

    @pytest.mark.parametrize(
        "options", [{"disturbances": 0.1}, {"physics": "quasistatic", "disturbances": DisturbanceRanges()}]
    )
    def test_what_cannot_be_disturbed_is_refused(self, options):
        with pytest.raises(SettingsError, match="disturbances must be"):
            gym.make("JetHR1Step-v0", **options)
