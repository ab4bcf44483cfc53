"""The optimal reference: what brute force finds, and never worse than any other planner's plan."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from agents import Plan, make_planner
from agents.optimal import OptimalPlanner, OptimalSettings, _Search
from agents.paths.cost import FAR
from agents.paths.lattice import accumulate, make_lattices, trace_back
from jet_gym import Step
from jet_gym.balance import BalanceSettings
from jet_gym.courses import PAPER
from jet_gym.errors import SettingsError
from jet_gym.fitness import FitnessSettings
from jet_gym.posture import evaluate_postures
from jet_gym.task.drawing import draw_random_steps

SHORT = replace(PAPER.side, points=8)


def _total(step: Step, path: np.ndarray, **settings: Any) -> float:
    """Total fitness, a ZMP outside of the foot penalised; out of range is no path."""
    if np.abs(np.diff(path, axis=0)).max() > 0.025 or np.abs(path[0] - step.nominal_pelvis).max() > 0.150:
        return FAR
    plan = Plan.from_pelvis_path(step, path, planner="test", **settings)
    return plan.total_fitness + 9000.0 * sum("zmp" in names for names in plan.violations)


@pytest.mark.parametrize("seed", range(6))
def test_dynamic_programming_finds_what_brute_force_finds(seed: int) -> None:
    """Three swing points with eight positions each: all 512 paths, one by one."""
    generator, step = np.random.default_rng(seed), replace(PAPER.side, points=3)
    middle = make_planner("gas").plan(step).pelvis
    lines = [tuple(np.sort(p[axis] + generator.uniform(-0.02, 0.02, 2)) for axis in range(3)) for p in middle]
    paths = [np.array(path) for path in itertools.product(*(list(itertools.product(*triple)) for triple in lines))]
    totals = [_total(step, path) for path in paths]
    search = _Search(OptimalPlanner(), step)
    lattices = make_lattices(lines)
    values, path = np.empty(lattices.offsets[-1]), np.empty((3, 3))
    accumulate(search.model, search.points, lattices, 0.0, 0, 3, values)
    total = trace_back(search.model, lattices, values, path)
    if min(totals) < FAR:
        assert total == pytest.approx(min(totals), rel=1e-12)
        assert np.array_equal(path, paths[int(np.argmin(totals))])
    else:
        assert total >= FAR


def test_two_swing_points_are_no_worse_than_three_million_paths() -> None:
    step = replace(PAPER.side, points=2, landing=(0.0, 0.14, 0.0))
    first = step.nominal_pelvis + np.stack(
        np.meshgrid(*3 * (np.linspace(-0.15, 0.15, 25),), indexing="ij"), axis=-1
    ).reshape(-1, 3)
    offsets = np.stack(np.meshgrid(*3 * (np.linspace(-0.024, 0.024, 5),), indexing="ij"), axis=-1).reshape(-1, 3)
    least = FAR
    costs = _costs(step, 0, first)
    for chosen in np.argsort(costs)[:4000]:
        moved = costs[chosen] + _costs(step, 1, first[chosen] + offsets) + 50e4 * (offsets**2).sum(axis=1)
        least = min(least, float(moved.min()))
    plan = make_planner("optimal").plan(step)
    assert plan.violated_points == ()
    assert plan.total_fitness <= least


def _costs(step: Step, point: int, pelvis: np.ndarray) -> np.ndarray:
    postures = evaluate_postures(step.robot, step.swing, step.swing_sole[point], step.support, pelvis)
    return np.where(postures.violations == 0, 10.0 * postures.thrust, FAR)


@pytest.mark.parametrize("model", ["assigned", "least"])
def test_it_is_never_worse_than_restarts_of_gas_and_ga(model: str) -> None:
    balance = BalanceSettings(thrust_model=model)  # type: ignore[arg-type]
    optimal = make_planner("optimal", balance=balance)
    for step in draw_random_steps(5, seed=7):
        total = _total(step, optimal.plan(step).pelvis, balance=balance)
        others = [
            _total(step, make_planner(name, balance=balance).plan(step, seed=seed).pelvis, balance=balance)
            for name in ("gas", "ga")
            for seed in range(1, 11)
        ]
        assert total <= min(others)


def test_different_beginnings_lead_to_one_optimum() -> None:
    """From the coarse lattice, from GAS and from GA: within a thousandth of each other."""
    for step in draw_random_steps(4, seed=11):
        search = _Search(OptimalPlanner(), step)
        coarse = search.coarse_path(None)
        assert coarse is not None
        totals = [
            search.refine(path)[1]
            for path in (coarse, make_planner("gas").plan(step).pelvis, make_planner("ga").plan(step, 5).pelvis)
        ]
        assert max(totals) - min(totals) <= 1e-3 * min(totals) + 0.1


@pytest.mark.parametrize("model", ["assigned", "least"])
def test_no_small_change_of_the_path_makes_it_better(model: str) -> None:
    balance = BalanceSettings(thrust_model=model)  # type: ignore[arg-type]
    plan = make_planner("optimal", balance=balance).plan(SHORT)
    generator = np.random.default_rng(0)
    bumps = np.array([np.exp(-0.5 * ((np.arange(8) - centre) / 1.5) ** 2) for centre in range(8)])
    for size in (1e-5, 1e-4, 1e-3, 5e-3):
        for _ in range(100):
            bump = bumps[generator.integers(8)][:, None] * generator.normal(0.0, size, 3)
            assert _total(SHORT, plan.pelvis + bump, balance=balance) >= plan.total_fitness - 0.1


def test_the_seed_changes_nothing() -> None:
    first, second = (make_planner("optimal").plan(SHORT, seed=seed).pelvis for seed in (0, 1))
    assert first.tobytes() == second.tobytes()


def test_many_steps_in_threads_are_planned_as_one_by_one() -> None:
    planner, seen = OptimalPlanner(), []
    steps = [replace(SHORT, apex=apex) for apex in (0.06, 0.08, 0.1)]
    plans = planner.plan_many(steps, threads=2, progress=lambda done, total: seen.append((done, total)))
    assert [plan.pelvis.tobytes() for plan in plans] == [planner.plan(step).pelvis.tobytes() for step in steps]
    assert seen == [(1, 3), (2, 3), (3, 3)]
    assert planner.plan_many([]) == []


@pytest.mark.parametrize("threads", [0, -1, 1.5, True])
def test_a_number_of_threads_that_is_none_is_refused(threads: Any) -> None:
    with pytest.raises(SettingsError, match="threads must be a whole number of 1 or more"):
        OptimalPlanner().plan_many([SHORT], threads=threads)


def test_a_seed_is_not_taken_for_a_number_of_threads() -> None:
    """It is what other planners' ``plan_many`` takes in the second place."""
    with pytest.raises(TypeError):
        OptimalPlanner().plan_many([SHORT], 3)  # type: ignore[misc]


def test_a_step_out_of_reach_is_planned_all_the_same_and_says_so() -> None:
    step = Step("left", (0.0, 0.1125, 0.0), (0.0, 1.1, 0.0), (0.0, -0.1125, 0.0), points=30)
    plan, gas = make_planner("optimal").plan(step), make_planner("gas").plan(step)
    assert plan.violated_points
    assert "reach" in plan.violations[-1]
    assert _total(step, plan.pelvis) < _total(step, gas.pelvis)


def test_without_smoothness_only_the_thrust_counts() -> None:
    fitness = FitnessSettings(smoothness_weight=0.0)
    plan = make_planner("optimal", fitness=fitness).plan(SHORT)
    assert plan.violated_points == ()
    assert plan.total_fitness <= make_planner("ga").plan(SHORT).thrust.sum() * 10.0


@pytest.mark.parametrize("wrong", [{"spacing": 0.0}, {"tolerance": float("nan")}, {"tube": 0}, {"rounds": 1.5}])
def test_settings_out_of_range_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(SettingsError, match=next(iter(wrong))):
        OptimalSettings(**wrong)
    with pytest.raises(SettingsError, match="search_range"):
        OptimalPlanner(search_range=0.0)


def test_a_seed_that_is_none_is_refused() -> None:
    with pytest.raises(ValueError, match="seed must be"):
        make_planner("optimal").plan(SHORT, seed=-1)


def test_a_feasible_set_too_thin_for_the_lattice_is_found_all_the_same() -> None:
    """A far landing backward, of which the lattice alone finds no path that keeps the thrust's limit to the end."""
    step = Step("right", (0.0342, -0.2168, 0.0257), (-0.5678, -0.3903, 0.0229), (0, 0.1125, 0), 0.11, 33)
    plan = make_planner("optimal").plan(step)
    assert plan.violated_points == ()
    assert plan.total_fitness <= min(make_planner("ga").plan(step, seed).total_fitness for seed in range(10))


def test_a_way_along_the_wedge_that_lattices_miss_is_found_all_the_same() -> None:
    """From the plans of GAS and the coarse lattice alone, the search ends 16 above the refined policy."""
    step = draw_random_steps(182, seed=21)[181]
    assert OptimalPlanner().plan(step).total_fitness < make_planner("policy", refine=16).plan(step).total_fitness
