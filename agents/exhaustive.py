"""The paper's baseline GAEx: a genetic search at the first swing point, local exhaustion at the others.

The paper's cube has edges of 12 mm and a grid of 1 mm, 13^3 points, and takes a position that satisfies the
constraints without minimising thrust. It does not say which; here it is the first in the order of three nested
loops over x, y and z from their low ends, and the search stops there. Where none satisfies the constraints, it is
the one of least fitness.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cache
from typing import ClassVar

import numpy as np

from agents.genetic import INITIAL_PHASE, GeneticSettings, genetic_search
from agents.planner import PointByPointPlanner
from jet_gym.errors import SettingsError
from jet_gym.fitness import FitnessParameters
from jet_gym.leg import Vector
from jet_gym.posture_state import fitness_of_candidates
from jet_gym.single_support import SingleSupport, single_support, stance_between
from jet_gym.step import Step
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point

_BLOCK = 169  # positions evaluated at a time: one layer of the paper's cube


@dataclass(frozen=True)
class GaexPlanner(PointByPointPlanner):
    """GAEx: the first point as GAS, then the first position of a grid that satisfies the constraints.

    Attributes:
        initial: The genetic search at the first swing point.
        edge: Edge of the cube [m].
        interval: Distance of its grid points [m].
    """

    initial: GeneticSettings = field(default=INITIAL_PHASE)
    edge: float = 0.012
    interval: float = 0.001
    name: ClassVar[str] = "gaex"

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed."""
        if not 0.0 < self.interval <= self.edge < math.inf:
            raise SettingsError(f"interval must lie between 0 m and the edge of {self.edge} m, not {self.interval}")

    @property
    def search_range(self) -> float:
        """Largest move of the pelvis between two swing points, per axis [m], eq. (13)."""
        return self.edge / 2.0

    def choose(
        self, step: Step, swing_sole: Array, previous: Array, first: bool, generator: np.random.Generator
    ) -> tuple[Array, int]:
        """Choose the pelvis at one swing point, by a genetic search at the first, by exhaustion later."""
        if first:
            without_f3 = replace(self.fitness, smoothness_weight=0.0)
            pelvis = genetic_search(step, swing_sole, previous, self.initial, self.balance, without_f3, generator)
            return pelvis, self.initial.population * self.initial.generations
        return self._exhaust(step, swing_sole, previous, _offsets(self.edge, self.interval))

    def warm_up(self, step: Step) -> None:
        """Load or compile both searches."""
        smallest = replace(self, initial=GeneticSettings(population=2, generations=1))
        smallest.choose(step, np.array(step.start), step.nominal_pelvis, True, np.random.default_rng(0))
        self._exhaust(step, np.array(step.start), step.nominal_pelvis, np.zeros((3, 1)))

    def _exhaust(self, step: Step, swing_sole: Array, previous: Array, offsets: Array) -> tuple[Array, int]:
        chosen, evaluations = _first_feasible(
            single_support(step.robot, step.swing, self.balance),
            self.fitness.parameters(),
            tuple(swing_sole.tolist()),
            step.support,
            tuple(previous.tolist()),
            offsets,
        )
        return previous + offsets[:, chosen], evaluations


@cache
def _offsets(edge: float, interval: float) -> Array:
    """Return the grid of the cube (3, M) [m] about its centre, z running fastest."""
    count = math.floor(edge / (2.0 * interval) + 1e-9)
    line = interval * np.arange(-count, count + 1)
    return np.ascontiguousarray(np.stack(np.meshgrid(line, line, line, indexing="ij")).reshape(3, -1))


@entry_point
def _first_feasible(
    robot: SingleSupport,
    minimised: FitnessParameters,
    swing_sole: Vector,
    support_sole: Vector,
    centre: Vector,
    offsets: Array,
) -> tuple[int, int]:
    """Return the first offset without a violation, else that of least fitness, and how many were evaluated."""
    stance = stance_between(robot, swing_sole, support_sole)
    candidates, fitness = np.empty((3, _BLOCK)), np.empty(_BLOCK)
    violations = np.empty(_BLOCK, np.int64)
    best, least = 0, 1e300
    count = offsets.shape[1]
    for start in range(0, count, _BLOCK):
        for axis in range(3):
            for i in range(_BLOCK):  # the last block is filled up with its last offset
                candidates[axis, i] = centre[axis] + offsets[axis, min(start + i, count - 1)]
        fitness_of_candidates(robot, minimised, stance, centre, candidates, fitness, violations)
        size = min(_BLOCK, count - start)
        for i in range(size):
            if violations[i] == 0:
                return start + i, start + size
            if fitness[i] < least:
                best, least = start + i, fitness[i]
    return best, count
