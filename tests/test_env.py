"""``JetHR1Step-v0`` keeps Gymnasium's contract: checkers, seeds, spaces, arguments, options, workers."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env, data_equivalence

import jet_gym  # noqa: F401  (registers the environment)
from jet_gym.courses import PAPER

ID = "JetHR1Step-v0"
SIDE = replace(PAPER.side, points=30)
PHYSICS = ("quasistatic", "bullet")


@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize("reward", ["graded", "fitness"])
@pytest.mark.parametrize("options", [{}, {"thrust_model": "least", "step": SIDE}, {"render_mode": "rgb_array"}])
def test_gymnasiums_checker_has_nothing_to_say(
    make_env: Any, physics: str, reward: str, options: dict[str, Any]
) -> None:
    env = make_env(physics=physics, reward=reward, **options)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)  # it would open a window


@pytest.mark.parametrize("physics", PHYSICS)
def test_stable_baselines_checker_has_nothing_to_say(make_env: Any, physics: str) -> None:
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    checker.check_env(make_env(physics=physics).unwrapped)


@pytest.mark.parametrize("physics", PHYSICS)
def test_same_seed_gives_the_same_episode_to_the_last_bit(make_env: Any, physics: str) -> None:
    first, second = make_env(physics=physics), make_env(physics=physics)
    first.reset(seed=99), first.step(np.ones(3, dtype=np.float32))  # a reset in mid-episode must leave no trace
    assert data_equivalence(first.reset(seed=5), second.reset(seed=5), exact=True)
    generator = np.random.default_rng(0)
    for _ in range(60):
        action = generator.uniform(-0.3, 0.3, 3).astype(np.float32)
        ours, theirs = first.step(action), second.step(action)
        assert data_equivalence(ours, theirs, exact=True)
        if ours[2]:
            break
    assert ours[2]


@pytest.mark.parametrize("physics", PHYSICS)
def test_seeded_and_unseeded_resets_repeat_in_order(make_env: Any, physics: str) -> None:
    env = make_env(physics=physics)
    seen = [env.reset(seed=seed)[0] for seed in (7, None, 7, None)]
    assert np.array_equal(seen[0], seen[2])
    assert np.array_equal(seen[1], seen[3])
    assert not np.array_equal(seen[0], seen[1])


@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize("action", [np.full(3, np.nan), np.array([np.inf, 0, 0]), np.zeros(2), 0.5, "left", None])
def test_a_wrong_action_is_refused(make_env: Any, physics: str, action: Any) -> None:
    env = make_env(physics=physics).unwrapped
    env.reset(seed=0)
    with pytest.raises((ValueError, TypeError)):
        env.step(action)


def test_actions_beyond_the_box_are_clipped(make_env: Any) -> None:
    ours, theirs = make_env(physics="quasistatic").unwrapped, make_env(physics="quasistatic").unwrapped
    ours.reset(seed=0), theirs.reset(seed=0)
    assert data_equivalence(
        ours.step(np.array([5.0, -7.0, 0.5])), theirs.step(np.array([1.0, -1.0, 0.5])), exact=True
    )


def test_before_the_first_reset_there_is_no_step_and_nothing_to_see(make_env: Any) -> None:
    env = make_env(physics="quasistatic", render_mode="rgb_array").unwrapped
    with pytest.raises(ResetNeeded, match="no step before"):
        _ = env.current_step
    with pytest.raises(ResetNeeded, match="nothing to see before"):
        env.render()


def test_a_step_before_the_beginning_or_after_the_end_is_refused(make_env: Any) -> None:
    env = make_env(physics="quasistatic", step=replace(SIDE, points=2)).unwrapped
    with pytest.raises(ResetNeeded):
        env.step(np.zeros(3))
    env.reset(seed=0)
    env.step(np.zeros(3))
    assert env.step(np.zeros(3))[2]
    with pytest.raises(ResetNeeded):
        env.step(np.zeros(3))


@pytest.mark.parametrize(
    "options",
    [{"physics": "newton"}, {"reward": "sparse"}, {"thrust_model": "most"}, {"smoothness_weight": -1.0},
     {"smoothness_weight": "a"}, {"difficulty": None}, {"time_per_point": "x"},
     {"step": "side"}, {"difficulty": float("nan")}, {"time_per_point": 0.0}, {"render_mode": "ascii"}],
)  # fmt: skip
def test_wrong_arguments_are_refused(options: dict[str, Any]) -> None:
    from jet_gym.envs.jet_hr1_step import JetHR1StepEnv

    with pytest.raises(ValueError, match=next(iter(options))):
        JetHR1StepEnv(**{"physics": "quasistatic", **options})


@pytest.mark.parametrize("options", [{"step": PAPER}, {"steps": SIDE}, {"step": {"swing": "left"}}])
def test_wrong_reset_options_are_refused(make_env: Any, options: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="step"):
        make_env(physics="quasistatic").reset(options=options)


@pytest.mark.parametrize("physics", PHYSICS)
def test_close_twice_and_pickle(make_env: Any, physics: str) -> None:
    env = make_env(physics=physics, reward="fitness", step=SIDE).unwrapped
    first = env.reset(seed=0)
    twin = pickle.loads(pickle.dumps(env))
    assert data_equivalence(twin.reset(seed=0), first, exact=True)
    assert data_equivalence(copy.deepcopy(env).reset(seed=0), first, exact=True)
    twin.close()
    env.close()
    env.close()


def test_spec_survives_json_and_plugs_in_by_module_name() -> None:
    env = gym.make(f"jet_gym:{ID}", physics="quasistatic")
    again = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))  # type: ignore[union-attr]
    assert np.array_equal(env.reset(seed=0)[0], again.reset(seed=0)[0])
    assert env.spec is not None
    assert env.spec.max_episode_steps == 500
    assert env.spec.reward_threshold == -11.3


def test_asynchronous_workers_that_are_spawned_find_the_environment(tmp_path: Path) -> None:
    code = f"""
import gymnasium as gym, numpy as np
if __name__ == "__main__":
    envs = gym.make_vec("jet_gym:{ID}", num_envs=2, vectorization_mode="async", physics="quasistatic",
                        vector_kwargs=dict(context="spawn"))
    observations, _ = envs.reset(seed=3)
    envs.step(np.zeros((2, 3), dtype=np.float32))
    single = gym.make("jet_gym:{ID}", physics="quasistatic")
    assert np.array_equal(observations[1], single.reset(seed=4)[0])
    envs.close()
    print("done")
"""
    script = tmp_path / "workers.py"
    script.write_text(code)
    command = [sys.executable, str(script)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert result.stdout.strip() == "done", result.stderr


@pytest.mark.parametrize("physics", PHYSICS)
def test_memory_stays_flat_over_resets(make_env: Any, physics: str) -> None:
    env = make_env(physics=physics)
    resets = 500 if physics == "bullet" else 5000

    def used() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * 4  # kB resident now

    for seed in range(resets // 5):
        env.reset(seed=seed)
    before = used()
    for seed in range(resets):
        env.reset(seed=seed)
        env.step(np.zeros(3)) if seed % 50 == 0 else None
    assert used() - before < 20_000  # kB
