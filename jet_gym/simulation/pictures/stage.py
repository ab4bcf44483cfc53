"""A stage that shows what a world holds: bodies to look at, in a physics server that never steps."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jet_gym.robot import Robot
from jet_gym.simulation.body import RobotBody
from jet_gym.simulation.bullet import connect
from jet_gym.simulation.cartons import Cartons
from jet_gym.simulation.pictures.camera import Camera, Pixels
from jet_gym.simulation.world import World
from jet_gym.utils.arrays import Array


class Shot(NamedTuple):
    """What a camera sees of the bodies on the stage."""

    color: NDArray[np.uint8]  # (height, width, 4)
    buffer: Pixels  # (height, width) what OpenGL keeps of depths along the line of sight
    bodies: NDArray[np.int32]  # (height, width) negative where there is none


class Stage:
    """Copies of a world's robot and cartons.

    A world that is only simulated so needs no meshes, and looking at it cannot disturb it.

    Attributes:
        client: The physics server's client.

    Args:
        robot: The robot.
    """

    def __init__(self, robot: Robot) -> None:
        self.client: Any = connect()
        self._cartons = Cartons(self.client, visible=True)
        self._body = RobotBody(self.client, robot, visible=True)
        self._open = True

    def close(self) -> None:
        """Shut down the physics server; a second time does nothing."""
        if self._open:
            self._open = False
            self.client.disconnect()

    def copy(self, world: World) -> None:
        """Put robot and cartons where they are in a world."""
        self._cartons.copy(world.cartons)
        self._body.place(np.array(world.body.joints()[0]), world.body.pelvis().pose)

    def shoot(self, camera: Camera, width: int, height: int, light: Array) -> Shot:
        """Take a picture.

        Args:
            camera: The camera.
            width: Width [px].
            height: Height [px].
            light: Direction to the light (3,).
        """
        _, _, color, depth, bodies = self.client.getCameraImage(
            width,
            height,
            camera.view_matrix,
            camera.projection_matrix,
            lightDirection=light.tolist(),
            lightColor=(1.0, 1.0, 1.0),
            lightDistance=10.0,
            shadow=0,
            lightAmbientCoeff=0.62,
            lightDiffuseCoeff=0.5,
            lightSpecularCoeff=0.12,
            renderer=self.client.ER_TINY_RENDERER,
        )
        shape = (height, width)
        return Shot(
            np.asarray(color, dtype=np.uint8).reshape(*shape, 4),
            np.asarray(depth, dtype=np.float32).reshape(shape),
            np.asarray(bodies, dtype=np.int32).reshape(shape),
        )
