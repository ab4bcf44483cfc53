"""What the studio draws in its scene: edge polygon, robot, balance space, where a pointer meets a plane."""

from __future__ import annotations

import math
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from page_inputs import SIDE

from agents import make_planner
from jet_gym.balance_space import compute_balance_space
from jet_gym.kinematics import forward_kinematics
from jet_gym.plan import Plan
from jet_gym.robot import Robot
from jet_gym.studio.joint_room import joints_near_limits
from jet_gym.studio.motion import Motion
from jet_gym.studio.scene.balance_cloud import boundary_of, hull_of
from jet_gym.studio.scene.balance_view import edge_polygon
from jet_gym.studio.scene.ground_view import meet_horizontal_plane
from jet_gym.studio.scene.robot_shapes import robot_tree
from jet_gym.studio.scene.robot_view import RobotView


@pytest.fixture(scope="module")
def plan() -> Plan:
    return make_planner("gas").plan(SIDE.step, seed=0)


def test_edge_polygon_is_where_equation_10_lets_the_centre_of_mass_be(rng: np.random.Generator) -> None:
    """On the outline the angle between ZMP, centre of mass and ankle is rho; by the formula, not by the arc."""
    zmp, ankle, rho = np.array([0.02, -0.1]), np.array([0.4, 0.3]), math.radians(7.0)
    outline = edge_polygon(zmp, ankle, rho, 24)
    inner = np.concatenate([outline[1:23], outline[25:47]])
    to_com, to_ankle = inner - zmp, ankle - inner
    angle = np.arctan2(to_com[:, 1], to_com[:, 0]) - np.arctan2(to_ankle[:, 1], to_ankle[:, 0])
    np.testing.assert_allclose(np.abs(angle), rho, rtol=1e-9)
    np.testing.assert_allclose(outline[[0, 24]], [zmp, zmp], atol=1e-12)
    np.testing.assert_allclose(outline[[23, 47]], [ankle, ankle], atol=1e-12)


def test_pointer_meets_the_plane_of_a_block(rng: np.random.Generator) -> None:
    eye, target = np.array([1.0, -2.0, 1.5]), np.array([0.3, 0.4, 0.1])
    through = eye + 0.37 * (target - eye)
    np.testing.assert_allclose(meet_horizontal_plane(eye, through, 0.1), target, atol=1e-12)
    assert meet_horizontal_plane(eye, eye + np.array([1.0, 0.0, 0.0]), 0.1) is None
    assert meet_horizontal_plane(eye, eye + np.array([1.0, 0.0, 0.2]), 0.1) is None


def test_robot_on_the_page_is_put_together_as_kinematics_has_it(plan: Plan) -> None:
    """The scene's chain of frames, multiplied out, leads to the soles that the kinematics knows."""
    transforms = pytest.importorskip("viser.transforms")
    robot = plan.step.robot
    urdf = robot_tree(robot.urdf_path).urdf
    joints = plan.joint_positions[11]
    body = forward_kinematics(robot, joints)
    for side, leg in enumerate((robot.names.left, robot.names.right)):
        pose = np.eye(4)
        for name in leg.joints:
            joint = urdf.joints[name]
            turn = transforms.SO3.exp(joints[robot.joint_names.index(name)] * joint.axis)
            pose = pose @ joint.origin @ transforms.SE3.from_rotation(turn).as_matrix()
        foot = leg.joints[-1]
        sole = np.linalg.inv(urdf.zero_poses[urdf.joints[foot].child]) @ urdf.zero_poses[leg.sole]
        np.testing.assert_allclose((pose @ sole)[:3, 3], body.soles[side], atol=1e-9)


class Frames:
    """A scene that notes where its frames are."""

    def __init__(self) -> None:
        self.placed: dict[str, SimpleNamespace] = {}

    def add_frame(self, name: str, position: Any = (0.0, 0.0, 0.0), **_: Any) -> SimpleNamespace:
        self.placed[name] = SimpleNamespace(position=np.array(position), wxyz=np.array([1.0, 0.0, 0.0, 0.0]))
        return self.placed[name]

    def add_mesh_simple(self, *_: Any, **__: Any) -> SimpleNamespace:
        return SimpleNamespace(visible=False)


def test_frames_of_a_robot_that_is_placed_lead_to_its_ankles(plan: Plan) -> None:
    transforms = pytest.importorskip("viser.transforms")
    scene, pose = Frames(), Motion.of_plan(plan).at(0.4 * plan.step.duration)
    RobotView(scene, "/robot", plan.step.robot).place(pose)
    body = forward_kinematics(plan.step.robot, pose.joint_positions)
    for side, leg in enumerate(("left", "right")):
        (foot,) = (name for name in scene.placed if name.endswith(f"/{leg}_foot"))
        parts = foot.split("/")
        chain = [scene.placed["/".join(parts[: k + 1])] for k in range(1, len(parts))]
        place = transforms.SE3.identity()
        for frame in chain:
            turn = transforms.SO3(frame.wxyz)
            place = place @ transforms.SE3.from_rotation_and_translation(turn, frame.position)
        ankle = pose.pelvis + transforms.SO3(pose.orientation).apply(body.ankles[side])
        np.testing.assert_allclose(place.translation(), ankle, atol=1e-9)


@pytest.mark.parametrize(
    ("mesh", "content"),
    [
        ("damaged.ply", b"ply\nformat ascii 1.0\nelement vertex 3\nend_header\n"),
        ("damaged.obj", b"v 0 0 0\nf 1 2 3\n"),
        ("damaged.glb", b"glTF"),
        ("needs_another_library.dae", b"<COLLADA/>"),
        ("of_no_known_format.x", b"mesh"),
        ("missing.stl", None),
    ],
)
def test_mesh_that_cannot_be_read_is_left_out(
    robot: Robot, tmp_path: Path, mesh: str, content: bytes | None
) -> None:
    pytest.importorskip("trimesh")
    urdf = tmp_path / "robot.urdf"
    urdf.write_text(robot.urdf_path.read_text().replace("meshes/pelvis_frame.obj", mesh))
    shutil.copytree(robot.urdf_path.parent / "meshes", tmp_path / "meshes")
    if content is not None:
        (tmp_path / mesh).write_bytes(content)
    whole, rest = (robot_tree(path).shapes["pelvis"] for path in (robot.urdf_path, urdf))
    assert 0 < sum(len(shape.faces) for shape in rest) < sum(len(shape.faces) for shape in whole)


def test_every_link_with_a_visual_is_drawn_with_its_colours() -> None:
    pytest.importorskip("trimesh")
    tree = robot_tree(SIDE.step.robot.urdf_path)
    assert {"pelvis", "left_thigh", "right_foot"} <= set(tree.shapes)
    assert "left_fan" not in tree.shapes  # it belongs to the foot that carries it
    feet = np.concatenate([shape.vertices for shape in tree.shapes["left_foot"]])
    assert feet[:, 2].min() == pytest.approx(-0.06, abs=2e-3)  # the sole is 60 mm below the ankle
    assert len({shape.color for shape in tree.shapes["pelvis"]}) >= 4


def test_joint_near_its_limit_is_named_with_what_is_left() -> None:
    robot = SIDE.step.robot
    joints = 0.5 * (robot.lower + robot.upper)
    joints[3] = robot.upper[3] - math.radians(2.0)
    assert joints_near_limits(robot, joints) == [("left_knee_pitch", pytest.approx(math.radians(2.0)))]


def test_boundary_of_a_set_of_cells_is_closed_and_holds_their_volume(rng: np.random.Generator) -> None:
    """By the divergence theorem: a closed surface with its front outside encloses as many cells as the set has."""
    inside = rng.random((5, 6, 4)) < 0.4
    corners, faces = boundary_of(inside)
    a, b, c = (corners[faces[:, k]] for k in range(3))
    assert (np.einsum("ni,ni->n", a, np.cross(b, c)) / 6.0).sum() == pytest.approx(inside.sum())
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    assert (uses % 2 == 0).all()


def test_boundary_of_nothing_has_no_face() -> None:
    assert len(boundary_of(np.zeros((3, 3, 3), dtype=bool))[1]) == 0


def test_hull_of_the_balance_space_lies_around_its_places() -> None:
    pytest.importorskip("trimesh")
    space = compute_balance_space(0.08, threads=1)
    inside = space.reachable(with_thrust=True)
    vertices, _ = hull_of(space, inside)
    places = np.stack(np.meshgrid(space.x, space.y, space.z, indexing="ij"), axis=-1)[inside] - space.support
    assert (np.abs(vertices.min(axis=0) - places.min(axis=0)) < 0.08).all()
    assert (np.abs(vertices.max(axis=0) - places.max(axis=0)) < 0.08).all()
