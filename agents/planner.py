"""What a planner is, and the planners by name."""

from __future__ import annotations

import importlib
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from time import perf_counter
from typing import Any, ClassVar

import numpy as np

from jet_gym.balance import BalanceSettings
from jet_gym.errors import SettingsError
from jet_gym.fitness import FitnessSettings
from jet_gym.plan import Plan
from jet_gym.step import Step
from jet_gym.utils.arrays import Array
from jet_gym.utils.progress import Progress
from jet_gym.utils.settings import require_seed

PLANNERS = {
    "gas": "agents.genetic:GasPlanner",
    "ga": "agents.genetic:GaPlanner",
    "gaex": "agents.exhaustive:GaexPlanner",
    "optimal": "agents.optimal:OptimalPlanner",
    "policy": "agents.policy:PolicyPlanner",
    "policy+refine": "agents.policy:RefinedPolicyPlanner",
}
"""Where each planner lives, by name."""


@dataclass(frozen=True)
class Planner(ABC):
    """Chooses the pelvis at every swing point of a step.

    Attributes:
        balance: What counts as balanced.
        fitness: Weights and penalties by which its plans are judged.
    """

    balance: BalanceSettings = field(default_factory=BalanceSettings)
    fitness: FitnessSettings = field(default_factory=FitnessSettings)
    name: ClassVar[str]
    deterministic: ClassVar[bool] = False  # whether the seed changes nothing

    @abstractmethod
    def plan(self, step: Step, seed: int = 0, progress: Progress | None = None) -> Plan:
        """Plan a step.

        Args:
            step: The step.
            seed: Seed of the search; the same seed gives the same plan to the last bit on the same machine.
            progress: Called after each swing point.

        Returns:
            The best plan found. Where a constraint is violated, the plan says so.

        Raises:
            ValueError: If the seed is not a whole number of 0 or more.
        """


@dataclass(frozen=True)
class BatchPlanner(Planner):
    """A planner that takes a fraction of the time for a step if it plans many of them at once."""

    @abstractmethod
    def plan_many(self, steps: Sequence[Step], seed: int = 0, progress: Progress | None = None) -> list[Plan]:
        """Plan many steps in one thread; the plans are those of :meth:`plan`."""


@dataclass(frozen=True)
class PointByPointPlanner(Planner):
    """A planner that goes through the swing points in order and never looks back or ahead."""

    def plan(self, step: Step, seed: int = 0, progress: Progress | None = None) -> Plan:
        """Plan a step, one swing point after the other; see :meth:`Planner.plan`."""
        require_seed(seed)
        generator = np.random.default_rng(seed)
        soles, previous = step.swing_sole, step.nominal_pelvis
        path, solve_time, evaluations = np.empty((step.points, 3)), np.empty(step.points), np.empty(step.points)
        self.warm_up(step)
        for point in range(step.points):
            started = perf_counter()
            path[point], evaluations[point] = self.choose(step, soles[point], previous, point == 0, generator)
            solve_time[point] = perf_counter() - started
            previous = path[point]
            if progress is not None:
                progress(point + 1, step.points)
        return Plan.from_pelvis_path(
            step,
            path,
            planner=self.name,
            seed=int(seed),
            balance=self.balance,
            fitness=self.fitness,
            search_range=self.search_range,
            solve_time=solve_time,
            evaluations=evaluations,
        )

    @property
    @abstractmethod
    def search_range(self) -> float:
        """Largest move of the pelvis between two swing points, per axis [m], eq. (13)."""

    @abstractmethod
    def choose(
        self, step: Step, swing_sole: Array, previous: Array, first: bool, generator: np.random.Generator
    ) -> tuple[Array, int]:
        """Choose the pelvis at one swing point.

        Args:
            step: The step.
            swing_sole: The swing sole (3,) [m].
            previous: Pelvis at the last swing point (3,) [m], or the nominal pelvis at the first.
            first: Whether this is the first swing point.
            generator: Source of random numbers.

        Returns:
            The pelvis (3,) [m] and how many postures were evaluated.
        """

    @abstractmethod
    def warm_up(self, step: Step) -> None:
        """Load or compile what :meth:`choose` needs, so that solve times leave it out."""


def make_planner(
    name: str,
    *,
    balance: BalanceSettings | None = None,
    fitness: FitnessSettings | None = None,
    **options: Any,
) -> Planner:
    """Make a planner by its name.

    Args:
        name: One of :data:`PLANNERS`.
        balance: What counts as balanced; the defaults where omitted.
        fitness: Weights and penalties; the defaults where omitted.
        **options: What this planner has besides, such as ``refine=16`` for ``"policy"``.

    Raises:
        SettingsError: A ``ValueError``, if there is no such planner, or it has no such option.
    """
    if name not in PLANNERS:
        raise SettingsError(f"there is no planner {name!r}; choose one of {', '.join(PLANNERS)}")
    module, _, class_name = PLANNERS[name].partition(":")
    planner: type[Planner] = getattr(importlib.import_module(module), class_name)
    known = {field.name for field in fields(planner) if field.init}
    if unknown := sorted(set(options) - known):
        raise SettingsError(f"the planner {name!r} has no option {unknown[0]!r}; it has {', '.join(sorted(known))}")
    return planner(balance=balance or BalanceSettings(), fitness=fitness or FitnessSettings(), **options)
