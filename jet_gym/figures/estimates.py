"""What peak thrust and the greatest ditch are with other values of what is estimated of the robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from jet_gym.figures import style
from jet_gym.utils.statistics import Interval

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from agents.studies.estimates import EstimateRow

_LOOKS = {"side": ("#0072B2", "o"), "forward": ("#D55E00", "s")}
_DITCH_COLOR = "#009E73"


def plot_estimates(rows: Sequence[EstimateRow], max_thrust: float, ditch: float) -> Figure:
    """Draw peak thrust and greatest ditch over each estimate, one column a quantity.

    Args:
        rows: The study.
        max_thrust: Thrust limit to draw [N].
        ditch: The paper's ditch to draw [m].

    Raises:
        ValueError: If there is no row.
    """
    if not rows:
        raise ValueError("a figure of the estimates needs at least one row")
    quantities = list(dict.fromkeys(row.quantity for row in rows))
    figure = style.new_figure(3.1 * len(quantities) + 0.6, 6.4)
    panels = figure.subplots(2, len(quantities), sharex="col", sharey="row", squeeze=False)
    for column, quantity in enumerate(quantities):
        chosen = [row for row in rows if row.quantity == quantity]
        _draw_thrust(panels[0, column], chosen, max_thrust)
        _draw_ditch(panels[1, column], chosen, ditch)
        first = column == 0
        style.label_axes(panels[0, column], y_label="peak thrust [N]" if first else "")
        style.label_axes(
            panels[1, column], f"{quantity} [{chosen[0].unit}]", "greatest ditch [mm]" if first else ""
        )
        panels[0, column].set_ylim(0.0, max(1.12 * max_thrust, 1.04 * _highest_peak(rows)))
        for panel in panels[:, column]:
            for row in chosen:
                if row.is_estimate:
                    panel.axvline(row.value, color=style.FAINT_INK, linewidth=1.2, linestyle=":", zorder=1.0)
    figure.legend(
        handles=panels[0, 0].get_legend_handles_labels()[0], loc="outside lower center", ncols=4,
        fontsize=style.TEXT_SIZE, frameon=False,
    )  # fmt: skip
    style.add_heading(
        figure,
        "What the estimates do",
        "one number changes at a time; dotted: the value that is taken here, dashed: the paper's limit and ditch",
    )
    return figure


def _highest_peak(rows: Sequence[EstimateRow]) -> float:
    """Return the upper end of the highest interval of peak thrusts that were measured [N]."""
    summaries = (getattr(row, name) for row in rows for name in ("side", "forward", "side_ga", "forward_ga"))
    return max((high for high in (one.peak_thrust.high for one in summaries) if np.isfinite(high)), default=0.0)


def _draw_thrust(panel: Axes, rows: Sequence[EstimateRow], max_thrust: float) -> None:
    values = [row.value for row in rows]
    for motion, (color, marker) in _LOOKS.items():
        for name, suffix, line in (("GAS", "", "-"), ("GA", "_ga", (0, (2, 1.5)))):
            peaks: list[Interval] = [getattr(row, motion + suffix).peak_thrust for row in rows]
            panel.errorbar(
                values, [peak.mean for peak in peaks], yerr=style.error_bars(peaks),
                color=color, marker=marker, markersize=4.5, linewidth=1.5, capsize=3.0, linestyle=line,
                markerfacecolor=color if name == "GAS" else "white", label=f"{name}, {motion}",
            )  # fmt: skip
    panel.axhline(max_thrust, **style.LIMIT_LINE)


def _draw_ditch(panel: Axes, rows: Sequence[EstimateRow], ditch: float) -> None:
    panel.plot(
        [row.value for row in rows], [1e3 * row.greatest_ditch for row in rows],
        color=_DITCH_COLOR, marker="D", markersize=5.0, linewidth=1.6,
    )  # fmt: skip
    panel.axhline(1e3 * ditch, **(style.LIMIT_LINE | {"color": style.INK}))
