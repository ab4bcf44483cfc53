"""From a pelvis position to a posture and the constraints that it violates."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from legs import MIRROR, MIRRORED_JOINTS
from standing import SOLE

from jet_gym import jet_hr1, load_robot
from jet_gym.balance import GRAVITY, BalanceSettings
from jet_gym.constraints import EDGE_POLYGON, JOINT_LIMITS, REACH, THRUST, ZMP, violation_names
from jet_gym.fitness import FitnessSettings
from jet_gym.kinematics import forward_kinematics
from jet_gym.leg import SIDES, Side, opposite
from jet_gym.posture import Postures, evaluate_postures
from jet_gym.posture_state import fitness_of_candidates
from jet_gym.robot import Robot
from jet_gym.single_support import single_support, stance_between
from jet_gym.utils.arrays import Array

MODELS = ("assigned", "least")
MAX_THRUST, WEIGHT, EDGE = jet_hr1().max_thrust, jet_hr1().mass * GRAVITY, BalanceSettings.edge_tolerance

by_swing = pytest.mark.parametrize("swing", SIDES)
by_model = pytest.mark.parametrize("model", MODELS)


def feet(swing: Side) -> tuple[Array, Array]:
    """Return a swing and a support sole in the midst of a step."""
    outward = 1.0 if swing == "left" else -1.0
    return np.array([0.25, outward * 0.2, 0.06]), np.array([0.02, -outward * 0.05, 0.01])


def cloud(rng: np.random.Generator, swing: Side, count: int) -> Array:
    """Return pelvis positions (count, 3), many of them good, some out of reach."""
    swing_sole, support = feet(swing)
    centre = 0.75 * support + 0.25 * swing_sole + np.array([0.0, 0.0, 0.36])
    spread = rng.choice([0.01, 0.05, 0.2], (count, 1))
    return centre + spread * rng.normal(size=(count, 3))


def with_limits(robot: Robot, joint: int, low: float, high: float, path: Path) -> Path:
    """Write the robot's file with other limits of one joint."""
    tree = ElementTree.parse(robot.urdf_path)
    limit = tree.find(f"joint[@name='{robot.joint_names[joint]}']/limit")
    assert limit is not None
    limit.attrib.update(lower=repr(float(low)), upper=repr(float(high)))
    tree.write(path)
    return path


def pelvis_axes(postures: Postures) -> Array:
    cos, sin = np.cos(postures.pelvis_yaw), np.sin(postures.pelvis_yaw)
    axes = np.zeros((*cos.shape, 3, 3))
    axes[..., 0, 0], axes[..., 0, 1], axes[..., 1, 0], axes[..., 1, 1] = cos, -sin, sin, cos
    axes[..., 2, 2] = 1.0
    return axes


def violated(robot: Robot, swing: Side, postures: Postures) -> tuple[dict[int, Array], Array]:
    """Work out the violated constraints from the posture alone.

    Returns:
        Whether each constraint is violated (N,), and whether none is too close to its bound to tell.
    """
    swing_sole, support = feet(swing)
    axes = pelvis_axes(postures)
    missing = np.full(len(postures.thrust), -np.inf)
    for side, sole in ((swing, swing_sole), (opposite(swing), support)):
        hip = postures.pelvis + axes @ np.array([0.0, 0.1125 if side == "left" else -0.1125, 0.0])
        missing = np.maximum(missing, np.linalg.norm(hip - sole - [0.0, 0.0, 0.06], axis=-1) - 0.4)
    joints = postures.joint_positions
    beyond = np.maximum(robot.lower - joints, joints - robot.upper).max(axis=-1)
    beyond[missing > 0.0] = np.inf  # out of reach, the knee is right at its limit
    com, thrust = postures.center_of_mass[:, :2], postures.thrust[:, None]
    first, second = com - postures.assigned_zmp, swing_sole[:2] - com
    turn = np.arctan2(first[:, 1], first[:, 0]) - np.arctan2(second[:, 1], second[:, 0])
    beside = np.abs((turn + np.pi) % (2.0 * np.pi) - np.pi) - EDGE
    ground_force = np.where(thrust == WEIGHT, np.nan, WEIGHT - thrust)
    zmp = np.nan_to_num((WEIGHT * com - thrust * postures.fan[:, :2]) / ground_force - support[:2], nan=1e9)
    x_min, x_max, y_min, y_max = SOLE
    off_sole = np.max([x_min - zmp[:, 0], zmp[:, 0] - x_max, y_min - zmp[:, 1], zmp[:, 1] - y_max], axis=0)
    excess = {REACH: missing, JOINT_LIMITS: beyond, EDGE_POLYGON: beside, ZMP: off_sole}
    verdict = {flag: (values > 0.0) | (missing > 0.0) for flag, values in excess.items()}
    verdict[THRUST] = (postures.thrust < 0.0) | (postures.thrust > MAX_THRUST) | (missing > 0.0)
    return verdict, np.min([np.abs(values) for values in excess.values()], axis=0) > 1e-8


# ---------------------------------------------------------------------- the posture


@by_swing
def test_soles_are_at_the_asked_places_level_and_pointing_forward(
    robot: Robot, rng: np.random.Generator, swing: Side
) -> None:
    swing_sole, support = feet(swing)
    postures = evaluate_postures(robot, swing, swing_sole, support, cloud(rng, swing, 5000))
    reached = postures.out_of_reach == 0.0
    assert 0.5 < reached.mean() < 1.0
    body = forward_kinematics(robot, postures.joint_positions[reached])
    axes, origin = pelvis_axes(postures)[reached][:, None], postures.pelvis[reached][:, None]
    soles = origin + (axes @ body.soles[..., None])[..., 0]
    expected = [swing_sole, support] if swing == "left" else [support, swing_sole]
    np.testing.assert_allclose(soles, np.broadcast_to(expected, soles.shape), atol=1e-9)
    rotations = axes @ body.foot_rotations
    np.testing.assert_allclose(rotations, np.broadcast_to(np.eye(3), rotations.shape), atol=1e-9)


@by_swing
def test_center_of_mass_and_fan_are_those_of_the_posture(
    robot: Robot, rng: np.random.Generator, swing: Side
) -> None:
    postures = evaluate_postures(robot, swing, *feet(swing), cloud(rng, swing, 2000))
    body = forward_kinematics(robot, postures.joint_positions)
    axes = pelvis_axes(postures)
    center = postures.pelvis + (axes @ body.center_of_mass[..., None])[..., 0]
    np.testing.assert_allclose(postures.center_of_mass, center, atol=1e-9)
    fan = postures.pelvis + (axes @ body.fans[:, SIDES.index(swing), :, None])[..., 0]
    reached = postures.out_of_reach == 0.0
    np.testing.assert_allclose(postures.fan[reached], fan[reached], atol=1e-9)


@by_model
@by_swing
def test_violations_are_those_worked_out_from_the_posture(
    robot: Robot, rng: np.random.Generator, swing: Side, model: str
) -> None:
    settings = BalanceSettings(thrust_model=model)
    postures = evaluate_postures(robot, swing, *feet(swing), cloud(rng, swing, 20_000), settings)
    verdict, clear = violated(robot, swing, postures)
    assert clear.mean() > 0.99
    for flag, fails in verdict.items():
        found = postures.violations & flag != 0
        np.testing.assert_array_equal(found[clear], fails[clear], err_msg=violation_names(flag)[0])
        assert 10 < np.count_nonzero(fails) < 19_990, violation_names(flag)
    assert np.count_nonzero(postures.violations == 0) > 100


@pytest.mark.parametrize("joint", range(12))
def test_each_joint_is_held_against_its_own_limits(
    robot: Robot, rng: np.random.Generator, tmp_path: Path, joint: int
) -> None:
    """A robot with one joint's range narrowed to what half of the postures need, between two of them."""
    swing_sole, support = feet("left")
    swing_soles, pelvis = swing_sole + rng.normal(0.0, 0.05, (20_000, 3)), cloud(rng, "left", 20_000)
    wide = evaluate_postures(robot, "left", swing_soles, support, pelvis)
    reached = wide.out_of_reach == 0.0
    angles = np.sort(wide.joint_positions[reached, joint])
    quarter = len(angles) // 4
    low, high = 0.5 * (angles[[quarter, -quarter]] + angles[[quarter + 1, 1 - quarter]])
    narrow = load_robot(with_limits(robot, joint, low, high, tmp_path / "narrow.urdf"))
    found = evaluate_postures(narrow, "left", swing_soles, support, pelvis)
    inside = (found.joint_positions >= narrow.lower) & (found.joint_positions <= narrow.upper)
    fails = found.violations & JOINT_LIMITS != 0
    np.testing.assert_array_equal(fails[reached], ~inside.all(axis=1)[reached])
    assert np.count_nonzero(~inside[reached, joint]) == pytest.approx(0.5 * len(angles), abs=5)


@by_swing
def test_everything_is_violated_out_of_reach(robot: Robot, rng: np.random.Generator, swing: Side) -> None:
    postures = evaluate_postures(robot, swing, *feet(swing), cloud(rng, swing, 5000))
    beyond = postures.out_of_reach > 0.0
    assert np.count_nonzero(beyond) > 100
    assert set(postures.violations[beyond]) == {REACH | JOINT_LIMITS | THRUST | EDGE_POLYGON | ZMP}
    assert not (postures.violations[~beyond] & REACH).any()


def test_violations_have_names() -> None:
    assert violation_names(0) == ()
    assert violation_names(THRUST | REACH | ZMP) == ("reach", "thrust", "zmp")


@by_swing
def test_settings_change_what_counts_as_violated(robot: Robot, rng: np.random.Generator, swing: Side) -> None:
    pelvis = cloud(rng, swing, 5000)
    usual = evaluate_postures(robot, swing, *feet(swing), pelvis)
    strict = evaluate_postures(
        robot, swing, *feet(swing), pelvis, BalanceSettings(edge_tolerance=math.radians(1.0), max_thrust=5.0)
    )
    reached = usual.out_of_reach == 0.0
    np.testing.assert_array_equal(strict.thrust, usual.thrust)
    too_much = (usual.thrust < 0.0) | (usual.thrust > 5.0)
    np.testing.assert_array_equal((strict.violations & THRUST != 0)[reached], too_much[reached])
    askew = np.abs(usual.edge_angle) > math.radians(1.0)
    np.testing.assert_array_equal((strict.violations & EDGE_POLYGON != 0)[reached], askew[reached])


# ---------------------------------------------------------------------- laws


@by_model
@by_swing
def test_a_batch_gives_what_its_postures_give_one_by_one(
    robot: Robot, rng: np.random.Generator, swing: Side, model: str
) -> None:
    pelvis, settings = cloud(rng, swing, 150), BalanceSettings(thrust_model=model)
    batch = evaluate_postures(robot, swing, *feet(swing), pelvis, settings)
    for i in range(len(pelvis)):
        single = evaluate_postures(robot, swing, *feet(swing), pelvis[i], settings)
        for name in vars(batch):
            np.testing.assert_array_equal(getattr(batch, name)[i], getattr(single, name), err_msg=name)


@by_model
def test_mirrored_steps_give_mirrored_postures(robot: Robot, rng: np.random.Generator, model: str) -> None:
    swing_sole, support = feet("left")
    pelvis, settings = cloud(rng, "left", 2000), BalanceSettings(thrust_model=model)
    left = evaluate_postures(robot, "left", swing_sole, support, pelvis, settings)
    right = evaluate_postures(robot, "right", swing_sole * MIRROR, support * MIRROR, pelvis * MIRROR, settings)
    np.testing.assert_allclose(right.thrust, left.thrust, atol=1e-12)
    np.testing.assert_array_equal(right.violations, left.violations)
    np.testing.assert_allclose(right.pelvis_yaw, -left.pelvis_yaw, atol=1e-12)
    np.testing.assert_allclose(right.edge_angle, -left.edge_angle, atol=1e-9)
    np.testing.assert_allclose(right.center_of_mass, left.center_of_mass * MIRROR, atol=1e-12)
    np.testing.assert_allclose(right.fan, left.fan * MIRROR, atol=1e-12)
    np.testing.assert_allclose(right.zmp, left.zmp * MIRROR[:2], atol=1e-9)
    mirrored = left.joint_positions.reshape(-1, 2, 6)[:, ::-1] * MIRRORED_JOINTS
    np.testing.assert_allclose(right.joint_positions.reshape(-1, 2, 6), mirrored, atol=1e-9)


@by_swing
def test_a_moved_step_gives_the_same_postures(robot: Robot, rng: np.random.Generator, swing: Side) -> None:
    moved, pelvis = np.array([3.0, -2.0, 0.5]), cloud(rng, swing, 500)
    here = evaluate_postures(robot, swing, *feet(swing), pelvis)
    there = evaluate_postures(robot, swing, *(foot + moved for foot in feet(swing)), pelvis + moved)
    np.testing.assert_allclose(there.thrust, here.thrust, atol=1e-9)
    np.testing.assert_allclose(there.joint_positions, here.joint_positions, atol=1e-7)
    np.testing.assert_allclose(there.zmp, here.zmp + moved[:2], atol=1e-9)


def test_positions_broadcast(robot: Robot, rng: np.random.Generator) -> None:
    swing_sole, support = feet("left")
    soles = swing_sole + rng.normal(0.0, 0.02, (4, 1, 3))
    pelvis = cloud(rng, "left", 5)
    grid = evaluate_postures(robot, "left", soles, support, pelvis)
    assert grid.thrust.shape == (4, 5)
    assert grid.joint_positions.shape == (4, 5, 12)
    assert grid.pelvis.shape == (4, 5, 3)
    assert grid.assigned_zmp.shape == (4, 5, 2)
    assert grid.violations.shape == (4, 5)
    for i, j in np.ndindex(4, 5):
        single = evaluate_postures(robot, "left", soles[i, 0], support, pelvis[j])
        assert single.thrust.shape == ()
        np.testing.assert_array_equal(grid.joint_positions[i, j], single.joint_positions)
        assert grid.thrust[i, j] == single.thrust


def test_postures_do_not_change_when_their_caller_moves_on(robot: Robot, rng: np.random.Generator) -> None:
    pelvis = cloud(rng, "left", 5)
    postures = evaluate_postures(robot, "left", *feet("left"), pelvis)
    before = postures.pelvis.copy()
    pelvis += 1.0
    np.testing.assert_array_equal(postures.pelvis, before)


@pytest.mark.parametrize("position", range(3))
def test_what_is_not_a_finite_position_is_refused(robot: Robot, position: int) -> None:
    name = ("swing_sole", "support_sole", "pelvis")[position]
    places = [[0.0, 0.1125, 0.0], [0.0, -0.1125, 0.0], [0.0, 0.0, 0.4]]
    places[position] = [0.0, math.nan, 0.0]
    with pytest.raises(ValueError, match=f"{name} must be finite"):
        evaluate_postures(robot, "left", *places)
    places[position] = [0.0, 0.0]
    with pytest.raises(ValueError, match=rf"{name} must have shape \(\.\.\., 3\), not \(2,\)"):
        evaluate_postures(robot, "left", *places)


def test_an_unknown_leg_is_refused(robot: Robot) -> None:
    with pytest.raises(ValueError, match="swing must be 'left' or 'right', not 'both'"):
        evaluate_postures(robot, "both", np.zeros(3), np.zeros(3), np.zeros(3))


# ---------------------------------------------------------------------- the planners' inner loop


@by_model
@by_swing
@pytest.mark.parametrize("smoothness_weight", [0.0, 50e4])
def test_fitness_of_candidates_is_the_formula_on_their_postures(
    robot: Robot, rng: np.random.Generator, swing: Side, model: str, smoothness_weight: float
) -> None:
    pelvis, settings = cloud(rng, swing, 20_000), BalanceSettings(thrust_model=model)
    swing_sole, support = feet(swing)
    numbers = single_support(robot, swing, settings)
    stance = stance_between(numbers, tuple(swing_sole.tolist()), tuple(support.tolist()))
    previous = tuple(pelvis[0].tolist())
    fitness, violations = np.empty(len(pelvis)), np.empty(len(pelvis), np.int64)
    parameters = FitnessSettings(smoothness_weight).parameters()
    fitness_of_candidates(
        numbers, parameters, stance, previous, np.ascontiguousarray(pelvis.T), fitness, violations
    )

    postures = evaluate_postures(robot, swing, swing_sole, support, pelvis, settings)
    flags = postures.violations
    np.testing.assert_array_equal(violations, flags)
    f1 = np.where(flags & JOINT_LIMITS, 11000.0, 0.0)
    f2 = np.where(flags & EDGE_POLYGON, 9000.0, 0.0)
    f3 = smoothness_weight * ((pelvis - pelvis[0]) ** 2).sum(axis=1)
    f4 = np.where(flags & THRUST, 5000.0, 10.0 * postures.thrust)
    np.testing.assert_allclose(fitness, f1 + f2 + f3 + f4, rtol=1e-12)
    assert len(set(flags)) > 5
