"""The candidates of a refinement's sweep, which tests go through one by one."""

from __future__ import annotations

import numpy as np

from agents.paths.cost import SearchModel, SwingPoints
from agents.paths.refinement import _STIFFNESS, _differentiate, _smooth, _surround
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point


@entry_point
def candidates_around(model: SearchModel, points: SwingPoints, cloud: Array, path: Array) -> Array:
    """Return the candidates of one sweep (N, 3, K) [m] for a cloud (3, K) [m] around a path (N, 3) [m]."""
    candidates, derivatives = np.empty((len(path), 3, cloud.shape[1])), np.empty((len(path), 2, 3))
    heights = np.empty((len(_STIFFNESS), len(path)))
    _differentiate(model, points, path, derivatives)
    _smooth(path[:, 2], heights)
    _surround(model, points, cloud, path, heights, derivatives, candidates)
    return candidates
