"""One leg of a biped, read from its URDF and reduced to the numbers that kinematics and balance compute with.

Leg topology: six joints a leg, ``hip_yaw`` (z), ``hip_roll`` (x), ``hip_pitch``, ``knee_pitch``,
``ankle_pitch`` (y), ``ankle_roll`` (x), where the three hip axes meet in one point and the two ankle axes
meet in one point. Then leg inverse kinematics has a closed form (:mod:`jet_gym.kinematics`). Axes may point
either way along their line, lengths, offsets and masses are free, and left and right may differ.

What does not fit is refused with a :class:`~jet_gym.errors.RobotError` that names the joint and the reason.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from jet_gym.errors import RobotError
from jet_gym.urdf import Joint, Link, Urdf
from jet_gym.utils.arrays import Array

Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")
Vector = tuple[float, float, float]
Six = tuple[float, float, float, float, float, float]

LEG_JOINTS = ("hip_yaw", "hip_roll", "hip_pitch", "knee_pitch", "ankle_pitch", "ankle_roll")
_LEG_AXES = (2, 0, 1, 1, 1, 0)  # index of the world axis along which each joint turns at zero posture
_LENGTH_TOLERANCE = 1e-6  # [m]
_ANGLE_TOLERANCE = 1e-6  # [rad]


class Leg(NamedTuple):
    """One leg in numbers that compiled code takes by value.

    Frames are those of the links at zero posture, all parallel to the pelvis frame; the hip and ankle frames
    have their origins where the axes meet. Joint angles are counted about +z, +x, +y, +y, +y, +x;
    ``axis_signs`` leads from there to the URDF's own directions.
    """

    hip: Vector  # [m] pelvis origin to hip centre, pelvis frame
    thigh: Vector  # [m] hip to knee, thigh frame; the knee point is taken at the hip's y
    shank: Vector  # [m] knee to ankle, shank frame
    sole: Vector  # [m] ankle to sole frame, foot frame
    fan: Vector  # [m] ankle to where the thrust acts, foot frame
    sole_rectangle: tuple[float, float, float, float]  # [m] x_min, x_max, y_min, y_max from the sole frame
    knee_direction: float  # +1 or -1: the sign of knee flexion from the straight leg
    axis_signs: Six  # +1 or -1
    lower: Six  # [rad]
    upper: Six  # [rad]
    range_cosines: Six  # cosine of the middle of each joint's range
    range_sines: Six  # sine of the middle of each joint's range
    range_half_cosines: Six  # cosine of half of each joint's range
    masses: Six  # [kg] of what each joint carries up to the next
    mass_moments: tuple[Vector, Vector, Vector, Vector, Vector, Vector]  # [kg m] mass times centre of mass


@dataclass(frozen=True)
class LegNames:
    """Names that one leg's joints and frames have in the URDF.

    Attributes:
        joints: Six joints from hip yaw to ankle roll.
        sole: Frame at the ankle's projection on the sole.
        fan: Frame where the thrust acts.
    """

    joints: tuple[str, str, str, str, str, str]
    sole: str
    fan: str


def opposite(side: Side) -> Side:
    """Return the other side."""
    return "right" if side == "left" else "left"


def jet_hr1_leg(side: Side) -> LegNames:
    """Return the names that a leg of Jet-HR1 has."""
    yaw, roll, pitch, knee, ankle_pitch, ankle_roll = (f"{side}_{joint}" for joint in LEG_JOINTS)
    joints = (yaw, roll, pitch, knee, ankle_pitch, ankle_roll)
    return LegNames(joints, sole=f"{side}_sole", fan=f"{side}_fan")


def read_leg(urdf: Urdf, names: LegNames) -> Leg:
    """Reduce one leg to numbers, or refuse it."""
    joints = [urdf.joints[name] for name in names.joints]
    signs = _axis_signs(urdf, joints)
    _check_chain(urdf, joints)
    yaw, roll, pitch, knee, ankle_pitch, ankle_roll = (urdf.zero_poses[joint.child][:3, 3] for joint in joints)
    hip = _meeting_point(joints[:3], (yaw, roll, pitch))
    ankle = _meeting_point(joints[4:], (ankle_pitch, ankle_roll))
    knee = np.array([knee[0], hip[1], knee[2]])  # anywhere on the knee's axis: take the hip's y
    for joint, length in ((joints[3], knee - hip), (joints[4], ankle - knee)):
        if math.hypot(length[0], length[2]) < _LENGTH_TOLERANCE:
            raise RobotError(f"joint {joint.name}: its axis coincides with that of the joint before it")
    origins = (hip, hip, hip, knee, ankle, ankle)
    masses, moments = zip(
        *(combined_mass(urdf, joint.child, origin) for joint, origin in zip(joints, origins, strict=True)),
        strict=True,
    )
    limits = [_limits(joint, sign) for joint, sign in zip(joints, signs, strict=True)]
    foot = joints[5].child
    return Leg(
        hip=_vector(hip),
        thigh=_vector(knee - hip),
        shank=_vector(ankle - knee),
        sole=_vector(_foot_frame(urdf, names.sole, foot) - ankle),
        fan=_vector(_foot_frame(urdf, names.fan, foot) - ankle),
        sole_rectangle=_sole_rectangle(urdf, foot, names.sole),
        knee_direction=_knee_direction(knee - hip, ankle - knee, limits[3]),
        axis_signs=six(signs),
        lower=six([low for low, _ in limits]),
        upper=six([high for _, high in limits]),
        range_cosines=six([math.cos(0.5 * (low + high)) for low, high in limits]),
        range_sines=six([math.sin(0.5 * (low + high)) for low, high in limits]),
        range_half_cosines=six([math.cos(min(0.5 * (high - low), math.pi)) for low, high in limits]),
        masses=six(masses),
        mass_moments=tuple(moments),
    )


def six(values: Iterable[float]) -> Six:
    """Return six numbers, one for each joint of a leg, as compiled code takes them."""
    a, b, c, d, e, f = values
    return a, b, c, d, e, f


def _axis_signs(urdf: Urdf, joints: Sequence[Joint]) -> list[float]:
    signs = []
    for joint, expected in zip(joints, _LEG_AXES, strict=True):
        axis = urdf.zero_poses[joint.child][:3, :3] @ joint.axis
        if abs(axis[expected]) < 1.0 - _ANGLE_TOLERANCE**2:
            raise RobotError(
                f"joint {joint.name}: at zero posture it must turn about {'xyz'[expected]}, "
                f"but its axis is ({axis[0]:.3g}, {axis[1]:.3g}, {axis[2]:.3g})"
            )
        signs.append(math.copysign(1.0, axis[expected]))
    return signs


def _check_chain(urdf: Urdf, joints: Sequence[Joint]) -> None:
    carrier = urdf.root
    for joint in joints:
        if urdf.moving_link(joint.parent) != carrier:
            raise RobotError(f"joint {joint.name}: it must hang on {carrier}, but hangs on {joint.parent}")
        carrier = joint.child


def _meeting_point(joints: Sequence[Joint], origins: Sequence[Array]) -> Array:
    """Return the point where the joints' axes meet, or refuse the joint that misses it.

    Each axis is parallel to a coordinate axis, so it fixes the two other coordinates of the point.
    """
    axes = [{"z": 2, "x": 0, "y": 1}[axis] for axis in ("zxy" if len(joints) == 3 else "yx")]
    point = np.zeros(3)
    for coordinate in range(3):
        fixed = [
            (joint, o[coordinate])
            for joint, o, axis in zip(joints, origins, axes, strict=True)
            if axis != coordinate
        ]
        values = [value for _, value in fixed]
        if max(values) - min(values) > _LENGTH_TOLERANCE:
            joint, other = fixed[-1][0], fixed[0][0]
            raise RobotError(
                f"joint {joint.name}: its axis misses that of {other.name} by "
                f"{1e3 * (max(values) - min(values)):.3g} mm along {'xyz'[coordinate]}, "
                "but the hip axes must meet in one point, and so must the ankle axes"
            )
        point[coordinate] = values[0]
    return point


def _limits(joint: Joint, sign: float) -> tuple[float, float]:
    lower, upper = max(joint.lower, -2.0 * math.pi), min(joint.upper, 2.0 * math.pi)  # continuous joints: finite
    low, high = (lower, upper) if sign > 0.0 else (-upper, -lower)
    if not low < high:
        raise RobotError(f"joint {joint.name}: its lower limit {joint.lower} is not below its upper {joint.upper}")
    return low, high


def _knee_direction(thigh: Array, shank: Array, limits: tuple[float, float]) -> float:
    """Return on which side of the straight leg the knee's range lies."""
    straight = math.atan2(thigh[2] * shank[0] - thigh[0] * shank[2], thigh[0] * shank[0] + thigh[2] * shank[2])
    middle = 0.5 * (max(limits[0], -math.pi) + min(limits[1], math.pi))
    return -1.0 if middle < -straight else 1.0


def _vector(values: Array) -> Vector:
    x, y, z = (round(float(value), 12) for value in values)  # sums of offsets: drop what is below 1 pm
    return x, y, z


def combined_mass(urdf: Urdf, moving_link: str, origin: Array) -> tuple[float, Vector]:
    """Return mass and first mass moment about ``origin`` (pelvis frame, zero posture) of what moves as one."""
    links: list[Link] = urdf.rigid_links(moving_link)
    moment = np.zeros(3)
    for link in links:
        pose = urdf.zero_poses[link.name]
        moment += link.mass * (pose[:3, :3] @ link.center_of_mass + pose[:3, 3] - origin)
    return math.fsum(link.mass for link in links), _vector(moment)


def _foot_frame(urdf: Urdf, frame: str, foot: str) -> Array:
    """Return a frame's origin at zero posture; it must ride on the foot with its axes along the pelvis'."""
    if frame not in urdf.links:
        raise RobotError(
            f"frame {frame}: {urdf.path.name} has no link of that name; tell load_robot what it is called, "
            "names=FrameNames(left=LegNames(...), right=LegNames(...))"
        )
    if urdf.moving_link(frame) != foot:
        raise RobotError(f"frame {frame}: it must be fixed to {foot}, the link of the ankle roll joint")
    pose = urdf.zero_poses[frame]
    if np.abs(pose[:3, :3] - np.eye(3)).max() > _ANGLE_TOLERANCE:
        raise RobotError(f"frame {frame}: at zero posture its axes must be parallel to the pelvis'")
    return np.asarray(pose[:3, 3])


def _sole_rectangle(urdf: Urdf, foot: str, sole: str) -> tuple[float, float, float, float]:
    """Return the underside of the foot's lowest collision box, from the sole frame."""
    origin = urdf.zero_poses[sole][:3, 3]
    best: tuple[float, tuple[float, float, float, float]] | None = None
    for link in urdf.rigid_links(foot):
        for shape in link.collisions:
            pose = urdf.zero_poses[link.name] @ shape.pose
            if shape.kind != "box" or np.abs(pose[:3, :3] - np.eye(3)).max() > _ANGLE_TOLERANCE:
                continue
            half = 0.5 * np.array(shape.size)
            low, high = pose[:3, 3] - half - origin, pose[:3, 3] + half - origin
            if best is None or low[2] < best[0]:
                best = low[2], (float(low[0]), float(high[0]), float(low[1]), float(high[1]))
    if best is None or abs(best[0]) > _LENGTH_TOLERANCE:
        raise RobotError(f"link {foot}: it needs a level collision box whose underside is the plane of {sole}")
    x_min, x_max, y_min, y_max = best[1]
    if not (x_min < 0.0 < x_max and y_min < 0.0 < y_max):
        raise RobotError(f"link {foot}: the frame {sole} must lie within the underside of its collision box")
    return best[1]
