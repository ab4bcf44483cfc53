"""A path made better by a few candidates around each of its points: dynamic programming in microseconds.

Each sweep puts the same cloud of ``K`` displacements around every point of a path, evaluates all candidates in SIMD
lanes, and takes the path through them of least total fitness (Viterbi's algorithm): immediate fitness plus exactly
what follows. The first displacement is none, so that a sweep never makes a path worse. The cloud shrinks from sweep
to sweep; its directions are random, drawn once, because constraints meet in edges that no axis runs along.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from agents.lattice import FAR, SearchModel, SwingPoints, exact_costs, stance_at
from jet_gym.compilation import entry_point
from jet_gym.errors import SettingsError, require_within
from jet_gym.posture_state import posture_at
from jet_gym.urdf import Array

_ROUNDING = 1e-9  # [m] kept from the edges of the search ranges


@dataclass(frozen=True)
class RefinementSettings:
    """How a path is refined.

    Attributes:
        candidates: Candidates at each swing point, the path's own point among them.
        sweeps: How often.
        widest: Standard deviation of the displacements in the first sweep, per axis [m].
        narrowest: The same in the last sweep [m]; in between it falls geometrically.
    """

    candidates: int = 24
    sweeps: int = 4
    widest: float = 3e-3
    narrowest: float = 5e-4

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed."""
        for name, least in (("candidates", 2), ("sweeps", 1)):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value < least:
                raise SettingsError(f"{name} must be a whole number of {least} or more, not {value!r}")
        for name in ("widest", "narrowest"):
            require_within(name, getattr(self, name), above=True)

    @property
    def displacements(self) -> Array:
        """Displacements of the candidates (sweeps, 3, candidates) [m]."""
        return _displacements(self)


@functools.lru_cache(maxsize=16)
def _displacements(settings: RefinementSettings) -> Array:
    cloud = np.random.default_rng(0).standard_normal((settings.sweeps, 3, settings.candidates))
    cloud[:, :, 0] = 0.0
    cloud *= np.geomspace(settings.widest, settings.narrowest, settings.sweeps)[:, None, None]
    cloud.flags.writeable = False
    return cloud


@entry_point
def refine_path(model: SearchModel, points: SwingPoints, displacements: Array, path: Array) -> float:
    """Refine a path in place.

    Args:
        model: The robot and what is minimised.
        points: The swing points.
        displacements: Of the candidates (sweeps, 3, K) [m].
        path: Pelvis path (N, 3) [m].

    Returns:
        The total cost of the path.
    """
    count, size = len(path), displacements.shape[2]
    omega = model.fitness.smoothness_weight
    candidates, total = np.empty((count, 3, size)), np.empty((count, size))
    came_from, costs = np.empty((count, size), np.int64), np.empty(size)
    least = 0.0
    for sweep in range(len(displacements)):
        for point in range(count):
            reach = (model.search_range if point > 0 else points.first_range) - _ROUNDING
            for axis in range(3):
                for i in range(size):
                    candidates[point, axis, i] = path[point, axis] + displacements[sweep, axis, i]
            exact_costs(model, stance_at(model, points, point), candidates[point], costs)
            x, y, z = candidates[point, 0], candidates[point, 1], candidates[point, 2]
            if point == 0:
                for i in range(size):
                    away = max(
                        abs(x[i] - points.centre[0]), abs(y[i] - points.centre[1]), abs(z[i] - points.centre[2])
                    )
                    total[0, i] = costs[i] if (away <= reach) | (i == 0) else FAR
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
        last = int(np.argmin(total[count - 1]))
        least = total[count - 1, last]
        for point in range(count - 1, -1, -1):
            for axis in range(3):
                path[point, axis] = candidates[point, axis, last]
            last = came_from[point, last] if point > 0 else last
    return least


@entry_point
def violates(model: SearchModel, points: SwingPoints, path: Array) -> bool:
    """Tell whether any posture of a path (N, 3) [m] violates a constraint."""
    for point in range(len(path)):
        pelvis = (path[point, 0], path[point, 1], path[point, 2])
        stance = stance_at(model, points, point)
        state = posture_at(model.swing_leg, model.support_leg, model.trunk, model.balance, stance, pelvis)
        if state.violations != 0:
            return True
    return False
