"""Where the ZMP is inside the soles, and where the ZMP of two feet is."""

from __future__ import annotations

import math

import numpy as np
import pytest

from jet_gym.ground import edge_distances, rectangle_margin
from jet_gym.leg import SIDES, Side
from jet_gym.robot import jet_hr1
from jet_gym.simulation.body import Pose
from jet_gym.simulation.rotation import cross, from_yaw
from jet_gym.simulation.support import nearest_edge, support_margin, zmp_of_feet

UPRIGHT = from_yaw(0.0)


@pytest.mark.parametrize("side", SIDES)
def test_margin_to_the_rectangle_is_that_to_the_hull_of_its_corners(side: Side, rng: np.random.Generator) -> None:
    leg, position = jet_hr1().leg(side), np.array([0.3, -0.2, 0.1])
    points = rng.uniform(-0.2, 0.2, (50, 2))
    margins = rectangle_margin(leg, points)
    assert (margins > 0.0).any()
    assert (margins < 0.0).any()
    hull = [support_margin(point + position[:2], [(leg, Pose(position, UPRIGHT))]) for point in points]
    np.testing.assert_allclose(margins, hull, atol=1e-12)
    np.testing.assert_array_equal(margins, [rectangle_margin(leg, point) for point in points])


@pytest.mark.parametrize("side", SIDES)
def test_opposite_edges_are_a_sole_apart_everywhere(side: Side, rng: np.random.Generator) -> None:
    leg = jet_hr1().leg(side)
    x_min, x_max, y_min, y_max = leg.sole_rectangle
    rear, front, right, left = edge_distances(leg, rng.uniform(-1.0, 1.0, (20, 2)))
    np.testing.assert_allclose(rear + front, x_max - x_min)
    np.testing.assert_allclose(right + left, y_max - y_min)


def test_nearest_edge_is_named_for_the_leg() -> None:
    robot, position = jet_hr1(), np.array([1.0, 2.0, 0.0])
    for side, toward_other in (("left", -1.0), ("right", 1.0)):
        x_min, x_max, y_min, y_max = robot.leg(side).sole_rectangle
        middle = np.array([0.5 * (x_min + x_max), 0.5 * (y_min + y_max)]) + position[:2]
        half = 0.5 * np.array([x_max - x_min, y_max - y_min])
        for edge, away in (
            ("front", (1.0, 0.0)),
            ("rear", (-1.0, 0.0)),
            ("inner", (0.0, toward_other)),
            ("outer", (0.0, -toward_other)),
        ):
            assert nearest_edge(middle + 0.99 * half * away, robot, side, position) == edge


def test_loads_balance_about_the_zmp_of_the_feet(rng: np.random.Generator) -> None:
    for _ in range(20):
        forces, centers = rng.uniform(0.1, 80.0, 2), rng.normal(size=(2, 2))
        np.testing.assert_allclose(forces @ (centers - zmp_of_feet(forces, centers)), 0.0, atol=1e-12)


def test_foot_that_is_not_pushed_up_does_not_move_the_zmp() -> None:
    centers = np.array([[0.1, 0.2], [0.5, -0.3]])
    for unloaded in (0.0, -2.0):
        np.testing.assert_array_equal(zmp_of_feet(np.array([40.0, unloaded]), centers), centers[0])
    np.testing.assert_array_equal(
        zmp_of_feet(np.array([0.0, 40.0]), np.array([[math.nan, math.nan], [0.5, -0.3]])), [0.5, -0.3]
    )
    assert np.isnan(zmp_of_feet(np.zeros(2), centers)).all()


def test_cross_product_is_that_of_numpy(rng: np.random.Generator) -> None:
    for _ in range(20):
        a, b = rng.normal(size=(2, 3))
        np.testing.assert_allclose(cross(a.tolist(), b.tolist()), np.cross(a, b), rtol=1e-15, atol=1e-15)
