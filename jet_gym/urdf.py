"""Read a URDF file into links and joints, all expressed in the root frame at zero posture.

Knows the file format and nothing about bipeds; :mod:`jet_gym.robot` gives the links their meaning.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from jet_gym.errors import RobotError
from jet_gym.utils.arrays import Array
from jet_gym.utils.files import read_whole


@dataclass(frozen=True, eq=False)
class Shape:
    """A collision shape.

    Attributes:
        kind: ``"box"``, ``"cylinder"`` or ``"sphere"``.
        size: Box edges [m] along x, y, z; a cylinder's or sphere's bounding box.
        pose: Homogeneous transform (4, 4) of the shape in its link's frame.
    """

    kind: str
    size: tuple[float, float, float]
    pose: Array


@dataclass(frozen=True, eq=False)
class Link:
    """A link's inertial and collision properties, in the link's own frame.

    Attributes:
        name: Name in the file.
        mass: Mass [kg].
        center_of_mass: Centre of mass (3,) [m].
        inertia: Rotational inertia (3, 3) [kg m^2] about the centre of mass.
        collisions: Collision shapes; meshes are left out.
    """

    name: str
    mass: float
    center_of_mass: Array
    inertia: Array
    collisions: tuple[Shape, ...]


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint as it stands in the file.

    Attributes:
        name: Name in the file.
        kind: URDF joint type.
        parent: Parent link.
        child: Child link.
        origin: Homogeneous transform (4, 4) of the child's frame in the parent's.
        axis: Unit vector (3,) in the child's frame.
        lower: Lower limit [rad].
        upper: Upper limit [rad].
        effort: Largest torque [N m].
        velocity: Largest speed [rad/s].
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: Array
    axis: Array
    lower: float = -math.inf
    upper: float = math.inf
    effort: float = math.inf
    velocity: float = math.inf

    @property
    def movable(self) -> bool:
        """Whether the joint has a degree of freedom."""
        return self.kind != "fixed"


@dataclass(frozen=True, eq=False)
class Urdf:
    """A robot description.

    Attributes:
        path: The file.
        name: The robot's name.
        root: Name of the root link.
        links: Links by name.
        joints: Joints by name.
        zero_poses: Link frames (4, 4) in the root frame with every joint at zero, by link name.
        extensions: Elements of the file that URDF does not define, each as (tag, attributes).
    """

    path: Path
    name: str
    root: str
    links: dict[str, Link]
    joints: dict[str, Joint]
    zero_poses: dict[str, Array] = field(repr=False)
    extensions: tuple[tuple[str, dict[str, str]], ...] = ()

    def parent_joint(self, link: str) -> Joint | None:
        """Return the joint whose child is the link; None for the root."""
        return next((joint for joint in self.joints.values() if joint.child == link), None)

    def moving_link(self, link: str) -> str:
        """Return the link that carries this one: the nearest above it that a joint moves, or the root."""
        while (joint := self.parent_joint(link)) is not None and not joint.movable:
            link = joint.parent
        return link

    def rigid_links(self, moving_link: str) -> list[Link]:
        """Return the links that move as one with ``moving_link``, itself included."""
        return [link for name, link in self.links.items() if self.moving_link(name) == moving_link]


def read_urdf(path: str | Path) -> Urdf:
    """Read a URDF file.

    Args:
        path: The file.

    Raises:
        RobotError: If the file is missing, is no URDF, or is not one tree of finite numbers.
    """
    path = Path(path)
    try:
        element = ElementTree.fromstring(read_whole(path))
    except OSError as error:
        raise RobotError(f"cannot read the robot description {path}: {error.strerror}") from error
    except (ElementTree.ParseError, LookupError, ValueError) as error:  # the latter two: an encoding it cannot read
        raise RobotError(f"{path} is not a URDF file: {error}") from error
    if element.tag != "robot":
        raise RobotError(f"{path} is not a URDF file: its root element is <{element.tag}>, not <robot>")
    for tag in ("link", "joint"):
        names = [child.get("name") for child in element.findall(tag)]
        twice = [name for name in names if not name or names.count(name) > 1]
        if twice:
            raise RobotError(f"{tag} {twice[0]!r}: every {tag} needs a name of its own")
    links = {link.name: link for link in map(_read_link, element.findall("link"))}
    joints = {joint.name: joint for joint in map(_read_joint, element.findall("joint"))}
    root = _find_root(links, joints)
    known = {"link", "joint", "material", "transmission", "gazebo"}
    return Urdf(
        path=path,
        name=element.get("name", path.stem),
        root=root,
        links=links,
        joints=joints,
        zero_poses=_zero_poses(root, joints),
        extensions=tuple((child.tag, dict(child.attrib)) for child in element if child.tag not in known),
    )


def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> Array:
    """Return the rotation matrix (3, 3) of URDF's fixed-axis roll, pitch, yaw [rad]."""
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _numbers(text: str | None, default: tuple[float, ...], owner: str) -> tuple[float, ...]:
    """Parse whitespace-separated finite numbers, as many as in the default."""
    if text is None:
        return default
    try:
        values = tuple(float(word) for word in text.split())
    except ValueError:
        values = ()
    if len(values) != len(default) or not all(map(math.isfinite, values)):
        count = f"{len(default)} finite numbers" if len(default) > 1 else "a finite number"
        raise RobotError(f"{owner}: expected {count}, got {text!r}")
    return values


def _attribute(element: ElementTree.Element | None, key: str, default: float, owner: str) -> float:
    """Return one numeric attribute of an element that may be missing."""
    text = None if element is None else element.get(key)
    return default if text is None else _numbers(text, (0.0,), f"{owner} {key}")[0]


def read_pose(element: ElementTree.Element | None, owner: str) -> Array:
    """Return the homogeneous transform of an <origin> element; the identity where there is none."""
    pose = np.eye(4)
    if element is not None:
        pose[:3, 3] = _numbers(element.get("xyz"), (0.0, 0.0, 0.0), f"{owner} origin xyz")
        roll, pitch, yaw = _numbers(element.get("rpy"), (0.0, 0.0, 0.0), f"{owner} origin rpy")
        pose[:3, :3] = rotation_from_rpy(roll, pitch, yaw)
    return pose


def _read_link(element: ElementTree.Element) -> Link:
    name = element.get("name", "")
    owner = f"link {name}"
    inertial = element.find("inertial")
    mass, pose, inertia = 0.0, np.eye(4), np.zeros((3, 3))
    if inertial is not None:
        mass = _attribute(inertial.find("mass"), "value", 0.0, f"{owner} mass")
        if mass < 0.0:
            raise RobotError(f"{owner}: its mass of {mass} kg is negative")
        pose = read_pose(inertial.find("origin"), owner)
        tensor = inertial.find("inertia")
        ixx, iyy, izz, ixy, ixz, iyz = (
            _attribute(tensor, key, 0.0, owner) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        )
        rotation = pose[:3, :3]
        inertia = rotation @ np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]) @ rotation.T
    shapes = (_read_shape(collision, owner) for collision in element.findall("collision"))
    return Link(name, mass, pose[:3, 3], inertia, tuple(shape for shape in shapes if shape is not None))


def _read_shape(element: ElementTree.Element, owner: str) -> Shape | None:
    pose = read_pose(element.find("origin"), owner)
    geometry = element.find("geometry")
    shape = None if geometry is None else next(iter(geometry), None)
    if shape is None or shape.tag not in ("box", "cylinder", "sphere"):
        return None
    if shape.tag == "box":
        x, y, z = _numbers(shape.get("size"), (0.0, 0.0, 0.0), f"{owner} box size")
    else:
        x = y = 2.0 * _attribute(shape, "radius", 0.0, owner)
        z = _attribute(shape, "length", 0.0, owner) if shape.tag == "cylinder" else x
    if min(x, y, z) <= 0.0:
        raise RobotError(f"{owner}: the size of its {shape.tag} must be more than 0, not {(x, y, z)} m")
    return Shape(shape.tag, (x, y, z), pose)


def _read_joint(element: ElementTree.Element) -> Joint:
    name = element.get("name", "")
    owner = f"joint {name}"
    parent, child = element.find("parent"), element.find("child")
    if parent is None or child is None:
        raise RobotError(f"{owner}: it needs a <parent> and a <child>")
    axis_element, limit = element.find("axis"), element.find("limit")
    axis = np.array(
        _numbers(None if axis_element is None else axis_element.get("xyz"), (1.0, 0.0, 0.0), f"{owner} axis")
    )
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        raise RobotError(f"{owner}: its axis has no length")
    unlimited = element.get("type") == "continuous"
    return Joint(
        name=name,
        kind=element.get("type", ""),
        parent=parent.get("link", ""),
        child=child.get("link", ""),
        origin=read_pose(element.find("origin"), owner),
        axis=axis / length,
        lower=-math.inf if unlimited else _attribute(limit, "lower", 0.0, owner),
        upper=math.inf if unlimited else _attribute(limit, "upper", 0.0, owner),
        effort=_attribute(limit, "effort", math.inf, owner),
        velocity=_attribute(limit, "velocity", math.inf, owner),
    )


def _find_root(links: dict[str, Link], joints: dict[str, Joint]) -> str:
    for joint in joints.values():
        for link in (joint.parent, joint.child):
            if link not in links:
                raise RobotError(f"joint {joint.name}: its link {link!r} is not in the file")
    children = [joint.child for joint in joints.values()]
    for child in children:
        if children.count(child) > 1:
            raise RobotError(f"link {child}: it has more than one parent joint")
    roots = [name for name in links if name not in children]
    if len(roots) != 1:
        raise RobotError(f"the links must form one tree with one root, but the roots are {roots}")
    return roots[0]


def _zero_poses(root: str, joints: dict[str, Joint]) -> dict[str, Array]:
    poses = {root: np.eye(4)}
    waiting = list(joints.values())
    while waiting:
        ready = [joint for joint in waiting if joint.parent in poses]
        if not ready:
            raise RobotError(f"the joints {[joint.name for joint in waiting]} form a loop")
        for joint in ready:
            poses[joint.child] = poses[joint.parent] @ joint.origin
        waiting = [joint for joint in waiting if joint.child not in poses]
    return poses
