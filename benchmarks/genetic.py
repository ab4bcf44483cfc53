"""GAS at one swing point beside off-the-shelf optimisers: time, and the fitness reached.

Everybody minimises the same compiled fitness in the same cube with 1,200 evaluations (a population of 150 and
8 generations where there is a population). The least fitness on a fine grid tells how near they come.
"""

from __future__ import annotations

import itertools
from statistics import median

import numpy as np

from agents.genetic import GeneticSettings, genetic_search
from agents.studies.off_the_shelf import EVALUATIONS, OPTIMISERS, SETTINGS, Search, contestant
from agents.studies.race import Contestant, race
from agents.studies.swing_point import SwingPoint, later_swing_point
from benchmarks.report import Report, command_line
from jet_gym.balance import BalanceSettings
from jet_gym.fitness import FitnessSettings
from jet_gym.utils.arrays import Array

_BALANCE, _FITNESS = BalanceSettings(), FitnessSettings()
_SEEDS = 25
_GRID = 101  # places a side of the cube, 0.5 mm apart
_GOALS = {
    "pymoo GA, 30 bits": 100.0,
    "pymoo GA, 3 reals": 100.0,
    "DEAP, one by one": 30.0,
    "DEAP, in batches": 30.0,
}


def measure(rounds: int) -> Report:
    """Run the race."""
    report = Report(f"GAS at one swing point, {EVALUATIONS:,} evaluations")
    point = later_swing_point()
    there = {module: report.has(module) for module in ("pymoo", "deap", "cmaes")}
    others = {name: make(point) for name, module, make in OPTIMISERS if there[module]}
    ours, *theirs = race([_gas("GAS", point), *itertools.starmap(contestant, others.items())], rounds)
    report.add("GAS", ours.seconds, "s", goal=1e-3)
    for other in theirs:
        report.add(other.name, other.seconds, "s")
        report.add(
            f"GAS over {other.name}",
            other.ratio, "x", lowest=other.lowest, highest=other.highest,
            goal=_GOALS.get(other.name), at_least=True,
        )  # fmt: skip
    _compare_fitness(report, point, others)
    _break_down(report, point, rounds)
    return report


def _gas(name: str, point: SwingPoint, settings: GeneticSettings = SETTINGS) -> Contestant:
    """Search with one random generator throughout, as a plan does."""
    generator = np.random.default_rng(0)
    return Contestant(name, lambda: _search(point, settings, generator))


def _search(point: SwingPoint, settings: GeneticSettings, generator: np.random.Generator) -> Array:
    return genetic_search(point.step, point.swing_sole, point.previous, settings, _BALANCE, _FITNESS, generator)


def _compare_fitness(report: Report, point: SwingPoint, others: dict[str, Search]) -> None:
    def gas(seed: int) -> float:
        return point.fitness_of_one(*_search(point, SETTINGS, np.random.default_rng(seed)))

    report.add("fitness, least on a grid of 0.5 mm", _least_on_grid(point))
    for name, search in {"GAS": gas, **others}.items():
        reached = [search(seed) for seed in range(_SEEDS)]
        report.add(f"fitness, {name}", median(reached), lowest=min(reached), highest=max(reached))
    report.notes.append(f"Fitness reached: median, least and largest of {_SEEDS} seeds; less is better.")


def _least_on_grid(point: SwingPoint) -> float:
    axes = [np.linspace(low, high, _GRID) for low, high in zip(point.lowest, point.highest, strict=True)]
    grid = np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")])
    return float(point.fitness(grid).min())


def _break_down(report: Report, point: SwingPoint, rounds: int) -> None:
    """Tell where GAS's time goes: evaluations, genetic operators with their random numbers, the call itself."""
    many = np.ascontiguousarray(point.random_pelvises(EVALUATIONS).T)
    two = np.ascontiguousarray(many[:, :2])
    smallest_search = GeneticSettings(population=2, generations=1)
    whole, smallest, evaluation, smallest_evaluation = race(
        [
            _gas("whole", point),
            _gas("smallest", point, smallest_search),
            Contestant("evaluations", lambda: point.fitness(many)),
            Contestant("two evaluations", lambda: point.fitness(two)),
        ],
        rounds,
    )
    evaluating = evaluation.seconds - smallest_evaluation.seconds
    shares = {
        "evaluations": evaluating,
        "random numbers and operators": whole.seconds - smallest.seconds - evaluating,
        "the call from Python": smallest.seconds,
    }
    for name, seconds in shares.items():
        report.add(f"GAS's time, {name}", 100.0 * seconds / whole.seconds, "%")


if __name__ == "__main__":
    command_line(__doc__, measure)
