"""The batched environment as Stable-Baselines3 wants it, and what it noticed between two looks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from time import perf_counter
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvIndices, VecEnvObs, VecEnvStepReturn

from agents.network import Chooses
from agents.training.replay import ReplayingDrawer
from jet_gym.envs.jet_hr1_step_vector import JetHR1StepVectorEnv
from jet_gym.errors import SettingsError
from jet_gym.task.model import default_task


class StepVecEnv(VecEnv):
    """Steps all lanes of a batch with one call.

    Stable-Baselines3 sees what its ``DummyVecEnv`` over as many single environments with ``Monitor`` shows, but
    infos are empty until an episode ends.

    Args:
        num_envs: Number of lanes.
        replay: Share of the episodes that take up a step again that lately failed.
        seed: Of which steps are taken up again.
        chooses: What it is told in each step: the ``"thrust"`` and what else :mod:`jet_gym.task.choices` leaves
            to choose, or the move of the ``"pelvis"``, the action itself.
        **task: Arguments of ``JetHR1Step-v0``.
    """

    def __init__(
        self, num_envs: int, replay: float = 0.0, seed: int = 0, chooses: Chooses = "pelvis", **task: Any
    ) -> None:
        self.batch = JetHR1StepVectorEnv(num_envs, **task)
        if replay > 0.0:
            self.batch.drawer = ReplayingDrawer(self.batch.drawer, replay, seed=seed)
        super().__init__(num_envs, self.batch.single_observation_space, self.batch.single_action_space)
        self._chooses, self._seen = chooses, np.empty((0, 0), dtype=np.float32)
        self._actions: NDArray[Any] = np.zeros((num_envs, 3), dtype=np.float32)
        self._returns, self._lengths = np.zeros(num_envs), np.zeros(num_envs, dtype=np.int64)
        self._started = perf_counter()
        self._noticed: dict[str, float] = {}
        self._points = 0

    def reset(self) -> VecEnvObs:
        """Begin an episode in every lane; return the observations (num_envs, C)."""
        seeds = list(self._seeds)
        observations, _ = self.batch.reset(seed=None if seeds == [None] * self.num_envs else seeds)
        self._reset_seeds()
        self._reset_options()
        self.reset_infos = [{} for _ in range(self.num_envs)]
        self._returns[:], self._lengths[:] = 0.0, 0
        self._seen = observations
        return observations

    def step_async(self, actions: NDArray[Any]) -> None:
        """Remember the actions (num_envs, 3), or those that carry out what is chosen."""
        if self._chooses == "thrust":
            actions = default_task().actions_of_choices(self._seen, actions)
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Take the actions; lanes that ended are reset, their last observation is in their info."""
        observations, rewards, terminations, truncations, infos = self.batch.step(self._actions)
        self._returns += rewards
        self._lengths += 1
        over = terminations | truncations
        lane_infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for lane in np.flatnonzero(over).tolist():
            lane_infos[lane] = {
                "terminal_observation": infos["final_obs"][lane],
                "TimeLimit.truncated": bool(truncations[lane]),
                "is_success": bool(infos["final_info"].get("is_success", over & False)[lane]),
                "episode": {
                    "r": float(self._returns[lane]),
                    "l": int(self._lengths[lane]),
                    "t": perf_counter() - self._started,
                },
            }
        self._returns[over], self._lengths[over] = 0.0, 0
        self._notice(infos)
        self._seen = observations
        return observations, rewards.astype(np.float32), over, lane_infos

    def noticed(self) -> dict[str, float]:
        """Return the mean of each reward term over the swing points since the last call, and forget them."""
        means = {name: total / max(self._points, 1) for name, total in self._noticed.items()}
        self._noticed, self._points = {}, 0
        return means

    def close(self) -> None:
        """Close the batch."""
        self.batch.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of the batch, once a lane."""
        return [getattr(self.batch, attr_name)] * len(self._lanes(indices))

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set ``violation_cost`` of all lanes; they have no attributes of their own."""
        if attr_name == "violation_cost" and indices is None:
            self.batch.violation_cost = value
            return
        raise SettingsError(f"{attr_name} cannot be set: the lanes of a batch have no attributes of their own")

    def env_method(self, method_name: str, *_: Any, **__: Any) -> list[Any]:
        """Refuse: lanes have no methods of their own."""
        raise SettingsError(f"{method_name} cannot be called: the lanes of a batch have no methods of their own")

    def env_is_wrapped(
        self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Tell whether lanes are wrapped; returns are counted here, as ``Monitor`` does."""
        from stable_baselines3.common.monitor import Monitor

        return [issubclass(Monitor, wrapper_class)] * len(self._lanes(indices))

    def _lanes(self, indices: VecEnvIndices) -> Sequence[int]:
        if indices is None:
            return range(self.num_envs)
        return list(indices) if isinstance(indices, Iterable) else [indices]

    def _notice(self, infos: dict[str, Any]) -> None:
        """Add up the terms of the reward, those of lanes that ended too."""
        for part in (infos, infos.get("final_info", {})):
            for name, values in part.get("reward_terms", {}).items():
                if not name.startswith("_"):
                    self._noticed[name] = self._noticed.get(name, 0.0) + float(values.sum())
        self._points += self.num_envs
