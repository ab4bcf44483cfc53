"""GAS, GA and GAEx: reproducible, honest about violations, and what the paper says of them."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from agents import PLANNERS, make_planner
from agents.exhaustive import GaexPlanner
from agents.genetic import GasPlanner, GeneticSettings, genetic_search
from jet_gym import Step
from jet_gym.balance import BalanceSettings
from jet_gym.courses import PAPER
from jet_gym.errors import SettingsError
from jet_gym.fitness import FitnessSettings
from jet_gym.posture import evaluate_postures

SHORT = replace(PAPER.side, points=12)


@pytest.mark.parametrize("name", PLANNERS)
def test_same_seed_gives_the_same_plan_to_the_last_bit(name: str) -> None:
    first, second = (make_planner(name).plan(SHORT, seed=3) for _ in range(2))
    assert first.pelvis.tobytes() == second.pelvis.tobytes()
    assert first.thrust.tobytes() == second.thrust.tobytes()
    assert first.fitness.tobytes() == second.fitness.tobytes()


@pytest.mark.parametrize("name", ["gas", "ga", "gaex"])
def test_another_seed_gives_another_plan(name: str) -> None:
    assert not np.array_equal(
        make_planner(name).plan(SHORT, seed=0).pelvis, make_planner(name).plan(SHORT, seed=1).pelvis
    )


@pytest.mark.parametrize("name", PLANNERS)
@pytest.mark.parametrize("motion", ["side", "forward"])
def test_paper_motions_are_planned_without_violation(name: str, motion: str) -> None:
    if name == "policy":
        name = "policy+refine"  # alone it promises less: its card says what
    plan = make_planner(name).plan(PAPER[motion], seed=0)
    assert plan.violated_points == ()
    assert plan.thrust.min() >= 0.0
    assert plan.thrust.max() <= plan.step.robot.max_thrust


@pytest.mark.parametrize("name", PLANNERS)
def test_pelvis_stays_within_the_search_range(name: str) -> None:
    planner = make_planner(name)
    plan = planner.plan(SHORT, seed=0)
    moved = np.abs(np.diff(plan.pelvis, axis=0)).max()
    assert moved <= (0.006 if name == "gaex" else 0.025) + 1e-12
    assert np.abs(plan.pelvis[0] - SHORT.nominal_pelvis).max() <= 0.150 + 1e-12


def test_table_3_makes_1200_evaluations_a_point_and_table_2_makes_10000() -> None:
    plan = make_planner("gas").plan(SHORT)
    assert plan.evaluations[0] == 10_000
    assert set(plan.evaluations[1:]) == {1_200}


def test_a_long_search_beats_999_of_1000_positions_of_a_dense_grid() -> None:
    sole = PAPER.side.swing_sole[30]
    center = make_planner("gas").plan(PAPER.side).pelvis[29]
    settings = GeneticSettings(population=400, generations=60)
    fitness = replace(FitnessSettings(), smoothness_weight=0.0)
    generator = np.random.default_rng(0)
    found = genetic_search(PAPER.side, sole, center, settings, BalanceSettings(), fitness, generator)
    line = np.linspace(-0.025, 0.025, 41)
    grid = center + np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
    postures = evaluate_postures(PAPER.side.robot, "left", sole, PAPER.side.support, grid)
    feasible = postures.thrust[postures.violations == 0]
    posture = evaluate_postures(PAPER.side.robot, "left", sole, PAPER.side.support, found)
    assert posture.violations == 0
    assert (feasible < posture.thrust).mean() < 0.001


def test_more_generations_never_lose_the_best_chromosome() -> None:
    """Elitism: with one seed, a longer search starts with the shorter one, so its result is no worse."""
    sole, fitness = SHORT.swing_sole[5], FitnessSettings()
    center = make_planner("gas").plan(SHORT).pelvis[4]
    thrusts = []
    for generations in range(1, 12):
        settings = GeneticSettings(generations=generations)
        pelvis = genetic_search(SHORT, sole, center, settings, BalanceSettings(), fitness, np.random.default_rng(7))
        posture = evaluate_postures(SHORT.robot, "left", sole, SHORT.support, pelvis)
        moved = fitness.smoothness_weight * float(((pelvis - center) ** 2).sum())
        thrusts.append(10.0 * float(posture.thrust) + moved + (1e6 if posture.violations else 0.0))
    assert all(later <= earlier + 1e-9 for earlier, later in itertools.pairwise(thrusts))
    assert thrusts[-1] < thrusts[0]


def test_random_numbers_are_uniform_and_independent() -> None:
    from scipy.stats import kstest

    from agents.genetic import _fill

    streams = np.empty((4, 200_000))
    for key, stream in enumerate(streams):
        assert _fill(2**62 + key, 7, stream) == 200_007
    assert all(kstest(stream, "uniform").pvalue > 1e-3 for stream in streams)
    assert np.abs(np.corrcoef(streams) - np.eye(4)).max() < 0.01
    assert (
        max(abs(np.corrcoef(stream[:-lag], stream[lag:])[0, 1]) for stream in streams for lag in (1, 2, 3)) < 0.01
    )
    again = np.empty(10)
    _fill(2**62, 10, again)
    assert np.array_equal(again, streams[0, 3:13])


def test_mutation_flips_one_bit_in_a_hundred() -> None:
    from agents.genetic import _mutate

    children = np.zeros(20_000, dtype=np.int64)
    _mutate(1, 0, 0.01, children)
    flips = np.array([[(child >> bit) & 1 for bit in range(30)] for child in children])
    assert abs(flips.mean() - 0.01) < 4.0 * np.sqrt(0.01 * 0.99 / flips.size)
    assert np.abs(flips.mean(axis=0) - 0.01).max() < 6.0 * np.sqrt(0.01 * 0.99 / len(children))
    assert children.max() < 2**30


def test_crossover_exchanges_tails_and_keeps_every_bit() -> None:
    from agents.genetic import _cross

    generator = np.random.default_rng(0)
    parents = generator.integers(0, 2**30, 10_000)
    children = parents.copy()
    _cross(generator.random(10_000), 0.5, children)
    assert np.array_equal(parents[::2] ^ parents[1::2], children[::2] ^ children[1::2])
    crossed = parents[::2] != children[::2]
    assert abs(crossed.mean() - 0.5) < 0.05
    tails = (parents[::2] ^ children[::2])[crossed]
    heads_kept = tails < 2**29
    assert heads_kept.all()


def test_gaex_takes_the_first_position_of_three_nested_loops() -> None:
    plan = make_planner("gaex").plan(SHORT, seed=0)
    line = 1e-3 * np.arange(-6, 7)
    for k in (1, 2, 3):
        for offset in ((x, y, z) for x in line for y in line for z in line):
            pelvis = plan.pelvis[k - 1] + offset
            posture = evaluate_postures(SHORT.robot, "left", SHORT.swing_sole[k], SHORT.support, pelvis)
            if posture.violations == 0:
                assert np.allclose(plan.pelvis[k], pelvis, atol=1e-12)
                break
        else:
            pytest.fail("no position of the cube satisfies the constraints")


def test_gaex_without_a_feasible_position_stays_near_and_says_so() -> None:
    step = Step("left", (0.0, 0.1125, 0.0), (0.0, 1.5, 0.0), (0.0, -0.1125, 0.0), points=4)
    plan = GaexPlanner().plan(step)
    assert "reach" in plan.violations[-1]
    assert np.isfinite(plan.joint_positions).all()


def test_a_planner_does_not_hide_what_it_violates() -> None:
    step = Step("left", (0.0, 0.1125, 0.0), (0.0, 0.9, 0.0), (0.0, -0.1125, 0.0), points=12)
    plan = make_planner("gas").plan(step)
    assert plan.violated_points
    assert plan.fitness[-1] >= 5000.0


def test_ga_is_judged_by_the_whole_fitness() -> None:
    plan = make_planner("ga").plan(SHORT)
    f3 = 50e4 * (np.diff(plan.pelvis, axis=0) ** 2).sum(axis=1)
    assert np.allclose(plan.fitness[1:], 10.0 * plan.thrust[1:] + f3)


def test_progress_counts_the_swing_points() -> None:
    seen: list[tuple[int, int]] = []
    make_planner("gas").plan(SHORT, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(k + 1, 12) for k in range(12)]


def test_a_plan_for_least_thrust_keeps_the_zmp_off_the_edge() -> None:
    settings = BalanceSettings(thrust_model="least")
    plan = make_planner("gas", balance=settings).plan(PAPER.side)
    assert plan.violated_points == ()
    x_min, x_max, y_min, y_max = PAPER.side.robot.right.sole_rectangle
    zmp = plan.zmp - np.array(PAPER.side.support[:2])
    assert (zmp >= np.array([x_min, y_min]) + settings.zmp_margin - 1e-9).all()
    assert (zmp <= np.array([x_max, y_max]) - settings.zmp_margin + 1e-9).all()


def test_unknown_planner_and_bad_seeds_are_refused() -> None:
    with pytest.raises(SettingsError, match="no planner 'annealing'; choose one of gas, ga, gaex"):
        make_planner("annealing")
    for seed in (-1, 1.5, True, "0"):
        with pytest.raises(ValueError, match="seed must be a whole number"):
            GasPlanner().plan(SHORT, seed=seed)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "settings",
    [
        {"population": 1},
        {"population": 150.5},
        {"population": True},
        {"generations": 0},
        {"generations": "8"},
        {"half_range": 0.0},
        {"half_range": "x"},
        {"half_range": float("inf")},
        {"crossover": 1.5},
        {"crossover": None},
        {"mutation": float("nan")},
    ],
)
def test_impossible_search_settings_are_refused_by_name(settings: dict[str, object]) -> None:
    with pytest.raises(SettingsError, match=next(iter(settings))):
        GeneticSettings(**settings)  # type: ignore[arg-type]
