"""The edge polygon in coordinates of its own, held against eq. (10) itself."""

from __future__ import annotations

import math

import numpy as np
import pytest

from jet_gym import jet_hr1
from jet_gym.balance import Stance, edge_vectors, stance_of, within_edge_polygon
from jet_gym.edge_polygon import along_and_aside, edge_axis, half_width, point_in_world

SLOPE = math.tan(math.radians(5.0))


@pytest.fixture(scope="module")
def stance() -> Stance:
    """A swing point ahead and to the left of the support foot."""
    robot = jet_hr1()
    return stance_of(robot.left, robot.right, 1.0, 0.02, (0.3, 0.2, 0.05), (0.0, -0.1125, 0.0))


def test_the_axis_leads_from_the_assigned_zmp_to_the_swing_ankle(stance: Stance) -> None:
    axis = edge_axis(stance)
    np.testing.assert_allclose(point_in_world(axis, 0.0, 0.0), stance.assigned_zmp, atol=1e-15)
    np.testing.assert_allclose(point_in_world(axis, axis.length, 0.0), stance.swing_ankle[:2], atol=1e-15)


def test_left_of_the_axis_is_positive(stance: Stance) -> None:
    axis = edge_axis(stance)
    left = (axis.tip[0] - axis.y, axis.tip[1] + axis.x)
    assert along_and_aside(axis, *left) == pytest.approx((0.0, 1.0), abs=1e-12)


def test_places_lead_there_and_back(stance: Stance) -> None:
    axis = edge_axis(stance)
    for along, aside in np.random.default_rng(0).uniform(-0.5, 0.5, (20, 2)):
        x, y = point_in_world(axis, along, aside)
        assert along_and_aside(axis, x, y) == pytest.approx((along, aside), abs=1e-14)


def test_half_the_width_is_where_the_angle_of_eq_10_reaches_rho(stance: Stance) -> None:
    axis = edge_axis(stance)
    for share in (0.01, 0.1, 0.3, 0.5, 0.8, 0.99):
        along = share * axis.length
        width = half_width(SLOPE, axis, along)
        for sign in (1.0, -1.0):
            for times, inside in ((0.98, True), (1.0 + 1e-6, False)):
                com = point_in_world(axis, along, sign * times * width)
                assert within_edge_polygon(SLOPE, *edge_vectors(stance, *com)) is inside


def test_a_swing_ankle_at_the_assigned_zmp_makes_no_infinity(stance: Stance) -> None:
    axis = edge_axis(stance._replace(swing_ankle=(*stance.assigned_zmp, 0.0)))
    assert (axis.x, axis.y) == (0.0, 0.0)
    assert axis.length > 0.0
