"""The quasi-static task that the single environment and the batch share: settings, spaces, actions, rewards."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal, TypeAlias, cast, get_args

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from jet_gym.balance import BalanceSettings, ThrustModel
from jet_gym.envs.drawing import StepDrawer
from jet_gym.envs.lanes import Lanes, Transition, advance
from jet_gym.envs.observation import HIGH, LOW, observe
from jet_gym.envs.packing import TaskNumbers, pack
from jet_gym.envs.settings import REWARD_TERMS, TaskSettings
from jet_gym.errors import SettingsError
from jet_gym.fitness import FitnessSettings
from jet_gym.kinematics import axis_signs, range_middles
from jet_gym.robot import jet_hr1
from jet_gym.step import Step
from jet_gym.urdf import Array

Float32Space: TypeAlias = spaces.Space[NDArray[np.float32]]
RewardForm = Literal["graded", "fitness"]
FITNESS_TERMS = ("f1", "f2", "f3", "f4")


class TaskModel:
    """The task without its episodes.

    Args:
        reward: ``"graded"`` or ``"fitness"``.
        thrust_model: ``"assigned"`` or ``"least"``.
        smoothness_weight: omega of eq. (18) [1/m^2]; the default where omitted.
        step: The step of every episode; a random one each time where omitted.
        difficulty: How far random steps may go, 0 to 1.

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
    ) -> None:
        if reward not in get_args(RewardForm):
            raise SettingsError(f"reward must be 'graded' or 'fitness', not {reward!r}")
        self.robot = jet_hr1()
        self.reward = reward
        self.step = None if step is None else self._check_step(step)
        self.settings = TaskSettings(difficulty=difficulty)
        self.balance = BalanceSettings(thrust_model=thrust_model)
        weight = {} if smoothness_weight is None else {"smoothness_weight": smoothness_weight}
        self.fitness = FitnessSettings(**weight)
        self._balance = self.balance.parameters(self.robot)
        parameters = self.fitness.parameters()
        task = self.settings.parameters()
        left, right, trunk = self.robot.left, self.robot.right, self.robot.trunk
        self._left_swing = pack(TaskNumbers(left, right, trunk, 1.0, self._balance, parameters, task))
        self._right_swing = pack(TaskNumbers(right, left, trunk, -1.0, self._balance, parameters, task))
        self._middles, self._axis_signs = range_middles(self.robot), axis_signs(self.robot)
        self.drawer = StepDrawer(self.robot, self._balance, self.settings.difficulty)

    @property
    def fitness_scale(self) -> float:
        """Fitness of a posture at full thrust; rewards are fitness over it."""
        return self.fitness.thrust_weight * self._balance.max_thrust

    @property
    def max_thrust(self) -> float:
        """Largest thrust [N]."""
        return self._balance.max_thrust

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
    def check_actions(actions: ArrayLike, count: int) -> Array:
        """Return actions (count, 3) as numbers that compiled code takes.

        Raises:
            ValueError: If the shape is wrong or a number is not finite.
        """
        chosen = np.ascontiguousarray(actions, dtype=np.float64)
        if chosen.shape != (count, 3):
            raise ValueError(f"actions must have shape ({count}, 3), not {chosen.shape}")
        if not np.isfinite(chosen).all():
            raise ValueError("actions must be finite")
        return chosen

    def advance(self, lanes: Lanes, actions: Array, first: int, last: int, result: Transition) -> None:
        """Take actions (N, 3) in the lanes from ``first`` up to ``last``."""
        for numbers, chosen in self._by_swing_leg(lanes, np.arange(first, last)):
            advance(numbers, lanes, actions, chosen, result)
        angles = np.arctan2(result.joint_sines[first:last], result.joint_cosines[first:last])
        angles += self._middles
        np.multiply(angles, self._axis_signs, out=result.joint_positions[first:last])

    def observe(
        self, lanes: Lanes, attitude: Array, selected: NDArray[np.int64], observations: NDArray[np.float32]
    ) -> None:
        """Observe the selected lanes into their rows; ``attitude`` is roll and pitch (N, 2) [rad]."""
        for numbers, chosen in self._by_swing_leg(lanes, selected):
            observe(numbers, lanes, attitude, chosen, observations)

    def _by_swing_leg(self, lanes: Lanes, selected: NDArray[np.int64]) -> Iterator[tuple[Array, NDArray[np.int64]]]:
        """Go through the selected lanes whose left leg swings, and then the others, with the task's numbers."""
        if len(selected) == 1:
            yield self._left_swing if lanes.swing_is_left[selected[0]] else self._right_swing, selected
            return
        is_left = lanes.swing_is_left[selected]
        yield self._left_swing, selected[is_left]
        yield self._right_swing, selected[~is_left]

    def rewards(self, result: Transition) -> Array:
        """Return the rewards (N,) of a quasi-static transition."""
        if self.reward == "graded":
            return np.array(result.graded)
        rewards: Array = result.fitness * (-1.0 / self.fitness_scale)
        return rewards

    def named_reward_terms(self, result: Transition) -> dict[str, Array]:
        """Return the terms (N,) of the reward by name; they sum to it."""
        if self.reward == "graded":
            return {name: result.reward_terms[:, i] for i, name in enumerate(REWARD_TERMS)}
        return {
            name: result.fitness_terms[:, i] * (-1.0 / self.fitness_scale) for i, name in enumerate(FITNESS_TERMS)
        }

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
        if step.robot is not self.robot:
            raise SettingsError(f"step must be for {self.robot.name}, but is for {step.robot.name}")
        return step
