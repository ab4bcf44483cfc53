"""Pictures of a world without a window: PyBullet's software renderer, shadows, and what is drawn over it."""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from jet_gym.courses import CARTON_HEIGHT
from jet_gym.robot import Robot, jet_hr1
from jet_gym.simulation.errors import WorldStateError
from jet_gym.simulation.pictures.camera import Camera, CameraSettings
from jet_gym.simulation.pictures.overlay import Overlay, draw_overlay
from jet_gym.simulation.pictures.shading import FAR_AWAY, floor_of, shade
from jet_gym.simulation.pictures.stage import Stage
from jet_gym.simulation.world import World
from jet_gym.step import Step
from jet_gym.utils.arrays import Array
from jet_gym.utils.self_closing import SelfClosing
from jet_gym.utils.settings import require_whole

_LIGHT = CameraSettings(
    azimuth=math.radians(-30.0),
    elevation=math.radians(56.0),
    field_of_view=math.radians(14.0),
    margin=0.02,
    near=1.0,
    far=30.0,
)
_LIGHT_PIXELS = 320
_ELBOW_ROOM = 0.10  # [m] around the pelvis
_CROUCHED = 0.8  # share of its height that the robot has when it walks


class Renderer(SelfClosing):
    """Draws worlds of one robot. What it draws is a copy, so that drawing changes nothing in a world.

    Attributes:
        width: Width of the pictures [px].
        height: Height of the pictures [px].
        camera: The camera; it frames the step and follows the robot.
        stage: What the camera looks at.

    Args:
        robot: The robot; Jet-HR1 where omitted.
        width: Width of the pictures [px].
        height: Height of the pictures [px].
        supersampling: By how much larger the bodies are rendered before they are made smaller, so that their
            edges are smooth; 1 is the fastest.
        camera: From where the camera looks; a three-quarter view from the front where omitted.

    Raises:
        BulletMissingError: If PyBullet is not installed.
        SettingsError: If a size makes no sense.
    """

    def __init__(
        self,
        robot: Robot | None = None,
        width: int = 640,
        height: int = 480,
        *,
        supersampling: int = 2,
        camera: CameraSettings | None = None,
    ) -> None:
        for name, value in (("width", width), ("height", height), ("supersampling", supersampling)):
            require_whole(name, value, 1, 8192)
        self.width, self.height = width, height
        self.camera = Camera(width, height, camera)
        self.stage = Stage(robot or jet_hr1())
        self._supersampling = supersampling
        self._light = Camera(_LIGHT_PIXELS, _LIGHT_PIXELS, _LIGHT)

    def close(self) -> None:
        """Shut down the stage; a second time does nothing."""
        self.stage.close()

    def render(self, world: World, overlay: Overlay | None = None) -> NDArray[np.uint8]:
        """Draw a world.

        Args:
            world: The world; its cartons must have been placed.
            overlay: What to draw over the picture.

        Returns:
            The picture (height, width, 3), red, green, blue.

        Raises:
            WorldStateError: If there is no step in the world yet.
        """
        if world.step is None:
            raise WorldStateError("there is nothing to draw: reset the world or place its cartons first")
        self.stage.copy(world)
        corners = _corners(world.step, world.body.pelvis().pose.position)
        self.camera.follow(corners)
        self._light.forget()
        self._light.follow(corners)
        picture = self._picture(world.step, corners.mean(axis=0))
        return picture if overlay is None else draw_overlay(picture, self.camera, overlay)

    def _picture(self, step: Step, middle: Array) -> NDArray[np.uint8]:
        scale, to_light = self._supersampling, -self._light.axes[2]
        shot = self.stage.shoot(self.camera, scale * self.width, scale * self.height, to_light)
        light = self.stage.shoot(self._light, _LIGHT_PIXELS, _LIGHT_PIXELS, to_light)
        light_depth = np.where(light.bodies >= 0, self._light.depth(light.buffer), np.float32(FAR_AWAY))
        ground = min(step.start[2], step.landing[2], step.support[2]) - CARTON_HEIGHT
        picture = np.empty((self.height, self.width, 3), dtype=np.uint8)
        shade(
            self.camera.lens, floor_of(step, ground, middle), self._light.lens, light_depth,
            shot.color, shot.buffer, shot.bodies, picture,
        )  # fmt: skip
        return picture


def _corners(step: Step, pelvis: Array) -> Array:
    """Return points (N, 3) [m] around everything that a picture should show."""
    soles = np.array([step.start, step.landing, step.support])
    rectangles = np.array([step.robot.left.sole_rectangle, step.robot.right.sole_rectangle])
    reach = np.abs(rectangles).max()
    low, high = soles.min(axis=0) - reach, soles.max(axis=0) + reach
    low[2], high[2] = low[2] + reach - CARTON_HEIGHT, step.support[2]
    robot_low = np.append(pelvis[:2] - _ELBOW_ROOM, step.support[2])
    head = pelvis[2] + step.robot.height - step.robot.leg_length
    robot_high = np.append(pelvis[:2] + _ELBOW_ROOM, max(head, step.support[2] + _CROUCHED * step.robot.height))
    boxes = ((low, high), (robot_low, robot_high))
    return np.array([corner for box in boxes for corner in itertools.product(*zip(*box, strict=True))])
