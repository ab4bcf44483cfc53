"""The command line: what it prints and writes, and one clear sentence for bad input."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from agents import Plan
from jet_gym.cli import run

OWN = ["--swing", "left", "--start", "0", "0.1125", "0", "--support", "0", "-0.1125", "0"]


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_plan_prints_a_table_and_writes_the_plan(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["plan", "side", "--points", "10", "--seed", "4"]) == 0
    output = capsys.readouterr().out
    assert "gas" in output
    assert "(mm)" in output
    plan = Plan.load("plan.json")
    assert (plan.planner, plan.seed, plan.step.points) == ("gas", 4, 10)


def test_plan_of_an_own_step_takes_negative_numbers_and_settings() -> None:
    arguments = ["plan", *OWN, "--landing", "-0.1", "0.2", "0.02", "--apex", "0.1", "--points", "8"]
    assert run([*arguments, "--thrust-model", "least", "--smoothness-weight", "1e5", "--output", "own.json"]) == 0
    step = Plan.load("own.json").step
    assert step.landing == (-0.1, 0.2, 0.02)
    assert (step.apex, step.points) == (0.1, 8)


def test_plan_of_several_planners_and_motions_names_the_files() -> None:
    arguments = ["plan", "paper", "--points", "30", "--planner", "gas", "--planner", "ga", "--output", "p.json"]
    run([*arguments, "--plot", "picture.svg"])
    assert sorted(path.name for path in Path().iterdir()) == [
        "p-forward-ga.json", "p-forward-gas.json", "p-side-ga.json", "p-side-gas.json",
        "picture-forward-locomotion.svg", "picture-forward.svg", "picture-side-locomotion.svg", "picture-side.svg",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["plan", *OWN, "--landing", "0", "2", "0"], "no posture makes swing point 29.*out of the legs' reach by"),
        (["plan", *OWN, "--landing", "0", "0.8", "0"], "no posture makes swing point .*thrust of 30 N"),
        (["plan", *OWN, "--landing", "0", "-0.1", "0"], "feet overlap"),
        (["plan", *OWN, "--landing", "nan", "0.3", "0"], "landing must be finite"),
        (["plan", *OWN, "--landing", "0", "0.1125", "0"], "same place"),
        (["plan", *OWN, "--landing", "a", "b", "c"], "not a valid float"),
        (["plan", *OWN], "--landing missing"),
        (["plan"], "name a motion"),
        (["plan", "side", "--start", "0", "0", "0"], "has its own start"),
        (["plan", "backwards"], "not one of"),
        (["plan", "side", "--planner", "annealing"], "no planner 'annealing'"),
        (["plan", "side", "--points", "1"], "points must be"),
        (["plan", "side", "--apex", "-1"], "apex must lie between"),
        (["plan", "side", "--points", "1000000000"], "points must be 100000 or fewer"),
        (["plan", "side", "--output", "a.png", "--plot", "a.png"], "same file"),
        (["plan", "side", "--seed", "-1"], "seed"),
        (["plan", "side", "--seed", "many"], "not a valid integer"),
        (["plan", "side", "--zmp-margin", "0.2"], "zmp_margin"),
        (["plan", "side", "--max-thrust", "nan"], "max_thrust"),
        (["plan", "side", "--smoothness-weight", "-1"], "smoothness_weight"),
        (["plan", "side", "--output", "none/plan.json"], "folder does not exist"),
        (["plan", "side", "--output", "."], "directory"),
        (["plan", "side", "--plot", "picture.doc"], "doc"),
        (["plan", "side", "--plot", "none/picture.png"], "folder does not exist"),
        (["sweep", "--plot", "picture.doc"], "doc"),
        (["sweep", "--seeds", "0"], "seeds"),
        (["fly"], "No such command"),
        (["compare", "--planner", "gas", "\n"], "unexpected extra argument"),
    ],
)
def test_bad_input_is_one_sentence_and_writes_nothing(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert re.search(words, captured.err), captured.err
    assert captured.err.startswith("jet-gym: ")
    assert captured.err.count("\n") == 1
    assert list(Path().iterdir()) == []


def test_a_plan_that_violates_is_written_told_and_exits_with_1(capsys: pytest.CaptureFixture[str]) -> None:
    """At 30 points GAEx's cube cannot follow the swing foot over the ditch, though postures exist."""
    assert run(["plan", "forward", "--points", "30", "--planner", "gaex"]) == 1
    assert "the plan of gaex violates" in capsys.readouterr().err
    assert Plan.load("plan.json").violated_points


def test_commands_have_help_with_units(capsys: pytest.CaptureFixture[str]) -> None:
    for command in ([], ["plan"], ["sweep"], ["claims"]):
        assert run([*command, "--help"]) == 0
    output = capsys.readouterr().out
    assert "[m]" in output
    assert "[N]" in output
    assert run([]) == 2


@pytest.mark.parametrize(
    ("command", "seeded"),
    [
        ("plan", "seed of the search"),
        ("studio", "seed of the search"),
        ("compare", "seed of the steps"),
        ("dataset", "seed of the steps and of the planners"),
        ("simulate", "seed of the planner of paper and of the imu's noise"),
        ("robustness", "seed of the disturbances and of the imu's noise"),
        ("reproduce", "first seed of plans, executions and statistics"),
        ("balance-space", "nothing is drawn at random"),
    ],
)
def test_each_command_says_what_its_seed_is_of(
    command: str, seeded: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([command, "--help"]) == 0
    told = " ".join(capsys.readouterr().out.split()).lower()
    option = told.partition("--seed integer range ")[2].partition(" [default: 0; x>=0]")[0]
    assert seeded in option


def test_studies_print_their_tables(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["sweep", "--seeds", "2", "--plot", "sweep.png"]) == 0
    assert run(["claims", "--seeds", "2"]) == 0
    output = capsys.readouterr().out
    assert "50 per cm²" in output
    assert "GAEx is the fastest" in output
    assert Path("sweep.png").stat().st_size > 10_000


def _mind_ctrl_c() -> None:
    """A process that was started in the background ignores Ctrl-C, and so would its children."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def test_ctrl_c_exits_with_130_and_one_sentence() -> None:
    code = "from jet_gym.cli import run; print('loaded', flush=True); exit(run(['sweep', '--seeds', '100000']))"
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=_mind_ctrl_c,  # noqa: PLW1509
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "loaded\n"
    time.sleep(2.0)  # into its work, which would take hours
    os.kill(process.pid, signal.SIGINT)
    _, error = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "Traceback" not in error
    assert "interrupted" in error


def test_plan_file_is_plain_json(capsys: pytest.CaptureFixture[str]) -> None:
    run(["plan", "side", "--points", "20"])
    assert capsys.readouterr().err == ""
    assert json.loads(Path("plan.json").read_text())["robot"] == "jet_hr1"


def test_ctrl_c_while_the_package_loads_is_one_sentence(tmp_path: Path) -> None:
    """With a package in the place of ours that takes its time."""
    import jet_gym_command

    (tmp_path / "jet_gym").mkdir()
    (tmp_path / "jet_gym" / "__init__.py").write_text("import time\nprint('loading', flush=True)\ntime.sleep(60)")
    (tmp_path / "jet_gym_command.py").write_text(Path(jet_gym_command.__file__).read_text(encoding="utf-8"))
    process = subprocess.Popen(
        [sys.executable, "-c", "import jet_gym_command; jet_gym_command.main()"],
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=_mind_ctrl_c,  # noqa: PLW1509
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "loading\n"
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=30)
    assert process.returncode == 130
    assert error == "jet-gym: interrupted\n"
