"""The swing point that the benchmarks look at: half way across the ditch, where GAS searches its small cube."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from agents.genetic import GeneticSettings
from agents.planner import make_planner
from jet_gym.balance import Stance, stance_of
from jet_gym.courses import PAPER
from jet_gym.fitness import FitnessParameters, FitnessSettings
from jet_gym.posture_state import fitness_of_candidates
from jet_gym.single_support import SingleSupport, single_support
from jet_gym.step import Step
from jet_gym.utils.arrays import Array


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
    def _compiled_arguments(self) -> tuple[SingleSupport, FitnessParameters, Stance]:
        robot, sole = single_support(self.step.robot, self.step.swing), tuple(self.swing_sole.tolist())
        legs, zmp_margin = (robot.swing_leg, robot.support_leg, robot.side), robot.balance.zmp_margin
        plain_stance_of = getattr(stance_of, "py_func", stance_of)  # itself where nothing is compiled
        return robot, FitnessSettings().parameters(), plain_stance_of(*legs, zmp_margin, sole, self.step.support)

    def fitness(self, candidates: Array) -> Array:
        """Return the fitness (N,), eq. (15), of pelvis positions (3, N) [m], C-ordered, by the compiled loop."""
        robot, parameters, stance = self._compiled_arguments
        count = candidates.shape[1]
        fitness, violations = np.empty(count), np.empty(count, dtype=np.int64)
        previous = tuple(self.previous.tolist())
        fitness_of_candidates(robot, parameters, stance, previous, candidates, fitness, violations)
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
