"""The studio without a browser: inputs, what is planned, simulated and said, and motions."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest
from page_inputs import SIDE, never

from agents import make_planner
from jet_gym.balance import BalanceSettings
from jet_gym.errors import StepError
from jet_gym.fitness import FitnessSettings
from jet_gym.plan import Plan
from jet_gym.posture import evaluate_postures
from jet_gym.studio import planning
from jet_gym.studio.curves import fitness_terms, zmp_margin
from jet_gym.studio.inputs import FEET, Inputs
from jet_gym.studio.motion import Motion
from jet_gym.studio.page.panel import mirrored
from jet_gym.studio.page.plot import Curve, Plot, Samples
from jet_gym.studio.page.table import comparison_table
from jet_gym.studio.physics import Physics


@pytest.fixture(scope="module")
def plan() -> Plan:
    return make_planner("gas").plan(SIDE.step, seed=0)


def test_defaults_of_the_page_are_those_of_the_package() -> None:
    assert SIDE.balance == BalanceSettings()
    assert SIDE.fitness == FitnessSettings()


@pytest.mark.parametrize("foot", FEET)
def test_moved_foot_is_the_only_thing_that_changes(foot: str) -> None:
    moved = SIDE.moved(foot, (0.01, 0.02, 0.03))
    assert moved.position(foot) == (0.01, 0.02, 0.03)
    assert all(moved.position(other) == SIDE.position(other) for other in FEET if other != foot)
    assert moved.moved(foot, SIDE.position(foot)) == SIDE


def test_unknown_foot_is_refused() -> None:
    with pytest.raises(ValueError, match="a foot is one of"):
        SIDE.moved("head", (0.0, 0.0, 0.0))


def test_step_that_makes_no_sense_is_refused_when_it_is_asked_for() -> None:
    inputs = SIDE.moved("landing", SIDE.start)
    with pytest.raises(StepError, match="same place"):
        _ = inputs.step


def test_mirrored_step_takes_the_same_thrust() -> None:
    """The robot is symmetric, so least thrusts of mirrored postures are equal."""
    other = mirrored(SIDE)
    assert other.swing == "right"
    pelvis = SIDE.step.nominal_pelvis
    thrusts = [
        evaluate_postures(i.step.robot, i.swing, i.landing, i.support, pelvis * np.array([1, sign, 1])).thrust
        for i, sign in ((SIDE, 1), (other, -1))
    ]
    assert thrusts[0] == pytest.approx(thrusts[1], abs=1e-9)


def test_plan_of_the_page_is_the_planners_own(plan: Plan) -> None:
    again = planning.plan_with("gas", SIDE, never)
    assert again is not None
    np.testing.assert_array_equal(again.pelvis, plan.pelvis)


def test_planning_gives_up_once_it_is_stale() -> None:
    assert planning.plan_with("gas", SIDE, lambda: True) is None


def test_verdict_of_a_plan_that_holds_tells_its_peak_thrust(plan: Plan) -> None:
    verdict = planning.judge(plan, SIDE)
    assert verdict.kind == "holds"
    assert f"{plan.thrust.max():.1f} N of {plan.step.robot.max_thrust:g} N" in verdict.sentence


@pytest.mark.parametrize(("y", "word"), [(2.0, "out of the legs' reach"), (0.8, "takes a thrust of")])
def test_infeasible_step_is_told_with_point_and_constraint(y: float, word: str) -> None:
    inputs = SIDE.moved("landing", (0.0, y, 0.0))
    plan = planning.plan_with("gas", replace(inputs, points=10), never)
    assert plan is not None
    verdict = planning.explain(plan, inputs, never)
    assert verdict is not None
    assert verdict.kind == "infeasible"
    assert verdict.sentence.startswith("No posture makes swing point 9 (of 0 to 9): ")
    assert word in verdict.sentence


def test_infeasible_step_is_told_even_while_it_is_dragged_on() -> None:
    inputs = replace(SIDE.moved("landing", (0.0, 2.0, 0.0)), points=10)
    plan = planning.plan_with("gas", inputs, never)
    assert plan is not None
    verdict = planning.explain(plan, inputs, lambda: True)
    assert verdict is not None
    assert verdict.kind == "infeasible"


def test_planner_that_misses_a_posture_is_told_apart_from_an_infeasible_step() -> None:
    """GAEx cannot follow a swing foot that moves 22 mm a point, though postures exist at each."""
    inputs = replace(Inputs.of_motion("forward"), points=30)
    plan = planning.plan_with("gaex", inputs, never)
    assert plan is not None
    assert plan.violated_points
    few = replace(
        plan, violations=tuple(v if k == plan.violated_points[-1] else () for k, v in enumerate(plan.violations))
    )
    verdict = planning.explain(few, inputs, never)
    assert verdict is not None
    assert verdict.kind == "violated"
    assert "though a posture exists there" in verdict.sentence


def test_fitness_terms_sum_to_the_fitness_of_the_plan(plan: Plan) -> None:
    np.testing.assert_allclose(fitness_terms(plan, SIDE.fitness).sum(axis=1), plan.fitness, rtol=1e-12)


def test_zmp_margin_is_zero_on_the_edge_and_negative_outside(plan: Plan) -> None:
    x_min, x_max, y_min, y_max = plan.step.robot.right.sole_rectangle
    x, y, _ = plan.step.support
    points = np.array([[x + x_max, y], [x + x_min - 0.01, y], [x, y + y_min + 0.005], [x, y + y_max + 0.002]])
    np.testing.assert_allclose(zmp_margin(plan.step, points), [0.0, -0.01, 0.005, -0.002], atol=1e-12)


def test_table_has_a_row_for_each_plan(plan: Plan) -> None:
    table = comparison_table([plan, replace(plan, planner="ga")])
    assert table.count("<tr") == 3
    assert f"{plan.thrust.max():.2f}" in table


def test_motion_meets_the_plan_at_its_swing_points_and_lies_between_them_elsewhere(plan: Plan) -> None:
    motion = Motion.of_plan(plan)
    pose = motion.at(float(plan.time[7]))
    np.testing.assert_allclose(pose.pelvis, plan.pelvis[7], atol=1e-12)
    np.testing.assert_allclose(pose.joint_positions, plan.joint_positions[7], atol=1e-12)
    between = motion.at(float(plan.time[7:9].mean()))
    np.testing.assert_allclose(between.pelvis, plan.pelvis[7:9].mean(axis=0), atol=1e-12)
    assert np.linalg.norm(between.orientation) == pytest.approx(1.0)
    np.testing.assert_array_equal(motion.at(1e3).pelvis, plan.pelvis[-1])
    np.testing.assert_array_equal(motion.at(-1.0).pelvis, plan.pelvis[0])


def test_simulated_motion_is_on_the_clock_of_its_plan() -> None:
    """Lift-off at zero, landing at the plan's duration, and the robot where the kinematics has it all the while."""
    pytest.importorskip("pybullet")
    plan = planning.plan_with("gas", replace(SIDE, points=10, duration=2.5), never)
    assert plan is not None
    done = threading.Event()
    results: list[Any] = []
    shares: list[float] = []
    physics = Physics(shares.append, lambda _plan, result: (results.append(result), done.set()))
    physics.send(plan)
    assert done.wait(120.0)
    (simulated,) = results
    assert simulated.success, simulated.outcome
    assert shares == sorted(shares)
    motion = simulated.motion
    assert motion.start < 0.0 < plan.step.duration < motion.end
    lifted = motion.poses.swing_sole[:, 2] > 0.01
    assert -0.2 < motion.time[lifted][0] < 0.5 * plan.step.duration
    landed = motion.at(plan.step.duration)
    np.testing.assert_allclose(landed.swing_sole, plan.step.landing, atol=5e-3)
    pose = motion.at(0.5 * plan.step.duration)
    np.testing.assert_allclose(pose.pelvis, Motion.of_plan(plan).at(0.5 * plan.step.duration).pelvis, atol=0.02)
    fan = plan.step.robot.left.fan[2] - plan.step.robot.left.sole[2]
    assert pose.fan[2] - pose.swing_sole[2] == pytest.approx(fan, abs=2e-3)


def test_dropped_simulation_is_not_reported(plan: Plan) -> None:
    pytest.importorskip("pybullet")
    results: list[Any] = []
    physics = Physics(lambda _: None, lambda _plan, result: results.append(result))
    thread = physics.send(plan)
    physics.drop()
    thread.join(60.0)
    assert not thread.is_alive()
    assert results == []


def test_plot_shows_all_of_a_measured_motion_that_lasts_longer_than_the_plan() -> None:
    gui: Any = MagicMock()
    planned = Samples(Curve("planned", "#000000"), np.array([0.0, 1.0]), np.array([1.0, 3.0]))
    measured = Samples(Curve("measured", "#111111"), np.array([-1.0, 2.0]), np.array([0.0, 5.0]))
    Plot(gui, MagicMock(), 0.0, "Thrust", "N").show([planned, measured], 0.5)
    scales = gui.add_uplot.call_args.kwargs["scales"]
    assert scales["x"]["range"] == (-1.0, 2.0)
    low, high = scales["y"]["range"]
    assert low < 0.0
    assert high > 5.0
