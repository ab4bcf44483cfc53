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
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import ConvertCallback
from tiny_training import ROOT, TINY, script, train

import jet_gym  # noqa: F401
from agents.policy import SHIPPED_POLICY, load_policy
from agents.training.callbacks import Curriculum
from agents.training.imitation import Imitation
from agents.training.ship import best_run
from agents.training.validation import TEST_SEED, VALIDATION_SEED
from jet_gym.cli import cli, run
from jet_gym.envs.jet_hr1_step import JetHR1StepEnv
from jet_gym.envs.jet_hr1_step_vector import JetHR1StepVectorEnv


def test_train_from_nothing_to_a_judged_policy_and_on_again(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    assert train(*TINY, "--output", str(folder)) == 0
    about = json.loads((folder / "run.json").read_text())
    assert about["settings"]["seed"] == 0
    assert about["command"] == ["python", "train.py", *TINY, "--output", str(folder)]
    assert about["versions"]["torch"]
    assert "git_revision" in about
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


def test_bullet_fine_tunes_from_a_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert train(*TINY, "--output", str(tmp_path / "first")) == 0
    start = ["--start-from", str(tmp_path / "first" / "best" / "model.zip")]
    bullet = ["--physics", "bullet", "--steps", "40", "--lanes", "2", "--rollout", "20", "--batch-size", "20"]
    assert train(*TINY, *bullet, *start, "--output", str(tmp_path / "bullet")) == 0
    assert (tmp_path / "bullet" / "test.json").exists()
    capsys.readouterr()
    assert train(*TINY, *start, "--hidden", "8", "--output", str(tmp_path / "other")) == 2
    assert "does not fit this network" in "".join(capsys.readouterr().err.splitlines())
    assert list((tmp_path / "other").iterdir()) == []


@pytest.mark.parametrize(
    "arguments",
    [
        ["--steps", "0"],
        ["--gamma", "2"],
        ["--seed", "-1"],
        ["--seed", "8900"],
        ["--seed", "9900"],
        ["--lanes", "100001"],
        ["--replay", "0.5", "--physics", "bullet"],
        ["--batch-size", "100000"],
        ["--resume", "no/such/run"],
        ["--device", "cuda:7"],
        ["--learning-rates", "nan", "1e-5"],
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(
    arguments: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(script().StepSet, "drawn", lambda *_: pytest.fail("it planned"))
    assert train(*arguments) == 2
    told = capsys.readouterr()
    assert "Traceback" not in told.err + told.out
    assert arguments[0].lstrip("-").replace("-", "_") in told.err or "no/such/run" in told.err


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--output", "/proc/nope"], "/proc/nope: No such file or directory"),
        (["--output", "file/run"], "file/run: Not a directory"),
        (["--output", "file"], "file: File exists"),
        (["--start-from", "none.zip"], "none.zip: No such file or directory"),
        (["--resume", "no/[/such]/run"], "no/[/such]/run holds no run: no/[/such]/run/run.json: No such file"),
    ],
)
def test_files_that_cannot_be_are_told_before_any_work(
    arguments: list[str],
    sentence: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    monkeypatch.setattr(script().StepSet, "drawn", lambda *_: pytest.fail("it planned"))
    assert train(*TINY, *arguments) == 2
    assert capsys.readouterr().err.startswith(f"error: {sentence}")
    assert list(tmp_path.iterdir()) == [tmp_path / "file"]


def test_the_highest_seed_draws_no_validation_or_test_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every seed that anything is reset with in a whole training is noted."""
    single, lanes = _noted_seeds(monkeypatch, JetHR1StepEnv), _noted_seeds(monkeypatch, JetHR1StepVectorEnv)
    assert train(*TINY, "--seed", "8899", "--output", str(tmp_path / "run")) == 0
    assert lanes == [8899 + lane for lane in range(4)]
    apart = {VALIDATION_SEED + step for step in range(4)} | {TEST_SEED + step for step in range(3)}
    assert apart <= set(single)
    drawn = sorted(set(single) - apart)
    imitated, scaled = drawn[:12], drawn[12:]  # 8 steps at first, and 2 in each of two rounds
    assert imitated == list(range(imitated[0], imitated[0] + 12))
    assert scaled == [900_000_000 + step for step in range(150)]
    full = script().TrainSettings(seed=8899)
    planned = full.imitation.first_steps + full.imitation.rounds * full.imitation.steps_per_round
    highest = (lanes[0] + full.lanes - 1, imitated[0] + planned - 1, scaled[-1])
    assert max(highest) < VALIDATION_SEED
    assert max(highest[:2]) < scaled[0]


def _noted_seeds(monkeypatch: pytest.MonkeyPatch, kind: type[Any]) -> list[int]:
    """Return a list that will have the seeds that environments of a kind are reset with."""
    noted: list[int] = []
    reset = kind.reset

    def noting(self: Any, *, seed: Any = None, options: Any = None) -> Any:
        noted.extend(seed if isinstance(seed, list) else [] if seed is None else [seed])
        return reset(self, seed=seed, options=options)

    monkeypatch.setattr(kind, "reset", noting)
    return noted


@pytest.mark.parametrize("chooses", ["thrust", "pelvis"])
@pytest.mark.parametrize(("rise", "costs"), [((0.0, 0.0), [2.0, 2.0]), ((0.0, 1.0), [0.0, 1.0])])
def test_with_physics_the_cost_of_a_violation_rises_as_asked(
    chooses: str, rise: tuple[float, float], costs: list[float]
) -> None:
    sizes = {"lanes": 2, "rollout": 4, "batch_size": 8, "steps": 16}
    settings = script().TrainSettings(physics="bullet", chooses=chooses, rise=rise, **sizes)
    envs, seen = script()._environments(settings), []
    model = PPO("MlpPolicy", envs, n_steps=4, batch_size=8, n_epochs=1, seed=0)

    def note(*_: Any) -> bool:
        seen.append([env.unwrapped.model.violation_cost for env in envs.envs])
        return True

    curriculum = Curriculum((0.1, 0.1), settings.rise, settings.violation_cost, settings.steps)
    model.learn(16, [curriculum, ConvertCallback(note)])
    envs.close()
    assert seen == [[cost] * 2 for cost in costs for _ in range(4)]


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


def test_jet_gym_train_records_a_command_that_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    recorded: list[list[str]] = []
    monkeypatch.setattr(script(), "train", lambda _, command: recorded.append(command))
    monkeypatch.setattr("jet_gym.cli.train._load", lambda _: script())
    monkeypatch.setattr(sys, "argv", ["jet-gym", "train", "--seed", "3"])
    assert run(["train", "--seed", "3"]) == 0
    assert recorded == [["python", "train.py", "--seed", "3"]]
    assert sys.argv == ["jet-gym", "train", "--seed", "3"]


def test_jet_gym_train_is_train_py() -> None:
    command = [sys.executable, "-c", "from jet_gym.cli import main; main()", "train", "--help"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert done.stdout.startswith("usage: jet-gym train ")
    assert "--deviations" in done.stdout
    assert "train" in cli.commands
    assert CliRunner().invoke(cli, ["--help"]).output.count("Train a posture policy") == 1
