"""What a path costs: the total fitness of a whole step, which planners that look ahead minimise.

The paper's fitness has no term for a ZMP outside of the support foot, eq. (11); here it has a penalty too, so that
no path is cheap by breaking that constraint alone. The range at the first swing point is about the nominal pelvis,
and the way from there costs nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from jet_gym.balance import BalanceSettings, Stance
from jet_gym.constraints import FIRST_RANGE, LATER_RANGE, ZMP
from jet_gym.fitness import FitnessParameters, FitnessSettings
from jet_gym.leg import Vector
from jet_gym.posture_state import fitness_of_candidates
from jet_gym.single_support import SingleSupport, single_support, stance_between
from jet_gym.step import Step
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined

FAR = 1e300  # the cost of what cannot be reached
_ROUNDING = 1e-9  # [m] of a distance that is compared with the search range


class SearchModel(NamedTuple):
    """The robot and what is minimised, in numbers that compiled code takes by value."""

    robot: SingleSupport
    fitness: FitnessParameters
    zmp_penalty: float  # for a ZMP outside of the support foot, eq. (11)
    search_range: float  # [m] eq. (13)


class SwingPoints(NamedTuple):
    """The swing points of a step, N of them, in numbers that compiled code takes by value."""

    soles: Array  # (N, 3) [m] the swing sole
    support_sole: Vector  # [m]
    centre: Vector  # [m] of the range at the first swing point
    first_range: float  # [m] that range, on either side, per axis


def search_of_step(
    step: Step,
    balance: BalanceSettings,
    fitness: FitnessSettings,
    *,
    first_range: float = FIRST_RANGE,
    search_range: float = LATER_RANGE,
    zmp_penalty: float = 9000.0,
) -> tuple[SearchModel, SwingPoints]:
    """Return a step, and what is minimised over it, in numbers that compiled code takes by value.

    Args:
        step: The step.
        balance: What counts as balanced.
        fitness: Weights and penalties.
        first_range: Range of the pelvis about the nominal one at the first swing point, per axis [m], Table 2.
        search_range: Largest move of the pelvis between two swing points, per axis [m], eq. (13).
        zmp_penalty: What a ZMP outside of the support foot costs.
    """
    robot = single_support(step.robot, step.swing, balance)
    x, y, z = step.nominal_pelvis.tolist()
    model = SearchModel(robot, fitness.parameters(), zmp_penalty, search_range)
    return model, SwingPoints(step.swing_sole, step.support, (x, y, z), first_range)


@inlined
def stance_at(model: SearchModel, points: SwingPoints, point: int) -> Stance:
    """Return the stance at a swing point."""
    sole = (points.soles[point, 0], points.soles[point, 1], points.soles[point, 2])
    return stance_between(model.robot, sole, points.support_sole)


@entry_point
def exact_costs(model: SearchModel, stance: Stance, candidates: Array, costs: Array) -> None:
    """Compute what postures (3, n) cost at a swing point, the way to them left out: f1 + f2 + f4, eq. (11) too."""
    p = model.fitness
    without_f3 = FitnessParameters(0.0, p.joint_limit_penalty, p.edge_penalty, p.thrust_penalty, p.thrust_weight)
    violations = np.empty(candidates.shape[1], np.int64)
    fitness_of_candidates(model.robot, without_f3, stance, (0.0, 0.0, 0.0), candidates, costs, violations)
    for i in range(len(costs)):
        costs[i] += model.zmp_penalty if violations[i] & ZMP else 0.0


@entry_point
def cost_of_path(model: SearchModel, points: SwingPoints, path: Array) -> float:
    """Return the total cost of a path (N, 3) [m]; ``FAR`` if it leaves the search range, eq. (13)."""
    total = 0.0
    candidate, cost = np.empty((3, 1)), np.empty(1)
    for point in range(len(path)):
        stance = stance_at(model, points, point)
        for axis in range(3):
            candidate[axis, 0] = path[point, axis]
            moved = path[point, axis] - path[max(point - 1, 0), axis]
            total += model.fitness.smoothness_weight * moved * moved
            if abs(moved) > model.search_range + _ROUNDING:
                return FAR
        exact_costs(model, stance, candidate, cost)
        total += cost[0]
    return total
