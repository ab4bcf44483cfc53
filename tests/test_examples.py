"""The examples run as they are."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parent.parent / "examples"


@pytest.mark.parametrize(
    ("name", "arguments", "words", "needs"),
    [
        ("random_agent.py", [], "episode 2: return", "pybullet"),
        ("own_reward.py", [], "return", "gymnasium"),
        ("gas_agent_video.py", ["out.gif"], "success True, wrote out.gif", "pybullet"),
        ("frame.py", ["out.png"], "wrote out.png", "pybullet"),
        ("train_sb3.py", ["2048"], "after 2048 training steps", "stable_baselines3"),
        ("evaluate_model.py", [], "of 10 steps", "gymnasium"),
        ("watch_policy.py", ["out.gif"], "wrote out.gif", "pybullet"),
    ],
)
def test_example_runs(name: str, arguments: list[str], words: str, needs: str, tmp_path: Path) -> None:
    pytest.importorskip(needs)
    command = [sys.executable, str(EXAMPLES / name), *arguments]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
    assert result.returncode == 0, result.stderr
    assert words in result.stdout
    if arguments and arguments[0].startswith("out"):
        assert (tmp_path / arguments[0]).stat().st_size > 50_000


@pytest.mark.parametrize(
    ("name", "target", "suffixes"),
    [
        ("frame.py", "out.mp4", ".png, .jpg or .webp"),
        ("gas_agent_video.py", "out.mp4", ".gif or .webp"),
        ("watch_policy.py", "out", ".gif or .webp"),
    ],
)
def test_a_picture_that_cannot_be_written_is_refused_in_one_sentence(
    name: str, target: str, suffixes: str, tmp_path: Path
) -> None:
    command = [sys.executable, str(EXAMPLES / name), target]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
    assert result.returncode == 1
    assert result.stdout == ""
    assert result.stderr.endswith(f"cannot be saved as '{target}'; its name must end in {suffixes}\n")
    assert result.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_the_optimal_planner_is_cloned_from_its_dataset(tmp_path: Path) -> None:
    """More epochs bring the clone nearer: its loss falls."""
    pytest.importorskip("minari")
    from agents.dataset import make_datasets

    make_datasets(("optimal",), steps=4, seed=0, output=tmp_path)
    losses = []
    for epochs in ("1", "40"):
        command = [sys.executable, str(EXAMPLES / "clone_optimal.py"), epochs, "clone.pt"]
        environment = os.environ | {"MINARI_DATASETS_PATH": str(tmp_path)}
        result = subprocess.run(
            command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False, env=environment
        )
        assert result.returncode == 0, result.stderr
        assert "cloned 4 episodes" in result.stdout
        losses.append(float(result.stdout.split("loss ")[1].split(",")[0]))
    assert losses[1] < 0.5 * losses[0]


def test_every_example_is_run_here() -> None:
    here = Path(__file__).read_text(encoding="utf-8")
    assert all(f'"{path.name}"' in here for path in EXAMPLES.glob("*.py"))
