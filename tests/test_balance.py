"""Weight and thrust balance about the zero-moment point, eqs (1) to (3), which must lie on the sole, eq. (11)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from standing import (
    MAX_THRUST,
    SOLE,
    WEIGHT,
    points,
    random_feet,
    random_steps,
    zmp_by_moments,
)

from jet_gym.balance import (
    GRAVITY,
    BalanceSettings,
    Point,
    assigned_thrust,
    within_support,
    zmp_of,
)
from jet_gym.leg import SIDES, Side
from jet_gym.posture import Postures, evaluate_postures
from jet_gym.robot import Robot
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from conftest import PinocchioRobot


def with_com_on_the_line(robot: Robot, swing: Side, swing_sole: Array, support: Array, share: float) -> Postures:
    """Return a posture with the centre of mass on the line from the assigned ZMP to the fan."""
    pelvis = support + np.array([0.0, 0.0, 0.35])
    for _ in range(60):
        posture = evaluate_postures(robot, swing, swing_sole, support, pelvis)
        wanted = (1.0 - share) * posture.assigned_zmp + share * posture.fan[:2]
        pelvis[:2] += wanted - posture.center_of_mass[:2]
    return posture


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
