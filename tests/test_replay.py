"""Failed steps are drawn again."""

from __future__ import annotations

import numpy as np

from agents.training.replay import ReplayingDrawer
from agents.training.vec_env import StepVecEnv
from jet_gym.task.lanes import Lanes
from jet_gym.task.model import TaskModel


def test_steps_on_which_the_policy_failed_are_drawn_again() -> None:
    lanes, drawer = Lanes(6), ReplayingDrawer(TaskModel().drawer, share=1.0, seed=3)
    generators = [np.random.default_rng(seed) for seed in range(6)]
    drawer.draw(lanes, np.arange(6), generators)
    first = lanes.array.copy()
    lanes.violated[[1, 4]] = 1.0
    lanes.point[:], lanes.pelvis[:] = 30, 0.0
    drawer.draw(lanes, np.arange(6), generators)
    for row in lanes.array:
        assert any(np.array_equal(row, first[lane]) for lane in (1, 4))


def test_without_a_failure_or_a_share_steps_are_drawn_as_ever() -> None:
    for share, failed in ((1.0, 0.0), (0.0, 1.0)):
        lanes, plain = Lanes(3), Lanes(3)
        drawers = (ReplayingDrawer(TaskModel().drawer, share), lanes), (TaskModel().drawer, plain)
        for drawer, drawn in drawers:
            generators = [np.random.default_rng(seed) for seed in range(3)]
            for _ in range(2):
                drawer.draw(drawn, np.arange(3), generators)
                drawn.violated[:] = failed
        np.testing.assert_array_equal(lanes.landing, plain.landing)


def test_replayed_steps_go_through_the_batch() -> None:
    env = StepVecEnv(4, replay=1.0)
    env.seed(0)
    env.reset()
    begun = env.batch._lanes.landing.copy()
    over = np.zeros(4, dtype=bool)
    while not over.any():
        _, _, over, _ = env.step(np.ones((4, 3), dtype=np.float32))  # straight up: beyond reach
    (again,) = np.flatnonzero(over)[:1]
    assert any(np.array_equal(env.batch._lanes.landing[again], landing) for landing in begun)
    env.close()
