"""Dynamic programming over a lattice of pelvis positions at every swing point.

The least total fitness of a path that ends at a node is the node's own cost plus the least, over the nodes of the
last swing point within the search range, of theirs plus ``omega`` times the squared distance. That distance is a
sum over the axes and the search range a cube, so the minimum is taken axis by axis: a windowed min-plus
convolution each (Felzenszwalb and Huttenlocher, "Distance transforms of sampled functions", 2012). The lattices
of two swing points need not be alike: each is the product of three sorted lines of coordinates.

A coarse lattice steps over feasible sets that are thinner than its spacing, such as the tip of the edge polygon,
where the thrust is least. Its costs can therefore be relaxed: constraints that are missed by less than a distance
count as met.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jet_gym.balance import BalanceParameters, BalanceSettings, Stance, stance_of
from jet_gym.compilation import entry_point, inlined
from jet_gym.constraints import ZMP
from jet_gym.fitness import FitnessParameters, FitnessSettings
from jet_gym.kinematics import within_limits
from jet_gym.leg import Leg, Vector
from jet_gym.posture import swing_and_support
from jet_gym.posture_state import fitness_of_candidates, posture_at
from jet_gym.robot import Trunk
from jet_gym.step import Step
from jet_gym.urdf import Array

FAR = 1e300  # the cost of what cannot be reached
_BLOCK = 64  # postures whose relaxed cost is computed side by side
_ROUNDING = 1e-9  # [m] of a distance that is compared with the search range


class SearchModel(NamedTuple):
    """The robot and what is minimised, in numbers that compiled code takes by value."""

    swing_leg: Leg
    support_leg: Leg
    trunk: Trunk
    side: float  # +1 where the left leg swings, -1 where the right one does
    balance: BalanceParameters
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
    first_range: float = 0.150,
    search_range: float = 0.025,
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
    swing_leg, support_leg, side = swing_and_support(step.robot, step.swing)
    x, y, z = step.nominal_pelvis.tolist()
    model = SearchModel(
        swing_leg,
        support_leg,
        step.robot.trunk,
        side,
        balance.parameters(step.robot),
        fitness.parameters(),
        zmp_penalty,
        search_range,
    )
    return model, SwingPoints(step.swing_sole, step.support, (x, y, z), first_range)


class Lattices(NamedTuple):
    """A lattice at each of N swing points."""

    lines: Array  # (N, 3, M) [m] coordinates along x, y and z, sorted, the first `counts` of each
    counts: NDArray[np.int64]  # (N, 3)
    offsets: NDArray[np.int64]  # (N + 1,) where the nodes of a swing point begin among those of all


def make_lattices(lines: Sequence[Sequence[Array]]) -> Lattices:
    """Return lattices from their lines of coordinates along x, y and z [m], one triple a swing point."""
    counts = np.array([[len(line) for line in triple] for triple in lines], dtype=np.int64)
    padded = np.zeros((len(lines), 3, int(counts.max())))
    for point, triple in enumerate(lines):
        for axis, line in enumerate(triple):
            padded[point, axis, : len(line)] = line
    offsets = np.concatenate([[0], np.cumsum(counts.prod(axis=1))]).astype(np.int64)
    return Lattices(padded, counts, offsets)


@inlined
def stance_at(model: SearchModel, points: SwingPoints, point: int) -> Stance:
    """Return a swing point."""
    sole = (points.soles[point, 0], points.soles[point, 1], points.soles[point, 2])
    return stance_of(
        model.swing_leg, model.support_leg, model.side, model.balance.zmp_margin, sole, points.support_sole
    )


@entry_point
def accumulate(
    model: SearchModel,
    points: SwingPoints,
    lattices: Lattices,
    relaxation: float,
    first: int,
    last: int,
    values: Array,
) -> None:
    """Compute the least total cost of a path that ends at each node, for the swing points from first to last.

    Args:
        model: The robot and what is minimised.
        points: The swing points.
        lattices: The lattices.
        relaxation: Distance [m] by which a posture may miss a constraint and still count as meeting it.
        first: First swing point; the values of the one before it are known.
        last: The swing point after the last.
        values: Holds and receives the values of the nodes of all swing points.
    """
    for point in range(first, last):
        stance = stance_at(model, points, point)
        nodes = values[lattices.offsets[point] : lattices.offsets[point + 1]]
        candidates = _nodes(lattices, point)
        if relaxation > 0.0:
            _relaxed_costs(model, stance, relaxation, candidates, nodes)
        else:
            exact_costs(model, stance, candidates, nodes)
        if point > 0:
            _add_cost_of_arrival(model, lattices, point, values, nodes)


@inlined
def _nodes(lattices: Lattices, point: int) -> Array:
    """Return the positions (3, n) [m] of a swing point's nodes, z running fastest."""
    nx, ny, nz = lattices.counts[point]
    lines = lattices.lines[point]
    candidates = np.empty((3, nx * ny * nz))
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                node = (i * ny + j) * nz + k
                candidates[0, node], candidates[1, node], candidates[2, node] = (
                    lines[0, i],
                    lines[1, j],
                    lines[2, k],
                )
    return candidates


@entry_point
def exact_costs(model: SearchModel, stance: Stance, candidates: Array, costs: Array) -> None:
    """Compute what postures (3, n) cost at a swing point, the way to them left out: f1 + f2 + f4, eq. (11) too."""
    p = model.fitness
    without_f3 = FitnessParameters(0.0, p.joint_limit_penalty, p.edge_penalty, p.thrust_penalty, p.thrust_weight)
    violations = np.empty(candidates.shape[1], np.int64)
    fitness_of_candidates(
        model.swing_leg, model.support_leg, model.trunk, model.balance, without_f3, stance,
        (0.0, 0.0, 0.0), candidates, costs, violations,
    )  # fmt: skip
    for i in range(len(costs)):
        costs[i] += model.zmp_penalty if violations[i] & ZMP else 0.0


@entry_point
def _relaxed_costs(model: SearchModel, stance: Stance, relaxation: float, candidates: Array, costs: Array) -> None:
    """Compute what postures cost if constraints missed by less than a distance count as met.

    The joint limits of the model are to be widened beforehand.
    """
    own, found = np.empty((3, _BLOCK)), np.empty(_BLOCK)
    count = len(costs)
    for start in range(0, count, _BLOCK):
        for axis in range(3):
            for i in range(_BLOCK):  # the last block is filled up with its last node
                own[axis, i] = candidates[axis, min(start + i, count - 1)]
        for i in range(_BLOCK):
            found[i] = _relaxed_cost(model, stance, relaxation, (own[0, i], own[1, i], own[2, i]))
        for i in range(min(_BLOCK, count - start)):
            costs[start + i] = found[i]


@inlined
def _relaxed_cost(model: SearchModel, stance: Stance, relaxation: float, pelvis: Vector) -> float:
    balance, fitness = model.balance, model.fitness
    state = posture_at(model.swing_leg, model.support_leg, model.trunk, balance, stance, pelvis)
    com_x, com_y, _ = state.center_of_mass
    zx, zy = stance.assigned_zmp
    ux, uy = com_x - zx, com_y - zy
    vx, vy = stance.swing_ankle[0] - com_x, stance.swing_ankle[1] - com_y
    wx, wy = stance.swing_ankle[0] - zx, stance.swing_ankle[1] - zy
    missing = relaxation * np.sqrt(wx * wx + wy * wy)
    sine, cosine = abs(vx * uy - vy * ux), ux * vx + uy * vy
    in_polygon = (sine - balance.edge_slope * max(cosine, 0.0) <= missing) & (cosine >= -missing)

    fx, fy = stance.fan[0] - zx, stance.fan[1] - zy
    thrust_error = relaxation * balance.weight / max(np.sqrt(fx * fx + fy * fy), relaxation)
    thrust_given = (state.thrust >= -thrust_error) & (state.thrust <= balance.max_thrust + thrust_error)
    thrust = min(max(state.thrust, 0.0), balance.max_thrust)

    x_min, x_max, y_min, y_max = stance.support
    on_foot = (state.zmp[0] >= x_min - 2.0 * relaxation) & (state.zmp[0] <= x_max + 2.0 * relaxation)
    on_foot = on_foot & (state.zmp[1] >= y_min - 2.0 * relaxation) & (state.zmp[1] <= y_max + 2.0 * relaxation)

    reachable = state.out_of_reach <= relaxation
    in_limits = within_limits(model.swing_leg, state.swing_cosines, state.swing_sines)
    in_limits = in_limits & within_limits(model.support_leg, state.support_cosines, state.support_sines)
    f1 = 0.0 if reachable & in_limits else fitness.joint_limit_penalty
    f2 = 0.0 if reachable & in_polygon else fitness.edge_penalty
    f4 = fitness.thrust_weight * thrust if reachable & thrust_given else fitness.thrust_penalty
    f5 = 0.0 if reachable & on_foot else model.zmp_penalty
    return f1 + f2 + f4 + f5


@inlined
def _add_cost_of_arrival(model: SearchModel, lattices: Lattices, point: int, values: Array, nodes: Array) -> None:
    """Add the least value of the last swing point's nodes plus f3 of the way from there, axis by axis."""
    ox, oy, oz = lattices.counts[point - 1]
    nx, ny, nz = lattices.counts[point]
    before, after = lattices.lines[point - 1], lattices.lines[point]
    weight, reach = model.fitness.smoothness_weight, model.search_range
    along_z = np.empty((ox * oy, nz))
    previous = values[lattices.offsets[point - 1] : lattices.offsets[point]].reshape(ox * oy, oz)
    for row in range(ox * oy):
        for k in range(nz):
            least = FAR
            for old in range(oz):
                d = after[2, k] - before[2, old]
                if abs(d) <= reach:
                    least = min(least, previous[row, old] + weight * d * d)
            along_z[row, k] = least
    along_y = np.empty((ox, ny * nz))
    _min_plus(along_z.reshape(ox, oy, nz), before[1], after[1], weight, reach, along_y.reshape(ox, ny, nz))
    along_x = np.empty((1, nx, ny * nz))
    _min_plus(along_y.reshape(1, ox, ny * nz), before[0], after[0], weight, reach, along_x)
    for node in range(len(nodes)):
        nodes[node] = min(nodes[node] + along_x[0, node // (ny * nz), node % (ny * nz)], FAR)


@inlined
def _min_plus(values: Array, before: Array, after: Array, weight: float, reach: float, result: Array) -> None:
    """Take the windowed min-plus convolution along the middle axis: ``values`` (a, old, b) to (a, new, b)."""
    for a in range(values.shape[0]):
        for new in range(result.shape[1]):
            for b in range(values.shape[2]):
                result[a, new, b] = FAR
            for old in range(values.shape[1]):
                d = after[new] - before[old]
                if abs(d) <= reach:
                    cost = weight * d * d
                    for b in range(values.shape[2]):
                        result[a, new, b] = min(result[a, new, b], values[a, old, b] + cost)


@entry_point
def reach_boxes(model: SearchModel, points: SwingPoints, relaxation: float, boxes: Array) -> None:
    """Compute bounds of the pelvis positions at which both soles are within reach.

    Args:
        model: The robot.
        points: The swing points.
        relaxation: Distance [m] beyond the reach that is taken in.
        boxes: Receives the lowest and the highest position (N, 2, 3) [m]; lowest above highest if there is none.
    """
    for point in range(len(points.soles)):
        stance = stance_at(model, points, point)
        boxes[point, 0, :], boxes[point, 1, :] = -FAR, FAR
        _cut(boxes[point], model.swing_leg, stance, stance.swing_ankle, relaxation)
        _cut(boxes[point], model.support_leg, stance, stance.support_ankle, relaxation)


@inlined
def _cut(box: Array, leg: Leg, stance: Stance, ankle: Vector, relaxation: float) -> None:
    """Cut a box down to where a leg reaches its ankle, the hip above it."""
    c, s, hip = stance.cos_yaw, stance.sin_yaw, leg.hip
    centre = (
        ankle[0] - c * hip[0] + s * hip[1],
        ankle[1] - s * hip[0] - c * hip[1],
        ankle[2] - hip[2],
    )
    thigh = np.sqrt(leg.thigh[0] ** 2 + leg.thigh[1] ** 2 + leg.thigh[2] ** 2)
    shank = np.sqrt(leg.shank[0] ** 2 + leg.shank[1] ** 2 + leg.shank[2] ** 2)
    reach = thigh + shank + relaxation
    for axis in range(3):
        box[0, axis] = max(box[0, axis], centre[axis] - (reach if axis < 2 else 0.0))
        box[1, axis] = min(box[1, axis], centre[axis] + reach)


@entry_point
def trace_back(model: SearchModel, lattices: Lattices, values: Array, path: Array) -> float:
    """Write the path (N, 3) [m] of least total cost, once all values are known, and return that cost."""
    weight, reach = model.fitness.smoothness_weight, model.search_range
    last = len(path) - 1
    total = 0.0
    for point in range(last, -1, -1):
        lines = lattices.lines[point]
        nx, ny, nz = lattices.counts[point]
        start = lattices.offsets[point]
        best, least = 0, 2.0 * FAR
        for i in range(nx):
            dx = lines[0, i] - path[min(point + 1, last), 0]
            if point < last and abs(dx) > reach:
                continue
            for j in range(ny):
                dy = lines[1, j] - path[min(point + 1, last), 1]
                if point < last and abs(dy) > reach:
                    continue
                for k in range(nz):
                    dz = lines[2, k] - path[min(point + 1, last), 2]
                    if point < last and abs(dz) > reach:
                        continue
                    node = (i * ny + j) * nz + k
                    moved = weight * (dx * dx + dy * dy + dz * dz) if point < last else 0.0
                    value = values[start + node] + moved
                    if value < least:
                        best, least = node, value
        path[point, 0], path[point, 1] = lines[0, best // (ny * nz)], lines[1, best // nz % ny]
        path[point, 2] = lines[2, best % nz]
        if point == last:
            total = least
    return total


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
