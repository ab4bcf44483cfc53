"""Choosing the thrust: what the model says the chosen posture is, and back."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from agents import make_planner
from jet_gym import jet_hr1
from jet_gym.constraints import EDGE_POLYGON, REACH, THRUST, ZMP
from jet_gym.envs.choices import ChooseThrust
from jet_gym.task.drawing import draw_random_steps
from jet_gym.task.lanes import Lanes
from jet_gym.task.model import default_task
from jet_gym.task.observation import HIGH, LOW
from jet_gym.task.transition import Transition
from jet_gym.utils.arrays import Array

COUNT, MAX_THRUST = 40, jet_hr1().max_thrust


class OnThePathOfGas:
    """Lanes along the plans of GAS, both legs among them, with the actions that GAS takes next."""

    def __init__(self) -> None:
        self.task, self.steps = default_task(), draw_random_steps(COUNT, seed=3)
        self.plans = [make_planner("gas").plan(step) for step in self.steps]
        self.lanes, self.transition = Lanes(COUNT), Transition(COUNT)
        for lane, step in enumerate(self.steps):
            self.lanes.begin(np.array([lane]), step)
        self.all = np.arange(COUNT)

    def observe(self) -> Array:
        observations = self.task.empty_observations(COUNT)
        self.task.observe(self.lanes, self.all, observations)
        return observations

    def actions(self, point: int) -> Array:
        reach = self.task.settings.first_range if point == 0 else self.task.settings.later_range
        moves = np.array([plan.pelvis[point] for plan in self.plans]) - self.lanes.pelvis
        moves[:, 1] *= self.lanes.side
        return moves / reach

    def advance(self, actions: Array) -> None:
        self.task.advance(self.lanes, np.asarray(actions, dtype=np.float64), self.all, self.transition)


@pytest.fixture
def walk() -> OnThePathOfGas:
    return OnThePathOfGas()


def test_what_an_action_chooses_leads_back_to_it(walk: OnThePathOfGas) -> None:
    for point in range(12):
        observations, actions = walk.observe(), walk.actions(point)
        choices = walk.task.choices_of_actions(observations, actions)
        found = walk.task.actions_of_choices(observations, choices)
        walk.advance(actions)
        chosen = walk.transition.thrust > 0.06  # below, the fan idles, which is not quite the same
        reach = 0.150 if point == 0 else 0.025
        assert chosen.sum() > COUNT / 4
        assert np.abs(found - actions)[chosen].max() * reach < 2e-3  # [m]
        assert np.median(np.abs(found - actions)[chosen]) * reach < 1e-5


@given(
    st.integers(0, 10_000),
    st.integers(0, 20),
    arrays(np.float32, (COUNT, 3), elements=st.floats(-1.0, 1.0, width=32)),
)
@settings(max_examples=30, deadline=None)
def test_every_choice_within_reach_keeps_thrust_and_edge_polygon(seed: int, point: int, choices: Array) -> None:
    task, lanes, transition = default_task(), Lanes(COUNT), Transition(COUNT)
    for lane, step in enumerate(draw_random_steps(COUNT, seed)):
        lanes.begin(np.array([lane]), step)
    every, observations = np.arange(COUNT), task.empty_observations(COUNT)
    lanes.point[:] = np.minimum(point, lanes.points - 1)
    task.observe(lanes, every, observations)
    actions = task.actions_of_choices(observations, choices)
    task.advance(lanes, actions.astype(np.float64), every, transition)
    flags = transition.violations.astype(int)
    done = (np.abs(actions[:, :2]).max(axis=1) < 1.0) & (flags & REACH == 0)
    assert (flags[done] & (THRUST | EDGE_POLYGON | ZMP) == 0).all()


def test_the_thrust_is_what_was_chosen(walk: OnThePathOfGas) -> None:
    """Where the pelvis comes so far in one action, and the legs allow it."""
    choices = np.zeros((COUNT, 3), dtype=np.float32)
    choices[:, 0] = np.linspace(-0.6, 0.3, COUNT)
    actions = walk.task.actions_of_choices(walk.observe(), choices)
    walk.advance(actions)
    done = (np.abs(actions).max(axis=1) < 1.0) & (walk.transition.violations == 0)
    asked = MAX_THRUST * ((choices[:, 0].astype(float) + 0.7) / 1.7) ** 2
    assert done.sum() > COUNT / 2
    assert (np.abs(walk.transition.thrust - asked) < 0.01)[done].mean() > 0.8


def test_places_across_are_the_polygons_edges(walk: OnThePathOfGas) -> None:
    observations = walk.observe()
    for aside, sign in ((-1.0, -1.0), (0.0, 0.0), (1.0, 1.0)):
        choices = np.tile(np.array([0.0, aside, 0.0], dtype=np.float32), (COUNT, 1))
        other = OnThePathOfGas.__new__(OnThePathOfGas)
        other.task, other.lanes, other.transition, other.all = walk.task, Lanes(COUNT), Transition(COUNT), walk.all
        other.lanes.array[:] = walk.lanes.array
        other.advance(walk.task.actions_of_choices(observations, choices))
        fine = other.transition.violations == 0
        angles = np.degrees(other.transition.edge_angle * other.lanes.side)[fine]
        assert fine.sum() > COUNT / 2
        assert angles == pytest.approx(sign * 4.75, abs=0.2)


def test_an_idle_fan_hardly_blows(walk: OnThePathOfGas) -> None:
    choices = np.tile(np.array([-0.9, 0.0, 0.0], dtype=np.float32), (COUNT, 1))
    walk.advance(walk.task.actions_of_choices(walk.observe(), choices))
    idle = np.abs(walk.transition.thrust - 0.002) < 1e-4
    fine = walk.transition.violations == 0
    assert (idle & fine).sum() > 0.8 * COUNT  # from a wide stance the pelvis does not come so far in one action


def test_the_thrust_yields_where_the_legs_need_it(walk: OnThePathOfGas) -> None:
    """With the swing foot far away the legs do not reach from where an idle fan would have the pelvis."""
    far = np.array([np.hypot(*step.landing[:2]) > 0.6 for step in walk.steps])
    walk.lanes.point[:] = walk.lanes.points - 1
    for lane, plan in enumerate(walk.plans):
        walk.lanes.pelvis[lane] = plan.pelvis[-1]
    choices = np.tile(np.array([-1.0, 0.0, 0.0], dtype=np.float32), (COUNT, 1))
    walk.advance(walk.task.actions_of_choices(walk.observe(), choices))
    thrust, violations = walk.transition.thrust[far], walk.transition.violations[far]
    gas = np.array([plan.thrust[-1] for plan in walk.plans])[far]
    assert far.sum() > 2
    assert (violations == 0).mean() > 0.8
    assert (thrust > 1.0).all()
    assert (thrust < gas + 2.0)[violations == 0].all()  # GAS places the centre of mass aside, which takes less


@given(arrays(np.float32, (3, len(LOW)), elements=st.floats(0.0, 1.0, width=32)))
@settings(deadline=None)
def test_whatever_is_observed_the_action_is_in_the_box(shares: Array) -> None:
    observations = LOW + shares * (HIGH - LOW)
    for choice in (-1.0, 0.0, 1.0):
        actions = default_task().actions_of_choices(observations, np.full((3, 3), choice))
        assert np.isfinite(actions).all()
        assert np.abs(actions).max() <= 1.0


@pytest.mark.parametrize("physics", ["quasistatic", "bullet"])
def test_the_wrapper_does_what_is_chosen(physics: str) -> None:
    if physics == "bullet":
        pytest.importorskip("pybullet")
    env = ChooseThrust(gym.make("JetHR1Step-v0", physics=physics))
    env.reset(seed=1)
    _, _, _, _, info = env.step(np.array([-1.0, 0.0, 0.0], dtype=np.float32))
    assert info["thrust"] == pytest.approx(0.002, abs=1e-4)
    _, _, _, _, info = env.step(np.array([0.0, 0.0, 0.0], dtype=np.float32))
    assert info["thrust"] == pytest.approx(MAX_THRUST * (0.7 / 1.7) ** 2, rel=0.01)
    env.close()
