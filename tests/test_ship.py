"""The folder of a policy that ships, and the card that says what it can do."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from agents import make_planner
from agents.network import PolicyNetwork
from agents.policy import SHIPPED_POLICY, PolicyPlanner

pytest.importorskip("stable_baselines3")

from agents.training import ship
from agents.training.validation import TEST_SEED, StepSet, drawn_steps

STEPS = 4


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that a run with the policy that ships would make, judged on a few steps."""
    run, target = tmp_path_factory.mktemp("run"), tmp_path_factory.mktemp("shipped") / "policy"
    shutil.copytree(SHIPPED_POLICY.parent, run / "best")
    about = json.loads((SHIPPED_POLICY.parent / "about.json").read_text())
    (run / "run.json").write_text(json.dumps(about["trained_by"]))
    with pytest.MonkeyPatch.context() as patch:
        assert _ship(patch, run, "--target", target, "--steps", STEPS) == 0
    return target


def _ship(patch: pytest.MonkeyPatch, *arguments: object) -> int:
    patch.setattr("sys.argv", ["ship", *map(str, arguments)])
    return ship.main()


@pytest.fixture
def a_run(tmp_path: Path) -> Path:
    """A run with the policy that ships."""
    shutil.copytree(SHIPPED_POLICY.parent, tmp_path / "run" / "best")
    about = json.loads((SHIPPED_POLICY.parent / "about.json").read_text())
    (tmp_path / "run" / "run.json").write_text(json.dumps(about["trained_by"]))
    return tmp_path / "run"


@pytest.mark.parametrize(
    ("lacking", "sentence"),
    [
        ("best/policy.npz", "policy.npz: No such file"),
        ("best/model.zip", "model.zip: No such file"),
        ("run.json", "holds no run: "),
    ],
)
def test_a_run_that_is_not_whole_is_refused_in_a_sentence_before_any_work(
    a_run: Path,
    lacking: str,
    sentence: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (a_run / lacking).unlink()
    monkeypatch.setattr(StepSet, "drawn", lambda *_: pytest.fail("it planned"))
    assert _ship(monkeypatch, a_run, "--target", tmp_path / "card") == 2
    said = capsys.readouterr().err
    assert said.startswith("error: ")
    assert said.count("\n") == 1
    assert sentence in said
    assert not (tmp_path / "card").exists()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--target", "/proc/nope"], "error: /proc/nope: No such file or directory\n"),
        (["--target", "card", "--steps", "0"], "error: steps must be a whole number of 1 or more, not 0\n"),
        (
            ["--target", "card", "--validation-steps", "-1"],
            "error: validation_steps must be a whole number of 1 or more, not -1\n",
        ),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(
    a_run: Path,
    arguments: list[str],
    sentence: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(a_run)
    assert _ship(monkeypatch, a_run, *arguments) == 2
    assert capsys.readouterr().err == sentence


def test_a_model_that_shipped_before_is_replaced_and_not_written_into(
    a_run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Written into, it would be half of one where the writing stops."""
    target, other_name = tmp_path / "card", tmp_path / "other"
    target.mkdir()
    (target / "model.zip").write_bytes(b"of before")
    other_name.hardlink_to(target / "model.zip")
    assert _ship(monkeypatch, a_run, "--target", target, "--steps", 2) == 0
    assert (target / "model.zip").read_bytes() == SHIPPED_POLICY.with_name("model.zip").read_bytes()
    assert other_name.read_bytes() == b"of before"


@pytest.fixture(scope="module")
def about(shipped: Path) -> dict[str, Any]:
    return json.loads((shipped / "about.json").read_text())


def test_what_ships_is_the_best_network_of_the_run(shipped: Path, about: dict[str, Any]) -> None:
    network = PolicyNetwork.load(shipped / "policy.npz")
    assert network.sha256 == about["sha256"] == PolicyNetwork.load(SHIPPED_POLICY).sha256
    assert network.about["test"] == about["test"]
    assert (shipped / "model.zip").read_bytes() == SHIPPED_POLICY.with_name("model.zip").read_bytes()


@pytest.mark.parametrize(("name", "refine"), [("policy", 0), ("policy+refine", 16)])
def test_the_scores_are_those_of_its_plans(about: dict[str, Any], name: str, refine: int) -> None:
    steps = drawn_steps(STEPS, TEST_SEED)
    plans = PolicyPlanner(refine=refine).plan_many(steps)
    gas = [make_planner("gas").plan(step) for step in steps]
    score = about["test"][name]
    wins = [mine.total_fitness < other.total_fitness for mine, other in zip(plans, gas, strict=True)]
    assert score["wins"] == pytest.approx(sum(wins) / STEPS)
    assert score["total_fitness"] == pytest.approx(sum(plan.total_fitness for plan in plans) / STEPS)
    assert score["violated_steps"] == pytest.approx(sum(bool(plan.violated_points) for plan in plans) / STEPS)
    assert score["median_gap"] >= -1e-6


def test_kinds_that_were_not_drawn_have_no_row(shipped: Path, about: dict[str, Any]) -> None:
    card = (shipped / "README.md").read_text()
    steps = drawn_steps(STEPS, TEST_SEED)
    for kind, belongs in ship._KINDS.items():
        drawn = any(belongs(step) for step in steps)
        assert (kind in about["by_kind"]) == drawn
        assert (f"| {kind} | policy |" in card) == drawn
    assert len(about["by_kind"]) < len(ship._KINDS), "all kinds were drawn: the test says nothing"


def test_of_several_runs_the_best_on_validation_steps_ships(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    network = PolicyNetwork.load(SHIPPED_POLICY)
    *others, (weights, biases) = network.layers
    for name, loss in (("worse", 0.5), ("best", 0.0), ("worst", 1.0)):
        folder = tmp_path / name / "best"
        folder.mkdir(parents=True)
        replace(network, layers=(*others, ((1.0 - loss) * weights, biases))).save(folder / "policy.npz")
    runs = [tmp_path / "worse", tmp_path / "best", tmp_path / "worst"]
    assert ship.best_run(runs, 6) == tmp_path / "best"
    assert capsys.readouterr().out.count("of 6 validation steps") == 3
    assert ship.best_run(runs[2:], 6) == tmp_path / "worst"


def test_every_step_is_of_a_direction_and_of_a_distance() -> None:
    for step in drawn_steps(50, TEST_SEED):
        assert sum(belongs(step) for belongs in ship._KINDS.values()) == 2


def test_the_card_says_what_about_json_says(shipped: Path, about: dict[str, Any]) -> None:
    card = (shipped / "README.md").read_text()
    for name, score in about["test"].items():
        assert f"| all | {name} | {score['wins']:.0%} | {score['median_ratio']:.2f} |" in card
    assert f"Judged on {STEPS} steps" in card
    assert about["sha256"][:16] in card
