"""What trials say: success rates, the guilty disturbance, and the picture of both."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from made_up_trials import made_up

from jet_gym.figures.robustness import plot_robustness
from jet_gym.simulation import DisturbanceRanges
from jet_gym.simulation.execution import CONTROL_NAMES, ThrustControl
from jet_gym.simulation.limits import (
    FACTORS,
    Limit,
)
from jet_gym.simulation.robustness import associations, causes, quantities, success_rate

pytest.importorskip("pybullet")


class TestAnalysis:
    def test_intervals_are_wilsons(self):
        rate = success_rate([made_up(k, k >= 5) for k in range(100)], "pid")
        z, share, number = 1.959964, 0.95, 100
        middle = (share + z**2 / (2 * number)) / (1 + z**2 / number)
        half = z / (1 + z**2 / number) * math.sqrt(share * (1 - share) / number + z**2 / (4 * number**2))
        assert (rate.rate, rate.low, rate.high) == pytest.approx((0.95, middle - half, middle + half), abs=1e-5)

    def test_the_guilty_disturbance_is_found(self, rng):
        lags, frictions = rng.uniform(0.05, 0.3, 200), rng.uniform(0.4, 1.0, 200)
        drawn = [
            made_up(k, bool(lag < 0.2 or rng.uniform() < 0.2), fan_lag=lag, friction=friction)
            for k, (lag, friction) in enumerate(zip(lags, frictions, strict=True))
        ]
        first, *others = associations(drawn, "pid")
        assert first.quantity == "fan lag"
        assert first.probability > 0.8
        assert first.p_value < 1e-6
        assert min(other.p_value for other in others) > 1e-3
        assert causes(drawn, "pid")["left foot"] == sum(not trial.success for trial in drawn)

    def test_without_failures_nothing_is_said(self):
        assert associations([made_up(k, True) for k in range(10)], "pid") == []
        with pytest.raises(ValueError, match="no trial with feedforward"):
            success_rate([made_up(0, True)], "feedforward")

    def test_quantities_are_numbers(self):
        numbers = quantities(DisturbanceRanges().draw(np.random.default_rng(0), 20.0, 2))
        assert all(math.isfinite(value) for value in numbers.values())
        assert {"block height 1", "block height 2", "largest push", "thrust gain"} <= set(numbers)


class TestPicture:
    def test_marks_say_what_breaks_the_course_and_what_does_not(self, rng):
        lags, frictions = rng.uniform(0.05, 0.3, 80), rng.uniform(0.4, 1.0, 80)
        trials = [
            made_up(k, bool(lag < 0.2), fan_lag=lag, friction=friction)
            for k, (lag, friction) in enumerate(zip(lags, frictions, strict=True))
        ]
        limits = [
            Limit("fan lag", "high", "pid", 1.5, "0.45 s", "left foot", "it fell"),
            Limit("friction", "low", "pid", None, "0.08", "", ""),
        ]
        rates, telling, ends = plot_robustness(trials, ("pid",), limits).axes
        (bar,) = rates.patches
        assert bar.get_height() == pytest.approx(100.0 * (lags < 0.2).mean())
        filled = [
            mark for mark in telling.lines if mark.get_marker() == "o" and mark.get_markerfacecolor() != "white"
        ]
        assert [mark.get_xdata()[0] for mark in filled] == [100.0]
        names = [label.get_text() for label in telling.get_yticklabels()]
        assert names[round(float(filled[0].get_ydata()[0]))] == "fan lag"
        rows = [label.get_text() for label in ends.get_yticklabels()]
        marks = {
            rows[round(float(mark.get_ydata()[0]))]: (mark.get_marker(), mark.get_xdata()[0])
            for mark in ends.lines
            if mark.get_marker() in ("x", ">")
        }
        assert marks == {"fan lag, high": ("x", 1.5), "friction, low": (">", FACTORS[-1])}

    def test_without_failures_and_limits_the_rate_stands_alone(self):
        (rates,) = plot_robustness([made_up(k, True) for k in range(5)], ("pid",)).axes
        assert rates.patches[0].get_height() == 100.0

    def test_ways_to_control_the_thrust_have_their_names_and_do_not_overlap(self):
        controls = get_args(ThrustControl)
        trials = [replace(made_up(k, True), control=control) for k in range(5) for control in controls]
        limits = [Limit("fan lag", "high", control, 1.5, "0.45 s", "left foot", "it fell") for control in controls]
        figure = plot_robustness(trials, controls, limits)
        figure.draw_without_rendering()
        labels = figure.axes[0].get_xticklabels()
        assert [label.get_text().replace("\n", " ") for label in labels] == list(CONTROL_NAMES.values())
        assert tuple(CONTROL_NAMES) == controls
        left, right = (label.get_window_extent() for label in labels)
        assert left.x1 < right.x0
