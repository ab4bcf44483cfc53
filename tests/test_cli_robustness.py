"""The command ``jet-gym robustness``: what it prints, resumes, refuses and leaves behind."""

from __future__ import annotations

import dataclasses
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from made_up_trials import made_up

from agents.planner import make_planner
from jet_gym.cli import run
from jet_gym.courses import PAPER
from jet_gym.simulation import Disturbance
from jet_gym.simulation.limits import (
    load_limits,
)
from jet_gym.simulation.trials import Experiment, Trial, load_trials

pytest.importorskip("pybullet")


@pytest.fixture
def plan_file(experiment, tmp_path) -> str:
    step = replace(PAPER.side, points=20, duration=2.0)
    make_planner("gas").plan(step, seed=0).save(tmp_path / "plan.json")
    return str(tmp_path / "plan.json")


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
