"""Another biped of the same topology: its own lengths, masses, axes and names, held against pinocchio."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from jet_gym import load_robot
from jet_gym.balance import BalanceSettings
from jet_gym.kinematics import axis_signs, forward_kinematics, inverse_kinematics, range_middles
from jet_gym.leg import SIDES, LegNames
from jet_gym.posture import evaluate_postures
from jet_gym.robot import FrameNames, Robot
from jet_gym.urdf import rotation_from_rpy
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from conftest import PinocchioRobot


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


def test_another_biped_counts_angles_as_its_axes_point(biped: Robot) -> None:
    signs = axis_signs(biped)
    assert set(signs.tolist()) == {-1.0, 1.0}
    np.testing.assert_allclose(signs * range_middles(biped), 0.5 * (biped.lower + biped.upper), atol=1e-12)


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
