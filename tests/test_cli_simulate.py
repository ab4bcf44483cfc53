"""``jet-gym simulate``: what it prints and writes, its exit codes, and one sentence for bad input."""

from __future__ import annotations

import csv
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from agents.planner import make_planner
from jet_gym.cli import run
from jet_gym.cli.changes import setting_values, with_changes
from jet_gym.courses import PAPER
from jet_gym.simulation import ExecutionSettings, PidSettings, SimulationSettings

pytest.importorskip("pybullet")


@pytest.fixture(scope="module")
def side_file(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("plans") / "side.json"
    make_planner("gas").plan(replace(PAPER.side, points=30, duration=4.0)).save(path)
    return path


def test_a_plan_is_executed_and_logged(side_file, tmp_path, capsys):
    log = tmp_path / "log.csv"
    assert run(["simulate", str(side_file), "--thrust", "pid", "--log", str(log)]) == 0
    printed = capsys.readouterr().out
    assert "the robot made one step in" in printed
    for name in ("duration (s)", "worst tilt (deg)", "least ZMP margin (mm)", "hip roll", "18.95"):
        assert name in printed
    with log.open() as file:
        rows = list(csv.DictReader(file))
    assert float(rows[-1]["time_s"]) > 4.0
    assert rows[-1]["phase"] == "rest"


def test_a_robot_that_falls_is_exit_code_1_and_a_sentence(tmp_path, capsys):
    path = tmp_path / "forward.json"
    make_planner("gas").plan(replace(PAPER.forward, points=60, duration=6.0)).save(path)
    assert run(["simulate", str(path), "--set", "fan_power=0"]) == 1
    captured = capsys.readouterr()
    (sentence,) = captured.err.strip().splitlines()
    assert sentence.startswith("the robot fell at ")
    assert "the left foot tipped over its inner edge" in sentence
    assert "fell: left foot" in captured.out


def test_the_film_shows_the_whole_execution(side_file, tmp_path):
    ffmpeg = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    video = tmp_path / "side.mp4"
    assert run(["simulate", str(side_file), "--video", str(video), "--fps", "1", "--size", "160", "120"]) == 0
    decoded = subprocess.run(
        [ffmpeg, "-v", "error", "-i", str(video), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
        capture_output=True,
        check=True,
    ).stdout
    frames = np.frombuffer(decoded, dtype=np.uint8).reshape(-1, 120, 160, 3)
    assert len(frames) == pytest.approx(0.5 + 2.0 + 3.2 + 1.5 + 0.5, abs=1.0)
    assert np.abs(frames[0].astype(float) - frames[-1]).mean() > 2.0  # something moved


@pytest.mark.parametrize(
    ("command", "missing", "extra"),
    [
        (["simulate", "paper", "--video", "course.mp4"], "imageio_ffmpeg", "video"),
        (["simulate", "paper"], "pybullet", "bullet"),
        (["robustness"], "pybullet", "bullet"),
        (["compare", "--planner", "gas", "--physics", "bullet"], "pybullet", "bullet"),
    ],
)
def test_what_is_not_installed_is_told_before_the_work(command, missing, extra, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, missing, None)
    assert run(command) == 2
    printed = capsys.readouterr()
    (sentence,) = printed.err.splitlines()
    assert f"pip install 'jet-gym[{extra}]'" in sentence
    assert not printed.out
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["nowhere.json"], "cannot read the plan nowhere.json"),
        (["paper", "other.json"], "paper is a course by itself"),
        (["paper", "--set", "fan_power=2"], "fan_power must lie between 0 and 1"),
        (["paper", "--set", "course.time_scale=0"], "time_scale must be more than 0"),
        (["paper", "--set", "pid.proportionel=1"], "near it: pid.proportional"),
        (["paper", "--set", "pid.derivative"], "--set needs NAME=VALUE"),
        (["paper", "--set", "pid.derivative=much"], "pid.derivative must be a number, not 'much'"),
        (["paper", "--set", "simulation.sample_every=1.5"], "simulation.sample_every must be a whole number"),
        (["paper", "--video", "course.gif"], "must end in .mp4"),
        (["paper", "--size", "641", "480"], "width must be an even whole number"),
        (["paper", "--log", "no/such/folder/log.csv"], "its folder does not exist"),
        (["paper", "--planner", "nobody"], "nobody"),
        (["paper", "--thrust", "none"], "none"),
        ([], "PLAN"),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(arguments, sentence, capsys):
    assert run(["simulate", *arguments]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert sentence in line


def test_settings_are_listed_with_units_and_defaults(capsys):
    assert run(["simulate", "--settings"]) == 0
    printed = capsys.readouterr().out
    for line in (
        "pid.proportional",
        f"{PidSettings().proportional:g}  Moment over tilt [N m/rad]",
        "course.time_scale",
        "landing_tolerance",
    ):
        assert line in printed
    assert "thrust " not in "".join(line.split("  ")[0] for line in printed.splitlines())


def test_settings_are_changed_and_the_rest_stays():
    changed = with_changes(ExecutionSettings(), ["pid.proportional=60", "fan_power = 0.5", "simulation.rate=480"])
    assert changed == ExecutionSettings(
        pid=PidSettings(proportional=60.0), fan_power=0.5, simulation=SimulationSettings(rate=480.0)
    )
    names = dict(setting_values(ExecutionSettings()))
    assert {"course.time_scale", "imu.delay", "pid.fan_time", "simulation.position_gain", "patience"} <= set(names)
    assert "thrust" not in names


def test_a_course_that_does_not_fit_together_is_refused(side_file, capsys):
    assert run(["simulate", str(side_file), str(side_file)]) == 2
    assert "plan 2 begins with the left sole at" in capsys.readouterr().err


def test_without_a_display_the_window_is_refused(side_file, capsys, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    assert run(["simulate", str(side_file), "--gui"]) == 2
    assert "no display" in capsys.readouterr().err
