"""Figs. 7 and 9 of the paper: where the pelvis goes and what thrust that takes, planner beside planner."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from jet_gym.figures import style
from jet_gym.plan import Plan
from jet_gym.step import Step
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Abscissa = Literal["point", "time"]

_AXIS_LABELS = ("pelvis x [mm]", "pelvis y [mm]", "pelvis z [mm]")


def plot_trajectories(
    plans: Sequence[Plan], *, against: Abscissa = "point", max_thrust: float | None = None
) -> Figure:
    """Draw the pelvis path and the thrust of several planners' plans for the same step.

    Four panels over one axis: pelvis x, y and z [mm] in the world, and thrust [N] with its limit. Crosses
    mark the swing points at which a plan violates a constraint; the legend counts them.

    Args:
        plans: One or more plans of one step.
        against: ``"point"`` for the number of the swing point, ``"time"`` for the time [s].
        max_thrust: Thrust limit to draw [N]; the robot's own where omitted.

    Raises:
        ValueError: If there is no plan, the plans are of different steps or ``against`` is neither.
    """
    step = _one_step(plans)
    if against not in ("point", "time"):
        raise ValueError(f"against must be 'point' or 'time', not {against!r}")
    limit = step.robot.max_thrust if max_thrust is None else max_thrust
    figure = style.new_figure(8.6, 10.6)
    panels: list[Axes] = list(figure.subplots(4, 1, sharex=True, height_ratios=(1.0, 1.0, 1.0, 1.25)))
    looks = style.planner_styles(plan.planner for plan in plans)
    names = [plan.planner for plan in plans]
    for order, plan in enumerate(plans):
        label = looks[plan.planner].label
        if names.count(plan.planner) > 1:
            label += f", seed {plan.seed}"
        repeated = names[:order].count(plan.planner)
        _draw_plan(panels, plan, against, looks[plan.planner], _legend_line(label, plan), 0.7**repeated)
    panels[3].axhline(limit, zorder=1.5, **style.LIMIT_LINE)
    panels[3].annotate(
        f"$F_\\mathrm{{max}}$ = {limit:g} N",
        (0.0, limit),
        xycoords=("axes fraction", "data"),
        xytext=(4.0, 3.0),
        textcoords="offset points",
        va="bottom",
        fontsize=style.TEXT_SIZE,
        color=style.LIMIT_COLOR,
    )
    thrusts = np.concatenate([plan.thrust for plan in plans])
    panels[3].set_ylim(min(0.0, float(thrusts.min())) - 0.5, 1.12 * max(limit, float(thrusts.max())))
    for panel, label in zip(panels, (*_AXIS_LABELS, "thrust [N]"), strict=True):
        style.label_axes(panel, y_label=label)
        panel.margins(x=0.015)
    panels[3].set_xlabel("swing point" if against == "point" else "time [s]", fontsize=style.LABEL_SIZE)
    figure.align_ylabels(panels)
    _add_legend(figure, panels[0], any(plan.violated_points for plan in plans))
    style.add_heading(figure, *style.describe_step(step))
    return figure


def _one_step(plans: Sequence[Plan]) -> Step:
    if not plans:
        raise ValueError("trajectories need at least one plan")
    first = plans[0].step
    for plan in plans[1:]:
        if plan.step.to_dict() != first.to_dict() or plan.step.robot.name != first.robot.name:
            raise ValueError(
                f"the plans must be of one step, but those of {plans[0].planner!r} and {plan.planner!r} differ"
            )
    return first


def _legend_line(label: str, plan: Plan) -> str:
    text = (
        f"{label}: thrust {plan.thrust.mean():.1f} N mean, {plan.thrust.max():.1f} N peak; "
        f"roughness {1e3 * plan.pelvis_roughness:.1f} mm (pelvis), {plan.thrust_roughness:.2f} N (thrust)"
    )
    violated = len(plan.violated_points)
    return text + (f"; {violated} of {plan.step.points} points violated" if violated else "")


def _draw_plan(
    panels: Sequence[Axes], plan: Plan, against: Abscissa, look: style.CurveStyle, label: str, opacity: float
) -> None:
    abscissa: Array = np.arange(float(len(plan.time))) if against == "point" else plan.time
    violated = list(plan.violated_points)
    for panel, values in zip(panels, (*(1e3 * plan.pelvis.T), plan.thrust), strict=True):
        panel.plot(
            abscissa,
            values,
            color=look.color,
            linestyle=look.line,
            linewidth=look.width,
            alpha=opacity,
            label=label,
            solid_joinstyle="round",
            zorder=2.0 + look.width / 10.0,
        )
        if violated:
            panel.plot(
                abscissa[violated],
                values[violated],
                linestyle="none",
                marker="X",
                markersize=7.0,
                markerfacecolor=look.color,
                markeredgecolor=style.LIMIT_COLOR,
                markeredgewidth=1.0,
                label="_violated",
                zorder=4.0,
            )


def _add_legend(figure: Figure, panel: Axes, violations: bool) -> None:
    from matplotlib.lines import Line2D

    handles = [line for line in panel.get_lines() if not str(line.get_label()).startswith("_")]
    if violations:
        cross = Line2D([], [], linestyle="none", marker="X", markersize=7.0, markerfacecolor="white")
        cross.set(markeredgecolor=style.LIMIT_COLOR, label="a constraint is violated")
        handles.append(cross)
    figure.legend(
        handles=handles, loc="outside lower center", fontsize=style.TEXT_SIZE, frameon=False, handlelength=3.2
    )
