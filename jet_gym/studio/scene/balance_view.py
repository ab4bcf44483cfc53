"""Balance in the scene: support rectangle, edge polygon, centre of mass, both ZMPs and the thrust as an arrow."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jet_gym.balance import BalanceSettings
from jet_gym.figures.style import ACHIEVED_COLOR, INK, LEG_COLORS, LIMIT_COLOR, THRUST_COLOR
from jet_gym.ground import sole_corners
from jet_gym.leg import opposite
from jet_gym.step import Step
from jet_gym.studio.motion import Pose
from jet_gym.studio.scene.colors import rgb
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from viser import SceneApi

METERS_PER_NEWTON = 0.015
"""Length of the thrust arrow."""

_LEAST_ARROW = 0.05  # [N] below which there is no arrow
_ON_FOOT = 0.024  # [m] above the sole's plane, where flat marks are seen on the foot and not hidden below it
_LAYER = 0.002  # [m] between marks that lie on each other
_ARC_POINTS = 24
_CORRIDOR_COLOR = (230, 160, 30)
_ASSIGNED_COLOR = (230, 120, 0)


class BalanceView:
    """What holds the robot in balance, drawn on and above the support foot.

    Args:
        scene: Where it is drawn.
    """

    def __init__(self, scene: SceneApi) -> None:
        names = {
            layer: f"/balance/{number}"
            for number, layer in enumerate(("support and ZMP", "edge polygon", "centre of mass", "thrust"))
        }
        self._roots = {layer: scene.add_frame(name, show_axes=False) for layer, name in names.items()}
        self._add_support(scene, names["support and ZMP"])
        self._corridor = scene.add_mesh_simple(
            f"{names['edge polygon']}/corridor",
            np.zeros((2 * _ARC_POINTS, 3)),
            _strip(_ARC_POINTS),
            color=_CORRIDOR_COLOR,
            opacity=0.38,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )
        self._add_center_of_mass(scene, names["centre of mass"])
        self._add_thrust(scene, names["thrust"])
        self._step: Step | None = None
        self._support_height = 0.0
        self._edge_tolerance = BalanceSettings.edge_tolerance

    def _add_support(self, scene: SceneApi, name: str) -> None:
        from trimesh.creation import annulus

        color = rgb(LEG_COLORS["left"])
        self._sole, self._margin = (
            scene.add_line_segments(
                f"{name}/{what}", np.zeros((4, 2, 3)), color, thickness=thickness, thickness_units="screen"
            )
            for what, thickness in (("sole", 3.0), ("margin", 1.5))
        )
        ring = annulus(r_min=0.009, r_max=0.0135, height=0.003, sections=32)
        self._assigned = scene.add_mesh_simple(
            f"{name}/assigned_zmp", ring.vertices, ring.faces, color=_ASSIGNED_COLOR, cast_shadow=False
        )
        self._zmp = scene.add_icosphere(f"{name}/zmp", radius=0.0085, color=rgb(ACHIEVED_COLOR), cast_shadow=False)

    def _add_center_of_mass(self, scene: SceneApi, name: str) -> None:
        self._com = scene.add_icosphere(f"{name}/com", radius=0.013, color=rgb(INK), cast_shadow=False)
        self._plumb = scene.add_line_segments(
            f"{name}/plumb", np.zeros((1, 2, 3)), rgb(INK), thickness=1.5, thickness_units="screen"
        )

    def _add_thrust(self, scene: SceneApi, name: str) -> None:
        self._arrow = scene.add_arrows(
            f"{name}/arrow",
            np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 0.1]]]),
            rgb(THRUST_COLOR),
            shaft_radius=0.006,
            head_radius=0.014,
            head_length=0.03,
        )
        self._newtons = scene.add_label(
            f"{name}/newtons", "", font_screen_scale=1.1, anchor="bottom-center", depth_test=False
        )

    def show(self, step: Step, settings: BalanceSettings) -> None:
        """Draw the support rectangle and its margin under the support foot of a step."""
        self._step, self._edge_tolerance = step, settings.edge_tolerance
        self._support_height = step.support[2]
        side = opposite(step.swing)
        for handle, margin in ((self._sole, 0.0), (self._margin, settings.zmp_margin)):
            corners = sole_corners(step.robot.leg(side), margin) + step.support + [0.0, 0.0, _ON_FOOT]
            handle.points = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
            handle.colors = np.array(rgb(LEG_COLORS[side]))

    def place(self, pose: Pose, max_thrust: float) -> None:
        """Draw the balance of one pose.

        Args:
            pose: The pose.
            max_thrust: Largest thrust [N], above which the arrow is red.
        """
        if self._step is None:
            return
        ground = self._support_height
        self._com.position = pose.com
        foot_of_plumb = np.array([pose.com[0], pose.com[1], ground])
        self._plumb.points = np.array([[pose.com, foot_of_plumb]])
        self._assigned.position = (*pose.assigned_zmp, ground + _ON_FOOT + _LAYER)
        self._zmp.visible = bool(np.isfinite(pose.zmp).all())
        if self._zmp.visible:
            self._zmp.position = (*pose.zmp, ground + _ON_FOOT + 2 * _LAYER)
        ankle = pose.swing_sole[:2] - np.array(self._step.robot.leg(self._step.swing).sole[:2])
        lens = edge_polygon(pose.assigned_zmp, ankle, self._edge_tolerance, _ARC_POINTS)
        self._corridor.vertices = np.column_stack([lens, np.full(len(lens), ground + _ON_FOOT)])
        self._place_arrow(pose, max_thrust)

    def show_layer(self, layer: str, visible: bool) -> None:
        """Draw one of its layers, or leave it out."""
        self._roots[layer].visible = visible

    def _place_arrow(self, pose: Pose, max_thrust: float) -> None:
        thrust = float(pose.thrust[0])
        self._arrow.visible = abs(thrust) >= _LEAST_ARROW
        tip = pose.fan + np.array([0.0, 0.0, METERS_PER_NEWTON * thrust])
        if self._arrow.visible:
            self._arrow.points = np.array([[pose.fan, tip]])
            possible = -1e-6 <= thrust <= max_thrust + 1e-6
            self._arrow.colors = np.array(rgb(THRUST_COLOR if possible else LIMIT_COLOR))
        self._newtons.position = tip + np.array([0.0, 0.0, 0.012])
        self._newtons.text = f"{thrust:.1f} N"


def edge_polygon(zmp: Array, ankle: Array, tolerance: float, count: int) -> Array:
    """Return the outline of where eq. (10) lets the centre of mass be.

    The angle between the lines from the assigned ZMP to the centre of mass and from there to the swing ankle is
    at most rho where the centre of mass sees the two under an angle of at least 180 degrees less rho: by the
    theorem of the inscribed angle, a lens between two arcs of circles through both.

    Args:
        zmp: The assigned ZMP (2,) [m].
        ankle: Projection of the swing ankle (2,) [m].
        tolerance: rho [rad].
        count: Points on each arc, at least 2.

    Returns:
        Points (2 count, 2) [m]: one arc from the ZMP to the ankle, then the other, also from the ZMP.
    """
    chord = ankle - zmp
    length = float(np.hypot(*chord))
    along = chord / max(length, 1e-12)
    across = np.array([-along[1], along[0]])
    angle = np.linspace(-tolerance, tolerance, count)  # at the circle's centre, from its bisector
    radius = 0.5 * length / math.sin(tolerance)
    x = 0.5 * length + radius * np.sin(angle)
    y = radius * (np.cos(angle) - math.cos(tolerance))
    return np.concatenate([zmp + np.outer(x, along) + sign * np.outer(y, across) for sign in (1.0, -1.0)])


def _strip(count: int) -> NDArray[np.int64]:
    """Return triangles (2 count - 2, 3) between two lines of points."""
    k = np.arange(count - 1)
    return np.concatenate(
        [np.column_stack([k, k + 1, k + count]), np.column_stack([k + 1, k + count + 1, k + count])]
    )
