"""How often the robot stands under disturbances, and which of them it falls over."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from jet_gym.figures import style
from jet_gym.simulation.robustness import associations, success_rate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from jet_gym.simulation.execution import ThrustControl
    from jet_gym.simulation.robustness import Extreme
    from jet_gym.simulation.trials import Trial

_LOOKS = {"feedforward": ("feed-forward", "#E69F00"), "pid": ("with PID", "#0072B2")}


def plot_robustness(
    trials: Sequence[Trial], controls: Sequence[ThrustControl], extremes: Sequence[Extreme] = ()
) -> Figure:
    """Draw success rates, what failures have to do with, and one disturbance at a time.

    Left, the share of the trials [%] in which the robot stands, with 95 % intervals. In the middle, by disturbance,
    the probability [%] that a failed trial had more of it than one that succeeded; filled where that is further
    from 50 % than chance makes it once in a hundred times. Right, the ZMP's margin [mm] with one disturbance at an
    end of its range; a cross where the robot fell.

    Args:
        trials: The trials.
        controls: Ways to control the thrust, in order.
        extremes: One disturbance at a time; without any, there is no panel on the right.
    """
    figure = style.new_figure(12.0 if extremes else 8.0, 5.4)
    widths = [1.0, 2.2, 2.2] if extremes else [1.0, 2.2]
    panels = figure.subplots(1, len(widths), gridspec_kw={"width_ratios": widths})
    number = max(sum(trial.control == control for trial in trials) for control in controls)
    style.add_heading(figure, f"The course under random disturbances, {number} trials")
    _draw_rates(panels[0], trials, controls)
    _draw_associations(panels[1], trials, controls)
    if extremes:
        _draw_extremes(panels[2], extremes, controls)
    return figure


def _draw_rates(axes: Axes, trials: Sequence[Trial], controls: Sequence[ThrustControl]) -> None:
    style.label_axes(axes, y_label="robot stands [% of the trials]")
    for place, control in enumerate(controls):
        color = _LOOKS[control][1]
        rate = success_rate(trials, control)
        share, low, high = (100.0 * value for value in (rate.rate, rate.low, rate.high))
        axes.bar(place, share, width=0.6, color=style.tint(color, 0.75))
        bars = [[max(share - low, 0.0)], [max(high - share, 0.0)]]
        axes.errorbar(place, share, yerr=bars, color=style.INK, capsize=4)
        axes.text(place, 2.0, f"{rate.successes}\nof {rate.trials}", ha="center", fontsize=style.TEXT_SIZE)
    axes.set_xticks(range(len(controls)), [_LOOKS[control][0] for control in controls])
    axes.set_ylim(0.0, 102.0)


def _draw_associations(axes: Axes, trials: Sequence[Trial], controls: Sequence[ThrustControl]) -> None:
    style.label_axes(axes, x_label="probability that a failed trial had more of it [%]")
    found = {control: {entry.quantity: entry for entry in associations(trials, control)} for control in controls}
    telling = {control: entries for control, entries in found.items() if entries}
    if not telling:
        axes.text(
            0.5, 0.5, "too few trials failed", transform=axes.transAxes, ha="center", fontsize=style.TEXT_SIZE
        )
        return
    names = list(next(iter(telling.values())))[::-1]
    for shift, (control, entries) in zip((0.14, -0.14), telling.items(), strict=False):
        name, color = _LOOKS[control]
        for row, quantity in enumerate(names):
            entry = entries[quantity]
            axes.plot(
                100.0 * entry.probability,
                row + shift,
                "o",
                color=color,
                markerfacecolor=color if entry.p_value < 0.01 else "white",
                label=name if row == 0 else None,
            )
    axes.axvline(50.0, color=style.FAINT_INK, linewidth=1.0)
    axes.set_yticks(range(len(names)), names)
    axes.set_xlim(0.0, 100.0)
    _add_legend(axes)


def _draw_extremes(axes: Axes, extremes: Sequence[Extreme], controls: Sequence[ThrustControl]) -> None:
    style.label_axes(axes, x_label="ZMP margin 99 % of the time [mm]")
    labels = list(dict.fromkeys(f"{entry.quantity} {entry.value}" for entry in extremes))[::-1]
    rows = {label: row for row, label in enumerate(labels)}
    for shift, control in zip((0.14, -0.14), controls, strict=False):
        name, color = _LOOKS[control]
        chosen = [entry for entry in extremes if entry.trial.control == control]
        for order, entry in enumerate(chosen):
            margin = 1e3 * (entry.trial.low_zmp_margin or 0.0)
            stands = entry.trial.success
            axes.plot(
                margin if stands else 0.0,
                rows[f"{entry.quantity} {entry.value}"] + shift,
                "o" if stands else "x",
                color=color,
                markersize=5.0 if stands else 7.0,
                label=name if order == 0 else None,
            )
    axes.set_yticks(range(len(labels)), labels)
    axes.tick_params(axis="y", labelsize=0.8 * style.TEXT_SIZE)
    _add_legend(axes)


def _add_legend(axes: Axes) -> None:
    """Put the legend above the axes, where it covers nothing."""
    axes.legend(fontsize=style.TEXT_SIZE, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
