"""A path made better by a few candidates around each of its points: dynamic programming in microseconds.

Each sweep puts a cloud of ``K`` candidates around every point of a path, evaluates them in SIMD lanes, and takes
the path through them of least total fitness (Viterbi's algorithm): immediate fitness plus exactly what follows. The
first candidate is the point itself, so that a sweep never makes a path worse; the next two take its height from
smoother versions of all heights, which random displacements of single points would not find. The cloud shrinks each
time.

A cloud in pelvis coordinates would mostly miss. The edge polygon, eq. (10), leaves the centre of mass a wedge that
opens at the assigned ZMP, where the thrust is nil, and near its tip is far narrower than a useful move is long. So
the cloud displaces the centre of mass along the wedge and aside within it, and the pelvis in height, the centre of
mass staying where it is in the plane. The pelvis follows from the derivatives of the centre of mass by the pelvis.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agents.paths.cost import FAR, SearchModel, SwingPoints, exact_costs, stance_at
from jet_gym.balance import Stance
from jet_gym.edge_polygon import along_and_aside, edge_axis, half_width
from jet_gym.leg import Vector
from jet_gym.posture_state import posture_at
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined
from jet_gym.utils.settings import require_whole, require_within

_ROUNDING = 1e-9  # [m] kept from the edges of the search ranges
_DIFFERENCE = 2e-5  # [m] of the derivatives
_HEIGHTS = 2.0  # displacements in height are larger by this factor
_ASIDE = 0.2  # of the wedge's half width that a displacement aside may take
_INSIDE = 0.8  # of the wedge's half width, within which a centre of mass from outside is put
_LEAST_DETERMINANT = 0.05  # of the derivatives in the plane, 0.5 or so in ordinary postures
_STEEPEST = 3.0  # derivative of the centre of mass by the pelvis' height; larger where a leg is all but straight
_STIFFNESS = (0.3, 0.03)  # of the springs that hold smoother heights to those of the path, over those between them
_TIP = 1e-6  # [m] from the tip within which there is no direction


@dataclass(frozen=True)
class RefinementSettings:
    """How a path is refined.

    Attributes:
        candidates: Candidates at each swing point, among them the path's own point and two with smoother heights.
        sweeps: How often.
        widest: Standard deviation of the displacements in the first sweep [m].
        narrowest: The same in the last sweep [m]; in between it falls geometrically.
    """

    candidates: int = 16
    sweeps: int = 5
    widest: float = 5e-3
    narrowest: float = 3e-4

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed."""
        for name, least in (("candidates", 2), ("sweeps", 1)):
            require_whole(name, getattr(self, name), least)
        for name in ("widest", "narrowest"):
            require_within(name, getattr(self, name), above=True)

    @property
    def clouds(self) -> Array:
        """Displacements of the candidates along the wedge, aside and in height (sweeps, 3, candidates) [m]."""
        return _clouds(self)


WIDE = RefinementSettings(candidates=64, sweeps=8, widest=20e-3, narrowest=1e-3)
"""For paths that are far from a good one, or violate a constraint."""


@functools.lru_cache(maxsize=16)
def _clouds(settings: RefinementSettings) -> Array:
    clouds = np.random.default_rng(0).standard_normal((settings.sweeps, 3, settings.candidates))
    clouds[:, :, 0] = 0.0
    clouds[:, 2] *= _HEIGHTS
    clouds *= np.geomspace(settings.widest, settings.narrowest, settings.sweeps)[:, None, None]
    clouds.flags.writeable = False
    return clouds


@entry_point
def refine_path(model: SearchModel, points: SwingPoints, clouds: Array, path: Array) -> float:
    """Refine a path in place.

    Args:
        model: The robot and what is minimised.
        points: The swing points.
        clouds: Displacements of the candidates (sweeps, 3, K) [m], as :attr:`RefinementSettings.clouds` has them.
        path: Pelvis path (N, 3) [m].

    Returns:
        The total cost of the path.
    """
    count, size = len(path), clouds.shape[2]
    candidates, derivatives = np.empty((count, 3, size)), np.empty((count, 2, 3))
    total, came_from = np.empty((count, size)), np.empty((count, size), np.int64)
    heights = np.empty((len(_STIFFNESS), count))
    _differentiate(model, points, path, derivatives)
    least = 0.0
    for sweep in range(len(clouds)):
        _smooth(path[:, 2], heights)
        _surround(model, points, clouds[sweep], path, heights, derivatives, candidates)
        _find_ways(model, points, candidates, total, came_from)
        last = int(np.argmin(total[count - 1]))
        least = total[count - 1, last]
        for point in range(count - 1, -1, -1):
            for axis in range(3):
                path[point, axis] = candidates[point, axis, last]
            last = came_from[point, last]
    return least


@inlined
def _differentiate(model: SearchModel, points: SwingPoints, path: Array, derivatives: Array) -> None:
    """Compute the derivatives of the centre of mass in the plane by the pelvis (N, 2, 3).

    They vary little from sweep to sweep. In height the difference goes down, where legs bend: above, one may be
    beyond its reach.
    """
    for point in range(len(path)):
        stance = stance_at(model, points, point)
        x, y, z = path[point, 0], path[point, 1], path[point, 2]
        here = _center_of_mass(model, stance, (x, y, z))
        by_x = _center_of_mass(model, stance, (x - _DIFFERENCE, y, z))
        by_y = _center_of_mass(model, stance, (x, y - _DIFFERENCE, z))
        by_z = _center_of_mass(model, stance, (x, y, z - _DIFFERENCE))
        for axis in range(2):
            derivatives[point, axis, 0] = (here[axis] - by_x[axis]) / _DIFFERENCE
            derivatives[point, axis, 1] = (here[axis] - by_y[axis]) / _DIFFERENCE
            derivatives[point, axis, 2] = (here[axis] - by_z[axis]) / _DIFFERENCE


@entry_point  # too long to be inlined five times
def _center_of_mass(model: SearchModel, stance: Stance, pelvis: Vector) -> Vector:
    """Return the centre of mass [m]."""
    return posture_at(model.robot, stance, pelvis).center_of_mass


@inlined
def _surround(
    model: SearchModel,
    points: SwingPoints,
    cloud: Array,
    path: Array,
    heights: Array,
    derivatives: Array,
    candidates: Array,
) -> None:
    """Place the candidates around the points of a path, the first few at its smoother heights (S, N) [m]."""
    for point in range(len(path)):
        stance, d = stance_at(model, points, point), derivatives[point]
        x, y, z = path[point, 0], path[point, 1], path[point, 2]
        com = _center_of_mass(model, stance, (x, y, z))
        axis, slope = edge_axis(stance), model.robot.balance.edge_slope
        along, aside = along_and_aside(axis, com[0], com[1])
        determinant = d[0, 0] * d[1, 1] - d[0, 1] * d[1, 0]
        steepest = max(abs(d[0, 2]), abs(d[1, 2]))
        directed = (along > _TIP) & (determinant > _LEAST_DETERMINANT) & (steepest < _STEEPEST)
        inside = half_width(slope, axis, along)
        for i in range(cloud.shape[1]):
            dx, dy, dz = cloud[0, i], cloud[1, i], cloud[2, i]
            if 1 <= i <= len(heights):
                dx, dy, dz = 0.0, 0.0, heights[i - 1, point] - z
            if directed and i > 0:
                # No move goes beyond the tip, and what the centre of mass is aside shrinks with the wedge.
                new_along = along + dx if dx > 0.0 else along * math.exp(dx / along)
                width = max(half_width(slope, axis, new_along), _TIP)
                new_aside = aside * new_along / along
                if abs(aside) > inside:
                    new_aside = min(max(new_aside, -_INSIDE * width), _INSIDE * width)
                widest = _ASIDE * width
                new_aside += dy * widest / math.sqrt(widest * widest + dy * dy)
                com_x = (new_along - along) * axis.x - (new_aside - aside) * axis.y - d[0, 2] * dz
                com_y = (new_along - along) * axis.y + (new_aside - aside) * axis.x - d[1, 2] * dz
                dx = (d[1, 1] * com_x - d[0, 1] * com_y) / determinant
                dy = (d[0, 0] * com_y - d[1, 0] * com_x) / determinant
            candidates[point, 0, i], candidates[point, 1, i], candidates[point, 2, i] = x + dx, y + dy, z + dz


@inlined
def _smooth(values: Array, smoother: Array) -> None:
    """Compute smoother versions (S, N) of values (N,), of which springs hold each to its value and its neighbours.

    They minimise the sum of the squared differences between neighbours, and of ``_STIFFNESS`` times those to the
    values: a tridiagonal system, solved by Thomas' algorithm.
    """
    count = len(values)
    pivots = np.empty(count)
    for row in range(len(smoother)):
        found = smoother[row]
        for i in range(count):
            neighbours = (1.0 if i > 0 else 0.0) + (1.0 if i + 1 < count else 0.0)
            pivots[i] = _STIFFNESS[row] + neighbours
            found[i] = _STIFFNESS[row] * values[i]
            if i > 0:
                pivots[i] -= 1.0 / pivots[i - 1]
                found[i] += found[i - 1] / pivots[i - 1]
        for i in range(count - 1, -1, -1):
            found[i] = (found[i] + (found[i + 1] if i + 1 < count else 0.0)) / pivots[i]


@inlined
def _find_ways(
    model: SearchModel, points: SwingPoints, candidates: Array, total: Array, came_from: NDArray[np.int64]
) -> None:
    """Compute the least total cost of a way to each candidate (N, K), and the candidate before it (N, K)."""
    count, size = len(candidates), candidates.shape[2]
    omega, costs = model.fitness.smoothness_weight, np.empty(size)
    for point in range(count):
        reach = (model.search_range if point > 0 else points.first_range) - _ROUNDING
        exact_costs(model, stance_at(model, points, point), candidates[point], costs)
        x, y, z = candidates[point, 0], candidates[point, 1], candidates[point, 2]
        if point == 0:
            for i in range(size):
                away = max(abs(x[i] - points.centre[0]), abs(y[i] - points.centre[1]), abs(z[i] - points.centre[2]))
                total[0, i] = costs[i] if (away <= reach) | (i == 0) else FAR
                came_from[0, i] = i
            continue
        px, py, pz = candidates[point - 1, 0], candidates[point - 1, 1], candidates[point - 1, 2]
        for i in range(size):
            best, which = FAR, 0
            for j in range(size):
                dx, dy, dz = x[i] - px[j], y[i] - py[j], z[i] - pz[j]
                within = (max(abs(dx), abs(dy), abs(dz)) <= reach) | (i + j == 0)
                way = total[point - 1, j] + omega * (dx * dx + dy * dy + dz * dz) if within else FAR
                if way < best:
                    best, which = way, j
            total[point, i] = costs[i] + best
            came_from[point, i] = which


@entry_point
def violates(model: SearchModel, points: SwingPoints, path: Array) -> bool:
    """Tell whether any posture of a path (N, 3) [m] violates a constraint."""
    for point in range(len(path)):
        pelvis = (path[point, 0], path[point, 1], path[point, 2])
        if posture_at(model.robot, stance_at(model, points, point), pelvis).violations != 0:
            return True
    return False
