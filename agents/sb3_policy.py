"""The policy that is trained, and how it becomes plain arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import nn

from agents.network import INPUT_LIMIT, Array32, Chooses, Layer, PolicyNetwork
from jet_gym.task.model import default_task


class ScaledObservation(BaseFeaturesExtractor):
    """Centres and scales each component of an observation; the constants are stored with the policy.

    Components are in metres, newtons and radians, and a millimetre matters: unscaled, the network learns
    several times slower.

    Args:
        observation_space: The observation space.
        center: What is taken from each component (C,).
        scale: What it is then divided by (C,).
    """

    def __init__(self, observation_space: spaces.Box, center: Array32, scale: Array32) -> None:
        super().__init__(observation_space, int(observation_space.shape[0]))
        self.register_buffer("center", torch.as_tensor(np.asarray(center), dtype=torch.float32))
        self.register_buffer("scale", torch.as_tensor(np.asarray(scale), dtype=torch.float32))

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Scale observations (N, C)."""
        center: Any = self.center
        scale: Any = self.scale
        return torch.clamp((observations - center) / scale, -INPUT_LIMIT, INPUT_LIMIT)


class ThrustPolicy(ActorCriticPolicy):
    """Chooses thrust, place across the edge polygon and height; predicts the action that carries this out.

    What PPO sees are the choices, in environments that take them; ``predict`` is for those who use the policy in
    ``JetHR1Step-v0`` as it is.
    """

    def predict(
        self,
        observation: NDArray[Any] | dict[str, NDArray[Any]],
        state: tuple[NDArray[Any], ...] | None = None,
        episode_start: NDArray[Any] | None = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[Any], tuple[NDArray[Any], ...] | None]:
        """Return the actions for observations (C,) or (N, C) of ``JetHR1Step-v0``."""
        choices, state = super().predict(observation, state, episode_start, deterministic)
        rows = np.atleast_2d(np.asarray(observation, dtype=np.float32))
        actions = default_task().actions_of_choices(rows, np.atleast_2d(choices))
        return actions.reshape(choices.shape), state


def network_of(policy: ActorCriticPolicy, about: dict[str, Any] | None = None) -> PolicyNetwork:
    """Return the part of a policy that acts, as plain arrays.

    Raises:
        TypeError: If it is not one that ``train.py`` makes.
    """
    extractor = policy.pi_features_extractor
    if not isinstance(extractor, ScaledObservation):
        raise TypeError(f"the policy's features come from {type(extractor).__name__}, not from ScaledObservation")
    layers: list[Layer] = []
    for module in (*policy.mlp_extractor.policy_net, policy.action_net):
        if isinstance(module, nn.Linear):
            layers.append((_array(module.weight), _array(module.bias)))
        elif not isinstance(module, nn.Tanh):
            raise TypeError(f"the policy's activation is {type(module).__name__}, not Tanh")
    chooses: Chooses = "thrust" if isinstance(policy, ThrustPolicy) else "pelvis"
    return PolicyNetwork(_array(extractor.center), _array(extractor.scale), tuple(layers), about or {}, chooses)


def _array(tensor: Any) -> Array32:
    array: Array32 = tensor.detach().cpu().numpy().astype(np.float32)
    return array
