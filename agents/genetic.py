"""The paper's planners GAS and GA: a genetic search at each swing point, section III-D.

A chromosome is 3 x 10 bits, eq. (14). Crossover and mutation probabilities, population sizes, generations and
ranges are the paper's Tables 2 and 3. What the paper leaves open is settled here: selection is by binary
tournament, crossover cuts at one random bit, the best chromosome of a generation survives unchanged (elitism),
and the first generation counts as one of the table's, so that Table 3 makes 150 x 8 = 1,200 evaluations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.planner import PointByPointPlanner
from jet_gym.balance import BalanceSettings
from jet_gym.constraints import FIRST_RANGE, LATER_RANGE
from jet_gym.fitness import FitnessParameters, FitnessSettings
from jet_gym.leg import Vector
from jet_gym.posture_state import fitness_of_candidates
from jet_gym.single_support import SingleSupport, single_support, stance_between
from jet_gym.step import Step
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined
from jet_gym.utils.settings import require_whole, require_within

_GENE_BITS = 10
_GENE_MAX = 2**_GENE_BITS - 1
_BITS = 3 * _GENE_BITS

_SPLIT_MIX_STEP = np.uint64(0x9E3779B97F4A7C15)
_SPLIT_MIX_1, _SPLIT_MIX_2 = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)

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
    half_range: float = LATER_RANGE
    crossover: float = 0.5
    mutation: float = 0.01

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed."""
        require_whole("population", self.population, 2)
        require_whole("generations", self.generations, 1)
        require_within("half_range", self.half_range, above=True)
        for name in ("crossover", "mutation"):
            require_within(name, getattr(self, name), 0.0, 1.0)

    def parameters(self) -> GeneticParameters:
        """Return the numbers for compiled code."""
        return GeneticParameters(self.population, self.generations, self.half_range, self.crossover, self.mutation)


class GeneticParameters(NamedTuple):
    """Settings of a genetic search in numbers that compiled code takes by value."""

    population: int
    generations: int
    half_range: float  # [m]
    crossover: float
    mutation: float


INITIAL_PHASE = GeneticSettings(population=200, generations=50, half_range=FIRST_RANGE)
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

    @cached_property
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

    @cached_property
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
    x, y, z = _evolve(
        int(generator.integers(2**63)),
        single_support(step.robot, step.swing, balance),
        fitness.parameters(),
        settings.parameters(),
        tuple(swing_sole.tolist()),
        step.support,
        tuple(centre.tolist()),
    )
    return np.array([x, y, z])


@entry_point
def _evolve(
    key: int,
    robot: SingleSupport,
    minimised: FitnessParameters,
    search: GeneticParameters,
    swing_sole: Vector,
    support_sole: Vector,
    centre: Vector,
) -> Vector:
    """Let chromosomes evolve; ``key`` selects the stream of random numbers. See :func:`genetic_search`."""
    stance, population = stance_between(robot, swing_sole, support_sole), search.population
    parents = np.empty(population, np.int64)
    children = np.empty(population, np.int64)
    candidates = np.empty((3, population))
    fitness, violations = np.empty(population), np.empty(population, np.int64)
    uniforms = np.empty(3 * population)
    drawn = _fill(key, 0, uniforms)
    for i in range(population):
        parents[i] = int(uniforms[i] * 2.0**_BITS)
    best = 0
    for generation in range(search.generations):
        _decode(parents, centre, search.half_range, candidates)
        fitness_of_candidates(robot, minimised, stance, centre, candidates, fitness, violations)
        best = int(np.argmin(fitness))
        if generation < search.generations - 1:
            drawn = _fill(key, drawn, uniforms)
            _select(uniforms, parents, fitness, children)
            _cross(uniforms[2 * population :], search.crossover, children)
            drawn = _mutate(key, drawn, search.mutation, children)
            children[0] = parents[best]
            parents, children = children, parents
    return candidates[0, best], candidates[1, best], candidates[2, best]


@inlined
def _decode(chromosomes: Chromosomes, centre: Vector, half_range: float, candidates: Array) -> None:
    """Turn chromosomes into positions, eq. (14): a gene of ten bits leads from one end of the cube to the other."""
    for i in range(len(chromosomes)):
        for axis in range(3):
            gene = (chromosomes[i] >> (_GENE_BITS * (2 - axis))) & _GENE_MAX
            candidates[axis, i] = centre[axis] - half_range + 2.0 * half_range * gene / _GENE_MAX


@inlined
def _uniform(key: int, number: int) -> float:
    """Return random number ``number`` of the stream ``key``, uniform in [0, 1): SplitMix64 (Steele et al., 2014).

    Counting instead of carrying a state lets a whole generation's numbers be drawn in SIMD lanes. NumPy's
    generators cannot be used here: when Ctrl-C comes while one is handed to compiled code, Python may crash.
    """
    z = np.uint64(key) + np.uint64(number) * _SPLIT_MIX_STEP
    z = (z ^ (z >> np.uint64(30))) * _SPLIT_MIX_1
    z = (z ^ (z >> np.uint64(27))) * _SPLIT_MIX_2
    uniform: float = np.float64((z ^ (z >> np.uint64(31))) >> np.uint64(11)) * 2.0**-53
    return uniform


@inlined
def _fill(key: int, drawn: int, uniforms: Array) -> int:
    """Fill an array with random numbers; return how many of the stream have been drawn then."""
    for i in range(len(uniforms)):
        uniforms[i] = _uniform(key, drawn + i)
    return drawn + len(uniforms)


@inlined
def _select(uniforms: Array, parents: Chromosomes, fitness: Array, children: Chromosomes) -> None:
    """Fill the next generation with winners of binary tournaments."""
    count = len(parents)
    for i in range(count):
        first, second = int(uniforms[2 * i] * count), int(uniforms[2 * i + 1] * count)
        one, other = parents[first], parents[second]
        children[i] = one if fitness[first] <= fitness[second] else other


@inlined
def _cross(uniforms: Array, probability: float, children: Chromosomes) -> None:
    """Exchange the tails of neighbours behind one random bit."""
    for i in range(0, len(children) - 1, 2):
        tail = (1 << (1 + int(uniforms[i + 1] * (_BITS - 1)))) - 1
        swapped = (children[i] ^ children[i + 1]) & (tail if uniforms[i] < probability else 0)
        children[i] ^= swapped
        children[i + 1] ^= swapped


@inlined
def _mutate(key: int, drawn: int, probability: float, children: Chromosomes) -> int:
    """Flip each bit with a probability, jumping from one flipped bit to the next (geometric distances)."""
    if probability <= 0.0:
        return drawn
    bits = _BITS * len(children)
    scale = 1.0 / math.log1p(-probability) if probability < 1.0 else 0.0
    bit = int(math.log(1.0 - _uniform(key, drawn)) * scale)
    drawn += 1
    while bit < bits:
        children[bit // _BITS] ^= 1 << (bit % _BITS)
        bit += 1 + int(math.log(1.0 - _uniform(key, drawn)) * scale)
        drawn += 1
    return drawn
