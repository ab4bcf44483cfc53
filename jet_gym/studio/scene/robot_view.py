"""The robot in the scene, moved by its joints; rings in colour where a joint is near the end of its range."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from jet_gym.robot import Robot
from jet_gym.studio.joint_room import AT_LIMIT, NEAR_LIMIT, room_to_limits
from jet_gym.studio.motion import Pose
from jet_gym.studio.scene.robot_shapes import Color, Shape, robot_tree
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from viser import FrameHandle, MeshHandle, SceneApi

_NEAR_COLOR, _AT_COLOR = (240, 165, 0), (214, 30, 40)
_RING_RADIUS, _RING_THICKNESS = 0.04, 0.0028  # [m]


class RobotView:
    """A robot whose links hang on each other in the scene, so that only joints and pelvis are sent as it moves.

    Attributes:
        node: What all of it hangs on in the scene.

    Args:
        scene: Where it is drawn.
        name: Name of the node.
        robot: The robot.
        color: One colour for the whole robot; the file's own where ``None``.
        opacity: How solid it is, from 0 to 1; as solid as can be where ``None``.
    """

    def __init__(
        self, scene: SceneApi, name: str, robot: Robot, color: Color | None = None, opacity: float | None = None
    ) -> None:
        from viser.transforms import SO3

        tree = robot_tree(robot.urdf_path)
        urdf = tree.urdf
        self._robot = robot
        self.node: FrameHandle = scene.add_frame(name, show_axes=False)
        paths, origins, axes = {urdf.root: name}, [], []
        self._joints: list[FrameHandle] = []
        self._rings: list[MeshHandle] = []
        for joint_name in robot.joint_names:
            joint = urdf.joints[joint_name]
            carrier = urdf.moving_link(joint.parent)
            origin = np.linalg.inv(urdf.zero_poses[carrier]) @ urdf.zero_poses[joint.parent] @ joint.origin
            path = paths[joint.child] = f"{paths[carrier]}/{joint.child}"
            self._joints.append(scene.add_frame(path, show_axes=False, position=origin[:3, 3]))
            origins.append(origin[:3, :3])
            axes.append(joint.axis)
            if color is None:
                self._rings.append(_add_ring(scene, f"{path}/limit", joint.axis))
        self._origins, self._axes = SO3.from_matrix(np.array(origins)), np.array(axes)
        for link, shapes in tree.shapes.items():
            whole = shapes if color is None else (_merged(shapes, color),)
            for number, shape in enumerate(whole):
                scene.add_mesh_simple(
                    f"{paths[link]}/{number}",
                    shape.vertices,
                    shape.faces,
                    color=shape.color,
                    opacity=opacity,
                    flat_shading=True,
                    cast_shadow=opacity is None,
                    receive_shadow=opacity is None,
                )

    def place(self, pose: Pose) -> None:
        """Move it into a pose and mark the joints that are near the end of their range."""
        from viser.transforms import SO3

        self.node.position = pose.pelvis
        self.node.wxyz = pose.orientation
        turns = self._origins @ SO3.exp(pose.joint_positions[:, None] * self._axes)
        for frame, turn in zip(self._joints, turns.wxyz, strict=True):
            frame.wxyz = turn
        for ring, room in zip(self._rings, room_to_limits(self._robot, pose.joint_positions), strict=False):
            ring.visible = bool(room < NEAR_LIMIT)
            if ring.visible:
                ring.color = _AT_COLOR if room < AT_LIMIT else _NEAR_COLOR


def _add_ring(scene: SceneApi, name: str, axis: Array) -> MeshHandle:
    from trimesh.creation import torus
    from trimesh.geometry import align_vectors

    ring = torus(_RING_RADIUS, _RING_THICKNESS, major_sections=32, minor_sections=8)
    ring.apply_transform(align_vectors([0.0, 0.0, 1.0], axis))
    return scene.add_mesh_simple(
        name, ring.vertices, ring.faces, color=_NEAR_COLOR, cast_shadow=False, receive_shadow=False, visible=False
    )


def _merged(shapes: tuple[Shape, ...], color: Color) -> Shape:
    first = np.cumsum([0, *(len(shape.vertices) for shape in shapes)])
    faces = [shape.faces + offset for shape, offset in zip(shapes, first, strict=False)]
    return Shape(np.concatenate([shape.vertices for shape in shapes]), np.concatenate(faces), color)
