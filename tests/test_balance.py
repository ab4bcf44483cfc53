"""Zero-moment point, thrust and edge polygon on one foot with the other foot's fan blowing."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError, replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from jet_gym.arrays import Array
from jet_gym.balance import (
    GRAVITY,
    BalanceSettings,
    Point,
    Rectangle,
    Stance,
    assigned_thrust,
    edge_vectors,
    least_thrust,
    outside_edge_polygon,
    stance_of,
    within_edge_polygon,
    within_support,
    zmp_of,
)
from jet_gym.errors import SettingsError
from jet_gym.leg import Side
from jet_gym.posture import Postures, evaluate_postures, swing_and_support
from jet_gym.robot import Robot

if TYPE_CHECKING:
    from conftest import PinocchioRobot

WEIGHT = 6.8 * 9.81  # [N]
MAX_THRUST = 23.0  # [N]
MARGIN = 0.02  # [m]
SOLE = (-0.07, 0.10, -0.05, 0.05)  # [m]
SIDES: tuple[Side, Side] = ("left", "right")

coordinates = st.floats(-0.4, 0.4)
points = st.tuples(coordinates, coordinates)


def shrunk(rectangle: Rectangle, margin: float = MARGIN) -> tuple[Array, Array]:
    """Return the low and the high corner of a rectangle shrunk by a margin."""
    x_min, x_max, y_min, y_max = rectangle
    return np.array([x_min + margin, y_min + margin]), np.array([x_max - margin, y_max - margin])


def zmp_by_moments(com: Array, fan: Array, thrust: Array) -> Array:
    """Return where the ground must push for weight, thrust and ground to turn nothing about the origin."""
    thrust = np.asarray(thrust)[..., None]
    return (WEIGHT * com - thrust * fan) / (WEIGHT - thrust)


def random_feet(rng: np.random.Generator, swing: Side) -> tuple[Array, Array]:
    """Return a swing and a support sole in an ordinary step."""
    outward = 1.0 if swing == "left" else -1.0
    support = rng.uniform([-1.0, -1.0, -0.1], [1.0, 1.0, 0.1])
    swing_sole = support + rng.uniform([-0.6, 0.15, 0.0], [0.6, 0.4, 0.1]) * [1.0, outward, 1.0]
    return swing_sole, support


def random_steps(rng: np.random.Generator, swing: Side) -> tuple[Array, Array, Array]:
    """Return swing soles, support soles and pelvis positions (200, 3) that the legs can mostly reach."""
    feet = np.array([random_feet(rng, swing) for _ in range(200)])
    pelvis = feet[:, 1] + 0.3 * (feet[:, 0] - feet[:, 1]) + rng.normal(0.0, 0.03, (200, 3))
    return feet[:, 0], feet[:, 1], pelvis + np.array([0.0, 0.0, 0.4])


def with_com_on_the_line(robot: Robot, swing: Side, swing_sole: Array, support: Array, share: float) -> Postures:
    """Return a posture with the centre of mass on the line from the assigned ZMP to the fan."""
    pelvis = support + np.array([0.0, 0.0, 0.35])
    for _ in range(60):
        posture = evaluate_postures(robot, swing, swing_sole, support, pelvis)
        wanted = (1.0 - share) * posture.assigned_zmp + share * posture.fan[:2]
        pelvis[:2] += wanted - posture.center_of_mass[:2]
    return posture


def stance(robot: Robot, swing: Side, swing_sole: Array, support: Array, margin: float = MARGIN) -> Stance:
    swing_leg, support_leg, side = swing_and_support(robot, swing)
    return stance_of(swing_leg, support_leg, side, margin, tuple(swing_sole.tolist()), tuple(support.tolist()))


# ---------------------------------------------------------------------- moments


def moment_about(place: Array, force: float, at: Array) -> Array:
    """Return the horizontal moment (2,) of an upward force."""
    return np.cross(at - place, [0.0, 0.0, force])[:2]


def moments(placed: PinocchioRobot, posture: Postures, about: Array) -> Array:
    """Return the moment (2,) of every body's weight and of the thrust, each at its own place."""
    placed.place(posture.joint_positions)
    cos, sin = math.cos(posture.pelvis_yaw), math.sin(posture.pelvis_yaw)
    axes = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    total = moment_about(about, float(posture.thrust), posture.fan)
    for mass, place in placed.bodies():
        total += moment_about(about, -9.81 * mass, posture.pelvis + axes @ place)
    return total


@pytest.mark.parametrize("thrust_model", ["assigned", "least"])
@pytest.mark.parametrize("swing", SIDES)
def test_thrust_balances_moments_about_the_zmp(
    robot: Robot, pinocchio_robot: PinocchioRobot, rng: np.random.Generator, swing: Side, thrust_model: str
) -> None:
    batch = evaluate_postures(robot, swing, *random_steps(rng, swing), BalanceSettings(thrust_model=thrust_model))
    checked = np.flatnonzero((batch.out_of_reach == 0.0) & (batch.thrust > 0.0) & (batch.thrust < MAX_THRUST))
    assert len(checked) > 50
    for i in checked:
        posture = Postures(**{name: values[i] for name, values in vars(batch).items()})
        about = np.array([*posture.zmp, 0.0])
        np.testing.assert_allclose(moments(pinocchio_robot, posture, about), 0.0, atol=1e-9)


@pytest.mark.parametrize("swing", SIDES)
@pytest.mark.parametrize("share", [0.05, 0.2, 0.3])
def test_assigned_thrust_balances_moments_about_the_assigned_zmp(
    robot: Robot, pinocchio_robot: PinocchioRobot, rng: np.random.Generator, swing: Side, share: float
) -> None:
    for _ in range(10):
        swing_sole, support = random_feet(rng, swing)
        posture = with_com_on_the_line(robot, swing, 0.5 * (swing_sole + support), support, share)
        about = np.array([*posture.assigned_zmp, 0.0])
        assert posture.out_of_reach == 0.0
        assert posture.thrust == pytest.approx(share * WEIGHT, rel=1e-9)
        np.testing.assert_allclose(moments(pinocchio_robot, posture, about), 0.0, atol=1e-9)
        np.testing.assert_allclose(posture.zmp, posture.assigned_zmp, atol=1e-12)


def test_gravity_is_the_standard_one() -> None:
    assert GRAVITY == 9.81


# ---------------------------------------------------------------------- eqs (1) to (3)


@given(points, points, points)
def test_assigned_thrust_leaves_the_least_square_of_the_moments(com: Point, fan: Point, zmp: Point) -> None:
    """Eqs (1) and (2) are ``F (P_T - Z) = Mg (CoM - Z)``, two equations for one F."""
    column, right = np.subtract(fan, zmp)[:, None], WEIGHT * np.subtract(com, zmp)
    if np.linalg.norm(column) < 1e-3:
        return
    expected = np.linalg.lstsq(column, right, rcond=None)[0][0]
    assert assigned_thrust(WEIGHT, *com, fan, zmp) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@given(points, points, st.floats(0.0, 40.0))
def test_zmp_takes_up_all_moments(com: Point, fan: Point, thrust: float) -> None:
    expected = zmp_by_moments(np.array(com), np.array(fan), np.array(thrust))
    assert zmp_of(WEIGHT, *com, fan, thrust) == pytest.approx(expected, abs=1e-12)


@given(points, points)
def test_zmp_leaves_the_center_of_mass_away_from_the_fan(com: Point, fan: Point) -> None:
    away = np.subtract(com, fan)
    path = np.array([zmp_of(WEIGHT, *com, fan, thrust) for thrust in np.linspace(0.0, MAX_THRUST, 20)])
    np.testing.assert_allclose(path[0], com, atol=1e-15)
    steps = np.diff(path, axis=0)
    np.testing.assert_allclose(steps[:, 0] * away[1], steps[:, 1] * away[0], atol=1e-12)
    assert np.linalg.norm(away) < 1e-6 or (steps @ away > 0.0).all()


@pytest.mark.parametrize("share", [1.0 - 2e-9, 1.0 - 5e-10, 1.0, 1.0 + 5e-10, 1.0 + 2e-9])
def test_zmp_is_finite_even_where_the_fan_carries_all_weight(share: float) -> None:
    """Nothing presses on the ground, and no point of it balances; the ZMP is as far off as a billionth makes it."""
    com, fan = np.array([0.02, -0.01]), np.array([0.3, 0.1])
    ground = (1.0 - share) * WEIGHT if abs(1.0 - share) > 1e-9 else 1e-9 * WEIGHT
    expected = (WEIGHT * com - share * WEIGHT * fan) / ground
    assert zmp_of(WEIGHT, *com, tuple(fan), share * WEIGHT) == pytest.approx(expected, rel=1e-6)


# ---------------------------------------------------------------------- least thrust


def test_least_thrust_is_that_of_brute_force(rng: np.random.Generator) -> None:
    scan = np.linspace(0.0, MAX_THRUST, 23_001)
    low, high = shrunk(SOLE)
    found = np.zeros(3, dtype=int)
    for _ in range(1500):
        com = rng.uniform([-0.12, -0.12], [0.15, 0.12])
        fan = rng.uniform(-0.7, 0.7, 2)
        fan *= max(1.0, 0.2 / np.linalg.norm(fan))  # a fan stands beside the support foot
        zmp = zmp_by_moments(com, fan, scan)
        balanced = ((zmp >= low) & (zmp <= high)).all(axis=1)
        thrust = least_thrust(WEIGHT, *com, tuple(fan), SOLE, MARGIN)
        assert 0.0 <= thrust <= WEIGHT
        if balanced.any():
            first = int(np.argmax(balanced))
            assert scan[max(first - 1, 0)] - 1e-9 <= thrust <= scan[first] + 1e-9
        if thrust <= MAX_THRUST:
            reached = zmp_by_moments(com, fan, thrust)
            inside = ((reached >= low - 1e-12) & (reached <= high + 1e-12)).all()
            assert inside or not balanced.any()
        found += [balanced[0], balanced.any() and not balanced[0], not balanced.any()]
    assert (found > 100).all()  # already balanced, balanced by the fan, beyond help


@given(st.floats(-0.05, 0.08), st.floats(-0.03, 0.03), points)
def test_no_thrust_is_needed_inside_the_shrunk_support(com_x: float, com_y: float, fan: Point) -> None:
    assert least_thrust(WEIGHT, com_x, com_y, fan, SOLE, MARGIN) == 0.0


@given(st.floats(-0.05, 0.08), st.floats(-0.03, 0.03), st.floats(-math.pi, math.pi), st.floats(0.2, 0.8))
def test_a_center_of_mass_nearer_to_the_fan_never_needs_less_thrust(
    start_x: float, start_y: float, direction: float, distance: float
) -> None:
    start = np.array([start_x, start_y])
    fan = start + distance * np.array([math.cos(direction), math.sin(direction)])
    path = [start + share * (fan - start) for share in np.linspace(0.0, 0.99, 60)]
    least = [least_thrust(WEIGHT, *com, tuple(fan), SOLE, MARGIN) for com in path]
    assigned = [assigned_thrust(WEIGHT, *com, tuple(fan), tuple(start)) for com in path]
    assert least[0] == 0.0
    assert least[-1] > 0.0
    assert (np.diff(least) >= -1e-9).all()
    assert (np.diff(assigned) > 0.0).all()


@pytest.mark.parametrize(
    ("fan", "border"),
    [
        ((0.4, 0.0), (0.08, 0.0)),
        ((-0.4, 0.0), (-0.05, 0.0)),
        ((0.0, 0.4), (0.0, 0.03)),
        ((0.0, -0.4), (0.0, -0.03)),
    ],
)
def test_least_thrust_leads_the_zmp_back_to_the_border_on_the_side_of_the_fan(fan: Point, border: Point) -> None:
    com = 1.5 * np.array(border)
    thrust = least_thrust(WEIGHT, *com, fan, SOLE, MARGIN)
    np.testing.assert_allclose(zmp_by_moments(com, np.array(fan), np.array(thrust)), border, atol=1e-12)


@pytest.mark.parametrize("away", [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
@pytest.mark.parametrize("aside", [0.0, 0.01])
def test_no_thrust_helps_on_the_far_side_of_the_support(away: Point, aside: float) -> None:
    """The ZMP only moves away from the fan, here further off the sole."""
    com, fan = 0.15 * np.array(away) + aside * np.array(away[::-1]), -0.4 * np.array(away)
    assert least_thrust(WEIGHT, *com, tuple(fan), SOLE, MARGIN) == pytest.approx(WEIGHT)


@pytest.mark.parametrize("swing", SIDES)
def test_least_thrust_puts_the_zmp_on_the_border_of_the_shrunk_support(
    robot: Robot, rng: np.random.Generator, swing: Side
) -> None:
    swing_sole, support, pelvis = random_steps(rng, swing)
    batch = evaluate_postures(robot, swing, swing_sole, support, pelvis, BalanceSettings(thrust_model="least"))
    low, high = shrunk(SOLE)
    zmp = batch.zmp - support[:, :2]
    inside = np.minimum(zmp - low, high - zmp).min(axis=1)
    given = (batch.thrust > 0.0) & (batch.violations == 0)
    assert np.count_nonzero(given) > 20
    np.testing.assert_allclose(inside[given], 0.0, atol=1e-12)


# ---------------------------------------------------------------------- the assigned ZMP and eq. (4)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_stance_is_right_for_feet_whose_frames_are_anywhere(
    robot: Robot, rng: np.random.Generator, side: float
) -> None:
    """Jet-HR1's own ankles stand above the origins of its soles, and its fans right beside them."""
    margin = 0.01
    for _ in range(100):
        frames = [rng.uniform(-0.02, 0.02, 3) - [0.0, 0.0, 0.05] for _ in range(2)]
        swing_leg, support_leg = (robot.left._replace(sole=tuple(frame)) for frame in frames)
        swing_leg = swing_leg._replace(fan=tuple(rng.uniform(-0.08, 0.08, 3)))
        rectangle = rng.uniform([-0.1, 0.05, -0.09, 0.04], [-0.05, 0.12, -0.04, 0.07])
        support_leg = support_leg._replace(sole_rectangle=tuple(rectangle))
        support_sole = rng.uniform(-1.0, 1.0, 3)
        swing_sole = support_sole + rng.choice([-1.0, 1.0], 3) * rng.uniform(0.2, 0.5, 3)
        found = stance_of(swing_leg, support_leg, side, margin, tuple(swing_sole), tuple(support_sole))

        swing_ankle, support_ankle = swing_sole - frames[0], support_sole - frames[1]
        fan = (swing_ankle + swing_leg.fan)[:2]
        np.testing.assert_allclose(found.swing_ankle, swing_ankle, atol=1e-15)
        np.testing.assert_allclose(found.support_ankle, support_ankle, atol=1e-15)
        np.testing.assert_allclose(found.fan, fan, atol=1e-15)
        np.testing.assert_allclose(found.support, support_sole[[0, 0, 1, 1]] + rectangle, atol=1e-15)
        low, high = shrunk(found.support, margin)
        zmp = np.array(found.assigned_zmp)
        to_zmp, to_fan = zmp - support_ankle[:2], fan - support_ankle[:2]
        assert np.minimum(zmp - low, high - zmp).min() == pytest.approx(0.0, abs=1e-12)
        assert to_zmp[0] * to_fan[1] == pytest.approx(to_zmp[1] * to_fan[0], abs=1e-12)
        assert to_zmp @ to_fan > 0.0
        hip_line = side * np.array([-found.sin_yaw, found.cos_yaw])  # from the support hip to the other
        np.testing.assert_allclose(hip_line, (fan - zmp) / np.linalg.norm(fan - zmp), atol=1e-12)


@pytest.mark.parametrize("margin", [0.0, 0.01, 0.02, 0.04])
@pytest.mark.parametrize("swing", SIDES)
def test_the_assigned_zmp_is_where_the_ray_to_the_fan_leaves_the_shrunk_support(
    robot: Robot, rng: np.random.Generator, swing: Side, margin: float
) -> None:
    low, high = shrunk(SOLE, margin)
    for _ in range(100):
        swing_sole, support = random_feet(rng, swing)
        found = stance(robot, swing, swing_sole, support, margin)
        zmp, fan = np.subtract(found.assigned_zmp, support[:2]), np.subtract(found.fan, support[:2])
        assert np.minimum(zmp - low, high - zmp).min() == pytest.approx(0.0, abs=1e-12)
        assert zmp[0] * fan[1] == pytest.approx(zmp[1] * fan[0], abs=1e-12)
        assert zmp @ fan > 0.0


@pytest.mark.parametrize(("swing", "outward"), [("left", 1.0), ("right", -1.0)])
def test_the_assigned_zmp_is_80_mm_ahead_of_the_ankle_with_the_fan_straight_ahead(
    robot: Robot, swing: Side, outward: float
) -> None:
    support = np.array([0.3, 0.2, 0.0])
    swing_sole = support + np.array([0.5, -outward * 0.06, 0.0])
    assert stance(robot, swing, swing_sole, support).assigned_zmp == pytest.approx([0.38, 0.2], abs=1e-12)


def test_the_assigned_zmp_is_30_mm_beside_the_ankle_with_the_fan_straight_aside(robot: Robot) -> None:
    found = stance(robot, "left", np.array([0.0, 0.3, 0.0]), np.array([0.0, 0.0, 0.0]))
    assert found.assigned_zmp == pytest.approx([0.0, 0.03], abs=1e-12)


@pytest.mark.parametrize(("swing", "quarter"), [("left", -90.0), ("right", 90.0)])
def test_the_pelvis_turns_the_hip_line_along_the_line_to_the_fan(
    robot: Robot, rng: np.random.Generator, swing: Side, quarter: float
) -> None:
    batch = evaluate_postures(robot, swing, *random_steps(rng, swing))
    line = batch.fan[:, :2] - batch.assigned_zmp
    expected = np.arctan2(line[:, 1], line[:, 0]) + math.radians(quarter)
    np.testing.assert_allclose(np.exp(1j * batch.pelvis_yaw), np.exp(1j * expected), atol=1e-12)
    assert np.abs(batch.pelvis_yaw).max() < math.pi / 2.0  # never facing backwards in an ordinary step


@pytest.mark.parametrize(("swing", "outward"), [("left", 1.0), ("right", -1.0)])
def test_the_pelvis_does_not_turn_with_feet_side_by_side(robot: Robot, swing: Side, outward: float) -> None:
    posture = evaluate_postures(robot, swing, [0.0, outward * 0.225, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.4])
    assert posture.pelvis_yaw == pytest.approx(0.0, abs=1e-12)


# ---------------------------------------------------------------------- eq. (10)


def turn_by_angles(found: Stance, com: Array) -> float:
    """Return theta_ZC - theta_CA of eq. (10) from two directions, within half a turn."""
    first, second = com - found.assigned_zmp, np.array(found.swing_ankle[:2]) - com
    difference = math.atan2(first[1], first[0]) - math.atan2(second[1], second[0])
    return (difference + math.pi) % (2.0 * math.pi) - math.pi


@pytest.mark.parametrize("swing", SIDES)
@pytest.mark.parametrize("tolerance", [1.0, 5.0, 30.0, 89.0])
def test_the_edge_polygon_bounds_the_turn_between_two_lines(
    robot: Robot, rng: np.random.Generator, swing: Side, tolerance: float
) -> None:
    slope, agreed = math.tan(math.radians(tolerance)), set()
    for _ in range(300):
        found = stance(robot, swing, *random_feet(rng, swing))
        ankle, zmp = np.array(found.swing_ankle[:2]), np.array(found.assigned_zmp)
        com = zmp + rng.uniform(-0.5, 1.5) * (ankle - zmp) + rng.normal(0.0, 0.02, 2)
        holds = within_edge_polygon(slope, *edge_vectors(found, *com))
        assert holds == (abs(turn_by_angles(found, com)) <= math.radians(tolerance))
        agreed.add(holds)
    assert agreed == {True, False}


def test_the_edge_angle_is_the_turn_between_the_two_lines(robot: Robot, rng: np.random.Generator) -> None:
    swing_sole, support = random_feet(rng, "left")
    found = stance(robot, "left", swing_sole, support)
    pelvis = support + rng.normal(0.0, 0.2, (300, 3)) + [0.0, 0.0, 0.4]
    postures = evaluate_postures(robot, "left", swing_sole, support, pelvis)
    expected = [turn_by_angles(found, com) for com in postures.center_of_mass[:, :2]]
    np.testing.assert_allclose(np.abs(postures.edge_angle), np.abs(expected), atol=1e-9)
    assert np.abs(expected).max() > math.pi / 2.0


def test_the_edge_angle_wraps(robot: Robot) -> None:
    """Lines that point to 179 and -179 degrees are 2 degrees apart."""
    found = stance(robot, "right", np.array([-0.6, 0.0, 0.0]), np.zeros(3))
    ankle, zmp = np.array(found.swing_ankle[:2]), np.array(found.assigned_zmp)
    middle = 0.5 * (ankle + zmp)
    first = math.radians(-179.0)
    com = zmp + (middle[0] - zmp[0]) / math.cos(first) * np.array([math.cos(first), math.sin(first)])
    directions = [com - zmp, ankle - com]
    angles = [math.degrees(math.atan2(line[1], line[0])) for line in directions]
    assert abs(angles[0] - angles[1]) > 180.0
    assert within_edge_polygon(math.tan(math.radians(5.0)), *edge_vectors(found, *com))


@given(st.floats(-1e-9, 1e-9))
def test_the_edge_polygon_holds_with_the_center_of_mass_at_the_assigned_zmp(offset: float) -> None:
    found = Stance(1.0, 0.0, (0.1, 0.3, 0.0), (0.0, 0.0, 0.0), (0.1, 0.4), (0.02, 0.03), SOLE)
    sine, cosine, length_squared = edge_vectors(found, 0.02, 0.03 - 0.5 * offset)
    assert within_edge_polygon(1e-6, sine, cosine, length_squared)


def test_no_center_of_mass_beside_the_assigned_zmp_is_excused() -> None:
    found = Stance(1.0, 0.0, (0.1, 0.3, 0.0), (0.0, 0.0, 0.0), (0.1, 0.4), (0.02, 0.03), SOLE)
    assert not within_edge_polygon(math.tan(math.radians(5.0)), *edge_vectors(found, 0.02 + 1e-6, 0.03))


@pytest.mark.parametrize("point", ["assigned ZMP", "swing ankle"])
def test_the_edge_polygon_reaches_from_the_assigned_zmp_to_the_swing_ankle(point: str) -> None:
    """At either end one of the two lines has no length, and the angle between them is none."""
    found = Stance(1.0, 0.0, (0.1, 0.3, 0.0), (0.0, 0.0, 0.0), (0.1, 0.4), (0.02, 0.03), SOLE)
    com = found.assigned_zmp if point == "assigned ZMP" else found.swing_ankle[:2]
    assert within_edge_polygon(1e-6, *edge_vectors(found, *com))


def outside(found: Stance, slope: float, com: Array) -> float:
    """Return how far a centre of mass is outside of the edge polygon [m]."""
    sine, cosine, _ = edge_vectors(found, *com)
    return outside_edge_polygon(found, slope, sine, cosine)


def standing(rng: np.random.Generator) -> tuple[Stance, Array, Array]:
    """Return a stance with a line from assigned ZMP to swing ankle in any direction, and that line."""
    ankle, zmp = rng.uniform(-1.0, 1.0, 3), rng.uniform(-1.0, 1.0, 2)
    return Stance(1.0, 0.0, tuple(ankle), (0.0, 0.0, 0.0), (0.1, 0.4), tuple(zmp), SOLE), zmp, ankle[:2] - zmp


@pytest.mark.parametrize("tolerance", [1.0, 5.0, 30.0])
def test_outside_of_the_edge_polygon_is_where_eq_10_does_not_hold(
    rng: np.random.Generator, tolerance: float
) -> None:
    slope, agreed = math.tan(math.radians(tolerance)), set()
    for _ in range(300):
        found, zmp, line = standing(rng)
        com = zmp + rng.uniform(-0.5, 1.5) * line + rng.normal(0.0, 0.1, 2) * np.linalg.norm(line)
        holds = within_edge_polygon(slope, *edge_vectors(found, *com))
        assert holds == (outside(found, slope, com) <= 0.0)
        agreed.add(holds)
    assert agreed == {True, False}


@pytest.mark.parametrize("slope", [0.0, 0.1])
def test_beside_the_line_the_edge_polygon_is_as_far_as_the_line_less_the_tolerance(
    rng: np.random.Generator, slope: float
) -> None:
    """Over the line, the polygon is as wide as its slope times the product of what is before and behind."""
    for _ in range(100):
        found, zmp, line = standing(rng)
        length, share, aside = np.linalg.norm(line), rng.uniform(0.2, 0.8), rng.uniform(-0.1, 0.1)
        com = zmp + share * line + aside * np.array([-line[1], line[0]])
        width = slope * (share * (1.0 - share) - aside**2) * length
        assert outside(found, slope, com) == pytest.approx(abs(aside) * length - width, abs=1e-12)


@pytest.mark.parametrize("slope", [0.0, 0.1])
def test_beyond_the_ends_of_the_line_the_edge_polygon_is_further_the_further_one_is(
    rng: np.random.Generator, slope: float
) -> None:
    """Near an end it is as far as that end; no tolerance widens it there."""
    for _ in range(100):
        found, zmp, line = standing(rng)
        beyond = rng.uniform(0.01, 0.5)
        behind, ahead = zmp - beyond * line, zmp + (1.0 + beyond) * line
        expected = beyond * (1.0 + beyond) * np.linalg.norm(line)
        assert [outside(found, slope, com) for com in (behind, ahead)] == pytest.approx([expected] * 2, abs=1e-12)


def test_the_edge_polygon_of_an_ankle_at_the_assigned_zmp_is_that_point() -> None:
    found = Stance(1.0, 0.0, (0.02, 0.03, 0.0), (0.0, 0.0, 0.0), (0.1, 0.4), (0.02, 0.03), SOLE)
    assert outside(found, 0.1, np.array([0.02, 0.03])) == 0.0
    near, far = (outside(found, 0.1, np.array([0.02, 0.03 + away])) for away in (0.001, 0.1))
    assert 0.0 < near < far < math.inf


# ---------------------------------------------------------------------- eq. (11)


@pytest.mark.parametrize(
    ("zmp", "inside"),
    [
        ((0.0, 0.0), True),
        ((0.10, 0.05), True),
        ((-0.07, -0.05), True),
        ((0.1001, 0.0), False),
        ((-0.0701, 0.0), False),
        ((0.0, 0.0501), False),
        ((0.0, -0.0501), False),
    ],
)
def test_the_zmp_must_lie_on_the_sole(zmp: Point, inside: bool) -> None:
    assert within_support(zmp, SOLE) == inside


# ---------------------------------------------------------------------- settings


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("thrust_model", "most", "thrust_model must be 'assigned' or 'least', not 'most'"),
        ("zmp_margin", -0.01, r"zmp_margin must be a distance of 0 m or more, not -0\.01"),
        ("zmp_margin", math.nan, "zmp_margin must be a distance"),
        ("zmp_margin", math.inf, "zmp_margin must be a distance"),
        ("edge_tolerance", 0.0, r"edge_tolerance must lie between 0 and pi/2 rad, not 0\.0"),
        ("edge_tolerance", -0.1, r"edge_tolerance must lie between 0 and pi/2 rad, not -0\.1"),
        ("edge_tolerance", 5.0, r"edge_tolerance must lie between 0 and pi/2 rad, not 5\.0"),
        ("edge_tolerance", math.pi / 2.0, r"edge_tolerance must lie between 0 and pi/2 rad, not 1\.57"),
        ("edge_tolerance", math.nan, "edge_tolerance must lie"),
        ("max_thrust", -1.0, r"max_thrust must be 0 N or more, not -1\.0"),
        ("max_thrust", math.inf, "max_thrust must be 0 N or more, not inf"),
    ],
)
def test_settings_out_of_range_are_refused(name: str, value: object, message: str) -> None:
    with pytest.raises(SettingsError, match=message):
        BalanceSettings(**{name: value})


@pytest.mark.parametrize(
    ("name", "value"),
    [("zmp_margin", 0.0), ("edge_tolerance", 1e-9), ("edge_tolerance", 1.57), ("max_thrust", 0.0)],
)
def test_settings_at_the_ends_of_their_range_are_accepted(name: str, value: float) -> None:
    assert getattr(BalanceSettings(**{name: value}), name) == value


def test_settings_stay_what_they_are() -> None:
    with pytest.raises(FrozenInstanceError):
        BalanceSettings().zmp_margin = 0.03


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(
    ("ankle", "room"), [((0.06, 0.0), 0.04), ((-0.05, 0.01), 0.02), ((0.03, 0.03), 0.03), ((0.03, -0.035), 0.015)]
)
def test_the_margin_leaves_the_ankle_wherever_it_stands_over_the_sole(
    robot: Robot, side: Side, ankle: Point, room: float
) -> None:
    leg = robot.leg(side)._replace(sole=(-ankle[0], -ankle[1], -0.06), sole_rectangle=(-0.07, 0.10, -0.05, 0.06))
    robot = replace(robot, **{side: leg})
    assert BalanceSettings(zmp_margin=room - 1e-9).parameters(robot).zmp_margin == room - 1e-9
    with pytest.raises(SettingsError, match=f"which is {room:.3g} m from the edge of the sole"):
        BalanceSettings(zmp_margin=room + 1e-9).parameters(robot)


def test_a_margin_that_leaves_no_sole_around_the_ankle_is_refused(robot: Robot) -> None:
    with pytest.raises(SettingsError, match=r"zmp_margin of 0\.05 m leaves no support around the ankle"):
        BalanceSettings(zmp_margin=0.05).parameters(robot)
    assert BalanceSettings(zmp_margin=0.0499).parameters(robot).zmp_margin == 0.0499


def test_the_defaults_are_those_of_the_paper_and_the_robot(robot: Robot) -> None:
    parameters = BalanceSettings().parameters(robot)
    assert not parameters.least_thrust
    assert parameters.zmp_margin == 0.02
    assert parameters.edge_slope == pytest.approx(math.tan(math.radians(5.0)))
    assert parameters.max_thrust == 23.0
    assert parameters.weight == pytest.approx(WEIGHT)
    assert BalanceSettings(max_thrust=10.0).parameters(robot).max_thrust == 10.0


def test_a_settings_error_is_a_value_error() -> None:
    assert issubclass(SettingsError, ValueError)
