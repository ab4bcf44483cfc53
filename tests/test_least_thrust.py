"""The least thrust with which the zero-moment point lies inside the support, against brute force."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from standing import (
    MARGIN,
    MAX_THRUST,
    SOLE,
    WEIGHT,
    points,
    random_steps,
    shrunk,
    zmp_by_moments,
)

from jet_gym.balance import (
    BalanceSettings,
    Point,
    assigned_thrust,
    least_thrust,
)
from jet_gym.leg import SIDES, Side
from jet_gym.posture import evaluate_postures
from jet_gym.robot import Robot

if TYPE_CHECKING:
    pass


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
