"""Eqs (15) to (22)."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from jet_gym.constraints import EDGE_POLYGON, JOINT_LIMITS, REACH, SEARCH_RANGE, THRUST, ZMP
from jet_gym.errors import SettingsError
from jet_gym.fitness import FitnessSettings, fitness_of_postures

STILL = np.zeros((1, 3))


def terms(violations: int, thrust: float) -> list[float]:
    """Return f1 to f4 of one posture, the first of its trajectory."""
    return fitness_of_postures([violations], [thrust], STILL)[0].tolist()


@given(st.floats(0.0, 23.0))
def test_a_good_posture_costs_ten_a_newton(thrust: float) -> None:
    assert terms(0, thrust) == pytest.approx([0.0, 0.0, 0.0, 10.0 * thrust], abs=1e-12)


@pytest.mark.parametrize(
    ("violations", "expected"),
    [
        (JOINT_LIMITS, [11000.0, 0.0, 0.0, 70.0]),
        (EDGE_POLYGON, [0.0, 9000.0, 0.0, 70.0]),
        (THRUST, [0.0, 0.0, 0.0, 5000.0]),
        (JOINT_LIMITS | EDGE_POLYGON, [11000.0, 9000.0, 0.0, 70.0]),
        (REACH | JOINT_LIMITS | EDGE_POLYGON | THRUST | ZMP, [11000.0, 9000.0, 0.0, 5000.0]),
        (ZMP, [0.0, 0.0, 0.0, 70.0]),  # eqs (15) to (22) know no penalty for eq. (11)
        (SEARCH_RANGE, [0.0, 0.0, 0.0, 70.0]),  # nor for eq. (13)
    ],
)
def test_penalties_are_those_of_the_paper(violations: int, expected: list[float]) -> None:
    assert terms(violations, 7.0) == expected


def test_thrust_out_of_range_costs_its_penalty_and_nothing_else() -> None:
    assert terms(THRUST, -50.0) == terms(THRUST, 1e6) == [0.0, 0.0, 0.0, 5000.0]


def test_the_pelvis_pays_for_the_square_of_its_moves_but_not_for_the_first_point() -> None:
    path = [[0.0, 0.0, 0.4], [0.01, 0.0, 0.4], [0.01, 0.02, 0.4], [0.01, 0.02, 0.37], [0.02, 0.03, 0.38]]
    found = fitness_of_postures(np.zeros(5, int), np.zeros(5), path)
    # 50 per square centimetre and axis: moves of 0, 1, 2, 3 and (1, 1, 1) cm.
    np.testing.assert_allclose(found[:, 2], [0.0, 50.0, 200.0, 450.0, 150.0], rtol=1e-9)
    assert not found[:, [0, 1, 3]].any()


def test_smoothness_weight_is_per_square_metre() -> None:
    path, none = [[0.0, 0.0, 0.0], [0.1, 0.2, 0.3]], np.zeros(2)
    found = fitness_of_postures(none.astype(int), none, path, FitnessSettings(smoothness_weight=100.0))
    assert found[1, 2] == pytest.approx(100.0 * (0.01 + 0.04 + 0.09))


def test_settings_replace_the_numbers_of_the_paper() -> None:
    settings = FitnessSettings(0.0, 1.0, 2.0, 4.0, 8.0)
    path = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
    found = fitness_of_postures([JOINT_LIMITS | EDGE_POLYGON, THRUST], [0.5, 0.5], path, settings)
    np.testing.assert_array_equal(found, [[1.0, 2.0, 0.0, 4.0], [0.0, 0.0, 0.0, 4.0]])


@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
@pytest.mark.parametrize(
    "name", ["smoothness_weight", "joint_limit_penalty", "edge_penalty", "thrust_penalty", "thrust_weight"]
)
def test_settings_out_of_range_are_refused(name: str, value: float) -> None:
    with pytest.raises(SettingsError, match=f"{name} must be a finite number of 0 or more, not {value}"):
        FitnessSettings(**{name: value})


def test_settings_stay_what_they_are() -> None:
    with pytest.raises(FrozenInstanceError):
        FitnessSettings().thrust_weight = 0.0
