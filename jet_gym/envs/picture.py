"""What an environment shows: the simulated robot, or one that is posed for the picture alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jet_gym.envs.physics import BulletPhysics, standing_posture
from jet_gym.step import Step
from jet_gym.task.model import TaskModel
from jet_gym.task.transition import Transition
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from jet_gym.simulation.pictures.renderer import Renderer
    from jet_gym.simulation.world import World


@dataclass(frozen=True, eq=False)
class Scene:
    """What is drawn into a frame.

    Attributes:
        step: The step.
        point: The last swing point for which a posture was chosen; -1 before the first.
        transition: What that led to, of one lane; ``None`` before the first.
        zmp: The ZMP to mark (2,) [m], as measured where there is physics.
        thrust: The thrust to draw [N], likewise.
    """

    step: Step
    point: int
    transition: Transition | None
    zmp: Array | None
    thrust: float


class Picture:
    """Draws an environment; built when the first frame is asked for.

    Args:
        model: The task.
        physics: The simulated robot; without it, one is posed for the picture.
        window: Whether to show PyBullet's window in place of making frames.
    """

    def __init__(self, model: TaskModel, physics: BulletPhysics | None, *, window: bool) -> None:
        self._model, self._physics, self._window = model, physics, window
        self._posed: World | None = None
        self._renderer: Renderer | None = None

    def begin(self) -> None:
        """Forget the last episode: the camera frames the new step at once."""
        if self._renderer is not None:
            self._renderer.camera.forget()

    def frame(self, scene: Scene) -> NDArray[np.uint8] | None:
        """Return a frame (height, width, 3), or ``None`` where the window shows it."""
        from jet_gym.simulation.pictures.overlay import Overlay
        from jet_gym.simulation.pictures.renderer import Renderer

        world = self._physics.world if self._physics is not None else self._pose(scene)
        if self._window:
            return None
        if self._renderer is None:
            self._renderer = Renderer(self._model.robot)
        step, shown = scene.step, scene.transition
        overlay = Overlay.of_step(
            step,
            self._model.balance.zmp_margin,
            center_of_mass=None if shown is None else shown.com[0],
            assigned_zmp=None if shown is None else shown.assigned_zmp[0],
            zmp=scene.zmp,
            fan=world.body.fan_pose(step.swing).position,
            thrust=scene.thrust,
            caption=f"swing point {scene.point} of {step.points - 1}" if scene.point >= 0 else "before the step",
        )
        return self._renderer.render(world, overlay)

    def close(self) -> None:
        """Close what was opened for the pictures."""
        for owner in (self._renderer, self._posed):
            if owner is not None:
                owner.close()
        self._renderer, self._posed = None, None

    def _pose(self, scene: Scene) -> World:
        """Place the robot of a quasi-static environment."""
        from jet_gym.simulation.world import World

        if self._posed is None:
            self._posed = World(self._model.robot, gui=self._window)
        if self._posed.step != scene.step:
            self._posed.place_cartons(scene.step)
        if scene.transition is None:
            standing = standing_posture(scene.step, self._model)
            self._posed.pose(standing.joint_positions, standing.pelvis, float(standing.pelvis_yaw))
        else:
            shown = scene.transition
            self._posed.pose(shown.joint_positions[0], shown.pelvis[0], float(shown.pelvis_yaw[0]))
        return self._posed
