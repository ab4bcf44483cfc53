import dataclasses
import json
import math
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.planner import make_planner
from jet_gym.cli import run
from jet_gym.courses import PAPER
from jet_gym.simulation import CourseSettings, Disturbance, DisturbanceRanges, ExecutionSettings, SimulationSettings
from jet_gym.simulation.robustness import associations, causes, extremes, quantities, success_rate
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

    def test_extremes_disturb_one_quantity_at_a_time(self):
        ranges = DisturbanceRanges()
        found = extremes(ranges, 20.0, 2)
        assert len({(name, value) for name, value, _ in found}) == len(found) == 2 * 13 + 4
        for name, _, disturbance in found:
            changed = [
                field.name
                for field in dataclasses.fields(Disturbance)
                if getattr(disturbance, field.name) != field.default
            ]
            assert len(changed) == 1, (name, changed)
        gains = [disturbance.thrust_gain for name, _, disturbance in found if name == "thrust gain"]
        assert gains == pytest.approx([0.9, 1.1])

    def test_quantities_are_numbers(self):
        numbers = quantities(DisturbanceRanges().draw(np.random.default_rng(0), 20.0, 2))
        assert all(math.isfinite(value) for value in numbers.values())
        assert {"block height 1", "block height 2", "largest push", "thrust gain"} <= set(numbers)


@pytest.fixture
def plan_file(experiment, tmp_path) -> str:
    step = replace(PAPER.side, points=20, duration=2.0)
    make_planner("gas").plan(step, seed=0).save(tmp_path / "plan.json")
    return str(tmp_path / "plan.json")


class TestCommand:
    def test_it_reports_and_resumes(self, plan_file, tmp_path, capsys):
        folder = tmp_path / "result"
        folder.mkdir()
        arguments = ["robustness", plan_file, "--jobs", "1", "--no-extremes", "--output", str(folder)]
        assert run([*arguments, "--trials", "1"]) == 0
        assert run([*arguments, "--trials", "2", "--resume", "--plot", str(tmp_path / "plot.svg")]) == 0
        printed = capsys.readouterr().out
        assert "2 trials, seed 0" in printed
        assert "feed-forward and PID" in printed
        data = json.loads((folder / "robustness.json").read_text())
        assert [trial["number"] for trial in data["trials"]] == [0, 0, 1, 1]
        assert (tmp_path / "plot.svg").stat().st_size > 5000

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            (["--trials", "0"], "--trials"),
            (["--jobs", "0"], "--jobs must be"),
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
        arguments = [plan_file, "--jobs", "2", "--trials", "500", "--no-extremes", "--output", str(path)]
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
        _, errors = process.communicate(timeout=300.0)
        assert process.returncode == 130, errors
        assert errors.strip().splitlines()[-1] == "jet-gym: interrupted; what was written is whole"
        assert "Traceback" not in errors
        kept = load_trials(path)
        assert 0 < len(kept) < 1000
