"""The quasi-static task that the single environment and the batch share: settings, spaces, actions, rewards."""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from typing import Any, Literal, TypeAlias, cast, get_args

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from jet_gym.balance import BalanceSettings, ThrustModel
from jet_gym.errors import SettingsError
from jet_gym.fitness import FitnessSettings
from jet_gym.leg import SIDES
from jet_gym.robot import jet_hr1
from jet_gym.single_support import single_support
from jet_gym.step import Step
from jet_gym.task.advance import advance
from jet_gym.task.choices import actions_of_choices, choices_of_actions
from jet_gym.task.drawing import Drawer, StepDrawer
from jet_gym.task.lanes import Lanes
from jet_gym.task.observation import HIGH, LOW, observe
from jet_gym.task.packing import TaskNumbers, pack
from jet_gym.task.settings import FITNESS_TERMS, REWARD_TERMS, TaskSettings
from jet_gym.task.transition import FIRST_FITNESS_TERM, FIRST_GRADED_TERM, FITNESS, GRADED, Transition
from jet_gym.utils.arrays import Array

Float32Space: TypeAlias = spaces.Space[NDArray[np.float32]]
RewardForm = Literal["graded", "fitness"]


@functools.cache
def default_task() -> TaskModel:
    """Return the task with all settings at their defaults; nobody changes it."""
    return TaskModel()


class TaskModel:
    """The task without its episodes.

    Args:
        reward: ``"graded"`` or ``"fitness"``.
        thrust_model: ``"assigned"`` or ``"least"``.
        smoothness_weight: omega of eq. (18) [1/m^2]; the default where omitted.
        step: The step of every episode; a random one each time where omitted.
        difficulty: How far random steps may go, 0 to 1.
        violation_cost: What a violated constraint costs at least in the graded reward.
        balance: What counts as balanced, in place of ``thrust_model``.
        fitness: Weights and penalties, in place of ``smoothness_weight``.

    Raises:
        SettingsError: A ``ValueError``, if an argument is not allowed.
    """

    def __init__(
        self,
        reward: RewardForm = "graded",
        thrust_model: ThrustModel = "assigned",
        smoothness_weight: float | None = None,
        step: Step | None = None,
        difficulty: float = 1.0,
        violation_cost: float = TaskSettings.violation_cost,
        *,
        balance: BalanceSettings | None = None,
        fitness: FitnessSettings | None = None,
    ) -> None:
        if reward not in get_args(RewardForm):
            raise SettingsError(f"reward must be 'graded' or 'fitness', not {reward!r}")
        self.robot = jet_hr1()
        self.reward = reward
        self.step = None if step is None else self._check_step(step)
        self.settings = TaskSettings(difficulty=difficulty, violation_cost=violation_cost)
        self.balance = balance or BalanceSettings(thrust_model=thrust_model)
        weight = {} if smoothness_weight is None else {"smoothness_weight": smoothness_weight}
        self.fitness = fitness or FitnessSettings(**weight)
        self._balance = self.balance.parameters(self.robot)
        self._numbers = self._packed()
        self.reward_names = REWARD_TERMS if reward == "graded" else FITNESS_TERMS
        self.drawer: Drawer = StepDrawer(self.robot, self.balance, self.settings.difficulty)

    @property
    def violation_cost(self) -> float:
        """What a violated constraint costs at least in the graded reward; may be set, for a curriculum."""
        return self.settings.violation_cost

    @violation_cost.setter
    def violation_cost(self, cost: float) -> None:
        self.settings = replace(self.settings, violation_cost=cost)
        self._numbers = self._packed()

    def _packed(self) -> Array:
        """Return the task with left and with right swing in numbers that compiled code takes."""
        fitness, task = self.fitness.parameters(), self.settings.parameters()
        robots = [single_support(self.robot, swing, self.balance) for swing in SIDES]
        return np.array([pack(TaskNumbers(robot, fitness, task)) for robot in robots])

    @property
    def fitness_scale(self) -> float:
        """Fitness of a posture at full thrust; rewards are fitness over it."""
        return self.fitness.thrust_weight * self._balance.max_thrust

    @property
    def max_thrust(self) -> float:
        """Largest thrust [N]."""
        return self._balance.max_thrust

    @property
    def edge_slope(self) -> float:
        """Tangent of rho of eq. (10)."""
        return self._balance.edge_slope

    @property
    def thrust_penalty(self) -> float:
        """What a thrust that the fan cannot give costs as a term of the fitness reward."""
        return self.fitness.thrust_penalty / self.fitness_scale

    @property
    def worst_reward(self) -> float:
        """The least that the terms of one swing point can come to, a fall left out."""
        fitness, largest = self.fitness, self.settings.largest_cost
        furthest = 3.0 * self.settings.later_range**2 * fitness.smoothness_weight / self.fitness_scale
        if self.reward == "graded":
            return -1.0 - furthest - 6.0 * largest
        penalties = fitness.joint_limit_penalty + fitness.edge_penalty + fitness.thrust_penalty
        return -penalties / self.fitness_scale - furthest - 2.0 * largest

    @staticmethod
    def observation_space() -> Float32Space:
        """Return the observation space of one environment."""
        space: Any = spaces.Box(LOW, HIGH, dtype=np.float32)
        return cast(Float32Space, space)

    @staticmethod
    def action_space() -> Float32Space:
        """Return the action space of one environment."""
        space: Any = spaces.Box(-1.0, 1.0, (3,), dtype=np.float32)
        return cast(Float32Space, space)

    @staticmethod
    def empty_observations(count: int) -> NDArray[np.float32]:
        """Return a fresh array for the observations of some lanes."""
        return np.empty((count, len(LOW)), dtype=np.float32)

    @staticmethod
    def check_actions(actions: ArrayLike, shape: tuple[int, ...]) -> Array:
        """Return actions as numbers that compiled code takes.

        Raises:
            ValueError: If the shape is wrong or a number is not finite.
        """
        chosen = np.ascontiguousarray(actions, dtype=np.float64)
        if chosen.shape != shape:
            raise ValueError(f"actions must have shape {shape}, not {chosen.shape}")
        # The product is the quick way: it is not finite if a number is not, or only if one is huge.
        if not math.isfinite(np.vdot(chosen, chosen)) and not np.isfinite(chosen).all():
            raise ValueError("actions must be finite")
        return chosen

    def advance(self, lanes: Lanes, actions: Array, selected: NDArray[np.int64], transition: Transition) -> None:
        """Take actions (N, 3) in the selected lanes."""
        advance(self._numbers, lanes.array, actions, selected, transition.array)

    def observe(self, lanes: Lanes, selected: NDArray[np.int64], observations: NDArray[np.float32]) -> None:
        """Observe the selected lanes into their rows."""
        observe(self._numbers, lanes.array, selected, observations)

    def actions_of_choices(self, observations: NDArray[np.float32], choices: ArrayLike) -> NDArray[np.float32]:
        """Return the actions (N, 3) that carry choices (N, 3) out; see :mod:`jet_gym.task.choices`.

        Args:
            observations: What was observed before (N, C).
            choices: Thrust, place across the edge polygon and height, each in [-1, 1] (N, 3).
        """
        chosen = np.ascontiguousarray(choices, dtype=np.float32)
        actions = np.empty_like(chosen)
        actions_of_choices(self._numbers[0], np.ascontiguousarray(observations, np.float32), chosen, actions)
        return actions

    def choices_of_actions(self, observations: NDArray[np.float32], actions: ArrayLike) -> NDArray[np.float32]:
        """Return what actions (N, 3) choose, bounded to what can be chosen (N, 3)."""
        wanted = np.ascontiguousarray(actions, dtype=np.float64)
        choices = np.empty(wanted.shape, dtype=np.float32)
        choices_of_actions(self._numbers[0], np.ascontiguousarray(observations, np.float32), wanted, choices)
        return choices

    def actions_to(self, lanes: Lanes, selected: NDArray[np.int64], pelvis: ArrayLike) -> Array:
        """Return the actions (N, 3) that move the pelvis of the selected lanes to given positions.

        They are not clipped: beyond [-1, 1] a position is out of the search range.

        Args:
            lanes: The lanes.
            selected: Which of them (N,).
            pelvis: Where the pelvis of each is to be next (N, 3) [m], world frame.
        """
        settings = self.settings
        half = np.where(lanes.point[selected] == 0.0, settings.first_range, settings.later_range)
        actions: Array = (np.asarray(pelvis, dtype=np.float64) - lanes.pelvis[selected]) / half[:, None]
        actions[:, 1] *= lanes.side[selected]
        return actions

    def rewards(self, transition: Transition) -> Array:
        """Return the rewards (N,) of a quasi-static transition."""
        return np.array(transition.graded if self.reward == "graded" else transition.fitness / -self.fitness_scale)

    def reward_terms(self, transition: Transition) -> Array:
        """Return the terms of the reward (len(reward_names), N); they sum to it."""
        graded, fitness = transition.graded_terms, transition.fitness_terms
        return np.array(graded if self.reward == "graded" else fitness / -self.fitness_scale)

    def reward_and_terms(self, numbers: list[float]) -> tuple[float, dict[str, float]]:
        """Return the reward of a lane whose transition is given as plain numbers, and its terms by name."""
        if self.reward == "graded":
            *terms, reward = numbers[FIRST_GRADED_TERM : GRADED + 1]
        else:
            *terms, reward = (value / -self.fitness_scale for value in numbers[FIRST_FITNESS_TERM : FITNESS + 1])
        return reward, dict(zip(self.reward_names, terms, strict=True))

    def read_options(self, options: dict[str, Any] | None) -> Step | None:
        """Return the step that reset options ask for.

        Raises:
            ValueError: If there is another option, or the step is none for this robot.
        """
        if options is not None and not isinstance(options, dict):
            raise ValueError(f"options must be a table, not {options!r}")
        given = dict(options or {})
        step = given.pop("step", None)
        if given:
            raise ValueError(f"the only reset option is 'step', not {sorted(map(str, given))}")
        return None if step is None else self._check_step(step)

    def _check_step(self, step: Step) -> Step:
        if not isinstance(step, Step):
            raise SettingsError(f"step must be a jet_gym.Step, not {type(step).__name__}")
        step.require_robot(self.robot)
        return step
