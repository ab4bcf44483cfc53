"""What a robot must be, what is read of it, and what is refused."""

from __future__ import annotations

import copy
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np
import pytest

from jet_gym import jet_hr1, load_robot
from jet_gym.arrays import Array
from jet_gym.balance import BalanceSettings
from jet_gym.errors import RobotError
from jet_gym.kinematics import forward_kinematics, inverse_kinematics
from jet_gym.leg import LegNames
from jet_gym.posture import evaluate_postures
from jet_gym.robot import FrameNames, Robot
from jet_gym.urdf import rotation_from_rpy

if TYPE_CHECKING:
    from conftest import PinocchioRobot

SIDES = ("left", "right")

# ---------------------------------------------------------------------- Jet-HR1


def test_jet_hr1_has_the_stated_size(robot: Robot) -> None:
    assert robot.name == "jet_hr1"
    assert robot.height == pytest.approx(0.608, abs=1e-12)
    assert robot.leg_length == pytest.approx(0.460, abs=1e-12)
    assert len(robot.joint_names) == 12


def test_joint_names_run_from_left_hip_yaw_to_right_ankle_roll(robot: Robot) -> None:
    leg = ("hip_yaw", "hip_roll", "hip_pitch", "knee_pitch", "ankle_pitch", "ankle_roll")
    assert robot.joint_names == tuple(f"{side}_{name}" for side in SIDES for name in leg)


def test_limits_stand_in_the_order_of_the_joints(robot: Robot) -> None:
    lower, upper = [-110, -60, -110, 0, -90, -60], [110, 60, 60, 140, 90, 60]
    np.testing.assert_allclose(np.degrees(robot.lower), 2 * lower, atol=1e-6)
    np.testing.assert_allclose(np.degrees(robot.upper), 2 * upper, atol=1e-6)
    np.testing.assert_array_equal(robot.effort, 2 * [7.8, 18.95, 15.6, 15.6, 15.6, 18.95])
    with pytest.raises(ValueError, match="read-only"):
        robot.lower[0] = 0.0


@pytest.mark.parametrize(("side", "outward"), [("left", 1.0), ("right", -1.0)])
def test_legs_have_the_lengths_of_the_table(robot: Robot, side: str, outward: float) -> None:
    leg = robot.leg(side)
    assert leg.hip == (0.0, outward * 0.1125, 0.0)
    assert leg.thigh == (0.0, 0.0, -0.2)
    assert leg.shank == (0.0, 0.0, -0.2)
    assert leg.sole == (0.0, 0.0, -0.06)
    assert leg.fan[:2] == (0.0, outward * 0.06)
    assert leg.sole_rectangle == pytest.approx((-0.07, 0.10, -0.05, 0.05), abs=1e-12)
    assert leg.knee_direction == 1.0


def test_fans_are_the_stated_ones(robot: Robot) -> None:
    assert [fan.frame for fan in robot.fans] == ["left_fan", "right_fan"]
    assert [fan.max_thrust for fan in robot.fans] == [23.0, 23.0]
    assert [fan.time_constant for fan in robot.fans] == [0.15, 0.15]
    assert robot.max_thrust == 23.0


def test_feet_stand_225_mm_apart_on_straight_legs(robot: Robot) -> None:
    left, right = forward_kinematics(robot, np.zeros(12)).soles
    np.testing.assert_allclose(left - right, [0.0, 0.225, 0.0], atol=1e-12)
    assert left[2] == pytest.approx(-0.46, abs=1e-12)


# ---------------------------------------------------------------------- the same robot everywhere


def test_the_same_file_gives_the_same_robot(robot: Robot) -> None:
    assert load_robot(robot.urdf_path) is robot
    assert jet_hr1() is robot


def test_an_edited_file_is_read_again(robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    text = robot.urdf_path.read_text(encoding="utf-8")
    path.write_text(text, encoding="utf-8")
    assert load_robot(path).max_thrust == 23.0
    path.write_text(text.replace('max_thrust="23"', 'max_thrust="30"'), encoding="utf-8")
    os.utime(path, ns=(0, 1_000_000_000))
    assert load_robot(path).max_thrust == 30.0


def test_a_robot_in_use_stays_the_same_object_however_many_others_are_read(robot: Robot, tmp_path: Path) -> None:
    text = robot.urdf_path.read_text(encoding="utf-8")
    for number in range(40):
        (tmp_path / f"{number}.urdf").write_text(text, encoding="utf-8")
        load_robot(tmp_path / f"{number}.urdf")
    assert load_robot(robot.urdf_path) is robot


@pytest.mark.parametrize("duplicate", [copy.copy, copy.deepcopy, lambda robot: pickle.loads(pickle.dumps(robot))])
def test_a_copy_is_the_same_robot(robot: Robot, duplicate: Callable[[Robot], Robot]) -> None:
    assert duplicate(robot) is robot


def test_another_process_unpickles_an_equal_robot(robot: Robot) -> None:
    code = """
import pickle, sys
robot = pickle.load(sys.stdin.buffer)
print([robot.names, robot.left, robot.right, robot.trunk, robot.fans, robot.servos, robot.lower.tolist()])
"""
    path = os.pathsep.join(filter(None, sys.path))
    answer = subprocess.run(
        [sys.executable, "-c", code],
        input=pickle.dumps(robot),
        capture_output=True,
        check=True,
        env=os.environ | {"PYTHONPATH": path},
    )
    mine = [robot.names, robot.left, robot.right, robot.trunk, robot.fans, robot.servos, robot.lower.tolist()]
    assert answer.stdout.decode().strip() == str(mine)


# ---------------------------------------------------------------------- what is refused

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
    "no such joint": (put(KNEE, name="left_knee"), "joint left_knee_pitch: it is not in edited.urdf"),
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
        "frame left_sole: it is not in edited.urdf",
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


# ---------------------------------------------------------------------- another biped

NAMES = FrameNames(
    pelvis="torso",
    left=LegNames(("L1", "L2", "L3", "L4", "L5", "L6"), sole="L_sole", fan="L_jet"),
    right=LegNames(("R1", "R2", "R3", "R4", "R5", "R6"), sole="R_sole", fan="R_jet"),
)


class Biped:
    """A random robot of the leg topology that is as unlike Jet-HR1 as the topology allows.

    Its two legs differ. Link frames are turned anyhow, joints sit anywhere on their axes and turn either way,
    thigh and shank have offsets, ankles stand beside the hips, and weights hang on fixed joints everywhere.
    """

    def __init__(self, rng: np.random.Generator, knee_bend: float) -> None:
        """Draw a biped whose knees bend backwards (+1, like ours) or forwards (-1)."""
        self._rng = rng
        self._knee_bend = knee_bend
        self._elements: list[str] = []
        self._frames = {"torso": (np.zeros(3), np.eye(3))}
        self._link("torso")
        self._fix("chest", "torso", rng.normal(0.0, 0.2, 3), self._turn())
        self._fix("head", "chest", rng.normal(0.0, 0.2, 3), self._turn())
        for names, outward in ((NAMES.left, 1.0), (NAMES.right, -1.0)):
            self._leg(names, outward)

    def write(self, path: Path) -> Path:
        path.write_text(f'<robot name="biped">{"".join(self._elements)}</robot>', encoding="utf-8")
        return path

    def _leg(self, names: LegNames, outward: float) -> None:
        rng = self._rng
        hip = np.array([rng.uniform(-0.1, 0.1), outward * rng.uniform(0.1, 0.3), rng.uniform(-0.2, 0.1)])
        knee = hip + np.array([rng.uniform(-0.05, 0.05), 0.0, -rng.uniform(0.2, 0.4)])
        ankle = knee + np.array([rng.uniform(-0.05, 0.05), rng.uniform(-0.03, 0.03), -rng.uniform(0.2, 0.4)])
        thigh, shank = knee - hip, ankle - knee
        straight = np.arctan2(thigh[2] * shank[0] - thigh[0] * shank[2], thigh @ shank - thigh[1] * shank[1])
        bent = -straight + self._knee_bend * np.array([0.0, rng.uniform(0.1, 1.2)])
        axes = np.eye(3)[[2, 0, 1, 1, 1, 0]]
        points = [hip, hip, hip, knee, ankle, ankle]
        ranges = [(-1.8, 1.9), (-1.0, 0.8), (-1.2, 1.0), bent, (-0.4, 0.3), (-0.7, 0.6)]
        parent = "torso"
        for i, name in enumerate(names.joints):
            sign = rng.choice([-1.0, 1.0])
            low, high = sorted(sign * np.array(ranges[i]))
            self._turning(name, parent, points[i] + rng.uniform(-0.1, 0.1) * axes[i], sign * axes[i], low, high)
            parent = f"{name}_link"
            if i == 2:
                self._fix(f"{name}_bracket", parent, knee + rng.normal(0.0, 0.1, 3), self._turn())
                parent = f"{name}_bracket"
        sole = ankle + np.array([rng.uniform(-0.02, 0.02), rng.uniform(-0.02, 0.02), -rng.uniform(0.02, 0.1)])
        self._fix(names.sole, parent, sole, np.eye(3), box=rng.uniform(0.1, 0.2, 3))
        self._fix(names.fan, parent, ankle + np.array([0.05, outward * 0.1, -0.01]), np.eye(3))
        self._elements.append(f'<fan frame="{names.fan}" max_thrust="40" time_constant="0.1"/>')

    def _turn(self) -> Array:
        return rotation_from_rpy(*self._rng.uniform(-1.5, 1.5, 3))

    def _link(self, name: str, box: Array | None = None) -> None:
        mass, place = self._rng.uniform(0.1, 2.0), self._rng.normal(0.0, 0.1, 3)
        collision = ""
        if box is not None:
            collision = (
                f'<collision><origin xyz="0.01 -0.01 {0.5 * float(box[2])!r}"/><geometry>'
                f'<box size="{_words(box)}"/></geometry></collision>'
            )
        self._elements.append(
            f'<link name="{name}"><inertial><origin xyz="{_words(place)}" rpy="{_words(place)}"/>'
            f'<mass value="{mass!r}"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
            f"{collision}</link>"
        )

    def _joint(self, name: str, kind: str, parent: str, child: str, place: Array, turn: Array, extra: str) -> None:
        origin, axes = self._frames[parent]
        self._frames[child] = (place, turn)
        self._elements.append(
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{_words(axes.T @ (place - origin))}" rpy="{_words(_rpy(axes.T @ turn))}"/>'
            f"{extra}</joint>"
        )

    def _fix(self, name: str, parent: str, place: Array, turn: Array, box: Array | None = None) -> None:
        self._link(name, box)
        self._joint(f"{name}_mount", "fixed", parent, name, place, turn, "")

    def _turning(self, name: str, parent: str, place: Array, axis: Array, low: float, high: float) -> None:
        turn = self._turn()
        self._link(f"{name}_link")
        limits = f'<limit lower="{float(low)!r}" upper="{float(high)!r}" effort="9" velocity="3"/>'
        extra = f'<axis xyz="{_words(turn.T @ axis)}"/>{limits}'
        self._joint(name, "revolute", parent, f"{name}_link", place, turn, extra)


def _words(vector: Array) -> str:
    return " ".join(repr(float(value)) for value in vector)


def _rpy(turn: Array) -> Array:
    """Return fixed-axis roll, pitch, yaw of a rotation matrix."""
    return np.array(
        [
            np.arctan2(turn[2, 1], turn[2, 2]),
            np.arctan2(-turn[2, 0], np.hypot(turn[2, 1], turn[2, 2])),
            np.arctan2(turn[1, 0], turn[0, 0]),
        ]
    )


@pytest.fixture(scope="module", params=[(seed, bend) for seed in range(4) for bend in (1.0, -1.0)], ids=str)
def biped(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Robot:
    seed, bend = request.param
    path = tmp_path_factory.mktemp("biped") / "biped.urdf"
    return load_robot(Biped(np.random.default_rng(seed), bend).write(path), NAMES)


@pytest.fixture(scope="module")
def placed_biped(biped: Robot, load_pinocchio: Callable[..., PinocchioRobot]) -> PinocchioRobot:
    return load_pinocchio(biped.urdf_path, biped.joint_names)


def test_another_biped_weighs_what_its_file_says(biped: Robot, placed_biped: PinocchioRobot) -> None:
    assert biped.mass == pytest.approx(placed_biped.mass(), abs=1e-12)
    assert biped.max_thrust == 40.0


def test_a_copy_of_another_biped_keeps_its_names(biped: Robot) -> None:
    assert pickle.loads(pickle.dumps(biped)) is biped


def test_another_biped_stands_where_pinocchio_puts_it(
    biped: Robot, placed_biped: PinocchioRobot, rng: np.random.Generator
) -> None:
    for joints in rng.uniform(biped.lower, biped.upper, (50, 12)):
        placed_biped.place(joints)
        body = forward_kinematics(biped, joints)
        np.testing.assert_allclose(body.center_of_mass, placed_biped.center_of_mass(), atol=1e-9)
        for i, names in enumerate((NAMES.left, NAMES.right)):
            sole, axes = placed_biped.pose(names.sole)
            np.testing.assert_allclose(body.soles[i], sole, atol=1e-9)
            np.testing.assert_allclose(body.foot_rotations[i], axes, atol=1e-9)
            np.testing.assert_allclose(body.fans[i], placed_biped.pose(names.fan)[0], atol=1e-9)


def test_another_biped_has_its_joints_on_their_axes(
    biped: Robot, placed_biped: PinocchioRobot, rng: np.random.Generator
) -> None:
    """The hips, knees and ankles lie on every axis that is said to go through them."""
    joints = rng.uniform(biped.lower, biped.upper)
    body = forward_kinematics(biped, joints)
    for turned in range(12):
        side, joint = divmod(turned, 6)
        point = (body.hips, body.hips, body.hips, body.knees, body.ankles, body.ankles)[joint][side]
        link = f"{biped.joint_names[turned]}_link"
        fixed = []
        for angle in (-0.5, 0.0, 0.7):  # a point on the axis stays where it is in the link that turns
            placed_biped.place(np.where(np.arange(12) == turned, angle, joints))
            origin, axes = placed_biped.pose(link)
            fixed.append(axes.T @ (point - origin))
        np.testing.assert_allclose(fixed, [fixed[0]] * 3, atol=1e-9, err_msg=link)


@pytest.mark.parametrize("side", SIDES)
def test_inverse_kinematics_of_another_biped_undoes_forward(
    biped: Robot, rng: np.random.Generator, side: str
) -> None:
    leg = slice(0, 6) if side == "left" else slice(6, 12)
    joints = rng.uniform(biped.lower, biped.upper, (500, 12))
    body = forward_kinematics(biped, joints)
    index = SIDES.index(side)
    found, out_of_reach = inverse_kinematics(biped, side, body.soles[:, index], body.foot_rotations[:, index])
    straight = np.abs(biped.lower[leg][3] - joints[:, leg][:, 3])
    straight = np.minimum(straight, np.abs(biped.upper[leg][3] - joints[:, leg][:, 3]))
    np.testing.assert_allclose(out_of_reach, 0.0, atol=1e-9)
    np.testing.assert_allclose(found[straight > 1e-3], joints[:, leg][straight > 1e-3], atol=1e-6)


@pytest.mark.parametrize("swing", SIDES)
def test_postures_of_another_biped_stand_on_their_soles(biped: Robot, rng: np.random.Generator, swing: str) -> None:
    """Hips at any height, legs that differ: the soles are where they should be all the same."""
    feet = forward_kinematics(biped, np.zeros(12)).soles + rng.uniform([-0.1, 0.0, 0.0], [0.1, 0.0, 0.1], (2, 3))
    pelvis = rng.normal(0.0, 0.05, (300, 3)) - [0.0, 0.0, 0.1]
    swing_sole, support = feet if swing == "left" else feet[::-1]
    postures = evaluate_postures(biped, swing, swing_sole, support, pelvis, BalanceSettings(zmp_margin=0.005))
    reached = postures.out_of_reach == 0.0
    assert np.count_nonzero(reached) > 20
    body = forward_kinematics(biped, postures.joint_positions[reached])
    turn = postures.pelvis_yaw[reached]
    for i in range(2):
        x, y, z = body.soles[:, i].T
        placed = np.stack([np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y, z], axis=1)
        np.testing.assert_allclose(placed + pelvis[reached], np.broadcast_to(feet[i], placed.shape), atol=1e-9)


def test_knees_bend_to_the_side_of_their_range(biped: Robot, request: pytest.FixtureRequest) -> None:
    bend = request.node.callspec.params["biped"][1]
    assert (biped.left.knee_direction, biped.right.knee_direction) == (bend, bend)
