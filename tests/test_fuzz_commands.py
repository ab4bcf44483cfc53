"""Arguments of every command, drawn at random: an exit code and a sentence, never a traceback or a stray file.

The work itself is cut off where it begins, so that what is tried is everything before it: arguments, settings,
files and paths. ``make fuzz`` tries many more examples than the suite does.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import patch

import click
import numpy as np
import pytest
from conftest import fuzz_settings
from hypothesis import given
from hypothesis import strategies as st
from watching import TEMPORARY, watched

from jet_gym.cli import cli, run
from jet_gym.courses import PAPER
from jet_gym.plan import Plan
from jet_gym.task.drawing import draw_random_steps

NUMBERS = [
    "0",
    "-1",
    "1",
    "2",
    "3",
    "0.02",
    "-0.0",
    "1e-9",
    "1e9",
    "1e400",
    "nan",
    "inf",
    "-inf",
    "1_0",
    "٣",
    "0x10",
]
NUMBERS += ["99999999999999999999", "", " ", "1,5", "--", "five", "1e", "0.1125", "0.34", "30"]
WORDS = [
    "left",
    "right",
    "side",
    "forward",
    "paper",
    "gas",
    "policy",
    "ga",
    "annealing",
    "policy+refine",
    "assigned",
]
WORDS += [
    "least",
    "pid",
    "feedforward",
    "quasistatic",
    "bullet",
    "",
    " ",
    "-",
    "--",
    "\x00",
    "\n",
    "ü",
    "[red]x[/red]",
]
WORDS += [
    "{}",
    "%s",
    "$(id)",
    "a" * 5000,
    "=",
    "pid.proportional=60",
    "fan_power=0",
    "fan_power=nan",
    "x=1",
    "seed=1",
]
PATHS = [
    "out.json",
    "out.png",
    "out.npz",
    "out.mp4",
    "out.csv",
    "out",
    ".",
    "..",
    "/",
    "",
    "folder",
    "none/out.json",
]
PATHS += [
    "folder/out.json",
    "folder/out.png",
    "plan.json",
    "damaged.json",
    "plan.json/out.json",
    "pipe",
    "link.json",
]
PATHS += ["/dev/full", "/proc/self/mem", "a" * 300 + ".json", "out.JSON", "out.png.exe", "\x00.json", "~/out.json"]
PATHS += [".json", "out .json", "-out.json", "*.json", "[bold].png"]


class BegunError(Exception):
    """The work has begun: what was asked for was taken."""


def begin(*_: Any, **__: Any) -> Any:
    """Stand in for the work."""
    raise BegunError


def training() -> ModuleType:
    """Return ``train.py``; loading torch once is enough."""
    from jet_gym.cli import train

    return train._load(next(place for place in train._PLACES if place.exists()))


@pytest.fixture(scope="module")
def plan_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    step = replace(PAPER.side, points=4)
    path = tmp_path_factory.mktemp("plan") / "plan.json"
    Plan.from_pelvis_path(step, np.tile(step.nominal_pelvis, (4, 1)), planner="mine").save(path)
    return path


@pytest.fixture(scope="module", autouse=True)
def _without_work() -> Iterator[None]:
    """Cut the work off where it begins."""
    for module in ("pybullet", "stable_baselines3"):
        pytest.importorskip(module)
    import matplotlib.font_manager  # noqa: F401  it writes its cache when it is first imported
    import minari  # noqa: F401

    import jet_gym.reproduction.run as reproduction

    draw_random_steps(1, 0)  # compiles, which takes a while
    script = training()
    parts = tuple(replace(part, make=begin) for part in reproduction.PARTS)
    with ExitStack() as stack:
        for target in (
            "agents.studies.claims.measure_claims",
            "agents.compare.compare",
            "agents.dataset._episode",
            "agents.studies.sweep.sweep_smoothness",
            "jet_gym.balance_space.for_each",
            "jet_gym.simulation.execution.execute",
            "jet_gym.simulation.limits.find_limits",
            "jet_gym.simulation.trials.run_trials",
            "jet_gym.studio.server.Studio.__init__",
            "agents.genetic.GasPlanner.plan",
            "agents.genetic.GaPlanner.plan",
            "agents.exhaustive.GaexPlanner.plan",
            "agents.optimal.OptimalPlanner.plan",
            "agents.policy.PolicyPlanner.plan",
        ):
            stack.enter_context(patch(target, begin))
        stack.enter_context(patch.object(reproduction, "PARTS", parts))
        stack.enter_context(patch.object(script, "train", begin))
        stack.enter_context(patch("jet_gym.cli.train._load", lambda _: script))
        yield


@st.composite
def command_lines(draw: st.DrawFn) -> list[str]:
    """Draw a command with options that it has, mostly with as many values as they want, and some others."""
    name = draw(st.sampled_from(sorted(cli.commands)))
    command = cli.commands[name]
    options = [p for p in command.params if isinstance(p, click.Option)]
    words = [name]
    for _ in range(draw(st.integers(0, 6))):
        kind = draw(st.sampled_from(["option", "option", "option", "option", "argument", "unknown"]))
        if kind == "option" and options:
            option = draw(st.sampled_from(options))
            words.append(draw(st.sampled_from([*option.opts, *option.secondary_opts])))
            count = 0 if option.is_flag else option.nargs
            if not draw(st.integers(0, 15)):
                count += draw(st.sampled_from([-1, 1]))
            words += [draw(_values(option)) for _ in range(count)]
        elif kind == "argument":
            words.append(draw(st.sampled_from([*WORDS, *PATHS])))
        else:
            words.append(draw(st.sampled_from(["--fast", "-x", "--seed=1", "--output=out.json", "--help", "-h"])))
            if name == "train":
                words += [draw(st.sampled_from(TRAINING)), draw(st.sampled_from(NUMBERS))]
    return words


TRAINING = ["--steps", "--lanes", "--hidden", "--deviations", "--gamma", "--output", "--resume", "--hide", "--rise"]
TRAINING += ["--imitation.rounds", "--imitation.episodes", "--physics", "--device", "--target-kl", "--threads"]


def _values(option: click.Option) -> st.SearchStrategy[str]:
    if isinstance(option.type, click.Path):
        return st.sampled_from(PATHS)
    if isinstance(option.type, click.Choice):
        return st.sampled_from([*map(str, option.type.choices)] * 3 + WORDS)
    if isinstance(option.type, click.types.StringParamType):
        return st.sampled_from(WORDS)
    plain = ["0", "1", "2", "3", "30", "0.02", "0.1", "0.34", "-0.1125", "0.1125"]
    return st.one_of(st.sampled_from(plain), st.sampled_from(plain + NUMBERS), st.text(max_size=3))


def prepare(folder: Path, plan_file: Path) -> None:
    """Make a folder with a few things in it to meet."""
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "folder").mkdir(parents=True)
    shutil.copy(plan_file, folder / "plan.json")
    (folder / "damaged.json").write_bytes(plan_file.read_bytes()[:-100])
    (folder / "link.json").symlink_to(folder / "folder" / "linked.json")
    os.mkfifo(folder / "pipe")


@given(words=command_lines())
@fuzz_settings(150)
def test_any_arguments_give_a_code_and_a_sentence(
    words: list[str], tmp_path: Path, plan_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "here"
    prepare(folder, plan_file)
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}
    capsys.readouterr()
    arguments = [word for word in words if "\x00" not in word or word == words[-1]]
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        patched.setenv("HOME", str(folder))
        patched.setattr(sys, "argv", ["jet-gym", *arguments])
        try:
            with watched() as deeds:
                code: int | None = run(arguments)
        except BegunError:
            code = None
        except SystemExit as stopped:  # of train.py's own reader of arguments
            code = int(stopped.code or 0)
    told = capsys.readouterr()
    assert code in (None, 0, 1, 2), told
    assert "Traceback" not in told.out + told.err
    if code == 2:
        assert told.err
        if words[0] != "train":
            assert told.err.rstrip("\n").count("\n") == 0, told.err
    changed = [path for path, time in before.items() if not path.exists() or path.stat().st_mtime_ns != time]
    assert changed == []
    assert [path for path in folder.rglob("*") if path.is_file() and path not in before] == []
    assert deeds.elsewhere(folder, TEMPORARY) == []
    assert [deed for deed in deeds.run if "socket" not in deed] == []
