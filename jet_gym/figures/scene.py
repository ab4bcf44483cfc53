"""What a locomotion figure shows, as points in the world: the robot at every swing point, cartons, the ditch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jet_gym.ground import Carton, Ditch, cartons_of, ditch_of, sole_corners
from jet_gym.kinematics import forward_kinematics
from jet_gym.plan import Plan
from jet_gym.step import Step
from jet_gym.utils.arrays import Array

DUCT_RADIUS = 0.035  # [m] of a 70 mm fan

_BLOCK_DEPTH = 0.12  # [m] of the trunk along the pelvis' x
_BLOCK_WIDTH_PER_HIP_WIDTH = 0.75


@dataclass(frozen=True, eq=False)
class Bodies:
    """The robot at each of N swing points, in the world. The axis of length 2 is left, right.

    Attributes:
        hips: Hip centres (N, 2, 3) [m].
        knees: Knees (N, 2, 3) [m].
        ankles: Ankles (N, 2, 3) [m].
        soles: Origins of the sole frames (N, 2, 3) [m].
        fans: Where the thrust acts (N, 2, 3) [m].
        sole_corners: Corners of the sole rectangles (N, 2, 4, 3) [m], in order around.
        ducts: Points on the rims of the fans' ducts (N, 2, 33, 3) [m], first and last the same.
        trunk_corners: Corners of the block on the pelvis (N, 8, 3) [m]: four below, in order around, then
            the four above them.
    """

    hips: Array
    knees: Array
    ankles: Array
    soles: Array
    fans: Array
    sole_corners: Array
    ducts: Array
    trunk_corners: Array

    def leg_chain(self, point: int, side: int) -> Array:
        """Return hip, knee, ankle and sole of one leg (4, 3) [m]; side 0 is left."""
        chain = (self.hips, self.knees, self.ankles, self.soles)
        return np.array([points[point, side] for points in chain])


@dataclass(frozen=True)
class Scene:
    """What stands around the robot.

    Attributes:
        cartons: The cartons under start, support and landing.
        ditch: The gap that the swing foot crosses, if there is one.
    """

    cartons: tuple[Carton, ...]
    ditch: Ditch | None

    @classmethod
    def of(cls, step: Step) -> Scene:
        """Return the scene of a step."""
        return cls(cartons_of(step), ditch_of(step))


def bodies_of(plan: Plan) -> Bodies:
    """Place the robot's points in the world, from joint positions, pelvis and its yaw."""
    robot = plan.step.robot
    body = forward_kinematics(robot, plan.joint_positions)
    cosine, sine, zero = np.cos(plan.pelvis_yaw), np.sin(plan.pelvis_yaw), np.zeros_like(plan.pelvis_yaw)
    turn = np.moveaxis(np.array([[cosine, -sine, zero], [sine, cosine, zero], [zero, zero, zero + 1.0]]), 2, 0)

    def to_world(points: Array) -> Array:
        placed: Array = np.einsum("nij,n...j->n...i", turn, points)
        return placed + plan.pelvis.reshape(-1, *(1,) * (points.ndim - 2), 3)

    angle = np.linspace(0.0, 2.0 * np.pi, 33)
    rim = DUCT_RADIUS * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(33)])
    corners = np.array([sole_corners(robot.left), sole_corners(robot.right)])
    trunk = np.broadcast_to(_trunk_corners(plan.step), (len(plan.time), 8, 3))
    return Bodies(
        hips=to_world(body.hips),
        knees=to_world(body.knees),
        ankles=to_world(body.ankles),
        soles=to_world(body.soles),
        fans=to_world(body.fans),
        sole_corners=to_world(body.soles[:, :, None] + np.einsum("nsij,scj->nsci", body.foot_rotations, corners)),
        ducts=to_world(body.fans[:, :, None] + np.einsum("nsij,cj->nsci", body.foot_rotations, rim)),
        trunk_corners=to_world(trunk),
    )


def _trunk_corners(step: Step) -> Array:
    robot = step.robot
    half_width = 0.5 * _BLOCK_WIDTH_PER_HIP_WIDTH * (robot.left.hip[1] - robot.right.hip[1])
    half_depth, top = _BLOCK_DEPTH / 2.0, max(robot.height - robot.leg_length, 0.0)
    around = [(-half_depth, -half_width), (half_depth, -half_width), (half_depth, half_width)]
    around.append((-half_depth, half_width))
    return np.array([(x, y, z) for z in (0.0, top) for x, y in around])
