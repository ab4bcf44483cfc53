"""Solids as polygons: slabs, lofts, lathed profiles, boxes, discs, and how they are moved."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mesh = list[Array]
"""Polygons (k, 3) [m], anticlockwise seen from outside, k = 3 or 4 unless they are convex and flat."""


def outward(polygons: Iterable[Array]) -> Mesh:
    """Drop repeated corners, and turn a closed, consistently oriented surface right side out."""
    mesh = []
    for polygon in polygons:
        corners = polygon[np.linalg.norm(polygon - np.roll(polygon, 1, axis=0), axis=1) > 1e-6]
        if len(corners) > 2:
            mesh.append(corners)
    volume = sum(np.linalg.det(p[[0, i, i + 1]]) for p in mesh for i in range(1, len(p) - 1))
    return mesh if volume > 0 else [polygon[::-1] for polygon in mesh]


def warp(mesh: Mesh, function: Callable[[Array], Array]) -> Mesh:
    """Map the corners (k, 3) of every polygon."""
    return outward(function(polygon) for polygon in mesh)


def moved(mesh: Mesh, *offset: float) -> Mesh:
    """Shift a mesh."""
    return [polygon + np.array(offset) for polygon in mesh]


def mirrored(mesh: Mesh) -> Mesh:
    """A left part as a right one."""
    return warp(mesh, lambda corners: corners * np.array([1.0, -1.0, 1.0]))


def slab(
    grid: Array, low: float, high: float, axes: str = "xyz", *, keep: Array | None = None, closed: bool = False
) -> Mesh:
    """Extrude the cells of a plane grid into a plate with holes.

    Args:
        grid: Nodes (m, n, 2), along the first two of ``axes``.
        low: Lower face along the third axis [m].
        high: Upper face along it [m].
        axes: Which axes the two grid coordinates and the height run along.
        keep: Cells (m - 1, n - 1), or (m, n - 1) if closed, that are not a hole; None keeps all.
        closed: The last row of nodes joins the first.
    """
    nodes = np.concatenate([grid, grid[:1]]) if closed else grid
    rows, columns = nodes.shape[0] - 1, nodes.shape[1] - 1
    solid = np.ones((rows, columns), dtype=bool) if keep is None else keep.astype(bool)
    order = np.argsort([*axes])

    def lift(corners: Sequence[Array], heights: Sequence[float]) -> Array:
        return np.column_stack([np.array(corners), heights])[:, order]

    def is_solid(row: int, column: int) -> bool:
        row = row % rows if closed else row
        return 0 <= row < rows and 0 <= column < columns and bool(solid[row, column])

    polygons = []
    for i, j in np.argwhere(solid):
        a, b, c, d = nodes[i, j], nodes[i + 1, j], nodes[i + 1, j + 1], nodes[i, j + 1]
        polygons += [lift([a, b, c, d], [high] * 4), lift([d, c, b, a], [low] * 4)]
        for start, end, beside in ((a, b, (i, j - 1)), (b, c, (i + 1, j)), (c, d, (i, j + 1)), (d, a, (i - 1, j))):
            if not is_solid(*beside):
                polygons.append(lift([end, start, start, end], [high, high, low, low]))
    return outward(polygons)


def loft(rings: Array) -> Mesh:
    """Join rings (m, n, 3) of corners, each convex, into a solid with flat ends."""
    polygons = [rings[0][::-1], rings[-1]]
    for lower, upper in pairwise(rings):
        polygons += _band(lower, upper)
    return outward(polygons)


def lathe(profile: Sequence[tuple[float, float]], segments: int) -> Mesh:
    """Turn a closed profile of (radius, z) about the z axis into a ring."""
    angles = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    rings = [np.column_stack([r * np.cos(angles), r * np.sin(angles), np.full(segments, z)]) for r, z in profile]
    return outward(quad for lower, upper in pairwise([*rings, rings[0]]) for quad in _band(lower, upper))


def _band(lower: Array, upper: Array) -> Mesh:
    return [np.array(q) for q in zip(lower, np.roll(lower, -1, 0), np.roll(upper, -1, 0), upper, strict=True)]


def box(low: Sequence[float], high: Sequence[float]) -> Mesh:
    """A box between two corners."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    return loft(np.array([[(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)] for z in (z0, z1)]))


def disc(radius: float, low: float, high: float, sides: int = 8) -> Mesh:
    """A cylinder about the z axis."""
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    circle = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return loft(np.array([np.column_stack([circle, np.full(sides, z)]) for z in (low, high)]))


def rotation(angle: float) -> Callable[[Array], Array]:
    """Rotation of points (k, 3) about the z axis by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return lambda points: points @ matrix
