"""Sine, cosine and arctangent against the standard library's."""

from __future__ import annotations

import math

import numpy as np
import pytest

from jet_gym.trigonometry import arctangent, sine_cosine
from jet_gym.utils.compilation import entry_point

ULP = 2.0**-53


@entry_point
def _sines_cosines(angles: np.ndarray, result: np.ndarray) -> None:
    for i in range(len(angles)):
        result[0, i], result[1, i] = sine_cosine(angles[i])


def test_sine_and_cosine_are_right_to_the_last_places() -> None:
    angles = np.concatenate([np.linspace(-math.pi, math.pi, 100_001), [1e-12, -1e-300]])
    result = np.empty((2, len(angles)))
    _sines_cosines(angles, result)
    assert np.abs(result[0] - np.sin(angles)).max() < 8.0 * ULP
    assert np.abs(result[1] - np.cos(angles)).max() < 8.0 * ULP
    assert sine_cosine(0.0) == (0.0, 1.0)


def test_arctangent_is_right_to_the_last_places_in_every_direction_and_length() -> None:
    angles = np.concatenate([np.linspace(-math.pi, math.pi, 20_001)[1:], np.geomspace(1e-15, 1.0, 50)])
    for length in (1e-9, 1.0, 3e5):
        for y, x in zip(length * np.sin(angles), length * np.cos(angles), strict=True):
            expected = math.atan2(y, x)
            assert abs(arctangent(y, x) - expected) <= 6.0 * ULP * max(abs(expected), ULP)


@pytest.mark.parametrize(
    ("y", "x"), [(0.0, 1.0), (1.0, 0.0), (-1.0, 0.0), (0.0, -1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)]
)
def test_arctangent_of_axes_and_diagonals(y: float, x: float) -> None:
    assert arctangent(y, x) == pytest.approx(math.atan2(y, x), rel=4.0 * ULP)


def test_arctangent_of_nothing_is_zero() -> None:
    assert arctangent(0.0, 0.0) == 0.0
