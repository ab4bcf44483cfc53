"""A biped with fans at its feet, read from its URDF: geometry, masses, limits, fans, servos.

What a leg must be like is in :mod:`jet_gym.leg`. What does not fit is refused with a
:class:`~jet_gym.errors.RobotError` that names the joint and the reason.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple
from weakref import WeakValueDictionary

import numpy as np

from jet_gym.errors import RobotError
from jet_gym.fans_and_servos import Fan, Servo, read_fan, read_servos
from jet_gym.leg import SIDES, Leg, LegNames, Side, Vector, combined_mass, jet_hr1_leg, read_leg
from jet_gym.urdf import Urdf, read_urdf
from jet_gym.utils.arrays import Array


class Trunk(NamedTuple):
    """What hangs on neither leg, in numbers that compiled code takes by value."""

    mass_moment: Vector  # [kg m] mass of the pelvis times its centre of mass, pelvis frame
    robot_mass: float  # [kg] pelvis and both legs


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
    left: LegNames = field(default_factory=lambda: jet_hr1_leg("left"))
    right: LegNames = field(default_factory=lambda: jet_hr1_leg("right"))
    imu: str = "imu"


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
        if side not in SIDES:
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


_in_use: WeakValueDictionary[tuple[Path, FrameNames, int], Robot] = WeakValueDictionary()


@functools.lru_cache(maxsize=32)  # keeps some that nobody uses just now
def _load_robot(path: Path, names: FrameNames, modified: int) -> Robot:
    robot = _in_use.get((path, names, modified))
    if robot is None:
        robot = _in_use[path, names, modified] = _read_robot(path, names)
    return robot


def _read_robot(path: Path, names: FrameNames) -> Robot:
    urdf = read_urdf(path)
    if urdf.root != names.pelvis:
        raise RobotError(
            f"the root link must be the pelvis, {names.pelvis!r}, but it is {urdf.root!r}; if that is the pelvis, "
            f"call load_robot(..., names=FrameNames(pelvis={urdf.root!r}))"
        )
    legs = (names.left, names.right)
    joint_names = (*names.left.joints, *names.right.joints)
    _refuse_other_movable_joints(urdf, joint_names)
    left, right = (read_leg(urdf, leg) for leg in legs)
    fans = (read_fan(urdf, names.left.fan), read_fan(urdf, names.right.fan))
    pelvis_mass, pelvis_mass_moment = combined_mass(urdf, names.pelvis, np.zeros(3))
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
        servos=tuple(read_servos(urdf, joint_names)),
    )


def _read_only(values: Sequence[float]) -> Array:
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array


def _refuse_other_movable_joints(urdf: Urdf, leg_joints: Sequence[str]) -> None:
    for name in leg_joints:
        if name not in urdf.joints:
            raise RobotError(
                f"joint {name}: {urdf.path.name} has no joint of that name; tell load_robot what it is called, "
                "names=FrameNames(left=LegNames(...), right=LegNames(...))"
            )
        kind = urdf.joints[name].kind
        if kind not in ("revolute", "continuous"):
            raise RobotError(f"joint {name}: it is {kind}, but a leg needs it to turn")
    for joint in urdf.joints.values():
        if joint.movable and joint.name not in leg_joints:
            raise RobotError(f"joint {joint.name}: it belongs to neither leg; make its type fixed")


def _highest_collision(urdf: Urdf) -> float:
    """Return the top of all collision shapes at zero posture [m], pelvis frame."""
    tops = []
    for link in urdf.links.values():
        for shape in link.collisions:
            pose = urdf.zero_poses[link.name] @ shape.pose
            tops.append(float(pose[2, 3] + 0.5 * np.abs(pose[2, :3]) @ np.array(shape.size)))
    return max(tops, default=0.0)
