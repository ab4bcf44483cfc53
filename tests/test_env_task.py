"""The task that ``JetHR1Step-v0`` states: what is rewarded and what is observed, as its documentation says."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from stepping import replay

import jet_gym  # noqa: F401  (registers the environment)
from agents import make_planner
from jet_gym import Step
from jet_gym.balance import BalanceSettings
from jet_gym.courses import PAPER
from jet_gym.posture import evaluate_postures
from jet_gym.task.observation import COMPONENTS
from jet_gym.task.settings import REWARD_TERMS

SIDE = replace(PAPER.side, points=30)
FORWARD = replace(PAPER.forward, points=60)
PHYSICS = ("quasistatic", "bullet")


@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize("step", [SIDE, FORWARD], ids=["side", "forward"])
def test_replaying_a_gas_plan_gives_its_fitness_point_for_point(make_env: Any, physics: str, step: Step) -> None:
    plan = make_planner("gas").plan(step)
    env = make_env(physics=physics, reward="fitness")
    results = replay(env, plan)
    infos = [result[4] for result in results]
    assert np.allclose([info["fitness"] for info in infos], plan.fitness, atol=1e-9, rtol=0.0)
    assert np.allclose([info["thrust"] for info in infos], plan.thrust, atol=1e-9, rtol=0.0)
    assert np.allclose([info["joint_positions"] for info in infos], plan.joint_positions, atol=1e-9)
    assert [info["violations"] for info in infos] == list(plan.violations)
    assert len(results) == step.points
    assert infos[-1]["is_success"] is (plan.violated_points == ())
    if physics == "quasistatic":
        scale = env.unwrapped.model.fitness_scale
        assert sum(result[1] for result in results) == pytest.approx(-plan.total_fitness / scale)


@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize("reward", ["graded", "fitness"])
def test_the_reward_is_the_sum_of_its_named_terms(make_env: Any, physics: str, reward: str) -> None:
    env = make_env(physics=physics, reward=reward)
    env.reset(seed=3)
    for _ in range(5):
        _, total, terminated, _, info = env.step(env.action_space.sample())
        assert total == pytest.approx(sum(info["reward_terms"].values()))
        assert all(term <= 0.0 for term in info["reward_terms"].values())
        if reward == "graded":
            assert set(info["reward_terms"]) == set(REWARD_TERMS)
        if terminated:
            break


def test_graded_reward_ranks_plans_as_the_fitness_does_where_it_matters(make_env: Any) -> None:
    """The plan that is best under one form is best under the other, with and without violating plans among them."""
    plans = [make_planner(name).plan(FORWARD, seed=seed) for name in ("gas", "ga", "gaex") for seed in range(3)]
    returns = []
    for reward in ("graded", "fitness"):
        env = make_env(physics="quasistatic", reward=reward)
        returns.append([sum(result[1] for result in replay(env, plan)) for plan in plans])
    clean = [i for i, plan in enumerate(plans) if not plan.violated_points]
    assert 0 < len(clean) < len(plans)
    assert np.argmax(returns[0]) == np.argmax(returns[1])
    assert np.argmax(returns[0]) in clean
    assert np.allclose(np.array(returns[0])[clean], np.array(returns[1])[clean])


def test_graded_penalties_grow_with_what_is_violated(make_env: Any) -> None:
    env = make_env(physics="quasistatic")
    costs = []
    for depth in (0.05, 0.5, 0.75, 1.0):
        env.reset(seed=0, options={"step": SIDE})
        costs.append(env.step(np.array([0.0, 0.0, depth]))[4]["reward_terms"]["reach"])
    assert costs[0] == 0.0
    assert 0.0 > costs[1] > costs[2] > costs[3] >= -6.0


@pytest.mark.parametrize("physics", PHYSICS)
def test_observations_are_within_bounds_for_wild_actions(make_env: Any, physics: str) -> None:
    env = make_env(physics=physics)
    env.action_space.seed(0)
    for seed in range(6 if physics == "bullet" else 40):
        observation, _ = env.reset(seed=seed)
        terminated = False
        while not terminated:
            assert env.observation_space.contains(observation)
            assert np.isfinite(observation).all()
            observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
            assert isinstance(reward, float)
            assert isinstance(terminated, bool)
            assert truncated is False
            assert np.isfinite(reward)
        assert isinstance(info["is_success"], bool)


def test_a_right_step_is_seen_and_done_as_its_mirror_image(make_env: Any) -> None:
    def mirrored(point: tuple[float, float, float]) -> tuple[float, float, float]:
        return point[0], -point[1], point[2]

    left = Step("left", (0.05, 0.12, 0.0), (0.3, 0.25, 0.03), (0.0, -0.1125, 0.0), points=12)
    right = Step("right", *(mirrored(p) for p in (left.start, left.landing, left.support)), points=12)
    ours, theirs = make_env(physics="quasistatic", step=left), make_env(physics="quasistatic", step=right)
    assert np.allclose(ours.reset(seed=0)[0], theirs.reset(seed=0)[0], atol=1e-6)
    generator = np.random.default_rng(0)
    for _ in range(12):
        action = generator.uniform(-0.5, 0.5, 3)
        mine, other = ours.step(action), theirs.step(action)
        assert np.allclose(mine[0], other[0], atol=1e-5)
        assert mine[1] == pytest.approx(other[1], abs=1e-9)
        assert mine[4]["pelvis"] == pytest.approx(other[4]["pelvis"] * [1.0, -1.0, 1.0])


def test_observations_are_what_their_table_says(make_env: Any) -> None:
    """Row by row, from the posture that the pelvis has if it stays, mirrored for a right step."""
    for step in (SIDE, FORWARD):
        side = 1.0 if step.swing == "left" else -1.0
        mirror, support = np.array([1.0, side, 1.0]), np.array(step.support)
        path, last, most = step.swing_sole, step.points - 1, step.robot.max_thrust
        env = make_env(physics="quasistatic", step=step)
        observation, _ = env.reset(seed=0)
        pelvis, thrust = step.nominal_pelvis, 0.0
        for k in range(5):
            staying = evaluate_postures(step.robot, step.swing, path[k], step.support, pelvis)
            expected = np.concatenate(
                [
                    [k / last, 1.0 if k == 0 else 0.0],
                    (pelvis - support) * mirror,
                    (path[k] - support) * mirror,
                    (path[k + 1] - path[k]) * mirror / 0.1,
                    (path[k + 3] - path[k]) * mirror / 0.1,
                    (path[-1] - support) * mirror,
                    (staying.center_of_mass[:2] - support[:2]) * mirror[:2],
                    [staying.thrust / most, side * staying.edge_angle / BalanceSettings.edge_tolerance],
                ]
            )
            assert np.allclose(observation[:21], expected, atol=2e-6)
            knees = staying.joint_positions[[3, 9] if step.swing == "left" else [9, 3]]
            if staying.out_of_reach == 0.0:
                assert np.allclose(observation[21:23], np.cos(knees / 2.0), atol=1e-6)  # thigh as long as shank
            assert np.allclose(observation[23:25], [(last - k) / 30.0, np.clip(thrust / most, 0.0, 1.0)])
            from_zmp = staying.center_of_mass[:2] - staying.assigned_zmp
            line = path[k][:2] - staying.assigned_zmp
            to_line = line * (from_zmp @ line) / (line @ line) - from_zmp
            expected = np.concatenate([from_zmp, to_line]) * np.tile(mirror[:2], 2) / 0.01
            assert np.allclose(observation[25:29], np.clip(expected, -20.0, 20.0), atol=1e-4)
            assert np.array_equal(observation[29:], [0.0, 0.0])
            observation, _, _, _, info = env.step(np.array([0.1, -0.2, -0.3]))
            pelvis, thrust = info["pelvis"], info["thrust"]


def test_every_component_is_documented_in_the_class(make_env: Any) -> None:
    from jet_gym.envs.jet_hr1_step import JetHR1StepEnv

    text = JetHR1StepEnv.__doc__ or ""
    for section in (
        "Description", "Action Space", "Observation Space", "Rewards", "Starting State", "Episode Termination",
        "Arguments", "Info", "Version History",
    ):  # fmt: skip
        assert f"## {section}" in text
    assert f"`Box(float32, ({len(COMPONENTS)},))`" in text
    assert all(f"`{term}`" in text for term in REWARD_TERMS)
    env = make_env(physics="bullet")
    env.reset(seed=0)
    info = env.step(np.zeros(3, dtype=np.float32))[4]
    assert all(f"`{key}`" in text for key in info)


def test_the_reward_threshold_is_what_gas_reaches(make_env: Any) -> None:
    """On the seeds that its comment names, a quarter of them here."""
    env = make_env(physics="quasistatic")
    returns = []
    for seed in range(50):
        env.reset(seed=seed)
        plan = make_planner("gas").plan(env.unwrapped.current_step)
        returns.append(sum(env.step(env.unwrapped.action_to(pelvis))[1] for pelvis in plan.pelvis))
    spread = np.std(returns) / np.sqrt(len(returns))
    assert abs(np.mean(returns) - env.spec.reward_threshold) < 3.0 * spread
