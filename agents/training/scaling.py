"""The scale of what is observed, from what GAS meets on some steps."""

from __future__ import annotations

import numpy as np

from agents.network import Array32
from agents.planner import make_planner
from agents.training.validation import drawn_steps
from jet_gym.task.lanes import Lanes
from jet_gym.task.model import TaskModel
from jet_gym.task.transition import Transition

_LEAST = 1e-3  # a component that varies by less is left as it is


def observation_scale(count: int, first_seed: int) -> tuple[Array32, Array32]:
    """Return mean and standard deviation of each component along GAS plans.

    Args:
        count: Number of steps.
        first_seed: Seed of the first; they follow each other.

    Returns:
        Mean (C,) and standard deviation (C,), 1 where a component does not vary.
    """
    task, steps = TaskModel(), drawn_steps(count, first_seed)
    paths = [make_planner("gas").plan(step).pelvis for step in steps]
    lanes, transition, seen = Lanes(count), Transition(count), task.empty_observations(count)
    for lane, step in enumerate(steps):
        lanes.begin(np.array([lane]), step)
    met = []
    for point in range(int(lanes.points.max())):
        acting = np.flatnonzero(lanes.points > point)
        task.observe(lanes, acting, seen)
        met.append(seen[acting])
        actions = np.zeros((count, 3))
        actions[acting] = task.actions_to(lanes, acting, np.array([paths[lane][point] for lane in acting]))
        task.advance(lanes, actions, acting, transition)
    observations = np.concatenate(met)
    deviation = observations.std(axis=0)
    return observations.mean(axis=0), np.where(deviation > _LEAST, deviation, 1.0).astype(np.float32)
