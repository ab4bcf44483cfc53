"""The swing point that the benchmarks look at: half way across the ditch, where GAS searches its small cube."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from agents.genetic import GeneticSettings
from agents.planner import make_planner
from jet_gym.arrays import Array
from jet_gym.balance import BalanceParameters, BalanceSettings, Stance, stance_of
from jet_gym.courses import PAPER
from jet_gym.fitness import FitnessParameters, FitnessSettings
from jet_gym.leg import Leg
from jet_gym.posture import swing_and_support
from jet_gym.posture_state import fitness_of_candidates
from jet_gym.step import Step


@dataclass(frozen=True, eq=False)
class SwingPoint:
    """One swing point as a planner meets it.

    Attributes:
        step: The step.
        swing_sole: The swing sole (3,) [m].
        previous: The pelvis at the swing point before (3,) [m], centre of the search.
        planned: The pelvis that GAS chose here (3,) [m].
        half_range: Search range on either side of ``previous``, per axis [m].
    """

    step: Step
    swing_sole: Array
    previous: Array
    planned: Array
    half_range: float = GeneticSettings().half_range

    @property
    def lowest(self) -> Array:
        """The cube's corner of smallest coordinates (3,) [m]."""
        return self.previous - self.half_range

    @property
    def highest(self) -> Array:
        """The cube's corner of largest coordinates (3,) [m]."""
        return self.previous + self.half_range

    def random_pelvises(self, count: int, seed: int = 0) -> Array:
        """Return pelvis positions (count, 3) [m], uniform in the cube."""
        return np.random.default_rng(seed).uniform(self.lowest, self.highest, (count, 3))

    @functools.cached_property
    def _compiled_arguments(self) -> tuple[Leg, Leg, BalanceParameters, FitnessParameters, Stance]:
        swing_leg, support_leg, side = swing_and_support(self.step.robot, self.step.swing)
        balance = BalanceSettings().parameters(self.step.robot)
        sole = tuple(self.swing_sole.tolist())
        plain_stance_of = stance_of.py_func  # type: ignore[attr-defined]
        stance = plain_stance_of(swing_leg, support_leg, side, balance.zmp_margin, sole, self.step.support)
        return swing_leg, support_leg, balance, FitnessSettings().parameters(), stance

    def fitness(self, candidates: Array) -> Array:
        """Return the fitness (N,), eq. (15), of pelvis positions (3, N) [m], C-ordered, by the compiled loop."""
        swing_leg, support_leg, balance, parameters, stance = self._compiled_arguments
        count = candidates.shape[1]
        fitness, violations = np.empty(count), np.empty(count, dtype=np.int64)
        fitness_of_candidates(
            swing_leg, support_leg, self.step.robot.trunk, balance, parameters, stance,
            tuple(self.previous.tolist()), candidates, fitness, violations,
        )  # fmt: skip
        return fitness

    def fitness_of_one(self, x: float, y: float, z: float) -> float:
        """Return the fitness of one pelvis position [m]."""
        return float(self.fitness(np.array([[x], [y], [z]]))[0])


@functools.cache
def later_swing_point() -> SwingPoint:
    """Return the middle swing point of the paper's step forward, reached by a plan of GAS."""
    step = PAPER.forward
    plan = make_planner("gas").plan(step, seed=0)
    middle = step.points // 2
    return SwingPoint(step, step.swing_sole[middle], plan.pelvis[middle - 1], plan.pelvis[middle])
