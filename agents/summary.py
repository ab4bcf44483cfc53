"""The figures by which plans of a step are compared, over one seed or many."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from jet_gym.plan import Plan
from jet_gym.utils.statistics import Interval, bootstrap_mean


@dataclass(frozen=True)
class PlanSummary:
    """Plans of one step by one planner, each figure as mean over the plans with a 95 % bootstrap interval.

    Attributes:
        planner: Name of the planner.
        mean_thrust: Mean thrust over the swing points [N].
        peak_thrust: Largest thrust [N].
        pelvis_roughness: Root mean square second difference of the pelvis path [m].
        thrust_roughness: Root mean square second difference of the thrust [N].
        total_fitness: Sum of the fitness.
        violated_points: Swing points at which a constraint is violated.
        milliseconds_per_point: Median solve time a swing point, the first one left out [ms].
        largest_thrust: Largest thrust of all plans [N].
        violations: Names of the constraints that any plan violates anywhere.
    """

    planner: str
    mean_thrust: Interval
    peak_thrust: Interval
    pelvis_roughness: Interval
    thrust_roughness: Interval
    total_fitness: Interval
    violated_points: Interval
    milliseconds_per_point: Interval
    largest_thrust: float
    violations: frozenset[str]


def summarize(plans: Sequence[Plan]) -> PlanSummary:
    """Summarize plans of one step by one planner, one a seed.

    Raises:
        ValueError: If there is no plan, or the plans are of several planners.
    """
    planners = {plan.planner for plan in plans}
    if len(planners) != 1:
        raise ValueError(f"a summary is of the plans of one planner, not of {sorted(planners)}")

    def mean(figure: Callable[[Plan], float]) -> Interval:
        return bootstrap_mean([figure(plan) for plan in plans])

    return PlanSummary(
        planner=planners.pop(),
        mean_thrust=mean(lambda plan: float(plan.thrust.mean())),
        peak_thrust=mean(lambda plan: float(plan.thrust.max())),
        pelvis_roughness=mean(lambda plan: plan.pelvis_roughness),
        thrust_roughness=mean(lambda plan: plan.thrust_roughness),
        total_fitness=mean(lambda plan: plan.total_fitness),
        violated_points=mean(lambda plan: float(len(plan.violated_points))),
        milliseconds_per_point=mean(lambda plan: 1e3 * float(np.median(plan.solve_time[1:]))),
        largest_thrust=max(float(plan.thrust.max()) for plan in plans),
        violations=frozenset(_all_names(plans)),
    )


def _all_names(plans: Iterable[Plan]) -> Iterable[str]:
    return (name for plan in plans for names in plan.violations for name in names)
