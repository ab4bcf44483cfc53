"""Planners side by side on the same random steps, each held against the optimal reference.

The steps depend on the seed alone: step number k of a seed is the same however many are drawn and whoever plans.
Statistics follow Agarwal et al. (2021): interquartile means, bootstrap intervals over steps and seeds, and the
probability that one planner improves on another.

How time is measured: after everything else, in one process bound to one core, the planners take turns on some of
the steps, and what counts is processor time, so that another program's share of the core does not. A step's time is
that of the whole plan, the first swing point included, over its number of swing points; loading and compiling are
left out. The median over the steps is reported.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from time import process_time
from typing import Any, Literal

import numpy as np

from agents.planner import BatchPlanner, Planner, make_planner
from jet_gym.balance import BalanceSettings
from jet_gym.errors import SettingsError
from jet_gym.fitness import FitnessSettings
from jet_gym.plan import Plan
from jet_gym.step import Step
from jet_gym.utils.arrays import Array
from jet_gym.utils.interrupts import call_in_worker
from jet_gym.utils.progress import Progress
from jet_gym.utils.settings import require_whole
from jet_gym.utils.statistics import STATISTICS, Interval, bootstrap_steps, improvement
from jet_gym.utils.threads import one_core

REFERENCE = "optimal"
RIVAL = "gas"
FORMAT = "jet-gym-compare/1"
FIGURES = {
    "mean_thrust": "N",
    "peak_thrust": "N",
    "total_fitness": "1",
    "optimality_gap": "1",
    "excess_fitness": "1",
    "pelvis_roughness": "m",
    "thrust_roughness": "N",
    "violated_points": "share of swing points",
    "violated_steps": "share of steps",
    "falls": "share of steps",
    "zmp_margin": "m",
    "ms_per_point": "ms",
    "ms_per_point_in_batch": "ms",
}
"""What is measured, and in which unit.

``falls`` and ``zmp_margin`` with physics only, ``ms_per_point_in_batch`` of planners that plan many steps at once.
"""


@dataclass(frozen=True)
class CompareSettings:
    """What is compared.

    Attributes:
        planners: Names of planners.
        steps: How many random steps.
        seed: Seed of the steps.
        planner_seeds: How often each planner plans each step, with seeds from 0 on; those that ignore it, once.
        physics: ``"bullet"`` also executes the first plan of each planner for each step in simulation.
        balance: What counts as balanced.
        fitness: Weights and penalties.
        timed_steps: On how many of the steps time is measured.
        processes: How many processes plan and simulate.
    """

    planners: tuple[str, ...]
    steps: int = 100
    seed: int = 0
    planner_seeds: int = 1
    physics: Literal["quasistatic", "bullet"] = "quasistatic"
    balance: BalanceSettings = field(default_factory=BalanceSettings)
    fitness: FitnessSettings = field(default_factory=FitnessSettings)
    timed_steps: int = 20
    processes: int = 2

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed."""
        if not self.planners:
            raise SettingsError("name at least one planner")
        for name, least in (("steps", 2), ("planner_seeds", 1), ("timed_steps", 1), ("processes", 1), ("seed", 0)):
            require_whole(name, getattr(self, name), least)
        if self.physics not in ("quasistatic", "bullet"):
            raise SettingsError(f"physics must be 'quasistatic' or 'bullet', not {self.physics!r}")

    def make(self, name: str) -> Planner:
        """Make a planner with these settings."""
        return make_planner(name, balance=self.balance, fitness=self.fitness)


@dataclass(frozen=True, eq=False)
class Comparison:
    """What came out.

    Attributes:
        settings: What was compared.
        steps: The steps.
        measured: By planner and figure, what was measured (steps, seeds); time (timed steps, 1).
        plans: By planner, the plan of each step with the first seed.
    """

    settings: CompareSettings
    steps: list[Step]
    measured: dict[str, dict[str, Array]]
    plans: dict[str, list[Plan]]

    def estimate(self, planner: str, figure: str, statistic: str = "mean") -> Interval:
        """Return a statistic of a figure with its 95 % bootstrap interval."""
        return bootstrap_steps(self.measured[planner][figure], STATISTICS[statistic], self.settings.seed)

    def improvement(self, planner: str, other: str) -> Interval:
        """Return the probability that a planner's total fitness is below another's on a random step."""
        ours, theirs = (self.measured[name]["total_fitness"] for name in (planner, other))
        return bootstrap_steps(improvement(ours, theirs), STATISTICS["mean"], self.settings.seed)

    def win_share(self, planner: str, other: str = RIVAL) -> float:
        """Return the share of steps on which a planner's mean total fitness is below another's."""
        ours, theirs = (self.measured[name]["total_fitness"].mean(axis=1) for name in (planner, other))
        return float((ours < theirs).mean())

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data, format ``jet-gym-compare/1``."""
        names, settings = self.settings.planners, self.settings
        return {
            "format": FORMAT,
            "seed": settings.seed,
            "steps": settings.steps,
            "planner_seeds": settings.planner_seeds,
            "physics": settings.physics,
            "thrust_model": settings.balance.thrust_model,
            "smoothness_weight": settings.fitness.smoothness_weight,
            "units": FIGURES,
            "planners": {name: self._planner_dict(name) for name in names},
            "probability_of_improvement": {
                a: {b: _interval_dict(self.improvement(a, b)) for b in names if b != a} for a in names
            },
            "per_step": {
                "steps": [step.to_dict() for step in self.steps],
                "planners": {
                    name: {figure: _plain(values) for figure, values in self.measured[name].items()}
                    for name in names
                },
            },
        }

    def _planner_dict(self, name: str) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for figure in FIGURES:
            if figure not in self.measured[name]:
                found[figure] = None
                continue
            found[figure] = _interval_dict(self.estimate(name, figure))
            for statistic in ("iqm", "median"):
                found[figure][statistic] = _interval_dict(self.estimate(name, figure, statistic))
        found["win_share_against_gas"] = self.win_share(name) if RIVAL in self.measured else None
        return found


def compare(settings: CompareSettings, progress: Progress | None = None) -> Comparison:
    """Plan random steps with several planners and measure.

    The reference plans too, whether it is among the planners or not.

    Raises:
        SettingsError: A ``ValueError``, if there is no such planner.
        BulletMissingError: If physics is asked for and PyBullet is not installed.
    """
    from joblib import Parallel, delayed

    from jet_gym.simulation.bullet import require_bullet
    from jet_gym.task.drawing import draw_random_steps

    if settings.physics == "bullet":
        require_bullet()
    names = tuple(dict.fromkeys((*settings.planners, REFERENCE)))
    for name in names:
        settings.make(name)
    steps = draw_random_steps(settings.steps, settings.seed, settings.balance)
    timed = min(settings.timed_steps, len(steps))
    total = len(steps) + timed
    results = []
    workers = Parallel(n_jobs=min(settings.processes, len(steps)), return_as="generator", batch_size=1)
    call = delayed(call_in_worker)
    for result in workers(call(os.getpid(), _work, settings, names, step) for step in steps):
        results.append(result)
        if progress is not None:
            progress(len(results), total)
    measured = {
        name: {figure: np.array([one[name][0][figure] for one in results]) for figure in results[0][name][0]}
        for name in names
    }
    for name in names:
        reference = measured[REFERENCE]["total_fitness"]
        excess = measured[name]["total_fitness"] - reference
        measured[name]["excess_fitness"] = excess
        measured[name]["optimality_gap"] = excess / np.maximum(reference, 1e-9)

    def report(done: int) -> None:
        if progress is not None:
            progress(len(steps) + done, total)

    times = _measure_times(settings, names, steps, timed, report)
    for name in names:
        measured[name].update(times[name])
    return Comparison(settings, steps, measured, {name: [one[name][1] for one in results] for name in names})


def _work(
    settings: CompareSettings, names: Sequence[str], step: Step
) -> dict[str, tuple[dict[str, list[float]], Plan]]:
    """Plan one step with every planner; return the figures (seeds) and the first plan of each."""
    found = {}
    for name in names:
        planner = settings.make(name)
        seeds = 1 if planner.deterministic else settings.planner_seeds
        plans = [planner.plan(step, seed=seed) for seed in range(seeds)]
        figures = {
            "mean_thrust": [float(plan.thrust.mean()) for plan in plans],
            "peak_thrust": [float(plan.thrust.max()) for plan in plans],
            "total_fitness": [plan.total_fitness for plan in plans],
            "pelvis_roughness": [plan.pelvis_roughness for plan in plans],
            "thrust_roughness": [plan.thrust_roughness for plan in plans],
            "violated_points": [len(plan.violated_points) / step.points for plan in plans],
            "violated_steps": [float(bool(plan.violated_points)) for plan in plans],
        }
        if settings.physics == "bullet":
            figures.update(_executed(plans[0]))
        found[name] = figures, plans[0]
    return found


def _executed(plan: Plan) -> dict[str, list[float]]:
    """Execute a plan in simulation and return whether the robot fell, and the measured margin of the ZMP [m]."""
    from jet_gym.simulation import execute

    summary = execute([plan]).summary
    margin = summary.low_zmp_margin
    return {"falls": [float(summary.fallen)], "zmp_margin": [margin if math.isfinite(margin) else 0.0]}


def _measure_times(
    settings: CompareSettings,
    names: Sequence[str],
    steps: Sequence[Step],
    timed: int,
    report: Callable[[int], None],
) -> dict[str, dict[str, Array]]:
    """Return processor times a swing point [ms]: (timed steps, 1), and in a batch of all steps (1, 1)."""
    planners = {name: settings.make(name) for name in names}
    times: dict[str, list[list[float]]] = {name: [] for name in names}
    with one_core():
        for planner in planners.values():
            planner.plan(steps[0])
        for done, step in enumerate(steps[:timed], start=1):
            for name, planner in planners.items():
                started = process_time()
                planner.plan(step)
                times[name].append([1e3 * (process_time() - started) / step.points])
            report(done)
        found = {name: {"ms_per_point": np.array(values)} for name, values in times.items()}
        points = sum(step.points for step in steps)
        for name, planner in planners.items():
            if isinstance(planner, BatchPlanner):
                started = process_time()
                planner.plan_many(steps)
                batch = 1e3 * (process_time() - started) / points
                found[name]["ms_per_point_in_batch"] = np.array([[batch]])
    return found


def _interval_dict(interval: Interval) -> dict[str, Any]:
    return {"value": interval.mean, "low": interval.low, "high": interval.high}


def _plain(values: Array) -> list[Any]:
    listed: list[Any] = values.tolist()
    return [row[0] for row in listed] if values.shape[1] == 1 else listed
