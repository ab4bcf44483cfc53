"""The edge polygon, eq. (10): where the centre of mass may be, and how far outside it is."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from standing import (
    SOLE,
    random_feet,
    stance,
)

from jet_gym.balance import (
    Stance,
    edge_vectors,
    outside_edge_polygon,
    within_edge_polygon,
)
from jet_gym.leg import SIDES, Side
from jet_gym.posture import evaluate_postures
from jet_gym.robot import Robot
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    pass


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
