"""Trials under disturbances: the same in one process or two, on disk whole, and what they say."""

from __future__ import annotations

import dataclasses
import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.planner import make_planner
from jet_gym.cli import run
from jet_gym.courses import PAPER
from jet_gym.figures.robustness import plot_robustness
from jet_gym.simulation import CourseSettings, Disturbance, DisturbanceRanges, ExecutionSettings, SimulationSettings
from jet_gym.simulation.limits import (
    FACTORS,
    End,
    Limit,
    _find_limit,
    ends_by_limit,
    find_limits,
    in_order_of_breaking,
    load_limits,
    range_ends,
    save_limits,
)
from jet_gym.simulation.robustness import associations, causes, quantities, success_rate
from jet_gym.simulation.trials import Experiment, Trial, TrialsFileError, load_trials, run_trials, save_trials

pytest.importorskip("pybullet")

SHORT = CourseSettings(
    stand_time=0.1, shift_time=0.8, time_scale=0.3, ease_time=0.3, finish_time=0.5, rest_time=0.1
)


@pytest.fixture(scope="module")
def experiment() -> Experiment:
    """One short step, under disturbances so large that some trials fail."""
    plan = make_planner("gas").plan(replace(PAPER.side, points=20), seed=0)
    settings = ExecutionSettings(course=SHORT, simulation=SimulationSettings(sample_every=8))
    return Experiment((plan,), settings, DisturbanceRanges().scaled(3.0), seed=5)


@pytest.fixture(scope="module")
def trials(experiment) -> list[Trial]:
    return run_trials(experiment, 3, jobs=1)


class TestTrials:
    def test_two_processes_give_what_one_gives(self, experiment, trials):
        assert run_trials(experiment, 3, jobs=2) == trials

    def test_what_was_interrupted_is_taken_up_again(self, experiment, trials, tmp_path):
        path = tmp_path / "trials.json"

        def interrupt(done: int, _: int) -> None:
            if done == 3:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            run_trials(experiment, 3, 1, progress=interrupt, save=lambda kept: save_trials(path, experiment, kept))
        kept = load_trials(path, experiment)
        assert kept == trials[:3]
        pid_alone = dataclasses.replace(experiment, controls=("pid",))
        assert run_trials(pid_alone, 1, 1, kept) == [trial for trial in trials[:2] if trial.control == "pid"]
        ran: list[int] = []
        assert run_trials(experiment, 3, 1, kept, progress=lambda done, _: ran.append(done)) == trials
        assert ran == [4, 5, 6]

    def test_both_ways_to_control_the_thrust_meet_the_same_disturbances(self, trials):
        by_number = {}
        for trial in trials:
            by_number.setdefault(trial.number, []).append(trial.disturbance)
        assert all(one == other for one, other in by_number.values())
        assert len({disturbances[0] for disturbances in by_number.values()}) == 3

    def test_a_trial_depends_on_seed_and_number_alone(self, experiment):
        same = dataclasses.replace(experiment, controls=("pid",))
        assert same.disturbance(7) == experiment.disturbance(7)
        assert dataclasses.replace(experiment, seed=6).disturbance(7) != experiment.disturbance(7)

    def test_files_of_other_experiments_are_refused(self, experiment, trials, tmp_path):
        path = tmp_path / "trials.json"
        save_trials(path, experiment, trials)
        with pytest.raises(TrialsFileError, match="another experiment: seed differ"):
            load_trials(path, dataclasses.replace(experiment, seed=6))
        with pytest.raises(TrialsFileError, match="ranges"):
            load_trials(path, dataclasses.replace(experiment, ranges=DisturbanceRanges()))

    @pytest.mark.parametrize(
        ("content", "message"),
        [
            ("{", "not JSON"),
            ('{"format": "other"}', "field 'format'"),
            ('{"format": "jet-gym-robustness/1", "trials": [{}]}', "field 'trials' is damaged"),
            ('{"format": "jet-gym-robustness/1"}', "field 'trials'"),
        ],
    )
    def test_damaged_files_are_refused(self, content, message, tmp_path):
        path = tmp_path / "trials.json"
        path.write_text(content)
        with pytest.raises(TrialsFileError, match=message):
            load_trials(path)


def made_up(number: int, success: bool, **disturbance: Any) -> Trial:
    """A trial that nobody ran."""
    chosen = dataclasses.replace(
        Disturbance(friction=0.8, contact_stiffness=3e5, imu_delay=0.01, fan_lag=0.15), **disturbance
    )
    cause = "" if success else "left foot"
    return Trial(number, "pid", chosen, success, cause, cause, 20.0, 0.01, 0.01, 20.0)


class TestAnalysis:
    def test_intervals_are_wilsons(self):
        rate = success_rate([made_up(k, k >= 5) for k in range(100)], "pid")
        z, share, number = 1.959964, 0.95, 100
        middle = (share + z**2 / (2 * number)) / (1 + z**2 / number)
        half = z / (1 + z**2 / number) * math.sqrt(share * (1 - share) / number + z**2 / (4 * number**2))
        assert (rate.rate, rate.low, rate.high) == pytest.approx((0.95, middle - half, middle + half), abs=1e-5)

    def test_the_guilty_disturbance_is_found(self, rng):
        lags, frictions = rng.uniform(0.05, 0.3, 200), rng.uniform(0.4, 1.0, 200)
        drawn = [
            made_up(k, bool(lag < 0.2 or rng.uniform() < 0.2), fan_lag=lag, friction=friction)
            for k, (lag, friction) in enumerate(zip(lags, frictions, strict=True))
        ]
        first, *others = associations(drawn, "pid")
        assert first.quantity == "fan lag"
        assert first.probability > 0.8
        assert first.p_value < 1e-6
        assert min(other.p_value for other in others) > 1e-3
        assert causes(drawn, "pid")["left foot"] == sum(not trial.success for trial in drawn)

    def test_without_failures_nothing_is_said(self):
        assert associations([made_up(k, True) for k in range(10)], "pid") == []
        with pytest.raises(ValueError, match="no trial with feedforward"):
            success_rate([made_up(0, True)], "feedforward")

    def test_quantities_are_numbers(self):
        numbers = quantities(DisturbanceRanges().draw(np.random.default_rng(0), 20.0, 2))
        assert all(math.isfinite(value) for value in numbers.values())
        assert {"block height 1", "block height 2", "largest push", "thrust gain"} <= set(numbers)


def without_simulation(
    monkeypatch: pytest.MonkeyPatch, succeeds: Callable[[Disturbance], bool], ran: list[Disturbance]
) -> None:
    """Let trials end as a rule says, instead of simulating them."""

    def made(self: Experiment, number: int, control: Any, disturbance: Disturbance) -> Trial:
        ran.append(disturbance)
        trial = made_up(number, succeeds(disturbance))
        return dataclasses.replace(trial, control=control, disturbance=disturbance)

    monkeypatch.setattr(Experiment, "run", made)


class TestLimits:
    def test_ends_disturb_one_quantity_at_a_time(self):
        ranges = DisturbanceRanges()
        found = range_ends(ranges, 20.0, 2)
        assert len({(end.quantity, end.end) for end in found}) == len(found) == 2 * 13 + 4
        for end in found:
            changed = [
                field.name
                for field in dataclasses.fields(Disturbance)
                if getattr(end.disturbance, field.name) != field.default
            ]
            assert len(changed) == 1, (end.quantity, changed)
        gains = [end.disturbance.thrust_gain for end in found if end.quantity == "thrust gain"]
        assert gains == pytest.approx([0.9, 1.1])
        assert [end.value for end in found if end.quantity == "thrust gain"] == ["-10 %", "+10 %"]

    def test_the_first_factor_that_is_too_much_is_found(self, experiment, monkeypatch):
        plain = dataclasses.replace(experiment, ranges=DisturbanceRanges(), controls=("pid",))
        for least_gain in (0.91, 0.9, 0.8, 0.72, 0.7, 0.55, 0.5, 0.4):
            ran: list[Disturbance] = []
            without_simulation(monkeypatch, lambda drawn, least=least_gain: drawn.thrust_gain > least + 1e-9, ran)
            limits = {(limit.quantity, limit.end): limit for limit in find_limits(plain, jobs=1)}
            expected = next((f for f in FACTORS if 1.0 - 0.1 * f <= least_gain + 1e-9), None)
            assert limits["thrust gain", "low"].factor == expected
            assert sum(drawn.thrust_gain < 1.0 for drawn in ran) <= 5
            reached = 5.0 if expected is None else expected
            assert limits["thrust gain", "low"].value == f"{-10.0 * reached:+.3g} %"
            others = [limit for key, limit in limits.items() if key != ("thrust gain", "low")]
            assert {limit.factor for limit in others} == {None}
            broken = in_order_of_breaking(list(limits.values()), "pid")
            assert [limit.factor for limit in broken] == [expected] * (expected is not None)

    def test_the_first_to_break_comes_first(self, experiment, monkeypatch):
        plain = dataclasses.replace(experiment, ranges=DisturbanceRanges())
        without_simulation(
            monkeypatch, lambda d: (d.friction or 1.0) > 0.2 and (d.fan_lag or 0.0) < 0.7 and not d.pushes, []
        )
        limits = find_limits(plain, jobs=1)
        first = in_order_of_breaking(limits, "feedforward")
        assert [(limit.quantity, limit.factor) for limit in first] == [
            *[("push", 1.0)] * 4, ("friction", 2.0), ("fan lag", 4.0),
        ]  # fmt: skip
        assert [quantity for quantity, _ in ends_by_limit(limits)][:6] == [*["push"] * 4, "friction", "fan lag"]

    def test_what_was_interrupted_is_taken_up_again(self, experiment, monkeypatch, tmp_path):
        path, ran = tmp_path / "limits.json", []
        without_simulation(monkeypatch, lambda drawn: drawn.thrust_gain > 0.75, ran)
        plain = dataclasses.replace(experiment, ranges=DisturbanceRanges())

        def interrupt(done: int, _: int) -> None:
            if done == 7:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            find_limits(plain, 1, progress=interrupt, save=lambda kept: save_limits(path, plain, kept))
        kept = load_limits(path, plain)
        assert len(kept) == 7
        ran.clear()
        resumed = find_limits(plain, 1, kept)
        assert resumed == find_limits(plain, 1)
        with pytest.raises(TrialsFileError, match="limits of another experiment: ranges differ"):
            load_limits(path, experiment)

    def test_a_real_limit(self, experiment):
        """Without nearly all of its friction the robot cannot stand."""
        frictions = {f: End("friction", "low", f"{0.4 / f:g}", Disturbance(friction=1e-3)) for f in FACTORS}
        limit = _find_limit(experiment, frictions, "pid")
        assert limit.factor == 1.0
        assert limit.cause


@pytest.fixture
def plan_file(experiment, tmp_path) -> str:
    step = replace(PAPER.side, points=20, duration=2.0)
    make_planner("gas").plan(step, seed=0).save(tmp_path / "plan.json")
    return str(tmp_path / "plan.json")


class TestPicture:
    def test_marks_say_what_breaks_the_course_and_what_does_not(self, rng):
        lags, frictions = rng.uniform(0.05, 0.3, 80), rng.uniform(0.4, 1.0, 80)
        trials = [
            made_up(k, bool(lag < 0.2), fan_lag=lag, friction=friction)
            for k, (lag, friction) in enumerate(zip(lags, frictions, strict=True))
        ]
        limits = [
            Limit("fan lag", "high", "pid", 1.5, "0.45 s", "left foot", "it fell"),
            Limit("friction", "low", "pid", None, "0.08", "", ""),
        ]
        rates, telling, ends = plot_robustness(trials, ("pid",), limits).axes
        (bar,) = rates.patches
        assert bar.get_height() == pytest.approx(100.0 * (lags < 0.2).mean())
        filled = [
            mark for mark in telling.lines if mark.get_marker() == "o" and mark.get_markerfacecolor() != "white"
        ]
        assert [mark.get_xdata()[0] for mark in filled] == [100.0]
        names = [label.get_text() for label in telling.get_yticklabels()]
        assert names[round(float(filled[0].get_ydata()[0]))] == "fan lag"
        rows = [label.get_text() for label in ends.get_yticklabels()]
        marks = {
            rows[round(float(mark.get_ydata()[0]))]: (mark.get_marker(), mark.get_xdata()[0])
            for mark in ends.lines
            if mark.get_marker() in ("x", ">")
        }
        assert marks == {"fan lag, high": ("x", 1.5), "friction, low": (">", FACTORS[-1])}

    def test_without_failures_and_limits_the_rate_stands_alone(self):
        (rates,) = plot_robustness([made_up(k, True) for k in range(5)], ("pid",)).axes
        assert rates.patches[0].get_height() == 100.0


class TestCommand:
    def test_it_reports_and_resumes(self, plan_file, tmp_path, capsys):
        folder = tmp_path / "result"
        folder.mkdir()
        arguments = ["robustness", plan_file, "--jobs", "1", "--no-limits", "--output", str(folder)]
        assert run([*arguments, "--trials", "1"]) == 0
        assert run([*arguments, "--trials", "2", "--resume", "--plot", str(tmp_path / "plot.svg")]) == 0
        printed = capsys.readouterr().out
        assert "2 trials, seed 0" in printed
        assert "feed-forward and PID" in printed
        data = json.loads((folder / "robustness.json").read_text())
        assert [trial["number"] for trial in data["trials"]] == [0, 0, 1, 1]
        assert (tmp_path / "plot.svg").stat().st_size > 5000

    def test_it_tells_what_breaks_the_course(self, plan_file, tmp_path, capsys, monkeypatch):
        """Slow fans, and feed-forward alone."""
        ran: list[Disturbance] = []

        def made(self: Experiment, number: int, control: Any, disturbance: Disturbance | None = None) -> Trial:
            ran.append(disturbance or self.disturbance(number))
            trial = made_up(number, control == "pid" or (ran[-1].fan_lag or 0.0) < 0.25)
            return dataclasses.replace(trial, control=control, disturbance=ran[-1])

        monkeypatch.setattr(Experiment, "run", made)
        path, plot = tmp_path / "result.json", tmp_path / "plot.png"
        arguments = ["robustness", plan_file, "--jobs", "1", "--trials", "40", "--output", str(path)]
        assert run([*arguments, "--plot", str(plot)]) == 0
        printed = " ".join(capsys.readouterr().out.split())
        assert "feed-forward: what failures have to do with" in printed
        assert "feed-forward and PID: what failures have to do with" not in printed
        ends = load_limits(tmp_path / "result-limits.json")
        broken = [limit for limit in ends if limit.factor is not None]
        assert {(limit.quantity, limit.end, limit.control) for limit in broken} == {
            ("fan lag", "high", "feedforward")
        }
        assert f"feed-forward: breaks first at 1 times the range: fan lag of {broken[0].value}" in printed
        assert "feed-forward and PID: nothing breaks it at 5 times its range" in printed
        assert plot.stat().st_size > 20_000
        ran.clear()
        assert run([*arguments, "--resume"]) == 0
        assert ran == []
        assert " ".join(capsys.readouterr().out.split()).startswith(printed[: printed.index("wrote")].strip())

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            (["--trials", "0"], "--trials"),
            (["--jobs", "0"], "--jobs must be"),
            (["--jobs", "-5"], "--jobs must be"),
            (["--scale", "9"], "thrust_gain must lie between"),
            (["--output", "no/such/file.json"], "its folder does not exist"),
            (["--plot", "plot.gif"], "plot.gif"),
            (["nowhere.json"], "cannot read the plan"),
        ],
    )
    def test_bad_input_is_one_sentence_and_exit_code_2(self, arguments, message, capsys, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        assert run(["robustness", *arguments]) == 2
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert message in line

    def test_ctrl_c_leaves_a_whole_file_and_one_sentence(self, plan_file, tmp_path):
        path = Path(tmp_path) / "trials.json"
        arguments = [plan_file, "--jobs", "2", "--trials", "500", "--no-limits", "--output", str(path)]
        process = subprocess.Popen(
            [sys.executable, "-m", "jet_gym.cli", "robustness", *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        deadline = time.monotonic() + 300.0
        while not path.exists() and time.monotonic() < deadline and process.poll() is None:
            time.sleep(0.2)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: the workers get it too
        printed, errors = process.communicate(timeout=300.0)
        assert process.returncode == 130, errors
        assert errors.strip().splitlines()[-1] == "jet-gym: interrupted; what was written is whole"
        assert "Traceback" not in errors
        assert "trials, seed 0" in printed  # what there is so far
        kept = load_trials(path)
        assert 0 < len(kept) < 1000
