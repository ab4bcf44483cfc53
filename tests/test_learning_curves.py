"""Learning curves of training runs."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from agents.training import curves
from jet_gym.figures.learning_curves import plot_learning_curves


def score(wins: float) -> dict[str, float]:
    return {"wins": wins, "median_ratio": 2.0, "violated_points": 0.0}


def run(last: int, rounds: int = 0) -> dict[str, list[dict[str, float]]]:
    imitation = [{"round": n, "states": n * 1e5, "seconds": n, **score(0.0)} for n in range(1, rounds + 1)]
    steps = range(0, last + 1, 100_000)
    return {
        "imitation": imitation,
        "validations": [{"steps": n, "seconds": n / 1e4, **score(n / last)} for n in steps],
    }


def test_each_run_and_their_median_are_drawn() -> None:
    figure = plot_learning_curves([run(400_000), run(600_000), run(800_000)])
    wins = figure.axes[0]
    assert len(wins.lines) == 4
    median = wins.lines[-1]
    assert median.get_xdata()[-1] == pytest.approx(0.4)
    assert median.get_ydata()[-1] == pytest.approx(100.0 * 4 / 6)


def test_ppo_comes_after_imitation() -> None:
    figure = plot_learning_curves([run(400_000, rounds=3), run(400_000, rounds=3)])
    median = figure.axes[0].lines[-1]
    assert list(median.get_xdata()) == pytest.approx([0.1, 0.2, 0.3, 0.3, 0.4, 0.5, 0.6, 0.7])
    assert list(median.get_ydata()) == pytest.approx([0, 0, 0, 0, 25, 50, 75, 100])


def test_nothing_to_draw_is_refused() -> None:
    for runs in ([], [{"imitation": [], "validations": []}]):
        with pytest.raises(ValueError, match="at least one run"):
            plot_learning_curves(runs)


def test_the_command_draws_folders_of_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "progress.json").write_text(json.dumps(run(300_000, rounds=60)))
    monkeypatch.setattr(sys, "argv", ["curves", str(tmp_path), "--plot", str(tmp_path / "a.png")])
    assert curves.main() == 0
    assert "300,000 steps of PPO, 1.5 min in all, below GAS on 100% of steps" in capsys.readouterr().out
    assert (tmp_path / "a.png").stat().st_size > 10_000


def test_folders_that_hold_no_run_are_one_sentence(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "agents.training.curves", "no/such/run", "--plot", str(tmp_path / "b.png")]
    root = Path(__file__).resolve().parents[1]
    bad = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
    assert bad.returncode == 2
    assert bad.stderr.count("\n") == 1
