"""Forward and inverse kinematics of the legs."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError, replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from jet_gym.arrays import Array
from jet_gym.kinematics import BodyPoints, forward_kinematics, inverse_kinematics, leg_inverse, within_limits
from jet_gym.leg import Leg
from jet_gym.robot import Robot, jet_hr1
from jet_gym.urdf import rotation_from_rpy

if TYPE_CHECKING:
    from conftest import Oracle

SIDES = ("left", "right")
LEG = {"left": slice(0, 6), "right": slice(6, 12)}
MIRRORED_JOINTS = np.array([-1.0, -1.0, 1.0, 1.0, 1.0, -1.0])  # of a leg, in the mirror of the x-z plane
MIRROR = np.array([1.0, -1.0, 1.0])

sides = st.sampled_from(SIDES)


def random_postures(robot: Robot, rng: np.random.Generator, count: int) -> Array:
    return rng.uniform(robot.lower, robot.upper, (count, 12))


@st.composite
def leg_postures(draw: st.DrawFn) -> Array:
    """Joint positions (6,) of a leg within its limits, often right at them."""
    robot = jet_hr1()
    ranges = zip(robot.lower[:6], robot.upper[:6], strict=True)
    return np.array([draw(st.floats(float(low), float(high))) for low, high in ranges])


def foot_of(robot: Robot, side: str, leg_joints: Array) -> tuple[Array, Array, BodyPoints]:
    """Return a sole's position and axes for the joints (..., 6) of its leg, and all points."""
    joints = np.zeros((*leg_joints.shape[:-1], 12))
    joints[..., LEG[side]] = leg_joints
    body = forward_kinematics(robot, joints)
    index = SIDES.index(side)
    return body.soles[..., index, :], body.foot_rotations[..., index, :, :], body


def height_over_foot(body: BodyPoints, side: str, ankle_roll: Array) -> Array:
    """Return how far the hip is from the ankle along the shank side's z axis, before ankle roll."""
    index = SIDES.index(side)
    up = body.hips[..., index, :] - body.ankles[..., index, :]
    in_foot = np.einsum("...ji,...j->...i", body.foot_rotations[..., index, :, :], up)
    return np.cos(ankle_roll) * in_foot[..., 2] + np.sin(ankle_roll) * in_foot[..., 1]


def assert_sole_is_placed(robot: Robot, side: str, joints: Array, position: Array, axes: Array) -> None:
    found_position, found_axes, _ = foot_of(robot, side, joints)
    np.testing.assert_allclose(found_position, position, atol=1e-9)
    np.testing.assert_allclose(found_axes, axes, atol=1e-9)


# ---------------------------------------------------------------------- forward


def test_points_are_where_other_libraries_put_them(robot: Robot, oracle: Oracle, rng: np.random.Generator) -> None:
    postures = random_postures(robot, rng, 300)
    body = forward_kinematics(robot, postures)
    for i, joints in enumerate(postures):
        oracle.place(joints)
        for side, name in enumerate(SIDES):
            ankle, axes = oracle.pose(f"{name}_foot")
            np.testing.assert_allclose(body.hips[i, side], oracle.pose(f"{name}_hip_yaw_link")[0], atol=1e-9)
            np.testing.assert_allclose(body.knees[i, side], oracle.pose(f"{name}_shank")[0], atol=1e-9)
            np.testing.assert_allclose(body.ankles[i, side], ankle, atol=1e-9)
            np.testing.assert_allclose(body.soles[i, side], oracle.pose(f"{name}_sole")[0], atol=1e-9)
            np.testing.assert_allclose(body.fans[i, side], oracle.pose(f"{name}_fan")[0], atol=1e-9)
            np.testing.assert_allclose(body.foot_rotations[i, side], axes, atol=1e-9)


def test_center_of_mass_is_that_of_other_libraries(robot: Robot, oracle: Oracle, rng: np.random.Generator) -> None:
    postures = random_postures(robot, rng, 300)
    centers = forward_kinematics(robot, postures).center_of_mass
    for joints, center in zip(postures, centers, strict=True):
        oracle.place(joints)
        np.testing.assert_allclose(center, oracle.center_of_mass(), atol=1e-9)


def test_a_batch_gives_what_its_postures_give_one_by_one(robot: Robot, rng: np.random.Generator) -> None:
    postures = random_postures(robot, rng, 60).reshape(3, 20, 12)
    batch = forward_kinematics(robot, postures)
    assert batch.soles.shape == (3, 20, 2, 3)
    assert batch.foot_rotations.shape == (3, 20, 2, 3, 3)
    assert batch.center_of_mass.shape == (3, 20, 3)
    for index in np.ndindex(3, 20):
        single = forward_kinematics(robot, postures[index])
        for name in vars(batch):
            np.testing.assert_array_equal(getattr(batch, name)[index], getattr(single, name), err_msg=name)


def test_mirrored_joints_give_mirrored_points(robot: Robot, rng: np.random.Generator) -> None:
    postures = random_postures(robot, rng, 200)
    mirrored = np.concatenate([postures[:, 6:] * MIRRORED_JOINTS, postures[:, :6] * MIRRORED_JOINTS], axis=1)
    body, other = forward_kinematics(robot, postures), forward_kinematics(robot, mirrored)
    for name in ("hips", "knees", "ankles", "soles", "fans"):
        np.testing.assert_allclose(getattr(other, name), getattr(body, name)[:, ::-1] * MIRROR, atol=1e-12)
    np.testing.assert_allclose(other.center_of_mass, body.center_of_mass * MIRROR, atol=1e-12)


def test_points_stay_what_they_are_and_are_equal_to_themselves_alone(robot: Robot) -> None:
    body, other = (forward_kinematics(robot, np.zeros(12)) for _ in range(2))
    assert len({body, other, body}) == 2
    with pytest.raises(FrozenInstanceError):
        body.hips = other.hips


# ---------------------------------------------------------------------- inverse


@pytest.mark.parametrize("side", SIDES)
def test_inverse_undoes_forward_on_random_postures(robot: Robot, rng: np.random.Generator, side: str) -> None:
    joints = random_postures(robot, rng, 5000)[:, LEG[side]]
    position, axes, body = foot_of(robot, side, joints)
    found, out_of_reach = inverse_kinematics(robot, side, position, axes)
    np.testing.assert_array_less(out_of_reach, 1e-12)
    assert_sole_is_placed(robot, side, found, position, axes)
    # Of two solutions whose ankle rolls are half a turn apart, inverse kinematics takes the hip above the foot.
    same_branch = (joints[:, 3] > 1e-3) & (height_over_foot(body, side, joints[:, 5]) > 1e-3)
    assert same_branch.mean() > 0.5
    np.testing.assert_allclose(found[same_branch], joints[same_branch], atol=1e-6)


@given(sides, leg_postures())
@example("left", np.zeros(6))  # on a straight leg
@example("left", np.array([0.0, 0.0, -math.pi / 2.0, 0.0, math.pi / 2.0, 0.0]))  # hip on the ankle's roll axis
@example("right", np.array([1.9, 1.0, -1.9, 2.44, -0.5, 1.0]))
def test_inverse_undoes_forward(side: str, joints: Array) -> None:
    robot = jet_hr1()
    position, axes, body = foot_of(robot, side, joints)
    found, out_of_reach = inverse_kinematics(robot, side, position, axes)
    height = height_over_foot(body, side, joints[5])
    assert out_of_reach < 1e-12
    assert_sole_is_placed(robot, side, found, position, axes)
    if joints[3] > 1e-3 and height > 1e-3:
        np.testing.assert_allclose(found, joints, atol=1e-6)


@given(leg_postures())
def test_mirrored_feet_need_mirrored_joints(joints: Array) -> None:
    robot = jet_hr1()
    position, axes, body = foot_of(robot, "left", joints)
    if abs(height_over_foot(body, "left", joints[5])) < 1e-6:
        return
    left, left_missing = inverse_kinematics(robot, "left", position, axes)
    right, right_missing = inverse_kinematics(robot, "right", position * MIRROR, axes * np.outer(MIRROR, MIRROR))
    assert right_missing == pytest.approx(left_missing, abs=1e-15)
    difference = right - left * MIRRORED_JOINTS
    np.testing.assert_allclose(np.exp(1j * difference), 1.0, atol=1e-12)  # half a turn either way is the same


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("knee", [0.0, 1e-12, 1e-9, 1e-7, 1e-6, 1e-4])
def test_a_leg_that_is_almost_straight_is_placed(
    robot: Robot, rng: np.random.Generator, side: str, knee: float
) -> None:
    joints = 0.5 * random_postures(robot, rng, 200)[:, LEG[side]]
    joints[:, 3] = knee
    position, axes, _ = foot_of(robot, side, joints)
    found, out_of_reach = inverse_kinematics(robot, side, position, axes)
    np.testing.assert_array_less(out_of_reach, 1e-12)
    assert_sole_is_placed(robot, side, found, position, axes)
    np.testing.assert_allclose(found[:, 3], knee, atol=1e-7)


@pytest.mark.parametrize("side", SIDES)
def test_a_leg_folded_to_its_limit_is_placed(robot: Robot, rng: np.random.Generator, side: str) -> None:
    joints = random_postures(robot, rng, 200)[:, LEG[side]]
    joints[:, 3] = robot.upper[LEG[side]][3]
    joints[:, 4] = rng.uniform(-1.5, -0.9, 200)  # the hip stays above the foot
    position, axes, _ = foot_of(robot, side, joints)
    found, out_of_reach = inverse_kinematics(robot, side, position, axes)
    np.testing.assert_array_equal(out_of_reach, 0.0)
    assert_sole_is_placed(robot, side, found, position, axes)
    np.testing.assert_allclose(found, joints, atol=1e-9)


@pytest.mark.parametrize("side", SIDES)
def test_hips_yaw_beyond_a_quarter_turn(robot: Robot, rng: np.random.Generator, side: str) -> None:
    joints = random_postures(robot, rng, 200)[:, LEG[side]]
    joints[:, 0] = rng.choice([-1.0, 1.0], 200) * rng.uniform(math.radians(90.0), math.radians(110.0), 200)
    joints[:, 3:5] = rng.uniform([0.2, -1.0], [1.2, 0.2], (200, 2))
    position, axes, _ = foot_of(robot, side, joints)
    found, _ = inverse_kinematics(robot, side, position, axes)
    np.testing.assert_allclose(found, joints, atol=1e-9)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("height", [0.46, 0.45, 0.3, 0.2])
def test_an_ankle_right_under_its_hip_bends_the_leg_evenly(robot: Robot, side: str, height: float) -> None:
    leg = robot.leg(side)
    found, out_of_reach = inverse_kinematics(robot, side, [leg.hip[0], leg.hip[1], -height])
    half_knee = math.acos((height - 0.06) / 0.4)  # thigh and shank are equally long
    assert out_of_reach == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(found, [0.0, 0.0, -half_knee, 2.0 * half_knee, -half_knee, 0.0], atol=1e-7)


@pytest.mark.parametrize("side", SIDES)
def test_a_sole_out_of_reach_stretches_the_leg_towards_it(
    robot: Robot, rng: np.random.Generator, side: str
) -> None:
    hip = np.array(robot.leg(side).hip)
    for _ in range(200):
        axes = rotation_from_rpy(*rng.uniform(-0.5, 0.5, 3))
        direction = rng.normal(0.0, [0.5, 0.5, 0.2]) - [0.0, 0.0, 1.0]
        direction /= np.linalg.norm(direction)
        distance = 0.4 + 10.0 ** rng.uniform(-6.0, 2.0)
        ankle_to_sole = axes @ [0.0, 0.0, -0.06]
        found, out_of_reach = inverse_kinematics(robot, side, hip + distance * direction + ankle_to_sole, axes)
        assert out_of_reach == pytest.approx(distance - 0.4, rel=1e-9)
        assert np.isfinite(found).all()
        assert found[3] == pytest.approx(0.0, abs=1e-7)
        assert_sole_is_placed(robot, side, found, hip + 0.4 * direction + ankle_to_sole, axes)


def test_a_sole_too_near_folds_a_leg_of_unequal_halves(robot: Robot, rng: np.random.Generator) -> None:
    """A leg with a short shank cannot bring its ankle to its hip; Jet-HR1's own could."""
    short = replace(robot, left=robot.left._replace(shank=(0.0, 0.0, -0.15)))
    hip = np.array(short.left.hip)
    for distance in (0.04, 0.01, 1e-3):
        direction = rng.normal(size=3)
        direction[2] = -abs(direction[2])
        direction /= np.linalg.norm(direction)
        found, out_of_reach = inverse_kinematics(short, "left", hip + distance * direction + [0.0, 0.0, -0.06])
        assert out_of_reach == pytest.approx(0.05 - distance, abs=1e-12)
        assert_sole_is_placed(short, "left", found, hip + 0.05 * direction + [0.0, 0.0, -0.06], np.eye(3))


def test_a_hip_too_near_to_the_roll_axis_of_an_ankle_beside_it_is_out_of_reach(robot: Robot) -> None:
    """With the ankle 30 mm beside the hip, no ankle roll brings the hip closer than that to the roll axis."""
    offset = replace(robot, left=robot.left._replace(shank=(0.0, 0.03, -0.2)))
    hip = np.array(offset.left.hip)
    for away in (0.0301, 0.03, 0.02, 0.01):
        sole = hip + np.array([0.3, 0.6 * away, -0.8 * away - 0.06])
        _, out_of_reach = inverse_kinematics(offset, "left", sole)
        assert out_of_reach == pytest.approx(max(0.03 - away, 0.0), abs=1e-12)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(
    "offset", [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (1e9, 0.0, 0.0), (0.0, 0.0, 1e9)]
)
def test_angles_are_finite_even_where_no_leg_could_go(robot: Robot, side: str, offset: tuple[float, ...]) -> None:
    ankle_on_hip = np.array(robot.leg(side).hip) + np.array(robot.leg(side).sole)
    found, out_of_reach = inverse_kinematics(robot, side, ankle_on_hip + offset)
    assert np.isfinite(found).all()
    assert np.isfinite(out_of_reach)


SINGULAR: dict[str, tuple[Array, Array]] = {  # ankle from hip, foot axes
    "hip on the ankle's roll axis": (np.array([0.3, 0.0, 0.0]), np.eye(3)),
    "hip roll of a quarter turn": (np.array([0.0, 0.3, 0.0]), np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])),
    "hip at the ankle": (np.zeros(3), np.eye(3)),
}


@pytest.mark.parametrize(("ankle_from_hip", "axes"), SINGULAR.values(), ids=SINGULAR)
def test_a_sole_in_reach_is_placed_where_a_joint_has_no_definite_angle(
    robot: Robot, ankle_from_hip: Array, axes: Array
) -> None:
    sole = np.array(robot.left.hip) + ankle_from_hip - 0.06 * axes[:, 2]
    found, out_of_reach = inverse_kinematics(robot, "left", sole, axes)
    assert out_of_reach == 0.0
    assert_sole_is_placed(robot, "left", found, sole, axes)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("ahead", [0.3, -0.3, 0.0])
def test_a_sole_turned_anyhow_is_placed_with_the_hip_on_the_axis_of_ankle_roll(
    robot: Robot, rng: np.random.Generator, side: str, ahead: float
) -> None:
    for _ in range(50):
        axes = rotation_from_rpy(*rng.uniform(-3.0, 3.0, 3))
        sole = robot.leg(side).hip - axes @ [ahead, 0.0, 0.06]
        found, out_of_reach = inverse_kinematics(robot, side, sole, axes)
        assert out_of_reach == 0.0
        assert_sole_is_placed(robot, side, found, sole, axes)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("quarter", [-0.5 * math.pi, 0.5 * math.pi])
def test_with_hip_roll_of_a_quarter_turn_hip_pitch_does_what_yaw_does(
    robot: Robot, rng: np.random.Generator, side: str, quarter: float
) -> None:
    joints = random_postures(robot, rng, 200)[:, LEG[side]]
    joints[:, 1] = quarter
    position, axes, _ = foot_of(robot, side, joints)
    found, out_of_reach = inverse_kinematics(robot, side, position, axes)
    np.testing.assert_allclose(out_of_reach, 0.0, atol=1e-12)
    assert_sole_is_placed(robot, side, found, position, axes)
    np.testing.assert_array_equal(found[:, 0], 0.0)


UNLIKE = {"thigh": (0.03, 0.0, -0.17), "shank": (-0.02, 0.04, -0.22), "knee_direction": -1.0}


@pytest.mark.parametrize("leg", [jet_hr1().left, jet_hr1().left._replace(**UNLIKE)], ids=["ours", "unlike"])
@pytest.mark.parametrize("where", ["anywhere", "hip on the axis of ankle roll", "hip at the ankle", "hip roll"])
def test_cosines_and_sines_are_those_of_an_angle(rng: np.random.Generator, leg: Leg, where: str) -> None:
    """Planning asks a leg for them, never for its angles."""
    checked = 0
    for _ in range(100):
        axes, hip = rotation_from_rpy(*rng.uniform(-3.0, 3.0, 3)), rng.normal(0.0, 0.25, 3)
        if where == "hip on the axis of ankle roll":
            hip[1:] = 0.0
        elif where == "hip at the ankle":
            hip[:] = 0.0
        elif where == "hip roll":  # a quarter turn of it: the y axis behind ankle roll is the pelvis' z axis
            lateral, y, z = leg.shank[1], hip[1], hip[2]
            roll = math.atan2(y, z) + math.asin(min(max(lateral / math.hypot(y, z), -1.0), 1.0))
            axes = rotation_from_rpy(0.0, 0.0, rng.uniform(-3.0, 3.0)) @ rotation_from_rpy(
                0.5 * math.pi + roll, 0, 0
            )
        cosines, sines, _ = leg_inverse(leg, tuple(hip.tolist()), tuple(axes.ravel().tolist()))
        if math.hypot(hip[1], hip[2]) < abs(leg.shank[1]):
            continue  # no ankle roll brings the ankle below its hip
        np.testing.assert_allclose(np.square(cosines) + np.square(sines), 1.0, atol=1e-9)
        assert cosines[1] >= 0.0
        assert where != "hip roll" or cosines[1] < 1e-9
        checked += 1
    assert checked > 50 or (leg.shank[1] != 0.0 and where in ("hip on the axis of ankle roll", "hip at the ankle"))


@pytest.mark.parametrize("side", SIDES)
def test_a_batch_of_soles_gives_what_they_give_one_by_one(
    robot: Robot, rng: np.random.Generator, side: str
) -> None:
    joints = random_postures(robot, rng, 60)[:, LEG[side]].reshape(3, 20, 6)
    position, axes, _ = foot_of(robot, side, joints)
    position[0] *= 1.5  # some are out of reach
    found, out_of_reach = inverse_kinematics(robot, side, position, axes)
    assert found.shape == (3, 20, 6)
    assert out_of_reach.shape == (3, 20)
    assert 0 < np.count_nonzero(out_of_reach > 1e-3) < 60
    for index in np.ndindex(3, 20):
        single, missing = inverse_kinematics(robot, side, position[index], axes[index])
        np.testing.assert_array_equal(single, found[index])
        assert missing == out_of_reach[index]


def test_a_sole_is_level_where_no_axes_are_given(robot: Robot) -> None:
    position = [[0.05, 0.15, -0.4], [-0.1, 0.1, -0.3]]
    found = inverse_kinematics(robot, "left", position)
    explicit = inverse_kinematics(robot, "left", position, np.eye(3))
    np.testing.assert_array_equal(found[0], explicit[0])
    assert_sole_is_placed(robot, "left", found[0], np.array(position), np.broadcast_to(np.eye(3), (2, 3, 3)))


# ---------------------------------------------------------------------- limits, eq. (8)


def leg_with_limits(leg: Leg, lower: Array, upper: Array) -> Leg:
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
    numbers = {
        "lower": lower,
        "upper": upper,
        "range_cosines": np.cos(middle),
        "range_sines": np.sin(middle),
        "range_half_cosines": np.cos(half),
    }
    return leg._replace(**{name: tuple(values.tolist()) for name, values in numbers.items()})


def is_within(leg: Leg, angles: Array) -> bool:
    return within_limits(leg, tuple(np.cos(angles).tolist()), tuple(np.sin(angles).tolist()))


def test_a_leg_is_within_its_limits_if_every_joint_is(robot: Robot, rng: np.random.Generator) -> None:
    for _ in range(30):
        lower = rng.uniform(-2.5, 1.5, 6)
        upper = lower + rng.uniform(0.2, 2.0, 6)
        leg = leg_with_limits(robot.left, lower, upper)
        inside = rng.uniform(lower, upper)
        assert is_within(leg, inside)
        for joint in range(6):
            one = np.arange(6) == joint
            assert is_within(leg, np.where(one, lower, inside))
            assert is_within(leg, np.where(one, upper, inside))
            assert not is_within(leg, np.where(one, lower - 1e-6, inside))
            assert not is_within(leg, np.where(one, upper + 1e-6, inside))
            assert not is_within(leg, np.where(one, lower - 0.5, inside))
            assert not is_within(leg, np.where(one, upper + 0.5, inside))


# ---------------------------------------------------------------------- what is refused


@pytest.mark.parametrize("joints", [np.zeros(11), np.zeros((2, 13)), 0.0])
def test_forward_refuses_another_number_of_joints(robot: Robot, joints: Array) -> None:
    with pytest.raises(ValueError, match=r"joint_positions must have shape \(\.\.\., 12\), not"):
        forward_kinematics(robot, joints)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_forward_refuses_what_is_not_finite(robot: Robot, bad: float) -> None:
    with pytest.raises(ValueError, match="joint_positions must be finite"):
        forward_kinematics(robot, [bad] + 11 * [0.0])


def test_inverse_refuses_wrong_shapes(robot: Robot) -> None:
    with pytest.raises(ValueError, match=r"sole_position must have shape \(\.\.\., 3\), not \(2,\)"):
        inverse_kinematics(robot, "left", [0.0, 1.0])
    with pytest.raises(ValueError, match=r"sole_rotation must be finite with shape \(\.\.\., 3, 3\), not \(3,\)"):
        inverse_kinematics(robot, "left", [0.0, 0.1, -0.4], np.ones(3))
    for shape in ((3, 4), (4, 3), (2, 2, 3)):
        with pytest.raises(ValueError, match="sole_rotation must be finite with shape"):
            inverse_kinematics(robot, "left", [0.0, 0.1, -0.4], np.ones(shape))


def test_inverse_refuses_what_is_not_finite(robot: Robot) -> None:
    with pytest.raises(ValueError, match="sole_position must be finite"):
        inverse_kinematics(robot, "left", [0.0, math.nan, -0.4])
    with pytest.raises(ValueError, match="sole_rotation must be finite"):
        inverse_kinematics(robot, "left", [0.0, 0.1, -0.4], np.full((3, 3), math.inf))
