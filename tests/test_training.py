"""``train.py`` from its first line to its last."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from tiny_training import ROOT, TINY, train

import jet_gym  # noqa: F401
from agents.policy import SHIPPED_POLICY, load_policy
from agents.training.imitation import Imitation
from agents.training.ship import best_run
from jet_gym.cli import cli


def test_train_from_nothing_to_a_judged_policy_and_on_again(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    assert train(*TINY, "--output", str(folder)) == 0
    run = json.loads((folder / "run.json").read_text())
    assert run["settings"]["seed"] == 0
    assert run["versions"]["torch"]
    assert "git_revision" in run
    test = json.loads((folder / "test.json").read_text())
    assert 0.0 <= test["policy"]["wins"] <= 1.0
    network = load_policy(folder / "best" / "policy.npz")
    assert network.about["validation"]["total_fitness"] > 0.0
    assert list((folder / "tensorboard").glob("events*"))
    progress = json.loads((folder / "progress.json").read_text())
    assert [row["round"] for row in progress["imitation"]] == [1, 2]
    assert 0 < progress["imitation"][0]["states"] < progress["imitation"][1]["states"]
    validations = progress["validations"]
    assert [row["steps"] for row in validations] == sorted({row["steps"] for row in validations})
    assert train(*TINY, "--output", str(folder)) == 2  # there is a run in it already
    assert train("--resume", str(folder)) == 0  # done, and judged again
    again = tmp_path / "again"
    assert train(*TINY, "--output", str(again)) == 0
    assert load_policy(again / "checkpoint" / "policy.npz").sha256 == (
        load_policy(folder / "checkpoint" / "policy.npz").sha256
    )


def test_a_model_holds_its_schedule_by_name_and_not_train_py_itself(tmp_path: Path) -> None:
    """What ``__main__`` defines is pickled whole, with the path of its file."""
    assert train(*TINY, "--output", str(tmp_path / "run")) == 0
    with zipfile.ZipFile(tmp_path / "run" / "best" / "model.zip") as archive:
        data = json.loads(archive.read("data"))
    pickled = [
        base64.b64decode(value[":serialized:"])
        for value in data.values()
        if isinstance(value, dict) and ":serialized:" in value
    ]
    assert any(b"agents.training.schedule" in found for found in pickled)
    assert not any(b"train.py" in found or b"_Falling" in found for found in pickled)


def test_the_best_of_several_runs_is_that_of_least_cost(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    worse, better = tmp_path / "worse", tmp_path / "better"
    assert train(*TINY, "--output", str(worse)) == 0
    (better / "best").mkdir(parents=True)
    shutil.copyfile(SHIPPED_POLICY, better / "best" / "policy.npz")
    assert best_run([worse, better], 10) == best_run([better, worse], 10) == better
    assert best_run([worse], 10) == worse
    assert "of points violated" in capsys.readouterr().out


def test_bullet_fine_tunes_from_a_model(tmp_path: Path) -> None:
    assert train(*TINY, "--output", str(tmp_path / "first")) == 0
    start = ["--start-from", str(tmp_path / "first" / "best" / "model.zip")]
    bullet = ["--physics", "bullet", "--steps", "40", "--lanes", "2", "--rollout", "20", "--batch-size", "20"]
    assert train(*TINY, *bullet, *start, "--output", str(tmp_path / "bullet")) == 0
    assert (tmp_path / "bullet" / "test.json").exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ["--steps", "0"],
        ["--gamma", "2"],
        ["--seed", "-1"],
        ["--batch-size", "100000"],
        ["--resume", "no/such/run"],
        ["--device", "cuda:7"],
        ["--learning-rates", "nan", "1e-5"],
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert train(*arguments) == 2
    told = capsys.readouterr()
    assert "Traceback" not in told.err + told.out
    assert arguments[0].lstrip("-").replace("-", "_") in told.err or "no/such/run" in told.err


def test_without_torch_it_says_in_one_sentence_what_to_install() -> None:
    program = "import runpy, sys; sys.modules['torch'] = None; runpy.run_path('train.py', run_name='__main__')"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == "training needs torch: pip install torch==2.13.0, and then 'jet-gym[train]'\n"


def test_ctrl_c_while_it_imitates_is_told_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Imitation, "_learn", interrupt)
    assert train(*TINY, "--output", str(tmp_path / "run")) == 130
    said = " ".join(capsys.readouterr().err.split())
    assert "stopped; begin imitation anew with: python train.py --resume" in said
    assert said.endswith("interrupted; what was written is whole")


def test_jet_gym_train_is_train_py() -> None:
    command = [sys.executable, "-c", "from jet_gym.cli import main; main()", "train", "--help"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert "--deviations" in done.stdout
    assert "train" in cli.commands
    assert CliRunner().invoke(cli, ["--help"]).output.count("Train a posture policy") == 1
