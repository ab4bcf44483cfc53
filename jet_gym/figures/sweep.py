"""What the smoothness weight does to thrust and shocks, as curves over the weight."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from agents.studies.sweep import UNITS
from jet_gym.figures import style
from jet_gym.fitness import FitnessSettings
from jet_gym.utils.statistics import Interval

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from agents.studies.sweep import SweepRow

_QUANTITIES = (
    ("mean_thrust", "mean thrust [N]", 1.0),
    ("peak_thrust", "peak thrust [N]", 1.0),
    ("pelvis_roughness", "roughness of the pelvis path [mm]", 1e3),
    ("thrust_roughness", "roughness of the thrust [N]", 1.0),
)
_MOTION_LOOKS = (("#0072B2", "o"), ("#D55E00", "s"), ("#009E73", "^"), ("#B5338A", "D"))


def plot_smoothness_sweep(rows: Sequence[SweepRow]) -> Figure:
    """Draw thrust and roughness over the smoothness weight, motion beside motion.

    Four panels over the weight [1/m^2], on a logarithmic axis: mean and peak thrust [N], roughness of the
    pelvis path [mm] and of the thrust [N]. Bars are 95 % intervals. Rows of weight zero, GA, are horizontal
    lines in bands. Upright lines mark the weights that are 50 in a round unit of area, and the default.

    Args:
        rows: The study; at least one row has a weight of more than 0.

    Raises:
        ValueError: If no row has a weight of more than 0, or a weight is negative or not finite.
    """
    weights = sorted({row.smoothness_weight for row in rows})
    if not all(0.0 <= weight < math.inf for weight in weights):
        raise ValueError(f"smoothness weights must be finite numbers of 0 or more, not {weights}")
    positive = [weight for weight in weights if weight > 0.0]
    if not positive:
        raise ValueError("a sweep needs at least one row with a smoothness weight of more than 0")
    figure = style.new_figure(12.0, 8.8)
    panels: list[Axes] = list(figure.subplots(2, 2, sharex=True).flat)
    motions = list(dict.fromkeys(row.motion for row in rows))
    for panel, (name, label, scale) in zip(panels, _QUANTITIES, strict=True):
        panel.set_xscale("log")
        panel.set_xlim(positive[0] / 1.6, positive[-1] * 1.6)
        for order, motion in enumerate(motions):
            color, marker = _MOTION_LOOKS[order % len(_MOTION_LOOKS)]
            _draw_motion(panel, [row for row in rows if row.motion == motion], name, scale, color, marker)
        style.label_axes(panel, y_label=label)
        panel.set_ylim(0.0, None)
        _mark_weights(panel, named=panel in panels[:2])
    for panel in panels[2:]:
        panel.set_xlabel("smoothness weight ω [1/m²]", fontsize=style.LABEL_SIZE, color=style.INK)
    figure.align_ylabels(panels)
    figure.legend(
        handles=panels[0].get_legend_handles_labels()[0],
        loc="outside lower center",
        ncols=2,
        fontsize=style.TEXT_SIZE,
        frameon=False,
        handlelength=3.0,
    )
    style.add_heading(
        figure,
        "What the smoothness weight buys, and what it costs in thrust",
        "means over seeds with 95 % intervals; roughness is the root mean square second difference along the step",
    )
    return figure


def _draw_motion(panel: Axes, rows: Sequence[SweepRow], name: str, scale: float, color: str, marker: str) -> None:
    """Draw one motion's curve, and its reference where there is a row of weight zero."""
    curve = sorted((row for row in rows if row.smoothness_weight > 0.0), key=lambda row: row.smoothness_weight)
    labels = style.planner_styles(row.summary.planner for row in rows)
    if curve:
        intervals: list[Interval] = [getattr(row.summary, name) for row in curve]
        means = [scale * interval.mean for interval in intervals]
        panel.errorbar(
            [row.smoothness_weight for row in curve],
            means,
            yerr=style.error_bars(intervals, scale),
            color=color,
            marker=marker,
            markersize=5.5,
            linewidth=1.8,
            capsize=3.0,
            label=f"{labels[curve[0].summary.planner].label}, {curve[0].motion}",
            zorder=3.0,
        )
    for row in rows:
        if row.smoothness_weight == 0.0:
            interval = getattr(row.summary, name)
            label = f"{labels[row.summary.planner].label} (weight 0), {row.motion}"
            panel.axhspan(
                scale * interval.low, scale * interval.high, color=color, alpha=0.16, linewidth=0.0, zorder=1.5
            )
            panel.axhline(
                scale * interval.mean, color=color, linewidth=1.5, linestyle=(0, (5, 2)), label=label, zorder=2.0
            )


def _mark_weights(panel: Axes, named: bool) -> None:
    """Mark the weights that are 50 in a round unit, and the default, as far as the axis reaches."""
    low, high = panel.get_xlim()
    default = FitnessSettings().smoothness_weight
    for weight in sorted({*UNITS, default}):
        if not low <= weight <= high:
            continue
        is_default = weight == default
        color = style.INK if is_default else style.FAINT_INK
        panel.axvline(weight, color=color, linewidth=1.2, linestyle="-" if is_default else ":", zorder=1.0)
        if named:
            text = UNITS.get(weight, f"{weight:g}")
            panel.annotate(
                text + ("\n(default)" if is_default else ""),
                (weight, 1.0),
                xycoords=panel.get_xaxis_transform(),
                xytext=(0.0, 3.0),
                textcoords="offset points",
                ha="center",
                va="bottom",
                fontsize=style.TEXT_SIZE,
                color=color,
            )
