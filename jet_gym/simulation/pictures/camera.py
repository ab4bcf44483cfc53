"""A pinhole camera that frames points, follows them smoothly and knows where they land in the picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jet_gym.errors import SettingsError
from jet_gym.simulation.pictures.lens import Lens
from jet_gym.utils.arrays import Array

Pixels = NDArray[np.float32]


@dataclass(frozen=True)
class CameraSettings:
    """From where the camera looks.

    Attributes:
        azimuth: Direction from the scene to the camera [rad], 0 in front of the robot (+x), positive towards its
            left (+y). The default is a three-quarter view from the front right.
        elevation: How far the camera looks down [rad].
        field_of_view: Vertical opening angle [rad].
        margin: Share of the picture that stays free at each edge.
        follow: Share of the way to its next place that the camera goes from picture to picture.
        near: Distance of the near plane [m].
        far: Distance of the far plane [m].
    """

    azimuth: float = math.radians(-52.0)
    elevation: float = math.radians(20.0)
    field_of_view: float = math.radians(30.0)
    margin: float = 0.06
    follow: float = 0.12
    near: float = 0.2
    far: float = 12.0

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed.

        Raises:
            SettingsError: A ``ValueError`` that names the setting and what it may be.
        """
        limits = {
            "azimuth": (-math.tau, math.tau),
            "elevation": (0.0, math.radians(89.0)),
            "field_of_view": (math.radians(1.0), math.radians(120.0)),
            "margin": (0.0, 0.4),
            "follow": (0.0, 1.0),
            "near": (1e-3, 1e3),
            "far": (1e-3, 1e3),
        }
        for name, (least, most) in limits.items():
            if not least <= getattr(self, name) <= most:
                raise SettingsError(
                    f"{name} must lie between {least:.4g} and {most:.4g}, not {getattr(self, name)}"
                )
        if not self.near < self.far:
            raise SettingsError(f"near must be less than far, not {self.near} and {self.far}")


class Camera:
    """A camera whose direction is fixed and whose place is chosen so that given points fill the picture.

    Attributes:
        eye: Where it is (3,) [m].
        axes: Its axes as rows (3, 3): right, up, forward.
        width: Width of the picture [px].
        height: Height of the picture [px].
        settings: The settings.

    Args:
        width: Width of the picture [px].
        height: Height of the picture [px].
        settings: The settings; the defaults where omitted.
    """

    def __init__(self, width: int, height: int, settings: CameraSettings | None = None) -> None:
        self.width, self.height = width, height
        self.settings = settings or CameraSettings()
        azimuth, elevation = self.settings.azimuth, self.settings.elevation
        right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
        forward = -np.array(
            [
                math.cos(azimuth) * math.cos(elevation),
                math.sin(azimuth) * math.cos(elevation),
                math.sin(elevation),
            ]
        )
        self.axes: Array = np.array([right, np.cross(right, forward), forward])
        self.slope_y = math.tan(0.5 * self.settings.field_of_view)  # of the line of sight at the picture's edge
        self.slope_x = self.slope_y * width / height
        self.eye: Array = np.zeros(3)
        self._placed = False

    def follow(self, points: ArrayLike) -> None:
        """Go towards the place from where points (N, 3) [m] just fit; the first time, go all the way."""
        best = self._fitting_place(np.asarray(points, dtype=np.float64))
        self.eye = self.eye + (self.settings.follow if self._placed else 1.0) * (best - self.eye)
        self._placed = True

    def forget(self) -> None:
        """Go all the way to the next place."""
        self._placed = False

    def project(self, points: ArrayLike) -> tuple[Array, Array]:
        """Return where points land in the picture.

        Args:
            points: Points (..., 3) [m], world.

        Returns:
            Pixels (..., 2), x from the left edge and y from the top edge, and depths (...) [m] along the line
            of sight.
        """
        given = np.asarray(points)
        number = given.dtype if given.dtype == np.float32 else np.float64
        seen = (given - self.eye.astype(number)) @ self.axes.T.astype(number)
        depth = np.maximum(seen[..., 2], self.settings.near)
        x = 0.5 * self.width * (1.0 + seen[..., 0] / (depth * self.slope_x))
        y = 0.5 * self.height * (1.0 - seen[..., 1] / (depth * self.slope_y))
        return np.stack([x, y], axis=-1), depth

    @property
    def lens(self) -> Lens:
        """The camera in numbers that compiled code takes."""
        eye, right, up, forward = ((float(x), float(y), float(z)) for x, y, z in (self.eye, *self.axes))
        near, far = self.settings.near, self.settings.far
        return Lens(eye, right, up, forward, self.slope_x, self.slope_y, self.width, self.height, near, far)

    @property
    def view_matrix(self) -> list[float]:
        """World to camera, as OpenGL wants it: sixteen numbers, column after column."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.axes * np.array([[1.0], [1.0], [-1.0]])
        matrix[:3, 3] = -matrix[:3, :3] @ self.eye
        return [float(value) for value in matrix.T.ravel()]

    @property
    def projection_matrix(self) -> list[float]:
        """Camera to picture, likewise."""
        near, far = self.settings.near, self.settings.far
        matrix = np.zeros((4, 4))
        matrix[0, 0], matrix[1, 1] = 1.0 / self.slope_x, 1.0 / self.slope_y
        matrix[2, 2], matrix[2, 3] = -(far + near) / (far - near), -2.0 * far * near / (far - near)
        matrix[3, 2] = -1.0
        return [float(value) for value in matrix.T.ravel()]

    def depth(self, buffer: Pixels) -> Pixels:
        """Return depths [m] from what OpenGL keeps of them, 0 at the near and 1 at the far plane."""
        near, far = self.settings.near, self.settings.far
        return np.asarray(far * near / (far - (far - near) * buffer), dtype=np.float32)

    def _fitting_place(self, points: Array) -> Array:
        """Return the nearest place from where all points are within the margins: in closed form."""
        right, up, forward = (points @ self.axes.T).T
        free = 1.0 - 2.0 * self.settings.margin
        backs, middles = [], []
        for across, slope in ((right, free * self.slope_x), (up, free * self.slope_y)):
            low, high = np.max(across - slope * forward), np.min(across + slope * forward)
            backs.append((high - low) / (2.0 * slope))
            middles.append(0.5 * (low + high))
        return np.array([middles[0], middles[1], min(backs)]) @ self.axes
