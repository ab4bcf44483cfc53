"""How often the course succeeds under disturbances, and which of them break it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from jet_gym.figures import style
from jet_gym.simulation.execution import CONTROL_NAMES
from jet_gym.simulation.limits import FACTORS, ends_by_limit
from jet_gym.simulation.robustness import associations, success_rate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from jet_gym.simulation.execution import ThrustControl
    from jet_gym.simulation.limits import Limit
    from jet_gym.simulation.robustness import Association
    from jet_gym.simulation.trials import Trial

_COLORS = {"feedforward": "#E69F00", "pid": "#0072B2"}


def plot_robustness(
    trials: Sequence[Trial], controls: Sequence[ThrustControl], limits: Sequence[Limit] = ()
) -> Figure:
    """Draw success rates, what failures have to do with, and how far one disturbance at a time may go.

    Left, the share of the trials [%] that succeed, with 95 % intervals. In the middle, by disturbance, the
    probability [%] that a failed trial had more of it than one that succeeded; filled where that is further from
    50 % than chance makes it once in a hundred times; without enough failures there is no such panel. Right, how
    many times its range a disturbance by itself reaches where the robot first fails; an arrow where it never does.

    Args:
        trials: The trials.
        controls: Ways to control the thrust, in order.
        limits: One disturbance at a time; without any, there is no panel on the right.
    """
    found = {control: associations(trials, control) for control in controls}
    telling = {control: ranked for control, ranked in found.items() if ranked}
    widths = [1.0, *([2.2] if telling else []), *([2.2] if limits else [])]
    rows = max([16 if telling else 0, len(ends_by_limit(limits)) if limits else 0])
    figure = style.new_figure(1.6 + 2.3 * sum(widths), max(4.6, 1.6 + 0.19 * rows))
    panels = list(figure.subplots(1, len(widths), gridspec_kw={"width_ratios": widths}, squeeze=False)[0])
    number = max(sum(trial.control == control for trial in trials) for control in controls)
    what = f"{number} random draw{'s' * (number > 1)}"
    if limits:
        what += f"; one disturbance at a time: a cross where it fails, an arrow where not at {FACTORS[-1]:g} times"
    style.add_heading(figure, "The course under disturbances", what)
    _draw_rates(panels.pop(0), trials, controls)
    if telling:
        _draw_associations(panels.pop(0), telling)
    if limits:
        _draw_limits(panels.pop(0), limits, controls)
    return figure


def _draw_rates(axes: Axes, trials: Sequence[Trial], controls: Sequence[ThrustControl]) -> None:
    style.label_axes(axes, y_label="success [% of the trials]")
    for place, control in enumerate(controls):
        color = _COLORS[control]
        rate = success_rate(trials, control)
        share, low, high = (100.0 * value for value in (rate.rate, rate.low, rate.high))
        axes.bar(place, share, width=0.6, color=style.tint(color, 0.75))
        bars = [[max(share - low, 0.0)], [max(high - share, 0.0)]]
        axes.errorbar(place, share, yerr=bars, color=style.INK, capsize=4)
        axes.text(place, 2.0, f"{rate.successes}\nof {rate.trials}", ha="center", fontsize=style.TEXT_SIZE)
    axes.set_xticks(
        range(len(controls)), [CONTROL_NAMES[control].replace(" and ", "\nand ") for control in controls]
    )
    axes.set_ylim(0.0, 102.0)


def _draw_associations(axes: Axes, telling: Mapping[ThrustControl, Sequence[Association]]) -> None:
    style.label_axes(axes, x_label="probability that a failed trial had more of it [%]")
    names = [entry.quantity for entry in next(iter(telling.values()))][::-1]
    for shift, (control, ranked) in zip(_shifts(len(telling)), telling.items(), strict=True):
        name, color = CONTROL_NAMES[control], _COLORS[control]
        entries = {entry.quantity: entry for entry in ranked}
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


def _draw_limits(axes: Axes, limits: Sequence[Limit], controls: Sequence[ThrustControl]) -> None:
    style.label_axes(axes, x_label="where the robot fails [times the range]")
    ends = ends_by_limit(limits)[::-1]
    rows = {end: row for row, end in enumerate(ends)}
    for shift, control in zip(_shifts(len(controls)), controls, strict=True):
        name, color = CONTROL_NAMES[control], _COLORS[control]
        for order, limit in enumerate(entry for entry in limits if entry.control == control):
            row = rows[limit.quantity, limit.end] + shift
            reached = FACTORS[-1] if limit.factor is None else limit.factor
            axes.plot([0.0, reached], [row, row], color=style.tint(color, 0.6), linewidth=1.2)
            axes.plot(
                reached,
                row,
                ">" if limit.factor is None else "x",
                color=color,
                markersize=5.0,
                markerfacecolor="white" if limit.factor is None else color,
                clip_on=False,
                label=name if order == 0 else None,
            )
    axes.axvline(1.0, color=style.FAINT_INK, linewidth=1.0)
    axes.set_yticks(range(len(ends)), [f"{quantity}, {end}" for quantity, end in ends])
    axes.tick_params(axis="y", labelsize=0.85 * style.TEXT_SIZE)
    axes.set_xlim(0.0, FACTORS[-1] + 0.15)
    axes.set_ylim(-0.8, len(ends) - 0.2)
    axes.grid(visible=False, axis="y")
    _add_legend(axes)


def _shifts(count: int) -> list[float]:
    """Return by how many rows the marks of each way to control the thrust are off their row."""
    return [0.32 * (0.5 * (count - 1) - place) for place in range(count)]


def _add_legend(axes: Axes) -> None:
    """Put the legend above the axes, where it covers nothing."""
    axes.legend(fontsize=style.TEXT_SIZE, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
