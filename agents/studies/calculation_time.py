"""Fig. 10 of the paper: how long a swing point takes, and beside it what one would take off the shelf."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from statistics import median

import numpy as np

from agents.planner import PointByPointPlanner, make_planner
from agents.studies.off_the_shelf import OPTIMISERS, contestant, missing_note
from agents.studies.race import Contestant, race
from agents.studies.swing_point import SwingPoint, later_swing_point
from jet_gym.utils.arrays import Array
from jet_gym.utils.progress import Progress

_PLANNERS = ("gas", "ga", "gaex")


@dataclass(frozen=True)
class PointTime:
    """How long one swing point takes.

    Attributes:
        name: Planner or optimiser.
        seconds: Median processor time [s].
        ratio: That over the time of GAS.
        lowest: Smallest ratio of any round.
        highest: Largest ratio of any round.
        fitness: Median of the fitness reached, over seeds; that of the same problem for all.
        off_the_shelf: Whether it is another library's.
    """

    name: str
    seconds: float
    ratio: float
    lowest: float
    highest: float
    fitness: float
    off_the_shelf: bool


def measure_calculation_time(
    rounds: int, seeds: int = 9, progress: Progress | None = None
) -> tuple[list[PointTime], list[str]]:
    """Let everybody solve the middle swing point of the paper's step across the ditch, on one core at a time.

    GAS, GA and the other optimisers evaluate 1,200 postures; GAEx up to 13^3, and stops at the first that balances.

    Args:
        rounds: How often everybody has a turn.
        seeds: How many searches the fitness is the median of.
        progress: Called with how many parts of the work are done.

    Returns:
        Times, that of GAS first, and a sentence for each library that is not installed.
    """
    point = later_swing_point()
    notes = sorted({note for _, module, _ in OPTIMISERS if (note := missing_note(module))})
    choices = {name: _planner_choice(name, point) for name in _PLANNERS}
    others = {name: make(point) for name, module, make in OPTIMISERS if missing_note(module) is None}
    generator = np.random.default_rng(0)  # one throughout, as a plan has
    contestants = [Contestant(name, partial(choose, generator)) for name, choose in choices.items()]
    timings = race([*contestants, *itertools.starmap(contestant, others.items())], rounds)
    rows = []
    for done, timing in enumerate(timings, start=1):
        name = timing.name
        if name in choices:
            reached = [point.fitness_of_one(*choices[name](np.random.default_rng(seed))) for seed in range(seeds)]
        else:
            reached = [others[name](seed) for seed in range(seeds)]
        rows.append(
            PointTime(
                name, timing.seconds, timing.ratio, timing.lowest, timing.highest, median(reached), name in others
            )
        )
        if progress is not None:
            progress(done, len(timings))
    return rows, notes


def _planner_choice(name: str, point: SwingPoint) -> Callable[[np.random.Generator], Array]:
    planner = make_planner(name)
    if not isinstance(planner, PointByPointPlanner):
        raise TypeError(f"{name} does not go point by point")

    def choose(generator: np.random.Generator) -> Array:
        pelvis, _ = planner.choose(point.step, point.swing_sole, point.previous, False, generator)
        return pelvis

    return choose
