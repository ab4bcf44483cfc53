"""Films show what there was."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from agents.planner import make_planner
from jet_gym import Step
from jet_gym.simulation import FilmSettings, Renderer, World, execute
from jet_gym.simulation.pictures.film import frames

pytest.importorskip("pybullet")


def test_a_carton_that_the_landing_needs_is_gone_once_the_foot_has_left_it(monkeypatch):
    step = Step("left", (0.0, 0.24, 0.0), (0.12, 0.26, 0.05), (0.0, 0.0, 0.0), points=30, duration=6.0)
    execution = execute([make_planner("gas").plan(step, seed=0)])
    assert execution.summary.success
    heights = []

    def look(_: Renderer, world: World, __: Any) -> Any:
        heights.append(world.client.getBasePositionAndOrientation(world.cartons.bodies["start"])[0][2])
        pelvis = execution.pelvis[rows[len(heights) - 1]]
        assert world.body.pelvis().pose.position == pytest.approx(pelvis, abs=1e-6)
        return np.zeros((48, 64, 3), dtype=np.uint8)

    monkeypatch.setattr(Renderer, "render", look)
    rows = list(range(0, len(execution.time), 10))
    assert len(list(frames(execution, rows, FilmSettings(width=64, height=64)))) == len(rows)
    assert heights[0] == pytest.approx(0.0)
    assert heights[-1] < -1.0
    swing = execution.soles[rows, 0]
    landing_is_nearer = np.linalg.norm(swing - step.landing, axis=1) < np.linalg.norm(swing - step.start, axis=1)
    assert np.array_equal(np.array(heights) < -1.0, landing_is_nearer)
