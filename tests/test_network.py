"""A policy's network as plain arrays, and its file."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.network import PolicyNetwork
from jet_gym.errors import PolicyFileError
from jet_gym.task.observation import COMPONENTS

WIDTH = len(COMPONENTS)


@pytest.fixture
def network() -> PolicyNetwork:
    random = np.random.default_rng(0)

    def layer(outputs: int, inputs: int) -> tuple[Any, Any]:
        weights, biases = random.standard_normal((outputs, inputs)), random.standard_normal(outputs)
        return weights.astype(np.float32), biases.astype(np.float32)

    center, scale = random.standard_normal(WIDTH), random.uniform(0.5, 2.0, WIDTH)
    layers = (layer(8, WIDTH), layer(8, 8), layer(3, 8))
    return PolicyNetwork(center.astype(np.float32), scale.astype(np.float32), layers, {"note": "made up"})


def test_actions_stay_within_the_box(network: PolicyNetwork) -> None:
    observations = 100.0 * np.random.default_rng(1).standard_normal((50, WIDTH)).astype(np.float32)
    actions = network.act(observations)
    assert actions.shape == (50, 3)
    assert actions.dtype == np.float32
    assert np.abs(actions).max() <= 1.0


def test_a_saved_network_acts_the_same(network: PolicyNetwork, tmp_path: Path) -> None:
    network.save(tmp_path / "policy.npz")
    loaded = PolicyNetwork.load(tmp_path / "policy.npz")
    observations = np.random.default_rng(1).standard_normal((5, WIDTH)).astype(np.float32)
    assert np.array_equal(loaded.act(observations), network.act(observations))
    assert loaded.about["note"] == "made up"
    assert loaded.about["sha256"] == network.sha256


def damage(path: Path, **changes: Any) -> None:
    with np.load(path) as file:
        content = {name: file[name] for name in file.files}
    about = json.loads(str(content["about"]))
    for name, value in changes.items():
        if name in content:
            content[name] = value
        else:
            about[name] = value
    content["about"] = np.array(json.dumps(about))
    np.savez(path, **content)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"environment": "Other-v0"}, "for 'Other-v0'"),
        ({"format": "something/2"}, "format"),
        ({"observation": ["progress"]}, "other observations"),
        ({"biases_0": np.zeros(8, np.float32)}, "damaged"),
        ({"biases_1": np.array(["text"])}, "not a policy"),
        ({"biases_2": np.array([None, 1], dtype=object)}, "not a policy"),
    ],
)
def test_a_file_that_does_not_fit_is_refused(
    network: PolicyNetwork, tmp_path: Path, changes: dict[str, Any], message: str
) -> None:
    network.save(tmp_path / "policy.npz")
    damage(tmp_path / "policy.npz", **changes)
    with pytest.raises(PolicyFileError, match=message):
        PolicyNetwork.load(tmp_path / "policy.npz")


@pytest.mark.parametrize("shape", [(3, 1, 1), (2, 3), (0, 1, 1), (8,)])
@pytest.mark.parametrize("chooses", ["pelvis", "thrust"])
def test_outputs_of_another_shape_are_refused(
    network: PolicyNetwork, tmp_path: Path, shape: tuple[int, ...], chooses: Any
) -> None:
    weights, _ = network.layers[-1]
    last = weights, np.zeros(shape, np.float32)
    replace(network, layers=(*network.layers[:-1], last), chooses=chooses).save(tmp_path / "policy.npz")
    with pytest.raises(PolicyFileError):
        PolicyNetwork.load(tmp_path / "policy.npz")


def test_what_is_no_file_of_arrays_is_refused(tmp_path: Path) -> None:
    (tmp_path / "policy.npz").write_bytes(b"\x80\x04\x95 pickled")
    for path in (tmp_path / "policy.npz", tmp_path / "missing.npz", tmp_path):
        with pytest.raises(PolicyFileError):
            PolicyNetwork.load(path)
