"""The paper's planners GAS and GA: a genetic search at each swing point, section III-D.

A chromosome is 3 x 10 bits, eq. (14). Crossover and mutation probabilities, population sizes, generations and
ranges are the paper's Tables 2 and 3. What the paper leaves open is settled here: selection is by binary
tournament, crossover cuts at one random bit, the best chromosome of a generation survives unchanged (elitism),
and the first generation counts as one of the table's, so that Table 3 makes 150 x 8 = 1,200 evaluations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agents.planner import PointByPointPlanner
from jet_gym.balance import BalanceParameters, BalanceSettings, stance_of
from jet_gym.compilation import entry_point, inlined
from jet_gym.errors import SettingsError
from jet_gym.fitness import FitnessParameters, FitnessSettings
from jet_gym.posture import swing_and_support
from jet_gym.posture_state import fitness_of_candidates
from jet_gym.robot import Leg, Trunk, Vector
from jet_gym.step import Step
from jet_gym.urdf import Array

_GENE_BITS = 10
_GENE_MAX = 2**_GENE_BITS - 1
_BITS = 3 * _GENE_BITS

Chromosomes = NDArray[np.int64]


@dataclass(frozen=True)
class GeneticSettings:
    """One phase of the genetic search; the defaults are Table 3, :data:`INITIAL_PHASE` is Table 2.

    Attributes:
        population: Chromosomes in a generation.
        generations: Generations, the first random one included.
        half_range: Search range on either side of the centre, per axis [m].
        crossover: Probability that two parents are crossed.
        mutation: Probability that a bit is flipped.
    """

    population: int = 150
    generations: int = 8
    half_range: float = 0.025
    crossover: float = 0.5
    mutation: float = 0.01

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed."""
        if self.population < 2 or self.generations < 1:
            raise SettingsError(
                f"a search needs a population of 2 and 1 generation at least, "
                f"not {self.population} and {self.generations}"
            )
        if not 0.0 < self.half_range < math.inf:
            raise SettingsError(f"half_range must be more than 0 m, not {self.half_range}")
        for name in ("crossover", "mutation"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise SettingsError(f"{name} must be a probability, not {getattr(self, name)}")


INITIAL_PHASE = GeneticSettings(population=200, generations=50, half_range=0.150)
INTERMEDIATE_PHASE = GeneticSettings()


@dataclass(frozen=True)
class GasPlanner(PointByPointPlanner):
    """GAS: the genetic search that minimises thrust and pelvis movement together.

    Attributes:
        initial: The search at the first swing point.
        intermediate: The search at the later ones.
    """

    initial: GeneticSettings = field(default=INITIAL_PHASE)
    intermediate: GeneticSettings = field(default=INTERMEDIATE_PHASE)
    name: ClassVar[str] = "gas"

    @property
    def search_range(self) -> float:
        """Largest move of the pelvis between two swing points, per axis [m], eq. (13)."""
        return self.intermediate.half_range

    @property
    def searched_fitness(self) -> FitnessSettings:
        """The fitness that the search itself minimises at later swing points."""
        return self.fitness

    def choose(
        self, step: Step, swing_sole: Array, previous: Array, first: bool, generator: np.random.Generator
    ) -> tuple[Array, int]:
        """Choose the pelvis at one swing point by a genetic search."""
        settings = self.initial if first else self.intermediate
        fitness = replace(self.fitness, smoothness_weight=0.0) if first else self.searched_fitness
        pelvis = genetic_search(step, swing_sole, previous, settings, self.balance, fitness, generator)
        return pelvis, settings.population * settings.generations

    def warm_up(self, step: Step) -> None:
        """Load or compile the search."""
        smallest = GeneticSettings(population=2, generations=1)
        start, generator = np.array(step.start), np.random.default_rng(0)
        genetic_search(step, start, step.nominal_pelvis, smallest, self.balance, self.fitness, generator)


@dataclass(frozen=True)
class GaPlanner(GasPlanner):
    """GA, a baseline of the paper: GAS without the smoothness term f3.

    Its plans are judged by the whole fitness all the same, so that they compare with those of GAS.
    """

    name: ClassVar[str] = "ga"

    @property
    def searched_fitness(self) -> FitnessSettings:
        """The fitness that the search itself minimises: without f3."""
        return replace(self.fitness, smoothness_weight=0.0)


def genetic_search(
    step: Step,
    swing_sole: Array,
    centre: Array,
    settings: GeneticSettings,
    balance: BalanceSettings,
    fitness: FitnessSettings,
    generator: np.random.Generator,
) -> Array:
    """Search the pelvis position of least fitness in a cube.

    Args:
        step: The step.
        swing_sole: The swing sole (3,) [m].
        centre: Centre of the cube (3,) [m], from which f3 counts the movement too.
        settings: The search.
        balance: What counts as balanced.
        fitness: Weights and penalties.
        generator: Source of random numbers.

    Returns:
        The best pelvis position found (3,) [m].
    """
    swing_leg, support_leg, side = swing_and_support(step.robot, step.swing)
    x, y, z = _evolve(
        generator, swing_leg, support_leg, step.robot.trunk, side,
        balance.parameters(step.robot), fitness.parameters(),
        tuple(swing_sole.tolist()), step.support, tuple(centre.tolist()), settings.half_range,
        settings.population, settings.generations, settings.crossover, settings.mutation,
    )  # fmt: skip
    return np.array([x, y, z])


@entry_point
def _evolve(
    generator: np.random.Generator,
    swing_leg: Leg,
    support_leg: Leg,
    trunk: Trunk,
    side: float,
    balance: BalanceParameters,
    parameters: FitnessParameters,
    swing_sole: Vector,
    support_sole: Vector,
    centre: Vector,
    half_range: float,
    population: int,
    generations: int,
    crossover: float,
    mutation: float,
) -> Vector:
    stance = stance_of(swing_leg, support_leg, side, balance.zmp_margin, swing_sole, support_sole)
    parents = np.empty(population, np.int64)
    children = np.empty(population, np.int64)
    candidates = np.empty((3, population))
    fitness, violations = np.empty(population), np.empty(population, np.int64)
    for i in range(population):
        parents[i] = int(generator.random() * 2.0**_BITS)
    best = 0
    for generation in range(generations):
        _decode(parents, centre, half_range, candidates)
        fitness_of_candidates(
            swing_leg, support_leg, trunk, balance, parameters, stance, centre, candidates, fitness, violations
        )
        best = int(np.argmin(fitness))
        if generation < generations - 1:
            _select(generator, parents, fitness, children)
            _cross(generator, crossover, children)
            _mutate(generator, mutation, children)
            children[0] = parents[best]
            parents, children = children, parents
    return candidates[0, best], candidates[1, best], candidates[2, best]


@inlined
def _decode(chromosomes: Chromosomes, centre: Vector, half_range: float, candidates: Array) -> None:
    """Turn chromosomes into positions, eq. (14)."""
    for i in range(len(chromosomes)):
        for axis in range(3):
            gene = (chromosomes[i] >> (_GENE_BITS * (2 - axis))) & _GENE_MAX
            candidates[axis, i] = centre[axis] - half_range + 2.0 * half_range * gene / _GENE_MAX


@inlined
def _select(generator: np.random.Generator, parents: Chromosomes, fitness: Array, children: Chromosomes) -> None:
    """Fill the next generation with winners of binary tournaments."""
    count = len(parents)
    for i in range(count):
        first, second = int(generator.random() * count), int(generator.random() * count)
        children[i] = parents[first] if fitness[first] <= fitness[second] else parents[second]


@inlined
def _cross(generator: np.random.Generator, probability: float, children: Chromosomes) -> None:
    """Exchange the tails of neighbours behind one random bit."""
    for i in range(0, len(children) - 1, 2):
        if generator.random() < probability:
            tail = (1 << (1 + int(generator.random() * (_BITS - 1)))) - 1
            swapped = (children[i] ^ children[i + 1]) & tail
            children[i] ^= swapped
            children[i + 1] ^= swapped


@inlined
def _mutate(generator: np.random.Generator, probability: float, children: Chromosomes) -> None:
    """Flip each bit with a probability, jumping from one flipped bit to the next (geometric distances)."""
    if probability <= 0.0:
        return
    bits = _BITS * len(children)
    scale = 1.0 / math.log1p(-probability) if probability < 1.0 else 0.0
    bit = int(math.log(1.0 - generator.random()) * scale)
    while bit < bits:
        children[bit // _BITS] ^= 1 << (bit % _BITS)
        bit += 1 + int(math.log(1.0 - generator.random()) * scale)
