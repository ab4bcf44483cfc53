"""Today's off-the-shelf optimisers on one swing point, with as many evaluations as GAS has.

Each function searches once and returns the least fitness that it met. Where a library evaluates a whole
population at once, it gets the compiled loop for the whole population.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np

from agents.genetic import GeneticSettings
from agents.studies.race import Contestant
from agents.studies.swing_point import SwingPoint
from jet_gym.utils.arrays import Array

SETTINGS = GeneticSettings()
EVALUATIONS = SETTINGS.population * SETTINGS.generations
Search = Callable[[int], float]

_GENE_BITS = 10
_GENE_WEIGHTS = 2 ** np.arange(_GENE_BITS - 1, -1, -1) / (2**_GENE_BITS - 1)


def _decode(point: SwingPoint, bits: Array) -> Array:
    """Turn bits (N, 30) into pelvis positions (3, N) [m], eq. (14)."""
    share = bits.reshape(-1, 3, _GENE_BITS) @ _GENE_WEIGHTS
    return np.ascontiguousarray((point.lowest + 2.0 * point.half_range * share).T)


def pymoo_binary(point: SwingPoint) -> Search:
    """Pymoo's GA on 30 bits, with GAS's operators and no search for duplicates, which would cost time."""
    from pymoo.operators.crossover.pntx import SinglePointCrossover
    from pymoo.operators.mutation.bitflip import BitflipMutation
    from pymoo.operators.sampling.rnd import BinaryRandomSampling

    return _pymoo(
        lambda bits: point.fitness(_decode(point, bits)),
        {"n_var": 3 * _GENE_BITS, "xl": 0, "xu": 1, "vtype": bool},
        sampling=BinaryRandomSampling(),
        crossover=SinglePointCrossover(prob=SETTINGS.crossover),
        mutation=BitflipMutation(prob=1.0, prob_var=SETTINGS.mutation),
    )


def pymoo_real(point: SwingPoint) -> Search:
    """Pymoo's GA on three real numbers, with the operators that are its own defaults."""
    return _pymoo(
        lambda pelvises: point.fitness(np.ascontiguousarray(pelvises.T)),
        {"n_var": 3, "xl": point.lowest, "xu": point.highest},
    )


def _pymoo(evaluate: Callable[[Array], Array], problem_arguments: dict[str, Any], **operators: Any) -> Search:
    from pymoo.algorithms.soo.nonconvex.ga import GA
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize

    class Posture(Problem):  # type: ignore[misc]
        """One swing point, evaluated a population at a time."""

        def __init__(self) -> None:
            super().__init__(n_obj=1, **problem_arguments)

        def _evaluate(self, x: Array, out: dict[str, Array], *_: Any, **__: Any) -> None:
            out["F"] = evaluate(x)

    problem = Posture()

    def search(seed: int) -> float:
        algorithm = GA(pop_size=SETTINGS.population, eliminate_duplicates=False, **operators)
        result = minimize(problem, algorithm, ("n_gen", SETTINGS.generations), seed=seed, verbose=False)
        if result.algorithm.evaluator.n_eval != EVALUATIONS:
            raise RuntimeError(f"pymoo made {result.algorithm.evaluator.n_eval} evaluations, not {EVALUATIONS}")
        return float(result.F[0])

    return search


def deap_one_by_one(point: SwingPoint) -> Search:
    """DEAP with GAS's operators, the fitness called for each chromosome, as its tutorials do."""

    def evaluate(individuals: list[list[int]]) -> list[float]:
        return [point.fitness_of_one(*_decode(point, np.array(individual)).ravel()) for individual in individuals]

    return _deap(evaluate)


def deap_in_batches(point: SwingPoint) -> Search:
    """DEAP with GAS's operators, the compiled fitness called for a generation at once."""

    def evaluate(individuals: list[list[int]]) -> list[float]:
        fitness: list[float] = point.fitness(_decode(point, np.array(individuals))).tolist()
        return fitness

    return _deap(evaluate)


def _deap(evaluate: Callable[[list[list[int]]], list[float]]) -> Search:
    """Make a search; in every generation all chromosomes are evaluated but the one that survives unchanged."""
    from deap import algorithms, base, creator, tools

    if not hasattr(creator, "Chromosome"):
        creator.create("LeastFitness", base.Fitness, weights=(-1.0,))
        creator.create("Chromosome", list, fitness=creator.LeastFitness)
    toolbox = base.Toolbox()
    toolbox.register("bit", random.getrandbits, 1)
    toolbox.register("chromosome", tools.initRepeat, creator.Chromosome, toolbox.bit, 3 * _GENE_BITS)
    toolbox.register("mate", tools.cxOnePoint)
    toolbox.register("mutate", tools.mutFlipBit, indpb=SETTINGS.mutation)
    toolbox.register("select", tools.selTournament, tournsize=2)

    def evaluate_new(population: list[Any]) -> None:
        new = [individual for individual in population if not individual.fitness.valid]
        if new:
            for individual, fitness in zip(new, evaluate(new), strict=True):
                individual.fitness.values = (fitness,)

    def search(seed: int) -> float:
        random.seed(seed)
        population = [toolbox.chromosome() for _ in range(SETTINGS.population)]
        evaluate_new(population)
        for _ in range(SETTINGS.generations - 1):
            best = tools.selBest(population, 1)[0]
            children = toolbox.select(population, len(population))
            population = algorithms.varAnd(children, toolbox, cxpb=SETTINGS.crossover, mutpb=1.0)
            population[0] = best
            evaluate_new(population)
        return float(tools.selBest(population, 1)[0].fitness.values[0])

    return search


def cma_es(point: SwingPoint) -> Search:
    """CMA-ES of the package ``cmaes``: 150 generations of 8, near its default of 7 for three variables."""
    from cmaes import CMA

    population = 8
    bounds = np.stack([point.lowest, point.highest], axis=1)

    def search(seed: int) -> float:
        optimiser = CMA(
            mean=point.previous, sigma=0.5 * point.half_range, bounds=bounds, seed=seed, population_size=population
        )
        least = np.inf
        for _ in range(EVALUATIONS // population):
            pelvises = np.array([optimiser.ask() for _ in range(population)])
            fitness = point.fitness(np.ascontiguousarray(pelvises.T)).tolist()
            optimiser.tell(list(zip(pelvises, fitness, strict=True)))
            least = min(least, *fitness)
        return float(least)

    return search


OPTIMISERS: tuple[tuple[str, str, Callable[[SwingPoint], Search]], ...] = (
    ("pymoo GA, 30 bits", "pymoo", pymoo_binary),
    ("pymoo GA, 3 reals", "pymoo", pymoo_real),
    ("DEAP, one by one", "deap", deap_one_by_one),
    ("DEAP, in batches", "deap", deap_in_batches),
    ("CMA-ES", "cmaes", cma_es),
)
"""Name, the module that it needs, and what makes its search."""


def contestant(name: str, search: Search) -> Contestant:
    """Return who searches with another seed each time, from 0 on."""
    seeds = itertools.count()
    return Contestant(name, lambda: search(next(seeds)))


def missing_note(module: str) -> str | None:
    """Return a sentence if a library is not installed."""
    if find_spec(module) is not None:
        return None
    return f"{module} is not installed and left out; pip install jet-gym[bench] adds it."
