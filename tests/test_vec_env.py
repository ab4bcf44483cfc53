"""The adapter through which Stable-Baselines3 sees the batch of environments."""

from __future__ import annotations

import numpy as np
import pytest
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.monitor import Monitor

import jet_gym  # noqa: F401
from agents.training.vec_env import StepVecEnv
from jet_gym.envs.choices import ChooseThrust
from jet_gym.errors import SettingsError


def test_the_adapter_shows_what_dummy_vec_env_shows() -> None:
    """Same seeds, same actions, over several episodes: the same numbers to the last bit."""
    ours = StepVecEnv(3, difficulty=0.7)
    theirs = make_vec_env(
        "JetHR1Step-v0", 3, env_kwargs={"physics": "quasistatic", "difficulty": 0.7}, wrapper_class=None
    )
    ours.seed(5), theirs.seed(5)
    assert np.array_equal(ours.reset(), theirs.reset())
    random, ended = np.random.default_rng(0), 0
    for _ in range(150):
        actions = random.uniform(-0.2, 0.2, (3, 3)).astype(np.float32)
        one, other = ours.step(actions), theirs.step(actions)
        for mine, its in zip(one[:3], other[:3], strict=True):
            assert np.array_equal(mine, its)
        for mine, its, over in zip(one[3], other[3], one[2], strict=True):
            if over:
                ended += 1
                assert np.array_equal(mine["terminal_observation"], its["terminal_observation"])
                assert mine["TimeLimit.truncated"] == its["TimeLimit.truncated"]
                assert mine["is_success"] == its["is_success"]
                assert mine["episode"]["r"] == pytest.approx(its["episode"]["r"], abs=1e-5)
                assert mine["episode"]["l"] == its["episode"]["l"]
    assert ended >= 6


def test_the_adapter_adds_up_the_terms_of_the_reward() -> None:
    envs = StepVecEnv(8)
    envs.reset()
    total = 0.0
    for _ in range(70):
        total += float(envs.step(np.zeros((8, 3), dtype=np.float32))[1].sum())
    noticed = envs.noticed()
    assert sum(noticed.values()) == pytest.approx(total / (70 * 8), rel=1e-5)
    assert envs.noticed() == {}


def test_the_adapter_takes_choices_of_the_thrust_as_the_wrapper_does() -> None:
    ours = StepVecEnv(2, chooses="thrust")
    theirs = make_vec_env("JetHR1Step-v0", 2, env_kwargs={"physics": "quasistatic"}, wrapper_class=ChooseThrust)
    ours.seed(5), theirs.seed(5)
    assert np.array_equal(ours.reset(), theirs.reset())
    random = np.random.default_rng(0)
    for _ in range(70):
        choices = random.uniform(-1.0, 0.2, (2, 3)).astype(np.float32)
        for mine, its in zip(ours.step(choices)[:3], theirs.step(choices)[:3], strict=True):
            assert np.array_equal(mine, its)


def test_the_adapter_answers_what_stable_baselines_asks() -> None:
    envs = StepVecEnv(2)
    assert envs.get_attr("num_envs", 0) == [2]
    assert envs.env_is_wrapped(Monitor) == [True, True]
    with pytest.raises(SettingsError):
        envs.set_attr("step", None)
    with pytest.raises(SettingsError):
        envs.env_method("render")
    envs.close()


def test_a_violation_costs_what_training_says() -> None:
    steps = [StepVecEnv(1, violation_cost=cost) for cost in (0.5, 5.5)]
    lowest = []
    for env in steps:
        env.seed(0)
        env.reset()
        _, rewards, _, _ = env.step(np.ones((1, 3), dtype=np.float32))
        lowest.append(float(rewards[0]))
    assert lowest[1] < lowest[0] - 4.0
