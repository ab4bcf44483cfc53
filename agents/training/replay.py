"""Steps on which the policy failed, drawn again: violations are rare, and the more so the better it gets."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jet_gym.task.drawing import Drawer
from jet_gym.task.lanes import Lanes
from jet_gym.utils.arrays import Array


class ReplayingDrawer:
    """Draws some of the steps from those that lately failed, the others as another drawer does.

    Hard steps drawn more often than easy ones is what prioritised level replay does (Jiang, Grefenstette and
    Rocktaeschel, "Prioritized level replay", 2021); here a step is hard that ended with a violated constraint.

    Args:
        drawer: Draws the others.
        share: Of the episodes that replay such a step, once there are any.
        memory: Failed steps that are kept, the latest ones.
        seed: Of which are replayed.
    """

    def __init__(self, drawer: Drawer, share: float, memory: int = 2000, seed: int = 0) -> None:
        self._drawer, self._share = drawer, share
        self._failed: deque[Array] = deque(maxlen=memory)
        self._random = np.random.default_rng(seed)
        self._begun: dict[int, Array] = {}

    def draw(self, lanes: Lanes, selected: NDArray[np.int64], generators: Sequence[np.random.Generator]) -> None:
        """Begin an episode in the selected lanes; remember the steps of those that failed in theirs."""
        for lane in selected.tolist():
            if lanes.violated[lane] and lane in self._begun:
                self._failed.append(self._begun[lane])
        self._drawer.draw(lanes, selected, generators)
        for lane in selected.tolist():
            if self._failed and self._random.random() < self._share:
                lanes.array[lane] = self._failed[self._random.integers(len(self._failed))]
            self._begun[lane] = lanes.array[lane].copy()
