"""``JetHR1Step-v0`` acted in by choosing the thrust, for policies that are trained that way."""

from __future__ import annotations

from typing import Any, SupportsFloat

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from jet_gym.task.model import default_task


class ChooseThrust(gym.Wrapper[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]):
    """Takes choices of thrust, place across the edge polygon and height, and acts so that they come true.

    See :mod:`jet_gym.task.choices`. The action space is the same box, and observations are as they were.

    Args:
        env: ``JetHR1Step-v0``, with either physics.
    """

    def __init__(self, env: gym.Env[NDArray[np.float32], NDArray[np.float32]]) -> None:
        super().__init__(env)
        self._seen = np.empty(0, dtype=np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin an episode."""
        self._seen, info = self.env.reset(seed=seed, options=options)
        return self._seen, info

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], SupportsFloat, bool, bool, dict[str, Any]]:
        """Carry out a choice (3,)."""
        actions = default_task().actions_of_choices(self._seen[None], np.asarray(action, np.float32)[None])
        self._seen, reward, terminated, truncated, info = self.env.step(actions[0])
        return self._seen, reward, terminated, truncated, info
