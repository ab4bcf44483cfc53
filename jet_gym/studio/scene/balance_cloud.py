"""The balance space of Fig. 5 as two translucent clouds around the support foot, computed in the background."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jet_gym.balance import BalanceSettings
from jet_gym.balance_space import BalanceSpace, compute_balance_space
from jet_gym.figures.style import THRUST_COLOR
from jet_gym.leg import Side, Vector
from jet_gym.robot import Robot
from jet_gym.studio.scene.colors import rgb
from jet_gym.studio.worker import LatestWorker, Stale, StaleError, give_up_if
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from viser import SceneApi

RESOLUTION = 0.04  # [m]
_SETTLED = 0.3  # [s] without a change before the space is computed
_LOOKS = {
    False: ((60, 110, 160), 0.34),
    True: (rgb(THRUST_COLOR), 0.13),
}  # colour and opacity, without and with thrust
_SMOOTHINGS = 8

Faces = NDArray[np.int64]


@dataclass(frozen=True)
class SpaceInputs:
    """What a balance space depends on.

    Attributes:
        robot: The robot.
        swing: The swing leg.
        settings: What counts as balanced.
    """

    robot: Robot
    swing: Side
    settings: BalanceSettings


class BalanceCloud:
    """Where the swing foot can be while some posture balances, with thrust and without.

    Args:
        scene: Where it is drawn.
        name: Begins the name of the thread that computes.
    """

    def __init__(self, scene: SceneApi, name: str) -> None:
        self._scene = scene
        self._root = scene.add_frame("/balance_space", show_axes=False, visible=False)
        self._shown: SpaceInputs | None = None
        self._wanted: SpaceInputs | None = None
        self.worker = LatestWorker(self._compute, f"{name}-space", patience=_SETTLED)

    @property
    def ready(self) -> bool:
        """Whether what is wanted is drawn."""
        return self._shown is not None and self._shown == self._wanted

    @property
    def visible(self) -> bool:
        """Whether it is drawn."""
        return bool(self._root.visible)

    @visible.setter
    def visible(self, visible: bool) -> None:
        self._root.visible = visible
        if visible and self._wanted is not None and not self.ready:
            self.worker.submit(self._wanted)

    def want(self, inputs: SpaceInputs, support: Vector) -> None:
        """Draw the space of these inputs around a support sole [m], as soon as it is visible and computed."""
        self._root.position = support
        if inputs != self._wanted:
            self._wanted = inputs
            if self.visible:
                self.worker.submit(inputs)

    def close(self) -> None:
        """End the thread; may be called twice."""
        self.worker.close()

    def _compute(self, inputs: SpaceInputs, stale: Stale) -> None:
        try:
            space = compute_balance_space(
                RESOLUTION, inputs.settings, robot=inputs.robot, swing=inputs.swing, threads=1,
                progress=give_up_if(stale),
            )  # fmt: skip
        except StaleError:
            return
        if stale():
            return
        for with_thrust, (color, opacity) in _LOOKS.items():
            vertices, faces = hull_of(space, space.reachable(with_thrust=with_thrust))
            name = f"/balance_space/{'with' if with_thrust else 'without'}_thrust"
            if len(faces):
                self._scene.add_mesh_simple(
                    name, vertices, faces, color=color, opacity=opacity, side="double", cast_shadow=False,
                    receive_shadow=False,
                )  # fmt: skip
        self._shown = inputs


def hull_of(space: BalanceSpace, inside: NDArray[np.bool_]) -> tuple[Array, Faces]:
    """Return the smoothed surface around the cells of a grid that belong to a space.

    Args:
        space: The space, for the places of its grid.
        inside: Which places belong (X, Y, Z).

    Returns:
        Corners (V, 3) [m] from the support sole, and triangles (F, 3).
    """
    from trimesh import Trimesh
    from trimesh.smoothing import filter_taubin

    corners, faces = boundary_of(inside)
    if len(faces) == 0:
        return np.zeros((0, 3)), faces
    first = np.array([space.x[0], space.y[0], space.z[0]]) - np.array(space.support)
    mesh = Trimesh(vertices=first + space.resolution * (corners - 0.5), faces=faces, process=False)
    filter_taubin(mesh, iterations=_SMOOTHINGS)
    return np.array(mesh.vertices, dtype=np.float64), faces


def boundary_of(inside: NDArray[np.bool_]) -> tuple[Array, Faces]:
    """Return the faces between cells inside and outside of a set, two triangles each.

    Args:
        inside: Which cells belong (X, Y, Z).

    Returns:
        Corners (V, 3), each there once, in cells from the lower corner of the first cell; triangles (F, 3), their
        front to the outside.
    """
    padded = np.pad(inside, 1)
    shape = np.array(padded.shape) + 1
    quads = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        step = np.diff(padded.astype(np.int8), axis=axis)
        for sign in (1, -1):
            lower = np.argwhere(step == -sign)
            lower[:, axis] += 1  # the face lies between this cell and the next
            offsets = np.zeros((4, 3), dtype=np.int64)
            offsets[[1, 2], u] = 1
            offsets[[2, 3], v] = 1
            quads.append(lower[:, None] + (offsets if sign > 0 else offsets[::-1]))
    corners = np.concatenate(quads)
    numbers = np.ravel_multi_index(tuple(corners.reshape(-1, 3).T), tuple(shape))
    used, faces = np.unique(numbers, return_inverse=True)
    faces = faces.reshape(-1, 4)
    vertices = np.column_stack(np.unravel_index(used, tuple(shape))).astype(np.float64) - 1.0
    return vertices, np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
