"""Random steps: as documented, feasible, and bounded by the difficulty."""

from __future__ import annotations

import numpy as np
import pytest

from agents import make_planner
from jet_gym import Step, jet_hr1
from jet_gym.balance import BalanceSettings
from jet_gym.feasibility import diagnose
from jet_gym.task.drawing import StepDrawer
from jet_gym.task.lanes import Lanes


def _draw(count: int, difficulty: float = 1.0, seed: int = 0) -> list[Step]:
    robot = jet_hr1()
    lanes = Lanes(count)
    drawer = StepDrawer(robot, BalanceSettings(), difficulty)
    drawer.draw(lanes, np.arange(count), [np.random.default_rng([seed, lane]) for lane in range(count)])
    return [lanes.step_of(lane, robot) for lane in range(count)]


def _seen_from_support(steps: list[Step]) -> np.ndarray:
    """Landings relative to the support sole, mirrored to a left swing."""
    landings = np.array([step.landing for step in steps]) - np.array([step.support for step in steps])
    landings[:, 1] *= [1.0 if step.swing == "left" else -1.0 for step in steps]
    return landings


def test_both_legs_all_directions_and_unequal_heights_are_drawn() -> None:
    steps = _draw(400)
    assert 0.4 < np.mean([step.swing == "left" for step in steps]) < 0.6
    landings = _seen_from_support(steps)
    angle = np.degrees(np.arctan2(landings[:, 0], landings[:, 1]))
    assert angle.min() < -60.0
    assert angle.max() > 85.0
    assert ((angle > -20.0) & (angle < 20.0)).mean() > 0.1
    assert np.hypot(landings[:, 0], landings[:, 1]).max() > 0.68
    assert landings[:, 2].min() < -0.05
    assert landings[:, 2].max() > 0.05
    points = [step.points for step in steps]
    assert (min(points), max(points)) == (30, 60)


def test_drawn_steps_are_feasible_at_their_ends_and_half_way() -> None:
    for step in _draw(12):
        assert diagnose(step, points=[0, (step.points - 1) // 2, step.points - 1]) == []


def test_gas_plans_nearly_all_of_them_without_violation() -> None:
    clean = [not make_planner("gas").plan(step).violated_points for step in _draw(100, seed=1)]
    assert np.mean(clean) >= 0.95


def test_a_drawn_step_makes_sense_as_a_step() -> None:
    """`Step` refuses overlapping feet by its own check, so making one is the test."""
    assert len(_draw(300, seed=2)) == 300


def test_difficulty_bounds_how_far_a_step_goes() -> None:
    easy, hard = _seen_from_support(_draw(200, 0.3)), _seen_from_support(_draw(200, 1.0))
    assert np.hypot(easy[:, 0], easy[:, 1]).max() <= 0.225 + 0.3 * 0.575 + 1e-9
    assert np.hypot(hard[:, 0], hard[:, 1]).max() > 0.6
    assert np.abs(easy[:, 2]).max() <= 0.3 * 0.06 + 1e-9


def test_a_lane_draws_from_its_own_generator_alone() -> None:
    robot = jet_hr1()
    drawer = StepDrawer(robot, BalanceSettings(), 1.0)
    together, alone = Lanes(20), Lanes(1)
    drawer.draw(together, np.arange(20), [np.random.default_rng(lane) for lane in range(20)])
    for lane in range(20):
        drawer.draw(alone, np.zeros(1, dtype=np.int64), [np.random.default_rng(lane)])
        assert alone.step_of(0, robot) == together.step_of(lane, robot)


@pytest.mark.parametrize("model", ["assigned", "least"])
def test_the_cheap_check_rarely_misses_a_feasible_landing(model: str) -> None:
    """Where the exhaustive check finds a posture at the landing, the cheap one should nearly always too."""
    from jet_gym.single_support import single_support, stance_between
    from jet_gym.task.drawing import _posture_exists

    settings, generator = BalanceSettings(thrust_model=model), np.random.default_rng(0)  # type: ignore[arg-type]
    robot = single_support(jet_hr1(), "left", settings)
    agree, feasible = 0, 0
    for _ in range(40):
        angle, distance = generator.uniform(-1.6, 1.6), generator.uniform(0.3, 0.8)
        landing = (distance * np.sin(angle), -0.1125 + distance * np.cos(angle), generator.uniform(-0.06, 0.06))
        try:
            step = Step("left", (0.0, 0.12, 0.0), landing, (0.0, -0.1125, 0.0), points=2)
        except ValueError:
            continue
        exhaustive = diagnose(step, settings, points=[1]) == []
        cheap = _posture_exists(robot, stance_between(robot, step.landing, step.support))
        assert exhaustive or not cheap
        feasible += exhaustive
        agree += exhaustive and cheap
    assert feasible >= 15
    assert agree >= 0.9 * feasible
