"""Fig. 11 of the paper: the robot in simulation, as pictures and as time series."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jet_gym.figures import style
from jet_gym.simulation.history import Execution

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Picture = NDArray[np.uint8]

_COLUMNS = 4


def plot_pictures(pictures: Sequence[Picture], captions: Sequence[str]) -> Figure:
    """Lay pictures out side by side, four in a row.

    Args:
        pictures: Pictures (height, width, 3) of one size.
        captions: What stands above each.

    Raises:
        ValueError: If there is no picture, or not a caption for each.
    """
    if not pictures or len(pictures) != len(captions):
        raise ValueError(f"{len(pictures)} pictures need as many captions, one at least, not {len(captions)}")
    rows = -(-len(pictures) // _COLUMNS)
    height, width, _ = pictures[0].shape
    figure = style.new_figure(13.0, rows * (13.0 / _COLUMNS * height / width + 0.3))
    panels: list[Axes] = list(figure.subplots(rows, _COLUMNS, squeeze=False).flat)
    for panel in panels:
        panel.set_axis_off()
    for panel, picture, caption in zip(panels, pictures, captions, strict=False):
        panel.imshow(picture)
        panel.set_title(caption, fontsize=style.TEXT_SIZE, color=style.INK, pad=3.0)
    return figure


def plot_execution(execution: Execution) -> Figure:
    """Draw thrust, tilt of the pelvis and distance of the ZMP from the soles' edge over the time [s].

    Args:
        execution: What was executed.
    """
    figure = style.new_figure(10.6, 7.4)
    thrust, tilt, margin = figure.subplots(3, 1, sharex=True, height_ratios=(1.4, 1.0, 1.0))
    time = execution.time
    swing = np.where(execution.swing_is_left, 0, 1)
    delivered = execution.thrust_delivered[np.arange(len(time)), swing]
    thrust.plot(time, execution.thrust_planned, color=style.INK, linewidth=1.6, label="planned")
    thrust.plot(time, execution.thrust_commanded, color="#E69F00", linewidth=1.0, label="commanded, with the PID")
    thrust.plot(time, delivered, color=style.THRUST_COLOR, linewidth=1.6, label="delivered")
    limit = execution.plans[0].step.robot.max_thrust
    thrust.axhline(limit, **style.LIMIT_LINE)
    thrust.legend(loc="upper left", fontsize=style.TEXT_SIZE, frameon=False)
    thrust.set_ylim(0.0, 1.12 * limit)
    tilt.plot(time, np.degrees(execution.tilt), color="#0072B2", linewidth=1.4)
    margin.plot(time, 1e3 * execution.zmp_margin, color=style.ACHIEVED_COLOR, linewidth=1.2)
    margin.axhline(0.0, **style.LIMIT_LINE)
    for axes, label in ((thrust, "thrust [N]"), (tilt, "tilt of the pelvis [deg]"), (margin, "ZMP to edge [mm]")):
        style.label_axes(axes, y_label=label)
        axes.margins(x=0.0)
        _mark_phases(axes, execution, named=axes is thrust)
    margin.set_xlabel("time [s]", fontsize=style.LABEL_SIZE, color=style.INK)
    figure.align_ylabels([thrust, tilt, margin])
    style.add_heading(
        figure,
        "The experiment in simulation",
        f"thrust: {execution.thrust_control}, seed of the IMU {execution.seed}; {execution.summary.outcome}",
    )
    return figure


def _mark_phases(axes: Axes, execution: Execution, named: bool) -> None:
    """Shade the motions, in which one foot is in the air."""
    motions = [name for name in dict.fromkeys(execution.phase.tolist()) if name.startswith("motion")]
    for name in motions:
        during = execution.time[execution.phase == name]
        axes.axvspan(during[0], during[-1], color="#F1F1EC", zorder=0.0)
        if named:
            axes.annotate(
                name, (0.5 * (during[0] + during[-1]), 1.0), xycoords=axes.get_xaxis_transform(),
                xytext=(0.0, 3.0), textcoords="offset points", ha="center",
                fontsize=style.TEXT_SIZE, color=style.INK,
            )  # fmt: skip
