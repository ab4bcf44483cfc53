"""The balance space in the studio's scene: computed when it is looked at, and anew when its inputs change."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest
from waiting import PATIENCE

from jet_gym import jet_hr1
from jet_gym.balance import BalanceSettings
from jet_gym.studio.scene import balance_cloud
from jet_gym.studio.scene.balance_cloud import BalanceCloud, SpaceInputs

pytest.importorskip("trimesh")

INPUTS = SpaceInputs(jet_hr1(), "left", BalanceSettings())
SUPPORT = (0.1, -0.2, 0.05)


@pytest.fixture
def scene() -> MagicMock:
    scene = MagicMock()
    scene.add_frame.return_value.visible = False
    return scene


@pytest.fixture
def cloud(scene: MagicMock, monkeypatch: pytest.MonkeyPatch) -> Iterator[BalanceCloud]:
    monkeypatch.setattr(balance_cloud, "RESOLUTION", 0.1)
    monkeypatch.setattr(balance_cloud, "_SETTLED", 0.0)
    cloud = BalanceCloud(scene, "test")
    yield cloud
    cloud.close()
    cloud.close()


def drawn(scene: MagicMock) -> dict[str, Any]:
    """The corners of what was drawn last, by name."""
    return {call.args[0].rpartition("/")[2]: call.args[1] for call in scene.add_mesh_simple.call_args_list}


def test_it_is_computed_once_it_is_looked_at(cloud: BalanceCloud, scene: MagicMock) -> None:
    cloud.want(INPUTS, SUPPORT)
    assert cloud.worker.wait_until_idle(PATIENCE)
    assert not cloud.ready
    assert scene.add_frame.return_value.position == SUPPORT
    cloud.visible = True
    assert cloud.worker.wait_until_idle(PATIENCE)
    assert cloud.ready
    spaces = drawn(scene)
    assert spaces.keys() == {"with_thrust", "without_thrust"}
    widths = {name: np.ptp(corners[:, 1]) for name, corners in spaces.items()}
    assert widths["with_thrust"] > widths["without_thrust"]  # what thrust is for


def test_it_is_computed_anew_when_its_inputs_change_and_only_then(cloud: BalanceCloud, scene: MagicMock) -> None:
    cloud.visible = True
    cloud.want(INPUTS, SUPPORT)
    assert cloud.worker.wait_until_idle(PATIENCE)
    before = scene.add_mesh_simple.call_count
    cloud.want(INPUTS, (0.0, 0.0, 0.0))
    assert cloud.worker.wait_until_idle(PATIENCE)
    assert scene.add_mesh_simple.call_count == before
    cloud.want(replace(INPUTS, settings=BalanceSettings(max_thrust=0.0)), SUPPORT)
    assert cloud.worker.wait_until_idle(PATIENCE)
    assert cloud.ready
    assert scene.add_mesh_simple.call_count > before


def test_a_space_that_is_no_longer_wanted_is_given_up(
    cloud: BalanceCloud, scene: MagicMock, monkeypatch: pytest.MonkeyPatch
) -> None:
    shares: list[int] = []

    def compute(*_: Any, progress: Any, **__: Any) -> None:
        cloud.worker.drop()
        for share in range(3):
            progress(share, 3)
            shares.append(share)

    monkeypatch.setattr(balance_cloud, "compute_balance_space", compute)
    cloud.visible = True
    cloud.want(INPUTS, SUPPORT)
    assert cloud.worker.wait_until_idle(PATIENCE)
    assert shares == []
    assert not cloud.ready
    assert not scene.add_mesh_simple.called
