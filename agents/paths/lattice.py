"""Dynamic programming over a lattice of pelvis positions at every swing point.

The least total fitness of a path that ends at a node is the node's own cost plus the least, over the nodes of the
last swing point within the search range, of theirs plus ``omega`` times the squared distance. That distance is a
sum over the axes and the search range a cube, so the minimum is taken axis by axis: a windowed min-plus
convolution each (Felzenszwalb and Huttenlocher, "Distance transforms of sampled functions", 2012). The lattices
of two swing points need not be alike: each is the product of three sorted lines of coordinates.

A coarse lattice steps over feasible sets that are thinner than its spacing; so its costs can be relaxed
(:mod:`agents.paths.relaxation`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.paths.cost import FAR, SearchModel, SwingPoints, exact_costs, stance_at
from agents.paths.relaxation import relaxed_costs
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined


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
            relaxed_costs(model, stance, relaxation, candidates, nodes)
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
