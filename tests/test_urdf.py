"""The URDF file of Jet-HR1 and its reader."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from jet_gym.errors import RobotError
from jet_gym.leg import SIDES
from jet_gym.robot import Robot
from jet_gym.urdf import Link, Urdf, read_urdf, rotation_from_rpy
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from conftest import BulletRobot, Oracle

# Joint limits [deg] and torque limits [N m] of the design's table; left and right alike.
JOINT_TABLE = {
    "hip_yaw": (-110, 110, 7.8),
    "hip_roll": (-60, 60, 18.95),
    "hip_pitch": (-110, 60, 15.6),
    "knee_pitch": (0, 140, 15.6),
    "ankle_pitch": (-90, 90, 15.6),
    "ankle_roll": (-60, 60, 18.95),
}
LEG_MASSES = {  # [kg], the links of each part of a leg
    ("hip_yaw_link", "hip_roll_link"): 0.40,
    ("thigh",): 0.50,
    ("shank",): 0.45,
    ("ankle_link", "foot", "sole", "fan"): 0.65,
}


@pytest.fixture(scope="module")
def urdf(robot: Robot) -> Urdf:
    return read_urdf(robot.urdf_path)


@pytest.fixture
def read(tmp_path: Path) -> Callable[[str], Urdf]:
    """Return a reader of a <robot> with the given content."""

    def read_content(content: str) -> Urdf:
        path = tmp_path / "robot.urdf"
        path.write_text(f'<robot name="test">{content}</robot>', encoding="utf-8")
        return read_urdf(path)

    return read_content


def links(names: str) -> str:
    """Return empty links, one a letter."""
    return "".join(f'<link name="{name}"/>' for name in names)


def inertial(content: str) -> str:
    return f'<link name="a"><inertial>{content}</inertial></link>'


def joint(name: str, parent: str, child: str, content: str = "", kind: str = "fixed") -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{content}</joint>'


def inertia_of_shape(link: Link) -> Array:
    """Return the inertia (3, 3) of a homogeneous box or upright cylinder of the link's mass."""
    (shape,) = link.collisions
    x, y, z = shape.size
    if shape.kind == "box":
        moments = (y * y + z * z, z * z + x * x, x * x + y * y)
    else:
        radius = 0.5 * x
        across = 3.0 * radius * radius + z * z
        moments = (across, across, 6.0 * radius * radius)
    axes = shape.pose[:3, :3]
    return axes @ np.diag(moments) @ axes.T * link.mass / 12.0


# ---------------------------------------------------------------------- the file


def test_total_mass_is_the_stated_one(urdf: Urdf, robot: Robot) -> None:
    assert sum(link.mass for link in urdf.links.values()) == pytest.approx(6.8, abs=1e-12)
    assert robot.mass == pytest.approx(6.8, abs=1e-12)


def test_total_mass_is_the_stated_one_for_other_libraries(oracle: Oracle) -> None:
    assert oracle.mass() == pytest.approx(6.8, abs=1e-12)


def test_pybullet_gives_every_link_the_mass_of_the_file(urdf: Urdf, bullet_robot: BulletRobot) -> None:
    names = {index: name for name, index in bullet_robot.links.items()} | {-1: urdf.root}
    masses = {name: bullet_robot.client.getDynamicsInfo(bullet_robot.body, i)[0] for i, name in names.items()}
    assert masses == {name: link.mass for name, link in urdf.links.items()}


@pytest.mark.parametrize("frame", ["left_sole", "right_sole", "imu"])
def test_frames_weigh_nothing(urdf: Urdf, frame: str) -> None:
    assert urdf.links[frame].mass == 0.0
    assert not urdf.links[frame].inertia.any()


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("parts", "mass"), LEG_MASSES.items(), ids=str)
def test_parts_have_the_masses_of_the_table(urdf: Urdf, side: str, parts: tuple[str, ...], mass: float) -> None:
    assert sum(urdf.links[f"{side}_{part}"].mass for part in parts) == pytest.approx(mass, abs=1e-12)


@pytest.mark.parametrize("side", SIDES)
def test_a_fan_has_the_stated_mass(urdf: Urdf, side: str) -> None:
    assert urdf.links[f"{side}_fan"].mass == 0.232


def test_inertias_are_those_of_rigid_bodies(urdf: Urdf) -> None:
    heavy = [link for link in urdf.links.values() if link.mass > 0.0]
    assert len(heavy) == 15
    for link in heavy:
        moments = np.linalg.eigvalsh(link.inertia)
        np.testing.assert_array_equal(link.inertia, link.inertia.T, err_msg=link.name)
        assert moments[0] > 0.0, link.name
        assert moments[0] + moments[1] > moments[2], link.name


def test_inertias_are_those_of_the_collision_shapes(urdf: Urdf) -> None:
    compared = set()
    for name, link in urdf.links.items():
        centers = [shape.pose[:3, 3] for shape in link.collisions]
        if len(centers) == 1 and np.allclose(centers[0], link.center_of_mass, rtol=0.0, atol=1e-9):
            expected = inertia_of_shape(link)
            np.testing.assert_allclose(link.inertia, expected, rtol=1e-6, atol=1e-12, err_msg=name)
            compared.add(name)
    assert compared >= {f"{side}_{part}" for side in SIDES for part in ("thigh", "shank", "foot", "fan")}


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("name", JOINT_TABLE)
def test_joints_have_the_limits_of_the_table(urdf: Urdf, side: str, name: str) -> None:
    low, high, effort = JOINT_TABLE[name]
    joint = urdf.joints[f"{side}_{name}"]
    assert joint.kind == "revolute"
    assert np.degrees([joint.lower, joint.upper]) == pytest.approx([low, high], abs=1e-6)
    assert joint.effort == effort
    assert 0.0 < joint.velocity < 10.0


def test_gears_trade_speed_for_torque(urdf: Urdf) -> None:
    for side in SIDES:
        fast = urdf.joints[f"{side}_hip_yaw"].velocity
        for name in JOINT_TABLE:
            gear = 2.43 if name.endswith("_roll") else 1.0
            assert urdf.joints[f"{side}_{name}"].velocity == pytest.approx(fast / gear, abs=0.01)


def test_efforts_are_those_of_the_servos(robot: Robot) -> None:
    servos = {servo.joint: servo for servo in robot.servos}
    assert set(servos) == set(robot.joint_names)
    for name, effort in zip(robot.joint_names, robot.effort, strict=True):
        servo = servos[name]
        assert servo.count * servo.torque * servo.gear_ratio == pytest.approx(effort, abs=0.005), name
        assert servo.torque == 7.8
        assert servo.gear_ratio == (2.43 if name.endswith("_roll") else 1.0)
        assert servo.count == (2 if name.endswith("_pitch") else 1)


def test_right_side_mirrors_the_left(urdf: Urdf) -> None:
    mirror = np.array([1.0, -1.0, 1.0])
    for name, link in urdf.links.items():
        if not name.startswith("left_"):
            continue
        other = urdf.links[name.replace("left_", "right_")]
        assert other.mass == link.mass
        np.testing.assert_array_equal(other.center_of_mass, mirror * link.center_of_mass)
        np.testing.assert_array_equal(other.inertia, np.outer(mirror, mirror) * link.inertia)
        place, other_place = urdf.zero_poses[name], urdf.zero_poses[other.name]
        np.testing.assert_allclose(other_place[:3, 3], mirror * place[:3, 3], atol=1e-15)


# ---------------------------------------------------------------------- the reader


def test_link_frames_are_where_other_libraries_put_them(urdf: Urdf, robot: Robot, oracle: Oracle) -> None:
    oracle.place(np.zeros(12))
    for name in urdf.links.keys() - {urdf.root}:
        position, axes = oracle.pose(name)
        np.testing.assert_allclose(urdf.zero_poses[name][:3, 3], position, atol=1e-12, err_msg=name)
        np.testing.assert_allclose(urdf.zero_poses[name][:3, :3], axes, atol=1e-12, err_msg=name)


def test_roll_pitch_yaw_turn_about_fixed_axes(rng: np.random.Generator) -> None:
    transform = pytest.importorskip("scipy.spatial.transform")
    for angles in rng.uniform(-np.pi, np.pi, (50, 3)):
        expected = transform.Rotation.from_euler("xyz", angles).as_matrix()
        np.testing.assert_allclose(rotation_from_rpy(*angles), expected, atol=1e-14)


def test_inertias_are_turned_into_the_link_frame(read: Callable[[str], Urdf]) -> None:
    urdf = read(
        '<link name="a"><inertial><origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/><mass value="2"/>'
        '<inertia ixx="3" iyy="4" izz="5" ixy="0.5" ixz="0" iyz="0"/></inertial></link>'
    )
    link = urdf.links["a"]
    np.testing.assert_array_equal(link.center_of_mass, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(link.inertia, [[4, -0.5, 0], [-0.5, 3, 0], [0, 0, 5]], atol=1e-12)


def test_shapes_are_read_and_meshes_left_out(read: Callable[[str], Urdf]) -> None:
    shapes = (
        '<box size="1 2 3"/>',
        '<cylinder radius="0.5" length="4"/>',
        '<sphere radius="2"/>',
        '<mesh filename="x.obj"/>',
    )
    content = "".join(f"<collision><geometry>{shape}</geometry></collision>" for shape in shapes)
    urdf = read(f'<link name="a">{content}</link>')
    assert [(shape.kind, shape.size) for shape in urdf.links["a"].collisions] == [
        ("box", (1.0, 2.0, 3.0)),
        ("cylinder", (1.0, 1.0, 4.0)),
        ("sphere", (4.0, 4.0, 4.0)),
    ]


def test_fixed_links_move_with_the_link_that_carries_them(urdf: Urdf) -> None:
    assert urdf.moving_link("left_fan") == "left_foot"
    assert urdf.moving_link("imu") == "pelvis"
    assert {link.name for link in urdf.rigid_links("right_foot")} == {"right_foot", "right_sole", "right_fan"}


def test_a_joint_without_an_axis_turns_about_x(read: Callable[[str], Urdf]) -> None:
    urdf = read(links("ab") + joint("j", "a", "b", kind="continuous"))
    np.testing.assert_array_equal(urdf.joints["j"].axis, [1.0, 0.0, 0.0])
    assert (urdf.joints["j"].lower, urdf.joints["j"].upper) == (-np.inf, np.inf)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(RobotError, match=r"nowhere\.urdf: No such file"):
        read_urdf(tmp_path / "nowhere.urdf")


@pytest.mark.parametrize("content", ["", "solid text", "<robot><link></robot>", "\0"])
def test_what_is_no_xml_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "broken.urdf").write_text(content, encoding="utf-8")
    with pytest.raises(RobotError, match=r"broken\.urdf is not a URDF file"):
        read_urdf(tmp_path / "broken.urdf")


def test_another_root_element_is_refused(tmp_path: Path) -> None:
    (tmp_path / "model.sdf").write_text("<sdf/>", encoding="utf-8")
    with pytest.raises(RobotError, match=r"root element is <sdf>, not <robot>"):
        read_urdf(tmp_path / "model.sdf")


BAD_TREES = {
    "a loop beside the root": (
        links("abc") + joint("j1", "b", "c") + joint("j2", "c", "b"),
        r"\['j1', 'j2'\] form a loop",
    ),
    "nothing but a loop": (
        links("ab") + joint("j1", "a", "b") + joint("j2", "b", "a"),
        r"one root, but the roots are \[\]",
    ),
    "two roots": (links("ab"), r"the roots are \['a', 'b'\]"),
    "no links": ("", r"the roots are \[\]"),
    "two parents": (
        links("abc") + joint("j1", "a", "c") + joint("j2", "b", "c"),
        "link c: it has more than one parent joint",
    ),
    "an unknown link": (links("a") + joint("j1", "a", "ghost"), "joint j1: its link 'ghost' is not in"),
    "no parent": (
        links("a") + '<joint name="j1" type="fixed"><child link="a"/></joint>',
        "joint j1: it needs a <parent> and a <child>",
    ),
}


@pytest.mark.parametrize(("content", "message"), BAD_TREES.values(), ids=BAD_TREES)
def test_what_is_not_one_tree_is_refused(read: Callable[[str], Urdf], content: str, message: str) -> None:
    with pytest.raises(RobotError, match=message):
        read(content)


BAD_NUMBERS = {
    "negative mass": (inertial('<mass value="-1"/>'), r"link a: its mass of -1\.0 kg is negative"),
    "infinite mass": (inertial('<mass value="inf"/>'), "link a mass value: .*'inf'"),
    "mass in words": (inertial('<mass value="one"/>'), "link a mass value: .*'one'"),
    "inertia": (inertial('<mass value="1"/><inertia ixx="nan"/>'), "link a ixx: .*'nan'"),
    "place": (inertial('<origin xyz="0 nan 0"/>'), "link a origin xyz: expected 3 finite numbers, got '0 nan 0'"),
    "two of three": (inertial('<origin xyz="0 0"/>'), "link a origin xyz: .*'0 0'"),
    "box": (
        '<link name="a"><collision><geometry><box size="1 1 inf"/></geometry></collision></link>',
        "link a box size: .*'1 1 inf'",
    ),
    "joint place": (
        links("ab") + joint("j", "a", "b", '<origin rpy="0 0 1e999"/>'),
        "joint j origin rpy: .*'0 0 1e999'",
    ),
    "axis": (links("ab") + joint("j", "a", "b", '<axis xyz="0 0 0"/>'), "joint j: its axis has no length"),
    "limit": (
        links("ab") + joint("j", "a", "b", '<limit lower="-inf" upper="1"/>', "revolute"),
        "joint j lower: .*'-inf'",
    ),
    "effort": (
        links("ab") + joint("j", "a", "b", '<limit effort="strong"/>', "revolute"),
        "joint j effort: .*'strong'",
    ),
}


@pytest.mark.parametrize(("content", "message"), BAD_NUMBERS.values(), ids=BAD_NUMBERS)
def test_numbers_that_make_no_sense_are_refused(read: Callable[[str], Urdf], content: str, message: str) -> None:
    with pytest.raises(RobotError, match=message):
        read(content)


def test_a_robot_error_is_a_value_error() -> None:
    assert issubclass(RobotError, ValueError)
