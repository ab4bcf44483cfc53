"""Planners side by side: how far from the optimum, how long they take, and what they do on three steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from jet_gym.figures import style
from jet_gym.figures.labels import LabelledPoint, label_points
from jet_gym.plan import Plan
from jet_gym.utils.arrays import Array
from jet_gym.utils.statistics import Interval

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LEAST_GAP = 0.01  # [%] on the logarithmic axis; less is drawn there
_MARKERS = "osD^vP*X"


def plot_comparison(
    gaps: Mapping[str, Array], times: Mapping[str, Interval], medians: Mapping[str, Interval], *, subtitle: str
) -> Figure:
    """Draw how total fitness relative to the optimum is distributed, and time against optimality gap.

    Left: the share of steps on which a planner's total fitness exceeds the optimum by no more than what the
    logarithmic axis tells [%]. Right: processor time a swing point [ms] against the median gap [%].

    Args:
        gaps: By planner, total fitness over that of the optimum, less 1, of any number of plans.
        times: By planner, milliseconds a swing point.
        medians: By planner, the median gap.
        subtitle: What was compared.

    Raises:
        ValueError: If there is no planner.
    """
    from matplotlib.ticker import NullFormatter

    if not gaps:
        raise ValueError("a comparison needs at least one planner")
    figure = style.new_figure(12.0, 5.6)
    left, right = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
    looks, points = style.planner_styles(gaps), []
    for order, (name, gap) in enumerate(gaps.items()):
        _draw_distribution(left, gap, looks[name])
        points.append(_draw_trade(right, times[name], medians[name], looks[name], _MARKERS[order % len(_MARKERS)]))
    left.set_xscale("log")
    left.set_ylim(0.0, 1.02)
    left.set_xlim(_LEAST_GAP, None)
    right.set_xscale("log")
    right.set_yscale("log")
    right.set_ylim(_LEAST_GAP / 1.6, None)
    right.margins(x=0.15)
    right.xaxis.set_minor_formatter(NullFormatter())  # which would write over each other
    style.label_axes(left, "total fitness above the optimum [%]", "share of steps with no more")
    style.label_axes(right, "processor time of a swing point [ms]", "median gap to the optimum [%]")
    right.axhline(_LEAST_GAP, color=style.FAINT_INK, linewidth=1.0, linestyle=":", zorder=1.0)
    figure.legend(
        *left.get_legend_handles_labels(), loc="outside lower center", ncols=min(len(gaps), 6),
        fontsize=style.TEXT_SIZE, frameon=False, handlelength=3.0,
    )  # fmt: skip
    style.add_heading(
        figure,
        "How far planners stay from the least total fitness of a step",
        f"{subtitle}; bars are 95 % intervals",
    )
    label_points(right, points)
    return figure


def _draw_distribution(axes: Axes, gap: Array, look: style.CurveStyle) -> None:
    values = np.sort(np.maximum(100.0 * gap.ravel(), _LEAST_GAP))
    share = np.arange(1, len(values) + 1) / len(values)
    start = np.concatenate([[_LEAST_GAP], values]), np.concatenate([[0.0], share])
    axes.step(*start, where="post", label=look.label, color=look.color, linestyle=look.line, linewidth=look.width)


def _draw_trade(axes: Axes, time: Interval, gap: Interval, look: style.CurveStyle, marker: str) -> LabelledPoint:
    height = max(100.0 * gap.mean, _LEAST_GAP)
    low, high = max(100.0 * gap.low, _LEAST_GAP), max(100.0 * gap.high, _LEAST_GAP)
    axes.errorbar(
        [time.mean], [height],
        xerr=style.error_bars([time]),
        yerr=[[max(height - low, 0.0)], [max(high - height, 0.0)]],
        color=look.color, marker=marker, markersize=8.0, capsize=3.0, zorder=3.0,
    )  # fmt: skip
    return LabelledPoint(look.label, look.color, (time.low, time.mean, time.high), (low, height, high))


def plot_examples(rows: Sequence[tuple[str, Sequence[Plan]]]) -> Figure:
    """Draw pelvis and thrust of every planner on some example steps, one step a column.

    Args:
        rows: By step, what it is called and the plans of the planners for it.

    Raises:
        ValueError: If there is no step.
    """
    if not rows:
        raise ValueError("there is no step to draw")
    figure = style.new_figure(4.6 * len(rows), 9.6)
    panels = np.array(figure.subplots(4, len(rows), sharex="col", squeeze=False))
    looks = style.planner_styles(plan.planner for _, plans in rows for plan in plans)
    for column, (title, plans) in enumerate(rows):
        for plan in plans:
            look = looks[plan.planner]
            curves = (*(1e3 * (plan.pelvis - plan.step.support).T), plan.thrust)
            for panel, curve in zip(panels[:, column], curves, strict=True):
                panel.plot(curve, color=look.color, linestyle=look.line, linewidth=look.width, label=look.label)
            broken = list(plan.violated_points)
            panels[3, column].plot(
                broken, plan.thrust[broken], linestyle="none", marker="x", color=style.LIMIT_COLOR, markersize=6.0
            )
        panels[0, column].set_title(title, fontsize=style.TEXT_SIZE, color=style.INK)
        labels = ("pelvis x [mm]", "pelvis y [mm]", "pelvis z [mm]", "thrust [N]") if column == 0 else [""] * 4
        for panel, label in zip(panels[:, column], labels, strict=True):
            style.label_axes(panel, "swing point" if panel is panels[3, column] else "", label)
        panels[3, column].set_ylim(0.0, None)
    handles, names = panels[0, 0].get_legend_handles_labels()
    figure.legend(
        handles, names, loc="outside lower center", ncols=min(len(names), 6), fontsize=style.TEXT_SIZE,
        frameon=False, handlelength=3.0,
    )  # fmt: skip
    style.add_heading(
        figure, "Pelvis and thrust on three steps", "pelvis from the support sole; crosses violate a constraint"
    )
    return figure
