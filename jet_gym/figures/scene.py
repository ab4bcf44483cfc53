"""What a locomotion figure shows, as points in the world: the robot at every swing point, cartons, the ditch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jet_gym.arrays import Array
from jet_gym.courses import CARTON_HEIGHT, CARTON_LENGTH, CARTON_WIDTH
from jet_gym.kinematics import forward_kinematics
from jet_gym.leg import Leg, opposite
from jet_gym.plan import Plan
from jet_gym.step import Step

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
class Carton:
    """A carton under a foot.

    Attributes:
        foot: What stands on it: ``"start"``, ``"landing"`` or ``"support"``.
        x: Its extent along x [m].
        y: Its extent along y [m].
        z: Its extent along z [m]: the ground and the sole.
    """

    foot: str
    x: tuple[float, float]
    y: tuple[float, float]
    z: tuple[float, float]

    @property
    def corners(self) -> Array:
        """Corners (8, 3) [m]: four below, in order around, then the four above them."""
        (x_min, x_max), (y_min, y_max) = self.x, self.y
        around = ((x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max))
        return np.array([(x, y, z) for z in self.z for x, y in around])


@dataclass(frozen=True)
class Ditch:
    """The clear gap between two cartons.

    Attributes:
        axis: 0 if it separates them along x, 1 if along y.
        edges: Where it begins and ends on that axis [m].
        across: Middle of the step on the other axis [m].
    """

    axis: int
    edges: tuple[float, float]
    across: float

    @property
    def span(self) -> float:
        """Clear width [m]."""
        return self.edges[1] - self.edges[0]

    @property
    def label(self) -> str:
        """Clear width in mm, with its unit."""
        return f"{1e3 * self.span:.4g} mm"


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
    corners = np.array([_sole_corners(robot.left), _sole_corners(robot.right)])
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


def cartons_of(step: Step) -> tuple[Carton, ...]:
    """Return the cartons under start, support and landing, each centred under the sole that stands on it.

    Where the soles differ in height, so do the cartons; the lowest one has the paper's height. Cartons of
    feet that stand close overlap.
    """
    ground = min(step.start[2], step.landing[2], step.support[2]) - CARTON_HEIGHT
    other = step.robot.leg(opposite(step.swing))
    swing = step.robot.leg(step.swing)
    feet = (("start", step.start, swing), ("support", step.support, other), ("landing", step.landing, swing))
    cartons = []
    for foot, (x, y, z), leg in feet:
        x_min, x_max, y_min, y_max = leg.sole_rectangle
        middle_x, middle_y = x + 0.5 * (x_min + x_max), y + 0.5 * (y_min + y_max)
        cartons.append(
            Carton(
                foot,
                (middle_x - CARTON_LENGTH / 2.0, middle_x + CARTON_LENGTH / 2.0),
                (middle_y - CARTON_WIDTH / 2.0, middle_y + CARTON_WIDTH / 2.0),
                (ground, z),
            )
        )
    return tuple(cartons)


def ditch_of(step: Step) -> Ditch | None:
    """Return the clear gap that the swing foot crosses, the wider one of x and y; ``None`` if there is none."""
    start, _, landing = cartons_of(step)
    gaps = []
    for axis, (a, b) in enumerate(((start.x, landing.x), (start.y, landing.y))):
        low, high = min(a[1], b[1]), max(a[0], b[0])
        gaps.append((high - low, axis, (low, high)))
    width, axis, edges = max(gaps)
    if width <= 0.0:
        return None
    return Ditch(axis, edges, 0.5 * (step.start[1 - axis] + step.landing[1 - axis]))


def _sole_corners(leg: Leg) -> Array:
    x_min, x_max, y_min, y_max = leg.sole_rectangle
    return np.array([[x_min, y_min, 0.0], [x_max, y_min, 0.0], [x_max, y_max, 0.0], [x_min, y_max, 0.0]])


def _trunk_corners(step: Step) -> Array:
    robot = step.robot
    half_width = 0.5 * _BLOCK_WIDTH_PER_HIP_WIDTH * (robot.left.hip[1] - robot.right.hip[1])
    half_depth, top = _BLOCK_DEPTH / 2.0, max(robot.height - robot.leg_length, 0.0)
    around = [(-half_depth, -half_width), (half_depth, -half_width), (half_depth, half_width)]
    around.append((-half_depth, half_width))
    return np.array([(x, y, z) for z in (0.0, top) for x, y in around])
