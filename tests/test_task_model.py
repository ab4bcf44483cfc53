"""The task without its episodes: which actions lead where."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from jet_gym.task.drawing import draw_random_steps
from jet_gym.task.lanes import Lanes
from jet_gym.task.model import TaskModel
from jet_gym.task.transition import Transition


def test_the_actions_to_a_place_move_the_pelvis_there() -> None:
    """With either swing leg, in some of the lanes, at the first swing point and at later ones side by side."""
    task, steps, generator = TaskModel(), draw_random_steps(8, seed=2), np.random.default_rng(0)
    assert {step.swing for step in steps} == {"left", "right"}
    lanes, transition = Lanes(8), Transition(8)
    for lane, step in enumerate(steps):
        lanes.begin(np.array([lane]), step)
    for selected in (np.array([6, 1, 3]), np.arange(8), np.arange(8)):
        ranges = np.where(lanes.point[selected] == 0, task.settings.first_range, task.settings.later_range)
        places = lanes.pelvis[selected] + generator.uniform(-1.0, 1.0, (len(selected), 3)) * ranges[:, None]
        actions, others = np.zeros((8, 3)), lanes.pelvis.copy()
        actions[selected] = task.actions_to(lanes, selected, places)
        task.advance(lanes, actions, selected, transition)
        np.testing.assert_allclose(lanes.pelvis[selected], places, rtol=0.0, atol=1e-15)
        untouched = np.setdiff1d(np.arange(8), selected)
        np.testing.assert_array_equal(lanes.pelvis[untouched], others[untouched])


def test_a_place_out_of_the_search_range_takes_an_action_beyond_one() -> None:
    task, lanes = TaskModel(), Lanes(1)
    (step,) = draw_random_steps(1, seed=2)
    lanes.begin(np.array([0]), step)
    away = np.array([0.0, 0.0, 2.0 * task.settings.first_range])
    (action,) = task.actions_to(lanes, np.array([0]), step.nominal_pelvis[None] + away)
    np.testing.assert_allclose(action, [0.0, 0.0, 2.0])


def test_the_environment_takes_the_same_action_to_a_place() -> None:
    env = gym.make("JetHR1Step-v0", physics="quasistatic")
    inner, task, away = env.unwrapped, TaskModel(), np.array([0.03, -0.02, 0.01])
    for step in draw_random_steps(4, seed=2):
        env.reset(options={"step": step})
        lanes, place = Lanes(1), step.nominal_pelvis + away
        lanes.begin(np.array([0]), step)
        (action,) = task.actions_to(lanes, np.array([0]), place[None])
        np.testing.assert_array_equal(inner.action_to(place), action)  # type: ignore[attr-defined]
