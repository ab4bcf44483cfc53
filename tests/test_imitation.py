"""What training begins with: the expert, its imitation, the scale of observations, the curriculum, what judges."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import ConvertCallback

import jet_gym  # noqa: F401
from agents import make_planner
from agents.policy import PolicyPlanner
from agents.sb3_policy import ThrustPolicy, network_of
from agents.training.callbacks import Curriculum
from agents.training.imitation import Imitation, ImitationSettings, expert_path
from agents.training.scaling import observation_scale
from agents.training.validation import TEST_SEED, VALIDATION_SEED, StepSet, drawn_steps
from agents.training.vec_env import StepVecEnv
from jet_gym.envs.jet_hr1_step import JetHR1StepEnv
from jet_gym.plan import Plan


def _policy(envs: StepVecEnv) -> dict[str, Any]:
    from agents.sb3_policy import ScaledObservation

    width = envs.observation_space.shape[0]
    scale = {"center": np.zeros(width), "scale": np.ones(width)}
    return {"net_arch": [32, 32], "features_extractor_class": ScaledObservation, "features_extractor_kwargs": scale}


def test_care_is_less_where_a_step_takes_hardly_any_thrust() -> None:
    step = next(step for step in drawn_steps(30, 500) if np.hypot(*step.landing[:2]) < 0.28)
    careful, light = expert_path(step, 3.0, 0.01), expert_path(step, 3.0, 0.01, relative_mu=1e-4)
    assert careful is not None
    assert light is not None
    fitness = [Plan.from_pelvis_path(step, path, planner="expert").total_fitness for path in (careful, light)]
    assert fitness[1] < 0.9 * fitness[0]


def test_the_expert_keeps_room_to_every_constraint() -> None:
    checked = 0
    for step in drawn_steps(6, 500):
        path = expert_path(step, 6.0)
        if path is None:
            continue
        checked += 1
        careful = Plan.from_pelvis_path(step, path, planner="expert")
        assert not careful.violated_points
        wobbly = path + 1e-4 * np.random.default_rng(0).uniform(-1.0, 1.0, path.shape)
        assert not Plan.from_pelvis_path(step, wobbly, planner="expert").violated_points
    assert checked >= 4


@pytest.mark.parametrize("policy", ["MlpPolicy", ThrustPolicy])
def test_imitation_brings_the_policy_near_the_expert(policy: str | type[ThrustPolicy]) -> None:
    """On steps that it did not imitate, where it acts by itself."""
    envs = StepVecEnv(4)
    model = PPO(policy, envs, policy_kwargs=_policy(envs), seed=0)
    steps = [step for step in drawn_steps(12, 900) if expert_path(step, 6.0) is not None]
    care = (6.0,) if policy == "MlpPolicy" else (3.0, 0.01, 3e-4)
    experts = [expert_path(step, *care) for step in steps]

    def distance() -> float:
        """Return how far the pelvis is from the expert's [m]; where the thrust is chosen, the thrust [N]."""
        plans = PolicyPlanner(model=network_of(model.policy)).plan_many(steps)
        if policy == "MlpPolicy":
            pairs = zip(plans, experts, strict=True)
            return float(np.mean([np.abs(plan.pelvis - expert).mean() for plan, expert in pairs]))
        careful = Plan.from_pelvis_paths(steps, experts, planner="expert")
        pairs = zip(plans, careful, strict=True)
        return float(np.mean([np.abs(plan.thrust - expert.thrust).mean() for plan, expert in pairs]))

    before, told = distance(), []
    settings = ImitationSettings(rounds=12, first_steps=60, steps_per_round=0, episodes=60)
    Imitation(model.policy, settings, 0, 100).run(lambda number, error: told.append((number, error)))
    assert distance() < 0.4 * before
    assert [number for number, _ in told] == list(range(1, 13))


def test_the_scale_is_that_of_what_gas_meets() -> None:
    center, scale = observation_scale(8, 42)
    env = JetHR1StepEnv(physics="quasistatic")
    met = []
    for seed in range(42, 50):
        observation, _ = env.reset(seed=seed)
        plan = make_planner("gas").plan(env.current_step)
        for pelvis in plan.pelvis:
            met.append(observation)
            observation, *_ = env.step(np.clip(env.action_to(pelvis), -1.0, 1.0))
    assert center == pytest.approx(np.mean(met, axis=0), abs=1e-3)
    varies = scale != 1.0
    assert varies.sum() >= 28
    assert scale[varies] == pytest.approx(np.std(met, axis=0)[varies], rel=1e-3)


def test_the_curriculum_raises_the_cost_of_violations_and_narrows_exploration() -> None:
    envs = StepVecEnv(4)
    model = PPO("MlpPolicy", envs, n_steps=8, batch_size=32, n_epochs=1, policy_kwargs=_policy(envs), seed=0)
    curriculum, seen = Curriculum((0.1, 0.001), (0.25, 0.75), 2.0, 320), []

    def note(*_: Any) -> bool:
        seen.append((model.num_timesteps, envs.get_attr("violation_cost")[0], float(model.policy.log_std.exp()[0])))
        return True

    model.learn(320, [curriculum, ConvertCallback(note)])
    costs = {steps: cost for steps, cost, _ in seen}
    assert costs[64] == 0.0
    assert costs[192] == pytest.approx(0.5 * 2.0, abs=0.21)
    assert costs[320] == 2.0
    deviations = [deviation for *_, deviation in seen]
    assert deviations[0] == pytest.approx(0.1)
    assert deviations == sorted(deviations, reverse=True)
    assert deviations[-1] < 0.0016


def test_the_plain_network_acts_like_the_trained_one() -> None:
    envs = StepVecEnv(4)
    model = PPO("MlpPolicy", envs, policy_kwargs=_policy(envs), seed=0)
    observations = envs.reset()
    expected, _ = model.predict(observations, deterministic=True)
    assert network_of(model.policy).act(observations) == pytest.approx(expected, abs=1e-6)
    other = PPO("MlpPolicy", envs, seed=0)
    with pytest.raises(TypeError, match="ScaledObservation"):
        network_of(other.policy)


def test_steps_of_training_validation_and_test_differ() -> None:
    sets = [drawn_steps(20, first) for first in (10_000_000, VALIDATION_SEED, TEST_SEED)]
    landings = {step.landing for steps in sets for step in steps}
    assert len(landings) == 60


def test_a_score_of_gas_against_itself_is_no_win() -> None:
    steps = StepSet.drawn(3, 77)
    score = steps.score_plans([make_planner("gas").plan(step) for step in steps.steps])
    assert score.wins == 0.0
    assert score.median_ratio == 1.0
    assert score.median_gap > 0.0
