"""Expert episodes as Minari datasets: whole, replayable, and as good as the planner."""

from __future__ import annotations

from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from agents import make_planner
from agents.dataset import make_datasets
from jet_gym.cli import run
from jet_gym.task.drawing import draw_random_steps

minari = pytest.importorskip("minari")


def test_episodes_are_those_of_the_planners(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[int, int]] = []
    folders = make_datasets(
        ("optimal", "gas"), 3, 5, tmp_path / "data", progress=lambda done, total: seen.append((done, total))
    )
    assert seen == [(k, 6) for k in range(1, 7)]
    assert sorted(path.name for path in (tmp_path / "data").rglob("*-v0")) == ["gas-v0", "optimal-v0"]
    assert all(folder.is_dir() for folder in folders)
    assert not list((tmp_path / "data").glob(".making*"))
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "data"))
    steps, returns = draw_random_steps(3, 5), {}
    for name in ("optimal", "gas"):
        episodes = list(minari.load_dataset(f"jet_hr1/{name}-v0").iterate_episodes())
        assert [len(episode.actions) for episode in episodes] == [step.points for step in steps]
        returns[name] = [float(episode.rewards.sum()) for episode in episodes]
        assert all(episode.terminations[-1] and not episode.terminations[:-1].any() for episode in episodes)
    for step, total in zip(steps, returns["gas"], strict=True):
        plan = make_planner("gas").plan(step, seed=5)
        if not plan.violated_points:
            assert total == pytest.approx(-plan.total_fitness / 230.0, abs=1e-3)
    for step, better, worse in zip(steps, returns["optimal"], returns["gas"], strict=True):
        if not make_planner("optimal").plan(step).violated_points:
            assert better > worse


def test_an_episode_replays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    make_datasets(("gas",), 1, 2, tmp_path)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    episode = minari.load_dataset("jet_hr1/gas-v0")[0]
    env = gym.make("jet_gym:JetHR1Step-v0", physics="quasistatic")
    observation, _ = env.reset(options={"step": draw_random_steps(1, 2)[0]})
    for k, action in enumerate(episode.actions):
        assert np.array_equal(observation, episode.observations[k])
        observation, reward, *_ = env.step(action)
        assert reward == episode.rewards[k]
    env.close()


def test_the_command_refuses_what_is_there_and_unknown_planners(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    arguments = ["dataset", "--steps", "1", "--planner", "gas", "--output", "data"]
    assert run(arguments) == 0
    assert "gas-v0" in capsys.readouterr().out
    assert run(arguments) == 2
    assert "already" in capsys.readouterr().err
    assert run(["dataset", "--planner", "annealing", "--output", "none"]) == 2
    assert "no planner 'annealing'" in capsys.readouterr().err
    assert not Path("none").exists()
