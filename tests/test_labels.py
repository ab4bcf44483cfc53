"""Labels beside points stand in nobody's way."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from matplotlib.text import Text

from jet_gym.figures import plot_comparison, style
from jet_gym.figures.labels import LabelledPoint, label_points
from jet_gym.utils.statistics import Interval


def drawn(points: list[LabelledPoint]) -> Any:
    figure = style.new_figure(6.0, 4.5)
    axes = figure.subplots()
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set(xlim=(1e-2, 1e2), ylim=(1e-2, 1e2))
    label_points(axes, points)
    return axes


def assert_labels_are_clear(axes: Any, points: list[LabelledPoint]) -> None:
    axes.figure.draw_without_rendering()
    labels = [Text.get_window_extent(text) for text in axes.texts]  # without the lines that lead to them
    marks = axes.transData.transform([(point.x[1], point.y[1]) for point in points])
    assert [text.get_text() for text in axes.texts] == [point.name for point in points]
    for one, other in combinations(labels, 2):
        assert not one.overlaps(other)
    for label in labels:
        assert not any(label.contains(*mark) for mark in marks)
        assert axes.get_window_extent().x0 <= label.x0
        assert axes.get_window_extent().x1 >= label.x1


@pytest.mark.parametrize("seed", range(5))
def test_labels_of_crowded_points_do_not_overlap(seed: int) -> None:
    random = np.random.default_rng(seed)
    points = []
    for number in range(10):
        x, y = 10.0 ** random.normal(0.0, 0.1, 2)
        points.append(LabelledPoint(f"planner {number}", "#000000", (x / 1.1, x, 1.1 * x), (y / 1.2, y, 1.2 * y)))
    axes = drawn(points)
    assert_labels_are_clear(axes, points)
    axes.figure.set_dpi(200.0)  # as it is saved
    assert_labels_are_clear(axes, points)


def test_a_lone_point_has_its_label_at_its_right_and_one_at_the_edge_at_its_left() -> None:
    alone, edge = (LabelledPoint("a", "#000000", (x, x, x), (1.0, 1.0, 1.0)) for x in (1.0, 99.0))
    axes = drawn([alone, edge])
    axes.figure.draw_without_rendering()
    assert axes.texts[0].get_window_extent().x0 > axes.transData.transform((1.0, 1.0))[0]
    assert axes.texts[1].get_window_extent().x1 < axes.transData.transform((99.0, 1.0))[0]


@pytest.mark.parametrize("spread", [1.0, 1.02, 1.5])
def test_planners_that_are_alike_are_told_apart_in_a_comparison(spread: float) -> None:
    """GA and GAEx take about as long and stay about as far from the optimum on a few steps."""
    names = ("gas", "ga", "gaex", "policy")
    gaps = {name: spread**k * np.geomspace(0.1, 10.0, 10)[:, None] for k, name in enumerate(names)}
    times = {name: Interval(0.1, 0.08, 0.13) for name in names}
    medians = {name: Interval(spread**k, 0.4, 3.0) for k, name in enumerate(names)}
    figure = plot_comparison(gaps, times, medians, subtitle="four alike")
    points = [
        LabelledPoint(label, "", (0.1, 0.1, 0.1), (0.0, 100.0 * spread**k, 0.0))
        for k, label in enumerate(("GAS", "GA", "GAEx", "policy"))
    ]
    assert_labels_are_clear(figure.axes[1], points)
