"""The policy as a planner: what ships, what a user brings, and how it is refined."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from agents import make_planner
from agents.network import PolicyNetwork
from agents.policy import SHIPPED_POLICY, PolicyPlanner, load_policy
from agents.training.validation import drawn_steps
from jet_gym.balance import BalanceSettings
from jet_gym.courses import PAPER
from jet_gym.errors import PolicyFileError, SettingsError
from jet_gym.fitness import FitnessSettings
from jet_gym.task.drawing import draw_random_steps

UNSEEN = 3_000_000_000  # seeds that neither training nor the tables use


@pytest.fixture(scope="module")
def steps() -> list:
    return drawn_steps(40, UNSEEN)


def test_the_shipped_policy_beats_gas_as_its_card_says(steps: list) -> None:
    """With room for the small number of steps; the card's numbers come from hundreds."""
    card = json.loads((SHIPPED_POLICY.parent / "about.json").read_text())
    gas = np.array([make_planner("gas").plan(step).total_fitness for step in steps])
    policy = np.array([plan.total_fitness for plan in make_planner("policy").plan_many(steps)])
    refined = np.array([plan.total_fitness for plan in make_planner("policy", refine=16).plan_many(steps)])
    promised = card["test"]["policy"]["wins"]
    assert (policy < gas).mean() >= promised - 0.2
    assert (refined < gas).mean() >= card["test"]["policy+refine"]["wins"] - 0.15
    assert (refined <= policy + 1e-6).all()


def test_the_shipped_files_are_small_and_tell_the_same() -> None:
    files = list(SHIPPED_POLICY.parent.iterdir())
    assert sum(file.stat().st_size for file in files) < 1_000_000
    card = json.loads((SHIPPED_POLICY.parent / "about.json").read_text())
    assert card["sha256"] == PolicyNetwork.load(SHIPPED_POLICY).sha256
    assert (SHIPPED_POLICY.parent / "README.md").read_text().strip()


def test_the_stable_baselines_model_acts_like_the_plain_network() -> None:
    network = PolicyNetwork.load(SHIPPED_POLICY)
    with pytest.raises(PolicyFileError, match="trust"):
        load_policy(SHIPPED_POLICY.with_name("model.zip"))
    pytest.importorskip("stable_baselines3")
    trusted = load_policy(SHIPPED_POLICY.with_name("model.zip"), trust=True)
    env = gym.make("JetHR1Step-v0", physics="quasistatic")
    observations = np.stack([env.reset(seed=seed)[0] for seed in range(5)])
    assert np.allclose(trusted.act(observations), network.act(observations), atol=1e-6)


def test_the_stable_baselines_model_predicts_actions_of_the_plain_environment() -> None:
    """Whatever it chooses inside: a script that knows nothing of that uses it as any other model."""
    sb3 = pytest.importorskip("stable_baselines3")
    model = sb3.PPO.load(SHIPPED_POLICY.with_name("model.zip"), device="cpu")
    network = PolicyNetwork.load(SHIPPED_POLICY)
    env = gym.make("JetHR1Step-v0", physics="quasistatic")
    observation, _ = env.reset(seed=4)
    total, terminated = 0.0, False
    while not terminated:
        action, _ = model.predict(observation, deterministic=True)
        assert action == pytest.approx(network.act(observation[None])[0], abs=1e-5)
        observation, reward, terminated, _, info = env.step(action)
        total += float(reward)
    assert info["is_success"]


def test_a_plan_is_what_the_policy_does_as_an_agent(steps: list) -> None:
    network = PolicyNetwork.load(SHIPPED_POLICY)
    env = gym.make("JetHR1Step-v0", physics="quasistatic")
    for step in steps[:3]:
        plan = make_planner("policy").plan(step)
        observation, _ = env.reset(options={"step": step})
        for point in range(step.points):
            observation, _, _, _, info = env.step(network.act(observation[None])[0])
            assert info["pelvis"] == pytest.approx(plan.pelvis[point], abs=1e-6)
            assert info["fitness"] == pytest.approx(plan.fitness[point], rel=1e-3)


def test_many_plans_at_once_are_those_of_one_at_a_time_but_for_rounding(steps: list) -> None:
    """Matrix products round by their size; between candidates that are worth the same, that may decide."""
    alone, refined = make_planner("policy"), make_planner("policy", refine=8)
    for step, plan in zip(steps[:5], alone.plan_many(steps[:5]), strict=True):
        assert alone.plan(step).pelvis == pytest.approx(plan.pelvis, abs=1e-6)
    for step, plan in zip(steps[:5], refined.plan_many(steps[:5]), strict=True):
        assert refined.plan(step).pelvis == pytest.approx(plan.pelvis, abs=1e-3)
        assert refined.plan(step).total_fitness == pytest.approx(plan.total_fitness, rel=1e-3)
    assert alone.plan_many([]) == refined.plan_many([]) == []


def test_between_the_points_that_it_knows_the_policy_keeps_its_balance() -> None:
    """With 180 points a path drawn straight between its 60 would leave the edge polygon."""
    plan = make_planner("policy").plan(PAPER.forward)
    assert len(plan.pelvis) == PAPER.forward.points > 60
    assert not plan.violated_points


def test_a_mirrored_step_gets_the_mirrored_plan() -> None:
    left = PAPER.side
    right = replace(left, swing="right", start=_mirrored(left.start), landing=_mirrored(left.landing),
                    support=_mirrored(left.support))  # fmt: skip
    ours, theirs = make_planner("policy").plan(left), make_planner("policy").plan(right)
    assert ours.pelvis * [1.0, -1.0, 1.0] == pytest.approx(theirs.pelvis, abs=1e-5)


def _mirrored(position: tuple[float, float, float]) -> tuple[float, float, float]:
    return position[0], -position[1], position[2]


def test_other_settings_reach_the_plan() -> None:
    step = replace(PAPER.side, points=20)
    heavier = FitnessSettings(thrust_weight=20.0)
    plan = make_planner("policy", fitness=heavier).plan(step)
    assert plan.fitness.sum() > make_planner("policy").plan(step).fitness.sum()
    assert make_planner("policy", balance=BalanceSettings(thrust_model="least"), refine=4).plan(step).planner == (
        "policy+refine"
    )


@pytest.mark.parametrize("name", ["policy", "policy+refine"])
def test_a_plan_says_whether_it_was_refined(name: str) -> None:
    step = replace(PAPER.side, points=20)
    assert make_planner(name, refine=0).plan(step).planner == "policy"
    assert make_planner(name, refine=4).plan(step).planner == "policy+refine"


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"refine": 1}, SettingsError),
        ({"refine": -3}, SettingsError),
        ({"refine": 2.5}, SettingsError),
        ({"refine": True}, SettingsError),
        ({"refine": "16"}, SettingsError),
        ({"sweeps": 0}, SettingsError),
        ({"model": "missing.npz"}, PolicyFileError),
        ({"model": "missing.zip"}, PolicyFileError),
        ({"model": "missing.zip", "trust": True}, PolicyFileError),
        ({"depth": 3}, SettingsError),
    ],
)
def test_what_makes_no_sense_is_refused(options: dict, error: type[Exception]) -> None:
    with pytest.raises(error):
        make_planner("policy", **options)


def test_a_policy_of_ones_own_is_taken_by_its_path(tmp_path: Path) -> None:
    network = PolicyNetwork.load(SHIPPED_POLICY)
    layers = tuple((0.0 * weights, 0.0 * biases) for weights, biases in network.layers)
    lazy = replace(network, layers=layers, chooses="pelvis")
    lazy.save(tmp_path / "lazy.npz")
    plan = PolicyPlanner(model=tmp_path / "lazy.npz").plan(replace(PAPER.side, points=5))
    assert (plan.pelvis == PAPER.side.nominal_pelvis).all()


def test_where_neither_its_own_path_nor_that_of_gas_can_be_mended_that_of_ga_is() -> None:
    step = draw_random_steps(16, seed=21)[15]
    assert make_planner("policy").plan(step).violated_points
    assert not make_planner("policy", refine=16).plan(step).violated_points
