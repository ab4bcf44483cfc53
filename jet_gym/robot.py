"""A biped with fans at its feet, read from its URDF: geometry, masses, limits, fans, servos.

Leg topology: six joints a leg, ``hip_yaw`` (z), ``hip_roll`` (x), ``hip_pitch``, ``knee_pitch``,
``ankle_pitch`` (y), ``ankle_roll`` (x), where the three hip axes meet in one point and the two ankle axes
meet in one point. Then leg inverse kinematics has a closed form (:mod:`jet_gym.kinematics`). Axes may point
either way along their line, lengths, offsets and masses are free, and left and right may differ.

What does not fit is refused with a :class:`~jet_gym.errors.RobotError` that names the joint and the reason.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from jet_gym.errors import RobotError
from jet_gym.urdf import Array, Joint, Link, Urdf, read_urdf

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


class Trunk(NamedTuple):
    """What hangs on neither leg, in numbers that compiled code takes by value."""

    mass_moment: Vector  # [kg m] mass of the pelvis times its centre of mass, pelvis frame
    robot_mass: float  # [kg] pelvis and both legs


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


def _default_leg(side: Side) -> LegNames:
    yaw, roll, pitch, knee, ankle_pitch, ankle_roll = (f"{side}_{joint}" for joint in LEG_JOINTS)
    joints = (yaw, roll, pitch, knee, ankle_pitch, ankle_roll)
    return LegNames(joints, sole=f"{side}_sole", fan=f"{side}_fan")


@dataclass(frozen=True)
class FrameNames:
    """The small table that names a biped's joints and frames; the defaults are Jet-HR1's.

    Attributes:
        pelvis: Root link.
        left: Left leg.
        right: Right leg.
        imu: Frame of the inertial measurement unit.
    """

    pelvis: str = "pelvis"
    left: LegNames = field(default_factory=lambda: _default_leg("left"))
    right: LegNames = field(default_factory=lambda: _default_leg("right"))
    imu: str = "imu"


@dataclass(frozen=True)
class Fan:
    """A ducted fan.

    Attributes:
        frame: URDF frame where its thrust acts, along z.
        max_thrust: Largest thrust [N].
        time_constant: Time constant of its first-order lag [s].
    """

    frame: str
    max_thrust: float
    time_constant: float


@dataclass(frozen=True)
class Servo:
    """The servos that drive one joint.

    Attributes:
        joint: URDF joint.
        count: How many servos share the joint.
        torque: Largest torque of one servo [N m].
        gear_ratio: Reduction between servo and joint.
    """

    joint: str
    count: int
    torque: float
    gear_ratio: float


@dataclass(frozen=True, eq=False)
class Robot:
    """A biped that fits the leg topology.

    Twelve-vectors run left leg then right leg, each from hip yaw to ankle roll, in the URDF's own joint
    directions.

    Attributes:
        name: The URDF's robot name.
        urdf_path: The file that it was read from.
        names: Names of joints and frames in the file.
        left: The left leg in numbers for compiled code.
        right: The right leg likewise.
        trunk: The pelvis likewise.
        joint_names: Names of the twelve joints.
        lower: Lower joint limits (12,) [rad].
        upper: Upper joint limits (12,) [rad].
        effort: Largest joint torques (12,) [N m].
        velocity: Largest joint speeds (12,) [rad/s].
        height: Highest collision shape above the soles at zero posture [m].
        leg_length: Hip centre to sole at zero posture [m], the mean of both legs.
        fans: The left and the right fan.
        servos: What drives each joint, as far as the file says.
    """

    name: str
    urdf_path: Path
    names: FrameNames
    left: Leg = field(repr=False)
    right: Leg = field(repr=False)
    trunk: Trunk = field(repr=False)
    joint_names: tuple[str, ...] = field(repr=False)
    lower: Array = field(repr=False)
    upper: Array = field(repr=False)
    effort: Array = field(repr=False)
    velocity: Array = field(repr=False)
    height: float
    leg_length: float
    fans: tuple[Fan, Fan] = field(repr=False)
    servos: tuple[Servo, ...] = field(repr=False)

    @property
    def mass(self) -> float:
        """Total mass [kg]."""
        return self.trunk.robot_mass

    @property
    def max_thrust(self) -> float:
        """Largest thrust of one fan [N]; the smaller one if the two differ."""
        return min(fan.max_thrust for fan in self.fans)

    def leg(self, side: Side) -> Leg:
        """Return the numbers of one leg, ``"left"`` or ``"right"``."""
        if side not in ("left", "right"):
            raise ValueError(f"side must be 'left' or 'right', not {side!r}")
        return self.left if side == "left" else self.right

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle and copy as the file and the names, so that a worker process reads the same robot."""
        return load_robot, (self.urdf_path, self.names)


def urdf_directory() -> Path:
    """Return the folder of the URDF files, in an installed wheel or a source tree."""
    package = Path(__file__).resolve().parent
    inside_wheel = package / "data" / "urdf"
    return inside_wheel if inside_wheel.is_dir() else package.parent / "urdf"


def jet_hr1() -> Robot:
    """Return Jet-HR1, the robot of the paper; the same object each time."""
    return load_robot(urdf_directory() / "jet_hr1.urdf")


def load_robot(urdf_path: str | Path, names: FrameNames | None = None) -> Robot:
    """Read a biped from a URDF file.

    Args:
        urdf_path: The file; fans stand in it as ``<fan frame max_thrust time_constant>`` elements.
        names: Names of the joints and frames in the file; Jet-HR1's where omitted.

    Returns:
        The robot; the same object for the same file and names as long as the file is unchanged.

    Raises:
        RobotError: If the file cannot be read or the robot does not fit the leg topology.
    """
    path = Path(urdf_path).resolve()
    try:
        modified = path.stat().st_mtime_ns
    except OSError as error:
        raise RobotError(f"cannot read the robot description {path}: {error.strerror}") from error
    return _load_robot(path, names or FrameNames(), modified)


@functools.lru_cache(maxsize=32)
def _load_robot(path: Path, names: FrameNames, _modified: int) -> Robot:
    urdf = read_urdf(path)
    if urdf.root != names.pelvis:
        raise RobotError(f"the root link must be the pelvis, {names.pelvis!r}, but it is {urdf.root!r}")
    legs = (names.left, names.right)
    joint_names = (*names.left.joints, *names.right.joints)
    _refuse_other_movable_joints(urdf, joint_names)
    left, right = (_read_leg(urdf, leg) for leg in legs)
    fans = (_read_fan(urdf, names.left.fan), _read_fan(urdf, names.right.fan))
    pelvis_mass, pelvis_mass_moment = _combined_mass(urdf, names.pelvis, np.zeros(3))
    mass = math.fsum((pelvis_mass, *left.masses, *right.masses))
    if mass <= 0.0:
        raise RobotError(f"{urdf.name}: its links have no mass")
    joints = [urdf.joints[name] for name in joint_names]
    lengths = [-(leg.thigh[2] + leg.shank[2] + leg.sole[2]) for leg in (left, right)]
    sole_height = min(float(urdf.zero_poses[leg.sole][2, 3]) for leg in legs)
    return Robot(
        name=urdf.name,
        urdf_path=path,
        names=names,
        left=left,
        right=right,
        trunk=Trunk(pelvis_mass_moment, mass),
        joint_names=joint_names,
        lower=_read_only([joint.lower for joint in joints]),
        upper=_read_only([joint.upper for joint in joints]),
        effort=_read_only([joint.effort for joint in joints]),
        velocity=_read_only([joint.velocity for joint in joints]),
        height=_highest_collision(urdf) - sole_height,
        leg_length=sum(lengths) / 2.0,
        fans=fans,
        servos=tuple(_read_servos(urdf, joint_names)),
    )


def _read_only(values: Sequence[float]) -> Array:
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array


def _vector(values: Array) -> Vector:
    x, y, z = (round(float(value), 12) for value in values)  # sums of offsets: drop what is below 1 pm
    return x, y, z


def _refuse_other_movable_joints(urdf: Urdf, leg_joints: Sequence[str]) -> None:
    for name in leg_joints:
        if name not in urdf.joints:
            raise RobotError(f"joint {name}: it is not in {urdf.path.name}; name yours in FrameNames")
        kind = urdf.joints[name].kind
        if kind not in ("revolute", "continuous"):
            raise RobotError(f"joint {name}: it is {kind}, but a leg needs it to turn")
    for joint in urdf.joints.values():
        if joint.movable and joint.name not in leg_joints:
            raise RobotError(f"joint {joint.name}: it belongs to neither leg; make its type fixed")


def _read_leg(urdf: Urdf, names: LegNames) -> Leg:
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
        *(_combined_mass(urdf, joint.child, origin) for joint, origin in zip(joints, origins, strict=True)),
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
        axis_signs=_six(signs),
        lower=_six([low for low, _ in limits]),
        upper=_six([high for _, high in limits]),
        range_cosines=_six([math.cos(0.5 * (low + high)) for low, high in limits]),
        range_sines=_six([math.sin(0.5 * (low + high)) for low, high in limits]),
        range_half_cosines=_six([math.cos(min(0.5 * (high - low), math.pi)) for low, high in limits]),
        masses=_six(masses),
        mass_moments=tuple(moments),
    )


def _six(values: Sequence[float]) -> Six:
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


def _combined_mass(urdf: Urdf, moving_link: str, origin: Array) -> tuple[float, Vector]:
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
        raise RobotError(f"frame {frame}: it is not in {urdf.path.name}; name yours in FrameNames")
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


def _highest_collision(urdf: Urdf) -> float:
    """Return the top of all collision shapes at zero posture [m], pelvis frame."""
    tops = []
    for link in urdf.links.values():
        for shape in link.collisions:
            pose = urdf.zero_poses[link.name] @ shape.pose
            tops.append(float(pose[2, 3] + 0.5 * np.abs(pose[2, :3]) @ np.array(shape.size)))
    return max(tops, default=0.0)


def _read_fan(urdf: Urdf, frame: str) -> Fan:
    for tag, attributes in urdf.extensions:
        if tag == "fan" and attributes.get("frame") == frame:
            max_thrust, time_constant = (
                _extension_number(tag, frame, attributes, key) for key in ("max_thrust", "time_constant")
            )
            if max_thrust <= 0.0 or time_constant < 0.0:
                raise RobotError(f"fan {frame}: max_thrust must be positive and time_constant not negative")
            return Fan(frame, max_thrust, time_constant)
    raise RobotError(f'frame {frame}: the file needs <fan frame="{frame}" max_thrust="..." time_constant="..."/>')


def _read_servos(urdf: Urdf, joint_names: Sequence[str]) -> list[Servo]:
    servos = []
    for tag, attributes in urdf.extensions:
        if tag == "servo":
            joint = attributes.get("joint", "")
            if joint not in joint_names:
                raise RobotError(f"servo: there is no leg joint {joint!r}")
            count, torque, ratio = (
                _extension_number(tag, joint, attributes, key) for key in ("count", "torque", "gear_ratio")
            )
            if count != int(count) or count < 1:
                raise RobotError(f"servo {joint}: its count must be a whole number of 1 or more, not {count:g}")
            servos.append(Servo(joint, int(count), torque, ratio))
    return servos


def _extension_number(tag: str, name: str, attributes: dict[str, str], key: str) -> float:
    try:
        value = float(attributes[key])
    except (KeyError, ValueError):
        value = math.nan
    if not math.isfinite(value):
        raise RobotError(f"{tag} {name}: its {key} must be a number, not {attributes.get(key)!r}")
    return value
