"""Where swing sole and pelvis go, as lines in the scene with a bead at each swing point."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from jet_gym.figures.style import INK, LEG_COLORS, LIMIT_COLOR
from jet_gym.plan import Plan
from jet_gym.step import Step
from jet_gym.studio.scene.colors import Rgb, rgb
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from viser import FrameHandle, SceneApi

_BEAD = 0.0065  # [m]


class PathView:
    """The swing path, known before anything is planned, and the pelvis path of a plan.

    Beads of swing points that violate a constraint are red.

    Attributes:
        node: What all of it hangs on in the scene.

    Args:
        scene: Where it is drawn.
        name: Name of the node.
        color: Colour of the pelvis path; black where omitted.
    """

    def __init__(self, scene: SceneApi, name: str, color: Rgb | None = None) -> None:
        color = rgb(INK) if color is None else color
        self._color = color
        self.node: FrameHandle = scene.add_frame(name, show_axes=False)
        lines = {"thickness": 2.5, "thickness_units": "screen"}
        self._swing = scene.add_line_segments(f"{name}/swing", np.zeros((1, 2, 3)), rgb(INK), **lines)
        self._pelvis = scene.add_line_segments(f"{name}/pelvis", np.zeros((1, 2, 3)), color, **lines)
        beads = {"point_size": _BEAD, "point_shape": "circle", "precision": "float32"}
        self._swing_beads = scene.add_point_cloud(f"{name}/swing_beads", np.zeros((1, 3)), (0, 0, 0), **beads)
        self._pelvis_beads = scene.add_point_cloud(f"{name}/pelvis_beads", np.zeros((1, 3)), (0, 0, 0), **beads)

    def show_step(self, step: Step) -> None:
        """Draw the swing path of a step."""
        soles = step.swing_sole
        color = rgb(LEG_COLORS[step.swing])
        self._swing.points = _segments(soles)
        self._swing.colors = np.array(color)
        self._swing_beads.points = soles
        self._swing_beads.colors = np.tile(np.array(color), (len(soles), 1))

    def show_plan(self, plan: Plan | None) -> None:
        """Draw the pelvis path of a plan, or none."""
        self._pelvis.visible = self._pelvis_beads.visible = plan is not None
        if plan is None:
            return
        violated = np.array([bool(names) for names in plan.violations])
        colors = np.where(violated[:, None], rgb(LIMIT_COLOR), self._color)
        self._pelvis.points = _segments(plan.pelvis)
        self._pelvis_beads.points = plan.pelvis
        self._pelvis_beads.colors = colors
        swing_colors = np.where(violated[:, None], rgb(LIMIT_COLOR), rgb(LEG_COLORS[plan.step.swing]))
        self._swing_beads.points = plan.swing_sole
        self._swing_beads.colors = swing_colors


def _segments(points: Array) -> Array:
    """Return the segments (N - 1, 2, 3) of a line through points (N, 3)."""
    return np.stack([points[:-1], points[1:]], axis=1)
