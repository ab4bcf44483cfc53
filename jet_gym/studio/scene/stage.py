"""Everything that one page draws in its scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from jet_gym.figures.style import planner_style
from jet_gym.plan import Plan
from jet_gym.robot import Robot
from jet_gym.step import Step
from jet_gym.studio.inputs import Inputs
from jet_gym.studio.motion import Pose
from jet_gym.studio.scene.balance_view import BalanceView
from jet_gym.studio.scene.colors import rgb
from jet_gym.studio.scene.ground_view import Dragged, GroundView
from jet_gym.studio.scene.path_view import PathView
from jet_gym.studio.scene.robot_view import RobotView
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from viser import SceneApi

LAYERS = ("paths", "support and ZMP", "edge polygon", "centre of mass", "thrust", "names of blocks")
"""What can be drawn or left out."""

_GHOST_OPACITY = 0.32


class _Ghost(NamedTuple):
    """Another planner's plan beside the one that is shown."""

    planner: str
    body: RobotView
    paths: PathView


class Stage:
    """The robot, a ghost beside it, what they stand on, and what holds them in balance.

    Args:
        scene: Where it is drawn.
        robot: The robot.
        camera_position: Returns where the camera is (3,) [m].
        dragged: Called while a block is dragged.
    """

    def __init__(
        self, scene: SceneApi, robot: Robot, camera_position: Callable[[], Array], dragged: Dragged
    ) -> None:
        self._scene = scene
        self._robot = robot
        self.ground = GroundView(scene, camera_position, dragged)
        self._body = RobotView(scene, "/robot", robot)
        self._paths = PathView(scene, "/paths")
        self._balance = BalanceView(scene)
        self._ghost: _Ghost | None = None
        self._hidden: set[str] = set()

    def show_step(self, inputs: Inputs, step: Step | None) -> None:
        """Draw what is known of a step before it is planned; ``None`` if it makes no sense."""
        self.ground.show(inputs, step)
        if step is not None:
            self._paths.show_step(step)
            self._balance.show(step, inputs.balance)

    def show_plan(self, plan: Plan) -> None:
        """Draw where the pelvis of a plan goes."""
        self._paths.show_plan(plan)

    def show_rival(self, plan: Plan | None) -> None:
        """Draw a ghost for another planner's plan, or none."""
        if self._ghost is not None and (plan is None or plan.planner != self._ghost.planner):
            self._ghost.body.node.remove()
            self._ghost.paths.node.remove()
            self._ghost = None
        if plan is None:
            return
        if self._ghost is None:
            color = rgb(planner_style(plan.planner).color)
            body = RobotView(self._scene, "/ghost", self._robot, color, _GHOST_OPACITY)
            self._ghost = _Ghost(plan.planner, body, PathView(self._scene, "/ghost_paths", color))
            self._ghost.paths.node.visible = "paths" not in self._hidden
        self._ghost.paths.show_plan(plan)

    def place(self, pose: Pose, rival: Pose | None, max_thrust: float) -> None:
        """Show the robot in a pose, and the ghost in another.

        Args:
            pose: The robot's.
            rival: The ghost's, if there is one.
            max_thrust: Largest thrust [N].
        """
        self._body.place(pose)
        self._balance.place(pose, max_thrust)
        if rival is not None and self._ghost is not None:
            self._ghost.body.place(rival)

    def show_layer(self, layer: str, visible: bool) -> None:
        """Draw one of :data:`LAYERS`, or leave it out."""
        (self._hidden.discard if visible else self._hidden.add)(layer)
        if layer == "paths":
            self._paths.node.visible = visible
            if self._ghost is not None:
                self._ghost.paths.node.visible = visible
        elif layer == "names of blocks":
            self.ground.show_names(visible)
        else:
            self._balance.show_layer(layer, visible)
