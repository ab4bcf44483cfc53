"""A robot that does not fit the topology is refused by the name of what does not fit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from jet_gym import load_robot
from jet_gym.errors import RobotError
from jet_gym.robot import FrameNames, Robot

Edit = Callable[[ElementTree.Element], object]


@pytest.fixture
def edited(robot: Robot, tmp_path: Path) -> Callable[[Edit], Path]:
    """Return a writer of Jet-HR1's file with something changed."""

    def write(edit: Edit) -> Path:
        root = ElementTree.parse(robot.urdf_path).getroot()
        edit(root)
        path = tmp_path / "edited.urdf"
        ElementTree.ElementTree(root).write(path)
        return path

    return write


def find(root: ElementTree.Element, path: str) -> ElementTree.Element:
    element = root.find(path)
    assert element is not None, path
    return element


def put(path: str, **attributes: str) -> Edit:
    """Set attributes of one element."""
    return lambda root: find(root, path).attrib.update(attributes)


def drop(parent: str, child: str) -> Edit:
    """Remove the children of one element that have a tag."""

    def edit(root: ElementTree.Element) -> None:
        owner = find(root, parent)
        for element in owner.findall(child):
            owner.remove(element)

    return edit


def no_mass(root: ElementTree.Element) -> None:
    for mass in root.iter("mass"):
        mass.set("value", "0")


def round_foot(root: ElementTree.Element) -> None:
    """Make the left foot a disc of the same thickness."""
    geometry = find(root, "link[@name='left_foot']/collision/geometry")
    geometry.clear()
    ElementTree.SubElement(geometry, "cylinder", radius="0.1", length="0.02")


def instep(root: ElementTree.Element) -> None:
    """Put a box on top of the left foot's sole plate."""
    collision = ElementTree.SubElement(find(root, "link[@name='left_foot']"), "collision")
    ElementTree.SubElement(collision, "origin", xyz="0 0 -0.03")
    ElementTree.SubElement(ElementTree.SubElement(collision, "geometry"), "box", size="0.3 0.3 0.02")


KNEE, ANKLE = "joint[@name='left_knee_pitch']", "joint[@name='right_ankle_pitch']"

FOOT_BOX = "link[@name='left_foot']/collision"


MISFITS: dict[str, tuple[Edit, str]] = {
    "hip pitch above hip roll": (
        put("joint[@name='left_hip_pitch']/origin", xyz="0 0 -0.01"),
        "joint left_hip_pitch: its axis misses that of left_hip_roll by 10 mm along z",
    ),
    "hip pitch ahead of hip yaw": (
        put("joint[@name='right_hip_pitch']/origin", xyz="0.02 0 0"),
        "joint right_hip_pitch: its axis misses that of right_hip_yaw by 20 mm along x",
    ),
    "hip roll beside hip yaw": (
        put("joint[@name='right_hip_roll']/origin", xyz="0 0.003 0"),
        "joint right_hip_roll: its axis misses that of right_hip_yaw by 3 mm along y",
    ),
    "ankle roll below ankle pitch": (
        put("joint[@name='left_ankle_roll']/origin", xyz="0 0 -0.015"),
        "joint left_ankle_roll: its axis misses that of left_ankle_pitch by 15 mm along z",
    ),
    "knee about x": (
        put(f"{KNEE}/axis", xyz="1 0 0"),
        r"joint left_knee_pitch: .* turn about y, but its axis is \(1, 0, 0\)",
    ),
    "knee askew": (
        put(f"{KNEE}/axis", xyz="0 1 0.01"),
        r"joint left_knee_pitch: .* but its axis is \(0, 1, 0\.01\)",
    ),
    "shank askew": (
        put(f"{KNEE}/origin", rpy="0.1 0 0"),
        r"joint left_knee_pitch: .* but its axis is \(0, 0\.995, 0\.0998\)",
    ),
    "knee at the hip": (
        put(f"{KNEE}/origin", xyz="0 0.02 0"),
        "joint left_knee_pitch: its axis coincides with that of the joint before it",
    ),
    "no such joint": (put(KNEE, name="left_knee"), "joint left_knee_pitch: edited.urdf has no"),
    "fixed knee": (put(KNEE, type="fixed"), "joint left_knee_pitch: it is fixed, but a leg needs it to turn"),
    "sliding knee": (put(KNEE, type="prismatic"), "joint left_knee_pitch: it is prismatic, but"),
    "a joint too many": (
        put("joint[@name='imu_mount']", type="revolute"),
        "joint imu_mount: it belongs to neither leg",
    ),
    "ankle on the thigh": (
        put(f"{ANKLE}/parent", link="right_thigh"),
        "joint right_ankle_pitch: it must hang on right_shank, but hangs on right_thigh",
    ),
    "empty range": (
        put(f"{ANKLE}/limit", lower="1", upper="1"),
        r"joint right_ankle_pitch: its lower limit 1\.0 is not below its upper 1\.0",
    ),
    "no fan": (drop(".", "fan"), 'frame left_fan: the file needs <fan frame="left_fan"'),
    "fan without thrust": (put("fan", max_thrust="0"), "fan left_fan: max_thrust must be positive"),
    "fan of words": (
        put("fan", max_thrust="strong"),
        "fan left_fan: its max_thrust must be a number, not 'strong'",
    ),
    "servo of nothing": (put("servo", joint="tail"), "servo: there is no leg joint 'tail'"),
    "sole on the shank": (
        put("joint[@name='left_sole_frame']/parent", link="left_shank"),
        "frame left_sole: it must be fixed to left_foot",
    ),
    "fan on the pelvis": (
        put("joint[@name='right_fan_mount']/parent", link="pelvis"),
        "frame right_fan: it must be fixed to right_foot",
    ),
    "sole turned": (
        put("joint[@name='left_sole_frame']/origin", rpy="0 0 0.1"),
        "frame left_sole: at zero posture its axes must be parallel",
    ),
    "no sole": (
        lambda root: (
            put("link[@name='left_sole']", name="heel")(root),
            put("joint/child[@link='left_sole']", link="heel")(root),
        ),
        "frame left_sole: edited.urdf has no",
    ),
    "no collision box": (
        drop("link[@name='left_foot']", "collision"),
        "link left_foot: it needs a level collision",
    ),
    "round foot": (round_foot, "link left_foot: it needs a level collision box"),
    "box on edge": (put(f"{FOOT_BOX}/origin", rpy="0.2 0 0"), "link left_foot: it needs a level collision box"),
    "box above the sole": (
        put(f"{FOOT_BOX}/origin", xyz="0.015 0 -0.04"),
        "link left_foot: .* whose underside is the plane of left_sole",
    ),
    "sole beside the box": (
        put(f"{FOOT_BOX}/origin", xyz="0.1 0 -0.05"),
        "link left_foot: the frame left_sole must lie within",
    ),
    "no mass": (no_mass, "jet_hr1: its links have no mass"),
}


@pytest.mark.parametrize(("edit", "message"), MISFITS.values(), ids=MISFITS)
def test_what_does_not_fit_is_refused_by_name(edited: Callable[[Edit], Path], edit: Edit, message: str) -> None:
    with pytest.raises(RobotError, match=message):
        load_robot(edited(edit))


def test_an_unchanged_copy_is_accepted(edited: Callable[[Edit], Path], robot: Robot) -> None:
    other = load_robot(edited(lambda root: None))
    assert (other.left, other.right, other.trunk) == (robot.left, robot.right, robot.trunk)


def test_the_sole_is_the_underside_of_the_lowest_box(edited: Callable[[Edit], Path], robot: Robot) -> None:
    assert load_robot(edited(instep)).left.sole_rectangle == robot.left.sole_rectangle


def test_another_root_is_refused(robot: Robot) -> None:
    with pytest.raises(RobotError, match="root link must be the pelvis, 'torso', but it is 'pelvis'"):
        load_robot(robot.urdf_path, FrameNames(pelvis="torso"))


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RobotError, match=r"nowhere\.urdf: No such file"):
        load_robot(tmp_path / "nowhere.urdf")
