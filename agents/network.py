"""A trained policy's network as plain arrays, with a forward pass in NumPy: no torch, nothing unpickled."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from jet_gym.errors import PolicyFileError
from jet_gym.task import ENVIRONMENT_ID
from jet_gym.task.model import TaskModel, default_task
from jet_gym.task.observation import COMPONENTS, HIGH, LOW
from jet_gym.utils.files import read_arrays, write_whole_with

FORMAT = "jet-gym-policy/1"
INPUT_LIMIT = 8.0  # scaled observations are clipped to this

Array32 = NDArray[np.float32]
Chooses = Literal["thrust", "pelvis"]
Layer = tuple[Array32, Array32]


@dataclass(frozen=True, eq=False)
class PolicyNetwork:
    """A multilayer perceptron from observation to what is chosen, ``tanh`` between its layers.

    Attributes:
        center: What is taken from each component of an observation (C,).
        scale: What it is then divided by (C,).
        layers: Weights (outputs, inputs) and biases (outputs,) of each layer.
        about: What the file says of itself: how it was trained and what it scores.
        chooses: What its three outputs are: ``"thrust"``, place across the edge polygon and height
            (:mod:`jet_gym.task.choices`), or the move of the ``"pelvis"``, the action itself.
    """

    center: Array32
    scale: Array32
    layers: tuple[Layer, ...]
    about: dict[str, Any] = field(default_factory=dict)
    chooses: Chooses = "pelvis"

    def act(self, observations: Array32, task: TaskModel | None = None) -> Array32:
        """Return the actions (N, 3), clipped to [-1, 1], for observations (N, C) of ``JetHR1Step-v0``.

        Args:
            observations: What was observed.
            task: The task that is asked for; with all settings at their defaults where omitted.
        """
        outputs = self.outputs(observations)
        if self.chooses == "pelvis":
            return outputs
        return (task or default_task()).actions_of_choices(observations, outputs)

    def outputs(self, observations: Array32) -> Array32:
        """Return what the network itself says (N, 3), clipped to [-1, 1]."""
        values = np.clip((observations - self.center) / self.scale, -INPUT_LIMIT, INPUT_LIMIT)
        *hidden, (last_weights, last_biases) = self.layers
        for weights, biases in hidden:
            values = values @ weights.T
            values += biases
            np.tanh(values, out=values)
        outputs: Array32 = np.clip(values @ last_weights.T + last_biases, -1.0, 1.0)
        return outputs

    @property
    def sha256(self) -> str:
        """Hash of all numbers of the network."""
        digest = hashlib.sha256()
        for array in self._arrays().values():
            digest.update(np.ascontiguousarray(array, dtype="<f4").tobytes())
        return digest.hexdigest()

    def save(self, path: str | Path) -> None:
        """Write the network to an ``.npz`` file, whole or not at all.

        Raises:
            OSError: If the file cannot be written.
        """
        about = self.about | {
            "format": FORMAT,
            "environment": ENVIRONMENT_ID,
            "observation": [component.name for component in COMPONENTS],
            "chooses": self.chooses,
            "sha256": self.sha256,
        }
        arrays: dict[str, Any] = {**self._arrays(), "about": np.array(json.dumps(about))}
        write_whole_with(path, lambda temporary: np.savez_compressed(temporary, **arrays))

    @classmethod
    def load(cls, path: str | Path) -> PolicyNetwork:
        """Read a network from an ``.npz`` file.

        Raises:
            PolicyFileError: If the file cannot be read or is damaged, or the policy is for another environment.
        """
        try:
            content = read_arrays(path)
            about = json.loads(str(content.pop("about")))
            if not isinstance(about, dict):
                raise TypeError("its part 'about' is no table")
            network = cls._from_arrays(content, about)
        except OSError as error:
            raise PolicyFileError(f"cannot read the policy {path!s}: {error.strerror or error}") from error
        except KeyError as error:
            raise PolicyFileError(f"{path!s} is not a policy: its part {error} is missing") from error
        except (TypeError, ValueError, RecursionError) as error:
            raise PolicyFileError(f"{path!s} is not a policy: {error}") from error
        network._check(path)
        return network

    @classmethod
    def _from_arrays(cls, content: dict[str, NDArray[Any]], about: dict[str, Any]) -> PolicyNetwork:
        depth = sum(name.startswith("weights") for name in content)
        for name, array in content.items():
            if array.dtype.kind != "f":
                raise ValueError(f"its part {name!r} holds no real numbers")
        arrays = {name: np.asarray(array, dtype=np.float32) for name, array in content.items()}
        layers = tuple((arrays[f"weights_{i}"], arrays[f"biases_{i}"]) for i in range(depth))
        for i, (weights, biases) in enumerate(layers):
            if weights.ndim != 2 or biases.shape != weights.shape[:1]:
                raise ValueError(
                    f"its weights_{i} of shape {weights.shape} and biases_{i} of {biases.shape} do not fit"
                )
        for name in ("center", "scale"):
            if arrays[name].ndim != 1:
                raise ValueError(f"its part {name!r} of shape {arrays[name].shape} is no vector")
        return cls(arrays["center"], arrays["scale"], layers, about, about.get("chooses", "pelvis"))

    def _arrays(self) -> dict[str, Array32]:
        arrays = {"center": self.center, "scale": self.scale}
        for i, (weights, biases) in enumerate(self.layers):
            arrays |= {f"weights_{i}": weights, f"biases_{i}": biases}
        return arrays

    def _check(self, path: str | Path) -> None:
        about = self.about
        if about.get("format") != FORMAT:
            raise PolicyFileError(
                f"{path!s} is not a policy: its format is {about.get('format')!r}, not {FORMAT!r}"
            )
        if about.get("environment") != ENVIRONMENT_ID:
            raise PolicyFileError(
                f"{path!s} is a policy for {about.get('environment')!r}, not for {ENVIRONMENT_ID}"
            )
        if about.get("observation") != [component.name for component in COMPONENTS]:
            raise PolicyFileError(
                f"{path!s} was trained on other observations than {ENVIRONMENT_ID} has today; train it anew"
            )
        if self.chooses not in get_args(Chooses):
            raise PolicyFileError(f"{path!s} chooses {self.chooses!r}, not one of {', '.join(get_args(Chooses))}")
        if about.get("sha256") != self.sha256:
            raise PolicyFileError(f"{path!s} is damaged: its numbers do not fit its hash")
        self.require_actions(str(path))

    def require_actions(self, name: str) -> None:
        """Refuse a network that does not make actions of observations, before anybody plans with it.

        Args:
            name: What the message calls it.

        Raises:
            PolicyFileError: If it does not.
        """
        observed = np.array([LOW, HIGH], dtype=np.float32)
        try:
            with np.errstate(over="raise", invalid="raise", divide="raise"):
                outputs = self.outputs(observed)
                fits = outputs.shape == (len(observed), 3)
                actions = self.act(observed) if fits else outputs
        except (ValueError, FloatingPointError) as error:
            raise PolicyFileError(f"{name} does not take the observations of {ENVIRONMENT_ID}: {error}") from error
        if not (fits and np.isfinite(actions).all()):
            raise PolicyFileError(f"{name} does not make the actions of {ENVIRONMENT_ID}")
