"""A wrong argument of a training script is one sentence and exit code 2."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pytest

pytest.importorskip("tyro")

from agents.training.arguments import parse_arguments, sentence_in
from jet_gym.cli import train
from jet_gym.errors import SettingsError

ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Settings:
    """Settings of something."""

    seed: int = 0
    """Seed of everything."""
    physics: Literal["quasistatic", "bullet"] = "quasistatic"
    """What simulates."""
    pair: tuple[float, float] = (0.0, 0.0)
    """Two numbers."""

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise SettingsError(f"seed must be 0 or more, not {self.seed}")


@pytest.mark.parametrize("width", ["40", "200"])
@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--wrong", "3"], "Unrecognized options: --wrong, 3"),
        (["--sed", "3"], "Unrecognized options: --sed, 3. Did you mean --seed?"),
        (["--seed", "abc"], "Error parsing --seed: invalid literal for int() with base 10: 'abc'"),
        (["--seed", "-1"], "seed must be 0 or more, not -1"),
        (["--seed"], "Missing value for argument '--seed'. Expected 1 values."),
        (
            ["--physics", "x"],
            "invalid choice 'x' for argument '--physics'. Expected one of ('quasistatic', 'bullet').",
        ),
    ],
)
def test_a_wrong_argument_is_one_sentence(
    arguments: list[str],
    sentence: str,
    width: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("COLUMNS", width)
    with pytest.raises(SettingsError) as error:
        parse_arguments(Settings, arguments, None, "train.py")
    assert str(error.value) == sentence
    assert capsys.readouterr() == ("", "")


def test_right_arguments_are_read() -> None:
    assert parse_arguments(Settings, ["--seed", "3", "--pair", "1", "2"], None, "train.py") == Settings(
        3, pair=(1.0, 2.0)
    )


def test_help_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        parse_arguments(Settings, ["--help"], "What it does.", "jet-gym train")
    assert not end.value.code
    said = capsys.readouterr().out
    assert "Two numbers" in said
    assert said.startswith("usage: jet-gym train ")


@pytest.mark.parametrize(
    "box",
    [
        "╭─ Wrong ─╮\n│ it is   │\n│ wrong   │\n│ ─────── │\n│ see -h  │\n╰─────────╯\n",
        " Wrong   \n -------- \n  it is \n  wrong \n  ------\n  see -h\n",
        "it is wrong\n",
    ],
)
def test_boxes_are_read_as_they_are_drawn(box: str) -> None:
    assert sentence_in(box) == "it is wrong"


def test_the_training_script_tells_it_so(capsys: pytest.CaptureFixture[str]) -> None:
    script = train._load(ROOT / "train.py")
    assert script.main(["--sed", "3"]) == 2
    assert capsys.readouterr().err.strip() == "error: Unrecognized options: --sed, 3. Did you mean --seed?"
