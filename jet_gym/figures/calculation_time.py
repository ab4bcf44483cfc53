"""Fig. 10 of the paper: how long a swing point takes, with other libraries' optimisers beside it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from jet_gym.figures import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from agents.studies.calculation_time import PointTime

_OTHER_COLOR = "#9A9A9A"


def plot_calculation_time(rows: Sequence[PointTime]) -> Figure:
    """Draw the times of a swing point as bars on a logarithmic axis, each with its ratio to the first.

    Args:
        rows: Planners and optimisers; at least one.

    Raises:
        ValueError: If there is no row.
    """
    if not rows:
        raise ValueError("a figure of calculation times needs at least one row")
    figure = style.new_figure(8.6, 1.5 + 0.42 * len(rows))
    axes = figure.subplots()
    looks = style.planner_styles(row.name for row in rows)
    places = list(range(len(rows)))[::-1]
    times = [1e3 * row.seconds for row in rows]
    colors = [_OTHER_COLOR if row.off_the_shelf else looks[row.name].color for row in rows]
    axes.barh(places, times, height=0.66, color=colors, zorder=2.0)
    axes.set_xscale("log")
    axes.set_xlim(min(times) / 3.0, max(times) * 6.0)
    axes.set_yticks(places, [row.name if row.off_the_shelf else looks[row.name].label for row in rows])
    for place, time, row in zip(places, times, rows, strict=True):
        size = f"{row.ratio:.2f}" if row.ratio < 10.0 else f"{row.ratio:,.0f}"
        axes.annotate(
            f"{time:.3g} ms, {size} ×", (time, place), xytext=(5.0, 0.0), textcoords="offset points",
            va="center", fontsize=style.TEXT_SIZE, color=style.INK,
        )  # fmt: skip
    style.label_axes(axes, "processor time of a swing point [ms]")
    axes.grid(False, axis="y")
    style.add_heading(
        figure, "Calculation time of one swing point", f"and its ratio to that of {looks[rows[0].name].label}"
    )
    return figure
