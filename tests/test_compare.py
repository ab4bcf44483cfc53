"""Planners side by side: statistics, the JSON, the pictures, and steps that depend on the seed alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.compare import FIGURES, CompareSettings, Comparison, compare
from jet_gym.cli import run
from jet_gym.errors import SettingsError
from jet_gym.plan import Plan
from jet_gym.task.drawing import draw_random_steps
from jet_gym.utils.statistics import STATISTICS, bootstrap_steps, improvement, interquartile_mean


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    """Four steps, GAS with two seeds and the reference, in this process."""
    return compare(CompareSettings(("gas", "ga"), steps=4, seed=3, planner_seeds=2, timed_steps=2, processes=1))


def test_interquartile_mean_leaves_out_a_quarter_at_either_end() -> None:
    assert interquartile_mean(np.array([[-100.0, 1.0, 3.0, 900.0]])) == pytest.approx([2.0])


def test_bootstrap_over_steps_covers_the_mean_in_about_95_of_100_samples() -> None:
    """Seeds of one step vary less than steps do: an interval over all values as equals would be too short."""
    generator, covered = np.random.default_rng(0), 0
    for trial in range(100):
        sample = generator.normal(1.0, 2.0, (40, 1)) + generator.normal(0.0, 0.3, (40, 3))
        interval = bootstrap_steps(sample, STATISTICS["mean"], seed=trial, resamples=400)
        covered += interval.low <= 1.0 <= interval.high
    assert 86 <= covered <= 100


def test_equal_values_have_a_point_for_an_interval() -> None:
    interval = bootstrap_steps(np.full((5, 2), 3.0), STATISTICS["median"])
    assert (interval.low, interval.mean, interval.high) == (3.0, 3.0, 3.0)
    with pytest.raises(ValueError, match="shape"):
        bootstrap_steps(np.empty((0, 1)), STATISTICS["mean"])


def test_probability_of_improvement_counts_pairs_and_half_of_the_ties() -> None:
    ours, theirs = [[1.0, 3.0], [5.0, 5.0]], [[2.0], [5.0]]
    assert improvement(ours, theirs).tolist() == [[0.5], [0.5]]
    assert improvement(theirs, ours).tolist() == [[0.5], [0.5]]
    assert improvement([[1.0]], [[2.0]]).tolist() == [[1.0]]


def test_steps_depend_on_the_seed_and_their_number_alone() -> None:
    assert draw_random_steps(5, 9) == draw_random_steps(8, 9)[:5]
    assert draw_random_steps(5, 9) != draw_random_steps(5, 10)


def test_gaps_are_of_the_total_fitness_to_the_reference(comparison: Comparison) -> None:
    for name in ("gas", "ga"):
        measured = comparison.measured[name]
        optimal = np.array([[plan.total_fitness] for plan in comparison.plans["optimal"]])
        assert measured["total_fitness"].shape == (4, 2)
        assert np.allclose(measured["optimality_gap"], measured["total_fitness"] / optimal - 1.0)
        assert (measured["optimality_gap"] >= 0.0).all()
        assert measured["total_fitness"][:, 0].tolist() == [p.total_fitness for p in comparison.plans[name]]
    assert (comparison.measured["optimal"]["optimality_gap"] == 0.0).all()


def test_the_json_has_every_figure_with_its_interval(comparison: Comparison) -> None:
    data: dict[str, Any] = json.loads(json.dumps(comparison.to_dict()))
    assert (data["format"], data["seed"], data["steps"]) == ("jet-gym-compare/1", 3, 4)
    assert set(data["planners"]) == {"gas", "ga"}
    for planner in data["planners"].values():
        for figure in FIGURES:
            if figure in ("falls", "zmp_margin", "ms_per_point_in_batch"):
                assert planner[figure] is None
            else:
                found = planner[figure]
                assert found["low"] <= found["value"] <= found["high"]
                assert found["iqm"]["low"] <= found["iqm"]["value"] <= found["iqm"]["high"]
    assert data["planners"]["gas"]["win_share_against_gas"] == 0.0
    there_and_back = data["probability_of_improvement"]
    assert there_and_back["gas"]["ga"]["value"] + there_and_back["ga"]["gas"]["value"] == pytest.approx(1.0)
    assert len(data["per_step"]["steps"]) == 4
    assert np.shape(data["per_step"]["planners"]["gas"]["total_fitness"]) == (4, 2)


def test_physics_counts_falls_and_measures_the_margin() -> None:
    pytest.importorskip("pybullet")
    settings = CompareSettings(("gas",), steps=2, seed=1, physics="bullet", timed_steps=1, processes=1)
    measured = compare(settings).measured["gas"]
    assert set(np.unique(measured["falls"])) <= {0.0, 1.0}
    assert np.isfinite(measured["zmp_margin"]).all()
    assert (measured["zmp_margin"][measured["falls"] == 0.0] > 0.0).all()


def test_a_foot_off_its_place_is_no_fall(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pybullet")
    from jet_gym import simulation

    execute, executions = simulation.execute, []

    def demanding(plans: list[Plan]) -> simulation.Execution:
        executions.append(execute(plans, simulation.ExecutionSettings(landing_tolerance=1e-9)))
        return executions[-1]

    monkeypatch.setattr(simulation, "execute", demanding)
    settings = CompareSettings(("optimal",), steps=2, seed=1, physics="bullet", timed_steps=1, processes=1)
    falls = compare(settings).measured["optimal"]["falls"]
    assert len(executions) == 2
    assert all(execution.summary.verdict.endswith("foot misplaced") for execution in executions)
    assert falls.tolist() == [[0.0], [0.0]]


def test_the_command_prints_tables_and_writes_json_and_pictures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    arguments = ["compare", "--planner", "gas", "--planner", "optimal", "--steps", "3", "--processes", "1"]
    assert run([*arguments, "--json", "c.json", "--plot", "c.png"]) == 0
    output = capsys.readouterr().out
    assert "optimal" in output
    assert "(mm)" in output
    assert sorted(path.name for path in Path().iterdir()) == ["c-examples.png", "c.json", "c.png"]
    assert Path("c.png").stat().st_size > 20_000


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--planner", "annealing"], "no planner 'annealing'"),
        (["--steps", "1"], "steps"),
        (["--json", "none/c.json"], "folder does not exist"),
        (["--plot", "c.doc"], "doc"),
    ],
)
def test_bad_input_is_one_sentence(
    arguments: list[str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert run(["compare", *arguments]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_settings_out_of_range_are_refused() -> None:
    with pytest.raises(SettingsError, match="at least one planner"):
        CompareSettings(())
    with pytest.raises(SettingsError, match="physics"):
        CompareSettings(("gas",), physics="mujoco")  # type: ignore[arg-type]
