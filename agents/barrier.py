"""A path's last millimetre: an interior-point method on the whole step at once.

Inside the set of postures that meet the constraints, thrust and constraints are smooth in the pelvis, so that a
path of a lattice can be led on to the nearest local optimum of the total fitness. This is the logarithmic barrier
method (Boyd and Vandenberghe, Convex Optimization, 2004, chapter 11): minimise the total fitness minus ``mu`` times
the sum of the logarithms of all slacks by Newton's method, and let ``mu`` fall. Slacks are differentiated
numerically; of their curvature what is positive is kept, so that the Hessian is positive definite. Neighbouring
swing points alone are coupled, which makes it a narrow band.

Where the thrust is least, the edge polygon ends in a tip that is far narrower than a useful step. So a step leads
the centre of mass, not the pelvis, along a straight line.

The unknowns of a swing point are the pelvis and a bound ``t`` on its thrust, which is what is minimised. So the
least thrust, which has kinks, needs no gradient: it is the smallest ``t`` that brings the ZMP into the sole.
A constraint that the path violates at a swing point has cost its penalty already, and is left out there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.lattice import FAR, SearchModel, SwingPoints, exact_costs, stance_at
from jet_gym.balance import Stance, edge_vectors, zmp_of
from jet_gym.compilation import entry_point, inlined
from jet_gym.constraints import EDGE_POLYGON, JOINT_LIMITS, REACH, THRUST, ZMP
from jet_gym.kinematics import from_middle
from jet_gym.leg import Leg, Vector
from jet_gym.posture_state import posture_at
from jet_gym.urdf import Array

# Slacks of a swing point.
_EDGES, _THRUST, _ON_FOOT, _REACHES, _JOINTS, _SLACKS = 0, 2, 5, 9, 11, 23
_UNKNOWNS = 4  # pelvis and bound on the thrust
_SHORTEST_STEP, _LONGEST_STEP, _THRUST_STEP = 2e-9, 1e-6, 1e-6  # [m], [m], [N] of the differences
_MU_FACTOR = 0.3
_NEWTON_STEPS = 25  # for each mu, at most
_CLOSE = 0.03  # decrement over mu that ends them
_KEPT = 0.5  # of a slack, at least, in one step
_ARMIJO, _HALVINGS = 1e-4, 12
_CORRECTIONS = 8  # of the pelvis, to bring the centre of mass where it is to be
_ROOM = 5e-4  # [m]
_DAMPING = 1e-9  # on the Hessian's diagonal, relative


@entry_point
def bring_inside(model: SearchModel, points: SwingPoints, path: Array) -> int:
    """Move the pelvis where the edge polygon or the thrust's limits are missed, where that is cheaper.

    The centre of mass goes into the middle half of the polygon, at least ``_ROOM`` from its tip.

    Args:
        model: The robot and what is minimised.
        points: The swing points.
        path: The path (N, 3) [m]; changed in place.

    Returns:
        How many swing points were moved.
    """
    moved, costs, candidates = 0, np.empty(2), np.empty((3, 2))
    x, slacks = np.zeros(_UNKNOWNS), np.empty(_SLACKS + 2)
    for point in range(len(path)):
        stance = stance_at(model, points, point)
        x[:3] = path[point]
        _, violations = _fill_slacks(model, stance, x, slacks)
        if violations & (EDGE_POLYGON | THRUST) == 0 or violations & REACH:
            continue
        target_x, target_y = _inside(model, stance, slacks[_SLACKS], slacks[_SLACKS + 1])
        for _ in range(2 * _CORRECTIONS):
            x[0] += target_x - slacks[_SLACKS]
            x[1] += target_y - slacks[_SLACKS + 1]
            _fill_slacks(model, stance, x, slacks)
        candidates[:, 0], candidates[:, 1] = path[point], x[:3]
        exact_costs(model, stance, candidates, costs)
        if costs[1] < costs[0]:
            path[point] = x[:3]
            moved += 1
    return moved


@inlined
def _inside(model: SearchModel, stance: Stance, com_x: float, com_y: float) -> tuple[float, float]:
    """Return the place of the centre of mass [m] inside of the edge polygon that is nearest, or nearly so."""
    balance, (zx, zy) = model.balance, stance.assigned_zmp
    ax, ay = stance.swing_ankle[0] - zx, stance.swing_ankle[1] - zy
    fx, fy = stance.fan[0] - zx, stance.fan[1] - zy
    length = max(math.sqrt(ax * ax + ay * ay), _ROOM)
    ax, ay = ax / length, ay / length
    a_thrust = balance.weight * (ax * fx + ay * fy) / max(fx * fx + fy * fy, _ROOM * _ROOM)  # [N/m]
    furthest = length
    if not balance.least_thrust:
        furthest = min(length, balance.max_thrust / max(a_thrust, 1e-9))
    along = (com_x - zx) * ax + (com_y - zy) * ay
    aside = (com_y - zy) * ax - (com_x - zx) * ay
    along = min(max(along, _ROOM), furthest - _ROOM)
    width = 0.5 * balance.edge_slope * along * (length - along) / length
    aside = min(max(aside, -width), width)
    return zx + along * ax - aside * ay, zy + along * ay + aside * ax


def shares_of_mu(of_thrust: float = 1.0) -> Array:
    """Return the share of ``mu`` of each slack (slacks,).

    Args:
        of_thrust: That of the edge polygon and of the thrust's limits; the others get all of it.
    """
    shares = np.ones(_SLACKS)
    shares[_EDGES:_ON_FOOT] = of_thrust
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
    x, active = np.empty((count, _UNKNOWNS)), np.empty((count, _SLACKS), np.bool_)
    slacks = np.empty(_SLACKS + 2)
    for point in range(count):
        _begin(model, stance_at(model, points, point), path[point], x[point], slacks, active[point])
    work = _Work(
        active,
        np.zeros((count, _SLACKS)),
        slacks,
        np.empty((_SLACKS + 2, _UNKNOWNS)),
        np.empty((3, 3)),
        np.empty((count, 2, 4)),
        np.empty(count * _UNKNOWNS),
        np.empty((count * _UNKNOWNS, _UNKNOWNS + 1)),
        np.empty(count * _UNKNOWNS),
        np.empty((count, _UNKNOWNS)),
        shares,
    )
    mu, steps = first_mu, 0
    while True:
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
    slacks: Array  # (slacks and the centre of mass's x and y) of one swing point
    jacobian: Array  # (slacks and centre of mass, unknowns) of one swing point
    curvature: Array  # (3, 3) of one swing point
    coms: Array  # (N, 2, 4) derivatives of the centre of mass by the pelvis, and the centre of mass itself
    gradient: Array  # (unknowns of all swing points,) of the barrier function
    band: Array  # (unknowns of all swing points, 5): [i, d] is the Hessian's entry (i, i - d)
    step: Array  # (unknowns of all swing points,)
    trial: Array  # (N, unknowns)
    shares: Array  # (slacks,) of mu


@inlined
def _follow(model: SearchModel, points: SwingPoints, mu: float, work: _Work, x: Array) -> int:
    """Minimise the barrier function by Newton's method; return the steps taken, -1 where it is not defined."""
    value = _barrier(model, points, mu, work, x, 0.0)
    if value >= FAR:
        return -1
    for taken in range(_NEWTON_STEPS):
        _differentiate(model, points, mu, work, x)
        decrement = _solve(work.band, work.gradient, work.step)
        if not decrement > _CLOSE * mu:
            return taken
        length, shorter = 1.0, True
        for _ in range(_HALVINGS):
            for point in range(len(x)):
                step = work.step[point * _UNKNOWNS : (point + 1) * _UNKNOWNS]
                stance = stance_at(model, points, point)
                active, com, trial = work.active[point], work.coms[point], work.trial[point]
                _walk(model, stance, active, com, x[point], step, -length, work.slacks, trial)
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
    thrust, violations = _fill_slacks(model, stance, x, slacks)
    thrust_kept = violations & THRUST == 0
    x[3] = thrust + min(0.1, 0.5 * (model.balance.max_thrust - thrust)) if thrust_kept else 0.0
    active[_EDGES:_THRUST] = violations & EDGE_POLYGON == 0
    active[_THRUST:_ON_FOOT] = thrust_kept
    active[_ON_FOOT:_REACHES] = (violations & ZMP == 0) & (thrust_kept or not model.balance.least_thrust)
    active[_REACHES:_JOINTS] = violations & REACH == 0
    active[_JOINTS:] = violations & JOINT_LIMITS == 0


@entry_point  # too long to be inlined wherever it is called
def _fill_slacks(model: SearchModel, stance: Stance, x: Array, slacks: Array) -> tuple[float, int]:
    """Compute what is left of each constraint, positive while it holds; then x and y of the centre of mass.

    Returns:
        The thrust that the posture takes [N], and the violated constraints as flags.
    """
    balance = model.balance
    bound = x[3]
    state = posture_at(model.swing_leg, model.support_leg, model.trunk, balance, stance, (x[0], x[1], x[2]))
    com_x, com_y, _ = state.center_of_mass
    slacks[_SLACKS], slacks[_SLACKS + 1] = com_x, com_y
    sine, cosine, _ = edge_vectors(stance, com_x, com_y)
    wx, wy = stance.swing_ankle[0] - stance.assigned_zmp[0], stance.swing_ankle[1] - stance.assigned_zmp[1]
    scale = 1.0 / max(math.sqrt(wx * wx + wy * wy), 1e-6)
    slacks[_EDGES] = (balance.edge_slope * cosine - sine) * scale
    slacks[_EDGES + 1] = (balance.edge_slope * cosine + sine) * scale
    thrust, margin = state.thrust, 0.0
    slacks[_THRUST + 2] = bound - thrust
    if balance.least_thrust:
        thrust, margin = bound, balance.zmp_margin
        slacks[_THRUST + 2] = 1.0  # it is the ZMP that bounds the thrust from below
    slacks[_THRUST], slacks[_THRUST + 1] = thrust, balance.max_thrust - thrust
    zmp_x, zmp_y = zmp_of(balance.weight, com_x, com_y, stance.fan, thrust)
    slacks[_ON_FOOT] = zmp_x - stance.support[0] - margin
    slacks[_ON_FOOT + 1] = stance.support[1] - margin - zmp_x
    slacks[_ON_FOOT + 2] = zmp_y - stance.support[2] - margin
    slacks[_ON_FOOT + 3] = stance.support[3] - margin - zmp_y
    slacks[_REACHES] = _reach_left(model.swing_leg, stance, stance.swing_ankle, x)
    slacks[_REACHES + 1] = _reach_left(model.support_leg, stance, stance.support_ankle, x)
    for joint in range(6):
        leg = model.swing_leg
        cosine, _ = from_middle(leg, joint, state.swing_cosines[joint], state.swing_sines[joint])
        slacks[_JOINTS + joint] = cosine - leg.range_half_cosines[joint]
        leg = model.support_leg
        cosine, _ = from_middle(leg, joint, state.support_cosines[joint], state.support_sines[joint])
        slacks[_JOINTS + 6 + joint] = cosine - leg.range_half_cosines[joint]
    knee = 3
    slacks[_JOINTS + knee] = _knee_left(model.swing_leg, state.swing_cosines[knee], state.swing_sines[knee])
    slacks[_JOINTS + 6 + knee] = _knee_left(
        model.support_leg, state.support_cosines[knee], state.support_sines[knee]
    )
    return state.thrust, state.violations


@inlined
def _walk(
    model: SearchModel,
    stance: Stance,
    active: NDArray[np.bool_],
    com: Array,
    x: Array,
    step: Array,
    length: float,
    slacks: Array,
    result: Array,
) -> None:
    """Go along a step of the unknowns, the centre of mass on a straight line."""
    for i in range(_UNKNOWNS):
        result[i] = x[i] + length * step[i]
    if not (active[_EDGES] or active[_THRUST]):
        return
    target_x = com[0, 3] + length * (com[0, 0] * step[0] + com[0, 1] * step[1] + com[0, 2] * step[2])
    target_y = com[1, 3] + length * (com[1, 0] * step[0] + com[1, 1] * step[1] + com[1, 2] * step[2])
    scale = 1.0 / (com[0, 0] * com[1, 1] - com[0, 1] * com[1, 0])
    for _ in range(_CORRECTIONS):
        _fill_slacks(model, stance, result, slacks)
        error_x, error_y = target_x - slacks[_SLACKS], target_y - slacks[_SLACKS + 1]
        if abs(error_x) + abs(error_y) < 1e-15:
            break
        result[0] += scale * (com[1, 1] * error_x - com[0, 1] * error_y)
        result[1] += scale * (com[0, 0] * error_y - com[1, 0] * error_x)


@inlined
def _knee_left(leg: Leg, cosine: float, sine: float) -> float:
    """Return what is left of a knee's range, in cosines of its flexion from the straight leg.

    Where a leg becomes straight, its flexion is the square root of what is left of the reach; the cosine is smooth.
    """
    straight = math.atan2(
        leg.thigh[0] * leg.shank[2] - leg.thigh[2] * leg.shank[0],
        leg.thigh[0] * leg.shank[0] + leg.thigh[2] * leg.shank[2],
    )
    ends = leg.knee_direction * (leg.lower[3] - straight), leg.knee_direction * (leg.upper[3] - straight)
    least, most = min(ends[0], ends[1]), min(max(ends[0], ends[1]), math.pi)
    cos_flexion = cosine * math.cos(straight) + sine * math.sin(straight)
    left = cos_flexion - math.cos(most)
    return min(left, math.cos(least) - cos_flexion) if least > 1e-9 else left


@inlined
def _reach_left(leg: Leg, stance: Stance, ankle: Vector, x: Array) -> float:
    """Return how far a leg is from being straight, or its ankle from the hip's side, whichever is nearer [m]."""
    dx = x[0] + stance.cos_yaw * leg.hip[0] - stance.sin_yaw * leg.hip[1] - ankle[0]
    dy = x[1] + stance.sin_yaw * leg.hip[0] + stance.cos_yaw * leg.hip[1] - ankle[1]
    dz = x[2] + leg.hip[2] - ankle[2]
    lateral = leg.shank[1]
    aside = dy * dy + dz * dz - lateral * lateral
    thigh = math.sqrt(leg.thigh[0] ** 2 + leg.thigh[2] ** 2)
    shank = math.sqrt(leg.shank[0] ** 2 + leg.shank[2] ** 2)
    straight = thigh + shank
    distance_squared = dx * dx + aside
    left: float = min(straight * straight - distance_squared, aside) / straight
    return left


@entry_point
def _barrier(model: SearchModel, points: SwingPoints, mu: float, work: _Work, x: Array, kept: float) -> float:
    """Return the barrier function, or ``FAR`` where a slack is used up, or all but a share of what was left."""
    slacks = work.slacks
    total = 0.0
    for point in range(len(x)):
        reach = model.search_range if point > 0 else points.first_range
        for axis in range(3):
            moved = x[point, axis] - (x[point - 1, axis] if point > 0 else points.centre[axis])
            if abs(moved) >= reach:
                return FAR
            total -= mu * math.log((reach - moved) * (reach + moved))
            total += model.fitness.smoothness_weight * moved * moved if point > 0 else 0.0
        _fill_slacks(model, stance_at(model, points, point), x[point], slacks)
        for i in range(_SLACKS):
            if work.active[point, i]:
                if slacks[i] <= kept * work.left[point, i]:
                    return FAR
                if kept == 0.0:
                    work.left[point, i] = slacks[i]
                total -= mu * work.shares[i] * math.log(slacks[i])
        if work.active[point, _THRUST]:
            total += model.fitness.thrust_weight * x[point, 3]
    result: float = total
    return result


@inlined
def _differentiate(model: SearchModel, points: SwingPoints, mu: float, work: _Work, x: Array) -> None:
    """Compute gradient and Hessian of the barrier function."""
    gradient, band, slacks, jacobian = work.gradient, work.band, work.slacks, work.jacobian
    gradient[:] = 0.0
    band[:, :] = 0.0
    weight = model.fitness.smoothness_weight
    for point in range(len(x)):
        stance, row = stance_at(model, points, point), point * _UNKNOWNS
        _fill_jacobian(
            model, stance, mu, work.shares, work.active[point], x[point], slacks, jacobian, work.curvature
        )
        for a in range(3):
            for b in range(a + 1):
                band[row + a, a - b] += work.curvature[a, b]
        work.coms[point] = jacobian[_SLACKS:]
        work.coms[point, :, 3] = slacks[_SLACKS:]
        for i in range(_SLACKS):
            if work.active[point, i]:
                pull = mu * work.shares[i] / slacks[i]
                stiffness = pull / slacks[i]
                for a in range(_UNKNOWNS):
                    gradient[row + a] -= pull * jacobian[i, a]
                    for b in range(a + 1):
                        band[row + a, a - b] += stiffness * jacobian[i, a] * jacobian[i, b]
        if work.active[point, _THRUST]:
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
                gradient[row - _UNKNOWNS + axis] -= slope
                band[row - _UNKNOWNS + axis, 0] += hardness
                band[row + axis, _UNKNOWNS] -= hardness
            gradient[row + axis] += slope
            band[row + axis, 0] += hardness


@inlined
def _fill_jacobian(
    model: SearchModel,
    stance: Stance,
    mu: float,
    shares: Array,
    active: NDArray[np.bool_],
    x: Array,
    slacks: Array,
    jacobian: Array,
    curvature: Array,
) -> None:
    """Compute the slacks, their derivatives (slack, unknown) and the curvature (3, 3) that they give the barrier.

    All by central differences. Where a leg is nearly straight, the centre of mass varies with the square root of
    what is left of its reach, so that the step of the differences has to be less than that.
    """
    _fill_slacks(model, stance, x, slacks)
    left = min(slacks[_REACHES], slacks[_REACHES + 1]) if active[_REACHES] else _LONGEST_STEP
    size = min(max(0.02 * left, _SHORTEST_STEP), _LONGEST_STEP)
    there, shifted, weights = np.empty(_UNKNOWNS), np.empty(len(slacks)), np.zeros(_SLACKS)
    middle = 0.0
    for i in range(_SLACKS):
        if active[i]:
            weights[i] = mu * shares[i] / slacks[i]
            middle += mu * shares[i]
    there[:] = x
    for a in range(_UNKNOWNS):
        step = size if a < 3 else _THRUST_STEP
        second = -2.0 * middle
        for sign in (1.0, -1.0):
            there[a] = x[a] + sign * step
            _fill_slacks(model, stance, there, shifted)
            for i in range(len(slacks)):
                jacobian[i, a] = (jacobian[i, a] if sign < 0.0 else 0.0) + sign * shifted[i] / (2.0 * step)
            for i in range(_SLACKS):
                second += weights[i] * shifted[i] if active[i] else 0.0
        there[a] = x[a]
        if a < 3:
            curvature[a, a] = -second / (size * size)
    for a in range(3):
        for b in range(a):
            second = -2.0 * middle
            for sign in (1.0, -1.0):
                there[a], there[b] = x[a] + sign * size, x[b] + sign * size
                _fill_slacks(model, stance, there, shifted)
                for i in range(_SLACKS):
                    second += weights[i] * shifted[i] if active[i] else 0.0
            there[a], there[b] = x[a], x[b]
            curvature[a, b] = 0.5 * (-second / (size * size) - curvature[a, a] - curvature[b, b])
            curvature[b, a] = curvature[a, b]
    _make_positive(curvature)


@inlined
def _make_positive(matrix: Array) -> None:
    """Set the negative eigenvalues of a symmetric matrix (3, 3) to zero."""
    eigenvalues, eigenvectors = np.linalg.eigh(matrix)
    matrix[:, :] = 0.0
    for k in range(3):
        for a in range(3):
            for b in range(3):
                matrix[a, b] += max(eigenvalues[k], 0.0) * eigenvectors[a, k] * eigenvectors[b, k]


@inlined
def _solve(band: Array, gradient: Array, step: Array) -> float:
    """Solve Hessian times step = gradient by a Cholesky factorisation in place; return gradient times step."""
    size, width = band.shape[0], band.shape[1] - 1
    for i in range(size):
        band[i, 0] += _DAMPING * band[i, 0] + 1e-12
        for j in range(max(0, i - width), i + 1):
            total = band[i, i - j]
            for k in range(max(0, i - width, j - width), j):
                total -= band[i, i - k] * band[j, j - k]
            band[i, i - j] = total / band[j, 0] if i != j else math.sqrt(max(total, 1e-300))
    for i in range(size):
        total = gradient[i]
        for k in range(max(0, i - width), i):
            total -= band[i, i - k] * step[k]
        step[i] = total / band[i, 0]
    for i in range(size - 1, -1, -1):
        total = step[i]
        for k in range(i + 1, min(size, i + width + 1)):
            total -= band[k, k - i] * step[k]
        step[i] = total / band[i, 0]
    decrement = 0.0
    for i in range(size):
        decrement += gradient[i] * step[i]
    return decrement
