"""Refinement of a path by dynamic programming over candidates."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from candidates import candidates_around

from agents import make_planner
from agents.paths.cost import cost_of_path, search_of_step
from agents.paths.refinement import RefinementSettings, refine_path
from jet_gym.balance import BalanceSettings
from jet_gym.errors import SettingsError
from jet_gym.fitness import FitnessSettings
from jet_gym.step import Step

STEP = Step(swing="left", start=(0, 0.1125, 0), landing=(0.2, 0.3, 0.02), support=(0, -0.1125, 0), points=12)


def test_it_is_the_best_of_all_paths_through_the_candidates() -> None:
    short = Step("left", STEP.start, STEP.landing, STEP.support, points=4)
    model, points = search_of_step(short, BalanceSettings(), FitnessSettings())
    path = make_planner("gas").plan(short).pelvis
    clouds = RefinementSettings(candidates=5, sweeps=1, widest=2e-3).clouds
    candidates = candidates_around(model, points, clouds[0], path)
    best = min(
        cost_of_path(model, points, candidates[np.arange(4), :, list(chosen)])
        for chosen in itertools.product(range(5), repeat=4)
    )
    refined = path.copy()
    assert refine_path(model, points, clouds, refined) == pytest.approx(best, rel=1e-12)
    assert cost_of_path(model, points, refined) == pytest.approx(best, rel=1e-12)


def test_it_never_makes_a_path_worse_and_more_sweeps_make_it_better() -> None:
    model, points = search_of_step(STEP, BalanceSettings(), FitnessSettings())
    path = make_planner("gas").plan(STEP).pelvis
    costs = [cost_of_path(model, points, path)]
    for sweeps in (1, 4, 16):
        refined = path.copy()
        costs.append(refine_path(model, points, RefinementSettings(sweeps=sweeps).clouds, refined))
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] < 0.9 * costs[0]


def test_it_mends_a_path_that_violates_a_constraint() -> None:
    plan = make_planner("gas").plan(STEP)
    path = plan.pelvis.copy()
    path[5:8, 0] += 4e-3  # the centre of mass leaves the edge polygon
    model, points = search_of_step(STEP, BalanceSettings(), FitnessSettings())
    assert cost_of_path(model, points, path) > 9000.0
    refine_path(model, points, RefinementSettings(widest=4e-3).clouds, path)
    assert cost_of_path(model, points, path) < 5000.0


def test_heights_are_smoothed_where_displacements_come_to_nothing() -> None:
    model, points = search_of_step(STEP, BalanceSettings(), FitnessSettings())
    path = make_planner("gas").plan(STEP).pelvis.copy()
    path[:, 2] += np.tile([0.0, -2e-3], 6) - 5e-3
    kinks, cost = np.abs(np.diff(path[:, 2], 2)).sum(), cost_of_path(model, points, path)
    clouds = RefinementSettings(sweeps=6, widest=1e-7, narrowest=1e-7).clouds
    assert refine_path(model, points, clouds, path) < cost - 50.0
    assert np.abs(np.diff(path[:, 2], 2)).sum() < 0.3 * kinks


@pytest.mark.parametrize(
    "wrong", [{"candidates": 1}, {"sweeps": 0}, {"widest": 0.0}, {"narrowest": float("nan")}, {"candidates": 2.5}]
)
def test_settings_that_make_no_sense_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(SettingsError):
        RefinementSettings(**wrong)  # type: ignore[arg-type]


def test_search_ranges_are_kept() -> None:
    model, points = search_of_step(STEP, BalanceSettings(), FitnessSettings())
    path = make_planner("gas").plan(STEP).pelvis.copy()
    refine_path(model, points, RefinementSettings(candidates=60, sweeps=3, widest=0.03).clouds, path)
    assert np.abs(np.diff(path, axis=0)).max() <= 0.025
    assert np.abs(path[0] - STEP.nominal_pelvis).max() <= 0.150
