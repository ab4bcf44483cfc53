r"""A path's last millimetre: an interior-point method on the whole step at once.

Inside the set of postures that meet the constraints, thrust and constraints are smooth in the pelvis, so that a
path of a lattice can be led on to the nearest local optimum of the total fitness. This is the logarithmic barrier
method (Boyd and Vandenberghe, Convex Optimization, 2004, chapter 11): with the slacks :math:`s_i`, what is left of
each constraint (:mod:`agents.paths.slacks`), Newton's method minimises

.. math:: f - \mu \sum_i \log s_i

for the total fitness :math:`f` and ever smaller :math:`\mu`. Neighbouring swing points alone are coupled, which
makes the Hessian a narrow band.

Where the thrust is least, the edge polygon ends in a tip that is far narrower than a useful step. So a step leads
the centre of mass, not the pelvis, along a straight line.

A constraint that the path violates at a swing point has cost its penalty already, and is left out there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.paths.cost import FAR, SearchModel, SwingPoints, stance_at
from agents.paths.linear_algebra import solve_banded
from agents.paths.slacks import (
    COM_X,
    COM_Y,
    EDGE_SLACKS,
    FILLED,
    JOINT_SLACKS,
    REACH_SLACKS,
    SLACKS,
    THRUST_SLACKS,
    UNKNOWNS,
    ZMP_SLACKS,
    Derivatives,
    differentiate_slacks,
    fill_slacks,
)
from jet_gym.balance import Stance
from jet_gym.constraints import EDGE_POLYGON, JOINT_LIMITS, REACH, THRUST, ZMP
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined

_MU_FACTOR = 0.3
_NEWTON_STEPS = 25  # for each mu, at most
_CLOSE = 0.03  # decrement over mu that ends them
_KEPT = 0.5  # of a slack, at least, in one step
_ARMIJO, _HALVINGS = 1e-4, 12
_CORRECTIONS = 8  # of the pelvis, to bring the centre of mass where it is to be


def shares_of_mu(of_thrust: float = 1.0) -> Array:
    """Return the share of ``mu`` of each slack (slacks,).

    Args:
        of_thrust: That of the edge polygon and of the thrust's limits; the others get all of it.
    """
    shares = np.ones(SLACKS)
    shares[EDGE_SLACKS:ZMP_SLACKS] = of_thrust
    return shares


@entry_point
def polish(
    model: SearchModel,
    points: SwingPoints,
    first_mu: float,
    last_mu: float,
    shares: Array,
    path: Array,
) -> int:
    """Lead a path to a local optimum of its total fitness.

    Args:
        model: The robot and what is minimised.
        points: The swing points.
        first_mu: Where ``mu`` begins: the larger, the farther the path is taken from the edge of its constraints.
        last_mu: Where ``mu`` stops: what each slack keeps the total fitness from its optimum by, about.
        shares: Share of ``mu`` that each slack's logarithm gets, as :func:`shares_of_mu` returns them (slacks,).
        path: The path (N, 3) [m]; changed in place.

    Returns:
        Newton steps taken; none if the path lies on the edge of its constraints, or beyond.
    """
    count = len(path)
    x, active = np.empty((count, UNKNOWNS)), np.empty((count, SLACKS), np.bool_)
    slacks = np.empty(FILLED)
    for point in range(count):
        _begin(model, stance_at(model, points, point), path[point], x[point], slacks, active[point])
    work = _Work(
        active=active,
        left=np.zeros((count, SLACKS)),
        weights=np.empty(SLACKS),
        here=Derivatives(slacks, np.empty((FILLED, UNKNOWNS)), np.empty((3, 3))),
        coms=np.empty((count, 2, 4)),
        gradient=np.empty(count * UNKNOWNS),
        band=np.empty((count * UNKNOWNS, UNKNOWNS + 1)),
        step=np.empty(count * UNKNOWNS),
        trial=np.empty((count, UNKNOWNS)),
    )
    mu, steps = first_mu, 0
    while True:
        work.weights[:] = mu * shares
        taken = _follow(model, points, mu, work, x)
        steps += max(taken, 0)
        if taken < 0 or mu <= last_mu:
            break
        mu = max(mu * _MU_FACTOR, last_mu)
    if steps > 0:
        path[:, :] = x[:, :3]
    return steps


class _Work(NamedTuple):
    """What the method works with."""

    active: NDArray[np.bool_]  # (N, slacks) constraints that are kept
    left: Array  # (N, slacks) where the last step ended
    weights: Array  # (slacks,) of their logarithms: mu, or a share of it
    here: Derivatives  # of one swing point
    coms: Array  # (N, 2, 4) derivatives of the centre of mass by the pelvis, and the centre of mass itself
    gradient: Array  # (unknowns of all swing points,) of the barrier function
    band: Array  # (unknowns of all swing points, 5): [i, d] is the Hessian's entry (i, i - d)
    step: Array  # (unknowns of all swing points,)
    trial: Array  # (N, unknowns)


@inlined
def _follow(model: SearchModel, points: SwingPoints, mu: float, work: _Work, x: Array) -> int:
    """Minimise the barrier function by Newton's method; return the steps taken, -1 where it is not defined."""
    value = _barrier(model, points, mu, work, x, 0.0)
    if value >= FAR:
        return -1
    for taken in range(_NEWTON_STEPS):
        _differentiate(model, points, mu, work, x)
        decrement = solve_banded(work.band, work.gradient, work.step)
        if not decrement > _CLOSE * mu:
            return taken
        length, shorter = 1.0, True
        for _ in range(_HALVINGS):
            for point in range(len(x)):
                _walk(model, stance_at(model, points, point), point, -length, work, x)
            shorter = _barrier(model, points, mu, work, work.trial, _KEPT) > value - _ARMIJO * length * decrement
            if not shorter:
                break
            length *= 0.5
        if shorter:
            return taken
        x[:, :] = work.trial
        value = _barrier(model, points, mu, work, x, 0.0)
    return _NEWTON_STEPS


@inlined
def _begin(
    model: SearchModel, stance: Stance, pelvis: Array, x: Array, slacks: Array, active: NDArray[np.bool_]
) -> None:
    """Set the unknowns of a swing point, and which constraints are to be kept."""
    x[0], x[1], x[2], x[3] = pelvis[0], pelvis[1], pelvis[2], 0.0
    thrust, violations = fill_slacks(model, stance, x, slacks)
    thrust_kept = violations & THRUST == 0
    x[3] = thrust + min(0.1, 0.5 * (model.robot.balance.max_thrust - thrust)) if thrust_kept else 0.0
    by_thrust = model.robot.balance.least_thrust  # then it is the thrust that keeps the ZMP inside
    active[EDGE_SLACKS:THRUST_SLACKS] = violations & EDGE_POLYGON == 0
    active[THRUST_SLACKS:ZMP_SLACKS] = thrust_kept
    active[ZMP_SLACKS:REACH_SLACKS] = (violations & ZMP == 0) & (thrust_kept or not by_thrust)
    active[REACH_SLACKS:JOINT_SLACKS] = violations & REACH == 0
    active[JOINT_SLACKS:] = violations & JOINT_LIMITS == 0


@inlined
def _walk(model: SearchModel, stance: Stance, point: int, length: float, work: _Work, x: Array) -> None:
    """Go along a step of a swing point's unknowns to its trial, the centre of mass on a straight line."""
    active, com, slacks, result = work.active[point], work.coms[point], work.here.slacks, work.trial[point]
    step = work.step[point * UNKNOWNS : (point + 1) * UNKNOWNS]
    for i in range(UNKNOWNS):
        result[i] = x[point, i] + length * step[i]
    if not (active[EDGE_SLACKS] or active[THRUST_SLACKS]):
        return
    target_x = com[0, 3] + length * (com[0, 0] * step[0] + com[0, 1] * step[1] + com[0, 2] * step[2])
    target_y = com[1, 3] + length * (com[1, 0] * step[0] + com[1, 1] * step[1] + com[1, 2] * step[2])
    scale = 1.0 / (com[0, 0] * com[1, 1] - com[0, 1] * com[1, 0])
    for _ in range(_CORRECTIONS):
        fill_slacks(model, stance, result, slacks)
        error_x, error_y = target_x - slacks[COM_X], target_y - slacks[COM_Y]
        if abs(error_x) + abs(error_y) < 1e-15:
            break
        result[0] += scale * (com[1, 1] * error_x - com[0, 1] * error_y)
        result[1] += scale * (com[0, 0] * error_y - com[1, 0] * error_x)


@entry_point
def _barrier(model: SearchModel, points: SwingPoints, mu: float, work: _Work, x: Array, kept: float) -> float:
    """Return the barrier function, or ``FAR`` where a slack is used up, or all but a share of what was left."""
    slacks = work.here.slacks
    total = 0.0
    for point in range(len(x)):
        reach = model.search_range if point > 0 else points.first_range
        for axis in range(3):
            moved = x[point, axis] - (x[point - 1, axis] if point > 0 else points.centre[axis])
            if abs(moved) >= reach:
                return FAR
            total -= mu * math.log((reach - moved) * (reach + moved))
            total += model.fitness.smoothness_weight * moved * moved if point > 0 else 0.0
        fill_slacks(model, stance_at(model, points, point), x[point], slacks)
        for i in range(SLACKS):
            if work.active[point, i]:
                if slacks[i] <= kept * work.left[point, i]:
                    return FAR
                if kept == 0.0:
                    work.left[point, i] = slacks[i]
                total -= work.weights[i] * math.log(slacks[i])
        if work.active[point, THRUST_SLACKS]:
            total += model.fitness.thrust_weight * x[point, 3]
    result: float = total
    return result


@inlined
def _differentiate(model: SearchModel, points: SwingPoints, mu: float, work: _Work, x: Array) -> None:
    """Compute gradient and Hessian of the barrier function."""
    gradient, band, (slacks, jacobian, curvature) = work.gradient, work.band, work.here
    gradient[:] = 0.0
    band[:, :] = 0.0
    weight = model.fitness.smoothness_weight
    for point in range(len(x)):
        stance, row = stance_at(model, points, point), point * UNKNOWNS
        differentiate_slacks(model, stance, work.weights, work.active[point], x[point], work.here)
        for a in range(3):
            for b in range(a + 1):
                band[row + a, a - b] += curvature[a, b]
        work.coms[point] = jacobian[COM_X:FILLED]
        work.coms[point, :, 3] = slacks[COM_X:FILLED]
        for i in range(SLACKS):
            if work.active[point, i]:
                pull = work.weights[i] / slacks[i]
                stiffness = pull / slacks[i]
                for a in range(UNKNOWNS):
                    gradient[row + a] -= pull * jacobian[i, a]
                    for b in range(a + 1):
                        band[row + a, a - b] += stiffness * jacobian[i, a] * jacobian[i, b]
        if work.active[point, THRUST_SLACKS]:
            gradient[row + 3] += model.fitness.thrust_weight
        else:
            band[row + 3, 0] += 1.0  # the bound on the thrust stays where it is
        reach = model.search_range if point > 0 else points.first_range
        for axis in range(3):
            moved = x[point, axis] - (x[point - 1, axis] if point > 0 else points.centre[axis])
            up, down = 1.0 / (reach - moved), 1.0 / (reach + moved)
            slope, hardness = mu * (up - down), mu * (up * up + down * down)
            if point > 0:
                slope += 2.0 * weight * moved
                hardness += 2.0 * weight
                gradient[row - UNKNOWNS + axis] -= slope
                band[row - UNKNOWNS + axis, 0] += hardness
                band[row + axis, UNKNOWNS] -= hardness
            gradient[row + axis] += slope
            band[row + axis, 0] += hardness
