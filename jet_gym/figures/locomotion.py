"""Figs. 6 and 8 of the paper: the robot's motion in a perspective view and from above."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from jet_gym.courses import CARTON_LENGTH, CARTON_WIDTH
from jet_gym.figures import style
from jet_gym.figures.scene import Bodies, Scene, bodies_of
from jet_gym.figures.stereo_view import draw_stereo_view
from jet_gym.figures.top_view import draw_support_view, draw_top_view
from jet_gym.leg import SIDES, opposite
from jet_gym.plan import Plan

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure
    from matplotlib.gridspec import SubplotSpec


def plot_locomotion(plan: Plan, frames: int = 6) -> Figure:
    """Draw the motion of a plan as a sequence of stick figures, in perspective and from above.

    Early frames are faint, later ones stronger. All positions are in mm in the world, and every view has
    one scale on all of its axes. A third view enlarges the support foot with the way of the centre of mass
    and of the zero-moment point.

    Args:
        plan: The plan.
        frames: How many swing points to draw, the first and the last among them; at most as many as the
            step has.

    Raises:
        ValueError: If ``frames`` is not a whole number of 2 or more.
    """
    if isinstance(frames, bool) or not isinstance(frames, int | np.integer) or frames < 2:
        raise ValueError(f"frames must be a whole number of 2 or more, not {frames!r}")
    step, bodies, scene = plan.step, bodies_of(plan), Scene.of(plan.step)
    last = step.points - 1
    points = [round(k) for k in np.linspace(0, last, min(int(frames), step.points))]
    figure = style.new_figure(15.0, 9.0)
    stereo, above, support = _lay_out(figure, bodies, scene)
    stereo_axes = draw_stereo_view(figure, stereo, plan, bodies, points, scene)
    above_axes, support_axes = figure.add_subplot(above), figure.add_subplot(support)
    draw_top_view(above_axes, plan, bodies, points, scene)
    draw_support_view(support_axes, plan, bodies, points)
    titles = ("perspective view", "top view", "support foot from above, enlarged")
    for axes, title in zip((stereo_axes, above_axes, support_axes), titles, strict=True):
        axes.set_title(title, fontsize=style.LABEL_SIZE, color=style.INK, style="italic")
    figure.legend(
        handles=_legend_handles(plan, scene),
        loc="outside lower center",
        ncols=5,
        fontsize=style.TEXT_SIZE,
        frameon=False,
        handlelength=2.6,
        columnspacing=2.2,
    )
    headline, where = style.describe_step(step)
    planner = style.planner_style(plan.planner).label
    style.add_heading(figure, f"{headline}, planned by {planner}", where, _describe_frames(plan, points))
    return figure


def _lay_out(figure: Figure, bodies: Bodies, scene: Scene) -> tuple[SubplotSpec, SubplotSpec, SubplotSpec]:
    """Return where the three views go: a tall top view stands beside that of the support foot, a wide one above."""
    around = [bodies.sole_corners[..., :2].reshape(-1, 2), *(carton.corners[:, :2] for carton in scene.cartons)]
    width, height = np.ptp(np.concatenate(around), axis=0)
    if height > 1.3 * width:
        grid = figure.add_gridspec(1, 3, width_ratios=(1.85, 0.75, 0.9))
        return grid[0], grid[1], grid[2]
    grid = figure.add_gridspec(2, 2, width_ratios=(1.35, 1.0), height_ratios=(1.5, 1.0))
    return grid[:, 0], grid[0, 1], grid[1, 1]


def _describe_frames(plan: Plan, points: Sequence[int]) -> str:
    *others, last = (str(point) for point in points)
    text = f"faint to strong: swing points {', '.join(others)} and {last}, over {plan.time[-1] - plan.time[0]:g} s"
    violated = len(plan.violated_points)
    return text + (f"; constraints violated at {violated} of {len(plan.time)} swing points" if violated else "")


def _legend_handles(plan: Plan, scene: Scene) -> list[Artist]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    swing_color = style.LEG_COLORS[plan.step.swing]
    support_color = style.LEG_COLORS[opposite(plan.step.swing)]
    handles: list[Artist] = [
        Line2D([], [], color=style.LEG_COLORS[side], label=f"{side} leg, sole and fan", **style.LEG_LINE)
        for side in SIDES
    ]
    thrust = f"thrust (from above: the disc fills the duct at {plan.step.robot.max_thrust:g} N)"
    markers = (
        (style.center_of_mass_marker, "centre of mass"),
        (style.assigned_zmp_marker, "assigned ZMP"),
        (style.achieved_zmp_marker, "achieved ZMP"),
    )
    handles += [
        Line2D([], [], color=style.INK, linewidth=4.0, label="pelvis, hip to hip"),
        Line2D([], [], color=style.INK, label="path of the pelvis", **style.PELVIS_PATH),
        Line2D([], [], color=swing_color, label="path of the swing sole", **style.SWING_PATH),
        *(Line2D([], [], label=label, **marker(1.0)) for marker, label in markers),
        Line2D([], [], color=style.THRUST_COLOR, linewidth=2.4, marker="^", markersize=7.0, label=thrust),
        Patch(facecolor="none", edgecolor=support_color, label="support polygon", **style.SUPPORT_FILL),
        Patch(
            facecolor=style.CARTON_COLOR,
            edgecolor=style.CARTON_EDGE,
            label=f"carton, {1e3 * CARTON_LENGTH:g} x {1e3 * CARTON_WIDTH:g} mm",
        ),
    ]
    if scene.ditch is not None:
        handles.append(Patch(facecolor=style.DITCH_COLOR, label="clear gap between start and landing"))
    return handles
