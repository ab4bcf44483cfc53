"""Plans that are executed: the paper's course within its limits, and what is said where it fails."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from agents.planner import make_planner
from jet_gym.courses import PAPER
from jet_gym.errors import SettingsError, StepError
from jet_gym.kinematics import forward_kinematics
from jet_gym.plan import Plan
from jet_gym.simulation import CourseSettings, Disturbance, Execution, ExecutionSettings, execute, make_course
from jet_gym.simulation.diagnosis import explain_fall
from jet_gym.simulation.landing import find_landings
from jet_gym.step import Step

pytest.importorskip("pybullet")

QUICK = CourseSettings(stand_time=0.2, time_scale=0.55, transition_time=2.0, rest_time=0.3)


@pytest.fixture(scope="module")
def plans() -> list[Plan]:
    return [make_planner("gas").plan(step, seed=0) for step in PAPER]


@pytest.fixture(scope="module")
def crossing(plans) -> Execution:
    """The paper's course at its own pace."""
    return execute(plans, ExecutionSettings(thrust="pid"), seed=0)


class TestThePapersCourse:
    def test_it_takes_24_seconds_or_less(self, crossing):
        assert crossing.summary.success, crossing.summary.outcome
        assert 15.0 < crossing.time[-1] <= 24.0

    def test_limits_hold(self, crossing, robot):
        assert 18.0 < crossing.thrust_delivered.max() <= robot.max_thrust
        assert np.all(crossing.joint_torques.max(axis=0) < robot.effort)
        speed = np.abs(np.diff(crossing.joint_positions, axis=0)) / np.diff(crossing.time)[:, None]
        assert np.all(speed.max(axis=0) < robot.velocity)

    def test_no_foot_slides_off_its_carton(self, crossing):
        for k, places in ((0, PAPER.side.landing), (1, PAPER.forward.landing)):
            assert crossing.soles[-1, k] == pytest.approx(places, abs=3e-3)
        assert crossing.slip.max() < 2e-3

    def test_the_support_foot_changes_when_the_other_one_carries_weight(self, crossing):
        (change,) = np.flatnonzero(np.diff(crossing.plan))
        weight = crossing.foot_forces[change].sum()
        assert crossing.phase[change] == "transition 1"
        assert crossing.foot_forces[change, 0] >= 0.3 * weight - 1.0
        assert crossing.thrust_delivered[change].max() < 0.5

    def test_in_the_air_the_fan_carries_what_the_support_foot_does_not(self, crossing, robot):
        in_the_air = (crossing.phase == "motion 2") & (crossing.foot_forces[:, 1] == 0.0)
        carried = crossing.foot_forces[in_the_air, 0] + crossing.thrust_delivered[in_the_air, 1]
        assert carried.mean() == pytest.approx(robot.mass * 9.81, rel=5e-3)

    def test_the_zmp_stays_on_the_soles(self, crossing):
        assert crossing.summary.least_zmp_margin > 2e-3
        assert math.degrees(crossing.summary.worst_tilt) < 1.0

    @pytest.mark.parametrize("seed", range(1, 5))
    def test_five_seeds_of_five_succeed(self, plans, seed):
        """The fifth is that of ``crossing``."""
        summary = execute(plans, ExecutionSettings(thrust="pid"), seed=seed).summary
        assert summary.success, summary.outcome
        assert summary.duration <= 24.0

    def test_both_feet_land_where_and_when_they_should(self, crossing):
        first, second = crossing.summary.landings
        assert (first.step, first.side, second.step, second.side) == (0, "left", 1, "right")
        for landing in (first, second):
            assert landing.distance < 5e-3
            assert abs(landing.early) < 0.25  # the joints are 0.15 s behind what is commanded
            assert crossing.time[landing.row] == landing.time
            k = 0 if landing.side == "left" else 1
            assert crossing.foot_forces[landing.row, k] > 0.0
            assert crossing.foot_forces[landing.row - 1, k] < 2.1  # 3 % of the weight
        assert crossing.summary.touchdown_error == max(first.distance, second.distance)

    def test_who_falls_onto_the_landing_carton_did_not_succeed(self, plans):
        """A fan that gives a fifth less lets the robot tip forward; the foot that lands too early catches it."""
        weak = execute(plans, ExecutionSettings(), disturbance=Disturbance(thrust_gain=0.8))
        summary = weak.summary
        assert not summary.success
        assert not summary.fallen
        assert summary.landings[1].early > 0.5
        assert summary.landings[1].distance > 0.03
        assert summary.cause == "left foot"
        assert "the right foot touched down" in summary.outcome
        assert "s early: the left foot tipped over its front edge" in summary.outcome
        assert summary.verdict == "not as planned: left foot"

    def test_without_fans_it_falls_over_the_ditch(self, plans):
        fallen = execute(plans, ExecutionSettings(course=QUICK, fan_power=0.0))
        assert not fallen.summary.success
        assert fallen.summary.fallen
        assert fallen.summary.verdict == f"fell: {fallen.summary.cause}"
        assert "in motion 2: the left foot tipped over its inner edge" in fallen.summary.outcome
        assert f"at {fallen.time[-1]:.1f} s" in fallen.summary.outcome

    def test_a_foot_that_carries_too_little_is_no_fall(self, plans):
        settings = ExecutionSettings(course=QUICK, carrying_share=1.0, patience=0.1)
        given_up = execute(plans, settings)
        assert given_up.phase[-1] == "transition 1"
        summary = given_up.summary
        assert (summary.success, summary.fallen, summary.cause) == (False, False, "left foot")
        end = f"at {given_up.time[-1]:.1f} s, in transition 1"
        assert summary.outcome == f"the left foot never carried the robot, {end}"
        strict = execute(plans, replace(settings, landing_tolerance=2e-5)).summary
        assert not strict.fallen
        assert strict.outcome.startswith(
            f"{summary.outcome}; before that, the left foot touched down 0 mm from its place at"
        )

    def test_the_phase_of_a_fall_is_that_of_its_time(self, robot):
        """A robot that leaves the vertical in the motion and falls 0.4 s later, when the motion has ended."""
        tilt = np.radians([0.0, 0.5, 1.0, 5.0, 9.0, 14.0, 21.0])
        series = {
            "time": 0.1 * np.arange(7),
            "phase": np.array([*["motion 1"] * 4, *["finish"] * 3]),
            "tilt": tilt,
            "swing_is_left": np.ones(7, dtype=bool),
            "joint_torques": np.zeros((7, 12)),
            "thrust_commanded": np.zeros(7),
            "slip": np.zeros(7),
            "zmp_margin": np.full(7, -0.001),
            "zmp": np.tile([0.0, -0.05], (7, 1)),
            "soles": np.zeros((7, 2, 3)),
        }
        onset, _, sentence = explain_fall(robot, series, "the pelvis tilts")
        assert onset == 2
        assert sentence.startswith(
            "the robot fell at 0.6 s, in finish, upright until 0.2 s, in motion 1: the right foot"
        )
        _, _, sentence = explain_fall(robot, {**series, "phase": np.full(7, "motion 1")}, "the pelvis tilts")
        assert sentence.startswith("the robot fell at 0.6 s, in motion 1: the right foot")


class TestDemands:
    @pytest.mark.parametrize(
        ("demand", "cause", "sentence"),
        [
            (
                {"landing_tolerance": 2e-5},
                "left foot misplaced",
                "the left foot touched down 0 mm from its place at",
            ),
            ({"slip_tolerance": 1e-6}, "right foot slip", "the right foot slid by more than 0 mm at"),
        ],
    )
    def test_what_is_not_met_is_told(self, plans, demand, cause, sentence):
        summary = execute(plans[:1], ExecutionSettings(course=QUICK, **demand)).summary
        assert not summary.success
        assert not summary.fallen
        assert summary.cause == cause
        assert summary.outcome.startswith(sentence)

    def test_touchdown_is_where_a_foot_carries_something_away_from_its_start(self):
        """A foot lifts off, comes back to its start, scuffs halfway, and lands."""
        step = Step(swing="left", start=(0.0, 0.1, 0.0), landing=(0.3, 0.1, 0.0), support=(0.0, -0.1, 0.0))
        x = np.array([0.0, 0.0, 0.005, 0.008, 0.1, 0.15, 0.2, 0.3, 0.3, 0.3])
        force = np.array([30.0, 20.0, 0.0, 9.0, 0.0, 5.0, 0.0, 0.0, 0.0, 20.0])
        soles = np.zeros((10, 2, 3))
        soles[:, 0, 0], soles[:, 0, 1] = x, 0.1
        series = {
            "time": 0.1 * np.arange(10),
            "plan": np.zeros(10, dtype=int),
            "phase": np.array(["shift", *["motion 1"] * 8, "finish"]),
            "foot_forces": np.stack([force, 60.0 - force], axis=1),
            "soles": soles,
        }
        plan = SimpleNamespace(step=step)
        (scuff,) = find_landings([plan], series, 2.0, 0.015)
        assert (scuff.row, scuff.side) == (5, "left")
        assert (scuff.time, scuff.early, scuff.distance) == pytest.approx((0.5, 0.3, 0.15))
        force[5] = 1.0
        series["foot_forces"][5] = 1.0, 59.0
        (landing,) = find_landings([plan], series, 2.0, 0.015)
        assert (landing.row, landing.distance) == (9, pytest.approx(0.0))
        assert landing.early == pytest.approx(-0.1)
        series["foot_forces"][9] = 0.0, 60.0
        assert find_landings([plan], series, 2.0, 0.015) == ()


class TestExecution:
    def test_the_same_seed_gives_the_same_result(self, plans):
        settings = ExecutionSettings(thrust="pid", course=QUICK)
        one, two, other = (execute(plans[:1], settings, seed=seed) for seed in (3, 3, 4))
        assert np.array_equal(one.joint_positions, two.joint_positions)
        assert np.array_equal(one.thrust_commanded, two.thrust_commanded)
        assert not np.array_equal(one.thrust_commanded, other.thrust_commanded)

    def test_feed_forward_commands_what_was_planned(self, plans):
        result = execute(plans[:1], ExecutionSettings(course=QUICK))
        assert result.thrust_commanded == pytest.approx(result.thrust_planned, abs=1e-9)
        motion = result.thrust_planned[result.phase == "motion 1"]
        assert motion.max() == pytest.approx(plans[0].thrust[-1], abs=0.1)

    def test_the_log_says_what_the_series_say(self, crossing, tmp_path):
        crossing.save_csv(tmp_path / "log.csv")
        with (tmp_path / "log.csv").open() as file:
            rows = list(csv.DictReader(file))
        assert len(rows) == len(crossing.time)
        at = len(rows) // 2
        assert float(rows[at]["time_s"]) == pytest.approx(crossing.time[at], rel=1e-6)
        assert float(rows[at]["left_knee_pitch_position_rad"]) == pytest.approx(crossing.joint_positions[at, 3])
        assert float(rows[at]["right_thrust_N"]) == pytest.approx(crossing.thrust_delivered[at, 1], abs=1e-6)
        assert rows[at]["phase"] == crossing.phase[at]
        assert {row["support"] for row in rows} == {"left", "right"}

    @pytest.mark.parametrize("seed", [-1, 1.5, True])
    def test_seeds_that_make_no_sense_are_refused(self, plans, seed):
        with pytest.raises(ValueError, match="seed"):
            execute(plans, seed=seed)

    @pytest.mark.parametrize(
        "change", [{"thrust": "none"}, {"fan_power": 1.5}, {"patience": math.inf}, {"carrying_share": "half"}]
    )
    def test_settings_that_make_no_sense_are_refused(self, change):
        with pytest.raises(SettingsError, match=next(iter(change))):
            ExecutionSettings(**change)


class TestCourse:
    def test_joints_move_smoothly_within_their_speed_and_range(self, plans, robot):
        course = make_course(plans)
        assert course.duration <= 24.0
        for phase in course.phases:
            speed = np.abs(np.diff(phase.joint_positions, axis=0)) / np.diff(phase.time)[:, None]
            assert np.all(speed <= 0.7 * robot.velocity + 1e-9)
            assert np.all((phase.joint_positions >= robot.lower) & (phase.joint_positions <= robot.upper))
            assert speed[[0, -1]].max() < 0.15  # from rest to rest
        for before, after in zip(course.phases, course.phases[1:], strict=False):
            assert before.joint_positions[-1] == pytest.approx(after.joint_positions[0], abs=1e-9)

    def test_a_motion_goes_through_the_plans_postures_and_thrusts(self, plans):
        course = make_course(plans[:1], CourseSettings(clearance=0.0))
        (motion,) = (phase for phase in course.phases if phase.kind == "motion")
        for posture, thrust in zip(plans[0].joint_positions, plans[0].thrust, strict=True):
            distance = np.abs(motion.joint_positions - posture).max(axis=1)
            assert distance.min() < 0.01
            assert motion.thrust[distance.argmin()] == pytest.approx(thrust, abs=0.1)

    @pytest.mark.parametrize("number", [0, 1])
    def test_the_swing_foot_leaves_and_comes_down_nearly_straight(self, plans, robot, number):
        """By forward kinematics from the support foot, with the pelvis as planned."""
        plan = plans[number]
        swing, support = (0, 1) if plan.step.swing == "left" else (1, 0)
        ways = {}
        for clearance in (0.0, 0.008):
            (motion,) = (
                p for p in make_course([plan], CourseSettings(clearance=clearance)).phases if p.kind == "motion"
            )
            soles = forward_kinematics(robot, motion.joint_positions).soles
            ways[clearance] = soles[:, swing] - soles[:, support]
        raised = ways[0.008] - ways[0.0]
        assert raised[[0, -1], 2] == pytest.approx([0.0, 0.0], abs=1e-6)
        assert raised[-60:-50] == pytest.approx(np.tile([0.0, 0.0, 0.008], (10, 1)), abs=3e-4)
        # Where a roll joint is at its limit, as after the lift-off of motion 2, the foot can be raised less.
        assert raised[:, 2].min() > -1e-4
        assert np.abs(raised[:, :2]).max() < 4e-3
        height = ways[0.008][:, 2]
        for near, far in ((0, 35), (-1, -36)):  # within 0.35 s of lift-off and landing
            aside = np.hypot(*(ways[0.008][far, :2] - ways[0.008][near, :2]))
            assert height[far] - height[near] > 6e-3
            assert aside < 6e-3

    def test_slow_servos_stretch_time(self, plans, robot):
        fast, slow = (make_course(plans, CourseSettings(speed_share=share)) for share in (1.0, 0.1))
        assert slow.duration > 1.5 * fast.duration

    def test_plans_that_do_not_belong_together_are_refused(self, plans):
        with pytest.raises(StepError, match="plan 2 begins with the left sole at"):
            make_course(plans[::-1])
        moved = replace(PAPER.forward, landing=(0.4, 0.1275, 0.0), points=20)
        with pytest.raises(StepError, match="plan 2"):
            make_course([plans[1], make_planner("gas").plan(moved)])
        back = make_planner("gas").plan(replace(PAPER.side, start=PAPER.side.landing, landing=PAPER.side.start))
        with pytest.raises(StepError, match="plan 2 swings the left foot again; the steps of a course take turns"):
            make_course([plans[0], back])
        with pytest.raises(ValueError, match="at least one plan"):
            make_course([])

    @pytest.mark.parametrize("change", [{"time_scale": 0.0}, {"speed_share": 1.5}, {"ease_time": math.nan}])
    def test_settings_that_make_no_sense_are_refused(self, change):
        with pytest.raises(SettingsError, match=next(iter(change))):
            CourseSettings(**change)
