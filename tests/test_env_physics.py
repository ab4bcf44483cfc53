"""``JetHR1Step-v0`` in PyBullet: physics that counts, frames, and what is said where there is none."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import data_equivalence
from stepping import replay

import jet_gym  # noqa: F401  (registers the environment)
from agents import make_planner
from jet_gym.courses import PAPER
from jet_gym.leg import opposite
from jet_gym.simulation.errors import BulletMissingError

ID = "JetHR1Step-v0"
SIDE = replace(PAPER.side, points=30)
FORWARD = replace(PAPER.forward, points=60)
PHYSICS = ("quasistatic", "bullet")


@pytest.mark.parametrize("reward", ["graded", "fitness"])
def test_the_two_physics_agree_while_nothing_slips_or_tips(make_env: Any, reward: str) -> None:
    """To 0.15 of a point at full thrust, to 0.3 at the first, the term `zmp` aside: on drawn steps too."""
    drawing = make_env(physics="quasistatic")
    steps = [SIDE, FORWARD]
    for seed in range(10):
        drawing.reset(seed=seed)
        steps.append(drawing.unwrapped.current_step)
    compared = 0
    for step in steps:
        plan = make_planner("gas").plan(step, seed=4)
        if plan.violated_points:
            continue
        rewards = []
        for physics in PHYSICS:
            results = replay(make_env(physics=physics, reward=reward), plan)
            assert results[-1][4]["is_success"]
            rewards.append(np.array([result[1] - result[4]["reward_terms"].get("zmp", 0.0) for result in results]))
        difference = np.abs(rewards[0] - rewards[1])
        assert difference[0] <= 0.3
        assert difference[1:].max() <= 0.15
        compared += 1
    assert compared >= 10


def test_two_live_environments_of_different_physics_do_not_disturb_each_other(make_env: Any) -> None:
    alone = make_env(physics="bullet")
    expected = [alone.reset(seed=1), *(alone.step(np.zeros(3)) for _ in range(4))]
    bullet, model, other = make_env(physics="bullet"), make_env(physics="quasistatic"), make_env(physics="bullet")
    results = [bullet.reset(seed=1)]
    model.reset(seed=2), other.reset(seed=3)
    for k in range(4):
        results.append(bullet.step(np.zeros(3)))
        model.step(np.zeros(3))
        if k < 2:
            other.step(np.full(3, 0.2))
        if k == 2:
            other.close()
    assert data_equivalence(expected, results, exact=True)


@pytest.mark.parametrize("physics", PHYSICS)
def test_frames_show_what_happens_and_change_nothing(make_env: Any, physics: str) -> None:
    seen, unseen = (
        make_env(physics=physics, render_mode="rgb_array", step=SIDE),
        make_env(physics=physics, step=SIDE),
    )
    seen.reset(seed=0), unseen.reset(seed=0)
    frames = [seen.render()]
    for action in (np.array([0.0, -0.5, -0.3]), np.array([0.3, 0.2, -0.2])):
        assert data_equivalence(seen.step(action), unseen.step(action), exact=True)
        frames.append(seen.render())
    for frame in frames:
        assert frame.shape == (480, 640, 3)
        assert frame.dtype == np.uint8
    assert (frames[0] != frames[1]).mean() > 0.01
    with pytest.warns(UserWarning, match="render_mode"):
        unseen.unwrapped.render()


def test_a_window_without_a_display_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pybullet")
    from jet_gym.errors import JetGymError

    monkeypatch.delenv("DISPLAY", raising=False)
    env = gym.make(ID, render_mode="human")
    with pytest.raises(JetGymError, match=r"[Dd]isplay"):
        env.reset(seed=0)
    env.close()


def test_the_paper_motions_stand_in_physics_with_the_zmp_in_the_foot(make_env: Any) -> None:
    for step in (PAPER.side, PAPER.forward):
        env = make_env(physics="bullet")
        results = replay(env, make_planner("gas").plan(step))
        infos = [result[4] for result in results]
        assert infos[-1]["is_success"] is True
        leg = step.robot.leg(opposite(step.swing))
        x_min, x_max, y_min, y_max = leg.sole_rectangle
        zmp = np.array([info["measured_zmp"] for info in infos]) - np.array(step.support[:2])
        assert (zmp >= [x_min, y_min]).all()
        assert (zmp <= [x_max, y_max]).all()
        assert max(info["tilt"] for info in infos) < np.radians(3.0)
        torques = np.abs([info["joint_torques"] for info in infos]).max(axis=0)
        assert (torques <= 0.95 * step.robot.effort).all()  # the servos are not at their limit
        assert max(info["measured_thrust"] for info in infos) < 22.0


@pytest.mark.parametrize("seed", [8, 35])
def test_a_foot_that_lifts_off_costs_nothing(make_env: Any, seed: int) -> None:
    """The swing foot carries up to 10 N until it leaves the ground; that is no fault of the posture."""
    env, quasistatic = make_env(), make_env(physics="quasistatic")
    quasistatic.reset(seed=seed)
    step = quasistatic.unwrapped.current_step
    plan = make_planner("gas").plan(step)
    assert plan.violated_points == ()
    env.reset(options={"step": step})
    for pelvis in plan.pelvis[:3]:
        _, _, _, _, info = env.step(env.unwrapped.action_to(pelvis))
        assert info["reward_terms"]["zmp"] == 0.0


def test_a_pelvis_that_is_thrown_about_costs(make_env: Any) -> None:
    """Jerks take the measured ZMP to the sole's edge where that of the model stays inside."""
    env, quasistatic = (
        make_env(step=PAPER.side, time_per_point=0.05),
        make_env(step=PAPER.side, physics="quasistatic"),
    )
    plan = make_planner("gas").plan(PAPER.side)
    terms = []
    for each in (env, quasistatic):
        each.reset(seed=0)
        jerks = [[0.0] * 3] * 10 + [[1.0, 0.0, 0.0]] * 3 + [[-1.0, 0.0, 0.0]] * 6 + [[1.0, 0.0, 0.0]] * 6
        actions = [each.unwrapped.action_to(plan.pelvis[0]), *np.array(jerks)]
        terms.append([each.step(action)[4]["reward_terms"]["zmp"] for action in actions])
    measured, modelled = np.array(terms)
    assert measured[modelled == 0.0].min() < -0.5


def test_a_fall_ends_the_episode_and_costs_what_was_left(make_env: Any) -> None:
    """Pelvis far beyond the support foot: no thrust of the fan can hold that."""
    env = make_env(physics="bullet", step=FORWARD)
    env.reset(seed=0)
    total, terminated, points = 0.0, False, 0
    while not terminated:
        _, reward, terminated, _, info = env.step(np.array([1.0, -1.0, 0.0]))
        total, points = total + reward, points + 1
    assert info["fall"]
    assert info["is_success"] is False
    assert points < FORWARD.points
    assert info["reward_terms"]["fall"] == pytest.approx(
        env.unwrapped.model.worst_reward * (FORWARD.points - points + 1)
    )
    assert env.unwrapped.model.worst_reward == pytest.approx(-41.1, abs=0.05)
    with pytest.raises(ResetNeeded):
        env.unwrapped.step(np.zeros(3))


def test_without_pybullet_making_it_says_in_a_sentence_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pybullet", None)
    with pytest.raises(
        BulletMissingError, match=r"pip install 'jet-gym\[bullet\]'.*physics='quasistatic'"
    ) as caught:
        gym.make(ID)
    assert "\n" not in str(caught.value)
    env = gym.make(ID, physics="quasistatic")
    env.reset(seed=0)
    assert np.isfinite(env.step(np.zeros(3, dtype=np.float32))[1])
