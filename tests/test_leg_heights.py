"""Heights of the hip that the legs allow, against inverse kinematics."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from jet_gym.kinematics import inverse_kinematics
from jet_gym.leg import Side
from jet_gym.leg_heights import hip_heights
from jet_gym.robot import jet_hr1
from jet_gym.utils.arrays import Array

ROBOT = jet_hr1()


def excess(side: Side, dx: float, dy: float, height: float) -> Array:
    """Return how far each joint of a leg is beyond its limits [rad]; NaN where the ankle is out of reach."""
    leg = ROBOT.left if side == "left" else ROBOT.right
    sole = np.array(leg.hip) - (dx, dy, height) + leg.sole
    angles, out_of_reach = inverse_kinematics(ROBOT, side, sole)
    beyond = np.maximum(np.array(leg.lower) - angles, angles - np.array(leg.upper))
    return np.full(6, np.nan) if out_of_reach > 0.0 else beyond


places = st.floats(-0.39, 0.39)
sides = st.sampled_from(("left", "right"))


@given(sides, places, places, st.floats(0.0, 1.0))
def test_between_the_heights_every_limit_is_kept(side: Side, dx: float, dy: float, share: float) -> None:
    leg = ROBOT.left if side == "left" else ROBOT.right
    low, high = hip_heights(leg, dx, dy)
    assume(low < high)
    beyond = excess(side, dx, dy, low + share * (high - low))
    assert beyond.max() <= 0.0


@given(sides, places, places)
def test_beyond_the_heights_a_limit_is_broken(side: Side, dx: float, dy: float) -> None:
    """Above the highest the ankle is out of reach, or the thigh leans back too far; below the lowest a joint is."""
    leg = ROBOT.left if side == "left" else ROBOT.right
    low, high = hip_heights(leg, dx, dy)
    assume(low + 1e-3 < high)
    above = excess(side, dx, dy, high + 1e-4)
    assert np.isnan(above).all() or above[2] > 0.0
    assume(low > 1e-3)
    assert excess(side, dx, dy, low - 1e-3).max() > 0.0


def test_a_leg_below_its_hip_stands_from_folded_to_straight() -> None:
    low, high = hip_heights(ROBOT.left, 0.0, 0.0)
    assert high == pytest.approx(-ROBOT.left.thigh[2] - ROBOT.left.shank[2], abs=1e-4)
    assert 0.0 < low < 0.5 * high


def test_nothing_is_left_beyond_the_leg() -> None:
    low, high = hip_heights(ROBOT.left, 0.41, 0.0)
    assert low > high
