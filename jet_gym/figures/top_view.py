"""The views from above of a locomotion figure: the whole step, and the support foot enlarged."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from jet_gym.figures import style
from jet_gym.figures.scene import DUCT_RADIUS, Bodies, Scene
from jet_gym.leg import SIDES, opposite
from jet_gym.plan import Plan
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_AROUND_SOLE = 60.0  # [mm] how far from the support sole a ZMP outside of it is still shown
_LEG_LINE = style.LEG_LINE | {"linewidth": 1.8, "markersize": 3.0}


def draw_top_view(axes: Axes, plan: Plan, bodies: Bodies, points: Sequence[int], scene: Scene) -> None:
    """Draw the robot at some swing points from above; x to the right, y upwards, in mm, at the same scale.

    Args:
        axes: Where.
        plan: The plan.
        bodies: The robot at every swing point.
        points: Swing points to draw, in order.
        scene: What stands around it.
    """
    _draw_surroundings(axes, scene)
    support_side = 1 if plan.step.swing == "left" else 0
    _fill_support(axes, plan, 1e3 * bodies.sole_corners[0, support_side, :, :2])
    axes.plot(
        *(1e3 * plan.swing_sole[:, :2].T), color=style.LEG_COLORS[plan.step.swing], zorder=3, **style.SWING_PATH
    )
    for order, point in enumerate(points):
        _draw_body(axes, plan, bodies, point, style.strength(order, len(points)), 10.0 + 10.0 * order)
    axes.plot(*(1e3 * plan.pelvis[:, :2].T), color=style.INK, zorder=200.0, **style.PELVIS_PATH)
    _draw_balance(axes, plan, points, 0.75)
    clouds = (bodies.sole_corners, bodies.ducts, bodies.knees, bodies.hips, bodies.trunk_corners)
    shown = [cloud[list(points)].reshape(-1, 3)[:, :2] for cloud in clouds]
    _prepare_axes(axes, 1e3 * np.concatenate([*shown, *(carton.corners[:, :2] for carton in scene.cartons)]))


def draw_support_view(axes: Axes, plan: Plan, bodies: Bodies, points: Sequence[int]) -> None:
    """Enlarge the support foot: where the centre of mass, the assigned and the achieved ZMP go.

    Args:
        axes: Where.
        plan: The plan.
        bodies: The robot at every swing point.
        points: Swing points to mark, in order.
    """
    side = 1 if plan.step.swing == "left" else 0
    outline = 1e3 * bodies.sole_corners[0, side, :, :2]
    _fill_support(axes, plan, outline)
    axes.plot(*outline[[0, 1, 2, 3, 0]].T, color=style.LEG_COLORS[SIDES[side]], linewidth=1.3)
    axes.plot(*(1e3 * plan.com[:, :2].T), color=style.INK, linewidth=1.0, zorder=4.0)
    axes.plot(*(1e3 * plan.zmp.T), color=style.ACHIEVED_COLOR, linewidth=1.0, zorder=4.0)
    _draw_balance(axes, plan, points, 1.2)
    near = np.clip(1e3 * plan.zmp, outline.min(axis=0) - _AROUND_SOLE, outline.max(axis=0) + _AROUND_SOLE)
    _prepare_axes(axes, np.concatenate([outline, 1e3 * plan.com[:, :2], 1e3 * plan.assigned_zmp, near]))


def _prepare_axes(axes: Axes, shown: Array) -> None:
    """Give axes one scale, limits around what they show [mm], and labels."""
    low, high = shown.min(axis=0), shown.max(axis=0)
    margin = 0.04 * float((high - low).max())
    axes.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin), aspect="equal")
    style.label_axes(axes, "x [mm]", "y [mm]")


def _draw_surroundings(axes: Axes, scene: Scene) -> None:
    from matplotlib.patches import Rectangle

    ditch = scene.ditch
    if ditch is not None:
        near, far = 1e3 * np.array(ditch.edges)
        band = axes.axvspan if ditch.axis == 0 else axes.axhspan
        band(near, far, facecolor=style.DITCH_COLOR, zorder=0.5)
        _draw_width(axes, ditch.axis, near, far, ditch.label)
    for carton in scene.cartons:
        corner = (1e3 * carton.x[0], 1e3 * carton.y[0])
        size = (1e3 * (carton.x[1] - carton.x[0]), 1e3 * (carton.y[1] - carton.y[0]))
        axes.add_patch(
            Rectangle(corner, *size, facecolor=style.CARTON_COLOR, edgecolor=style.CARTON_EDGE, zorder=1.0)
        )


def _draw_width(axes: Axes, axis: int, near: float, far: float, label: str) -> None:
    """Draw a dimension along the lower or the right edge of the axes [mm]."""
    edge = 0.035 if axis == 0 else 0.965
    place = axes.get_xaxis_transform() if axis == 0 else axes.get_yaxis_transform()
    ends = [(near, edge), (far, edge)] if axis == 0 else [(edge, near), (edge, far)]
    axes.plot(*zip(*ends, strict=True), transform=place, color=style.INK, linewidth=1.1, zorder=2.5)
    for end in ends:
        tick = "|" if axis == 0 else "_"
        axes.plot(*end, transform=place, color=style.INK, marker=tick, markersize=8.0, zorder=2.5)
    axes.annotate(
        label,
        (0.5 * (ends[0][0] + ends[1][0]), 0.5 * (ends[0][1] + ends[1][1])),
        xycoords=place,
        xytext=(0.0, 4.0) if axis == 0 else (-4.0, 0.0),
        textcoords="offset points",
        ha="center" if axis == 0 else "right",
        va="bottom" if axis == 0 else "center",
        rotation=0.0 if axis == 0 else 90.0,
        fontsize=style.TEXT_SIZE,
        color=style.INK,
        zorder=2.5,
    )


def _fill_support(axes: Axes, plan: Plan, outline: Array) -> None:
    from matplotlib.patches import Polygon

    color = style.LEG_COLORS[opposite(plan.step.swing)]
    corners = [(x, y) for x, y in outline]
    axes.add_patch(Polygon(corners, facecolor="none", edgecolor=color, zorder=2.0, **style.SUPPORT_FILL))


def _draw_body(axes: Axes, plan: Plan, bodies: Bodies, point: int, strength: float, zorder: float) -> None:
    from matplotlib.patches import Circle

    ink = style.tint(style.INK, strength)
    swing_side = 0 if plan.step.swing == "left" else 1
    for side in (1 - swing_side, swing_side):
        color = style.tint(style.LEG_COLORS[SIDES[side]], strength)
        corners = 1e3 * bodies.sole_corners[point, side, :, :2]
        axes.plot(*corners[[0, 1, 2, 3, 0]].T, color=color, linewidth=1.3, zorder=zorder)
        axes.plot(*(1e3 * bodies.ducts[point, side, :, :2]).T, color=color, linewidth=1.3, zorder=zorder)
        chain = 1e3 * bodies.leg_chain(point, side)[:, :2]
        axes.plot(*chain.T, color=color, zorder=zorder + 1.0, **_LEG_LINE)
    share = max(plan.thrust[point], 0.0) / plan.step.robot.max_thrust
    disc = Circle(
        tuple(1e3 * plan.fan[point, :2]),
        1e3 * DUCT_RADIUS * float(np.sqrt(share)),
        facecolor=style.tint(style.THRUST_COLOR, strength),
        edgecolor="none",
        zorder=zorder + 2.0,
    )
    axes.add_patch(disc)
    hips = 1e3 * bodies.hips[point, :, :2]
    axes.plot(*hips.T, color=ink, linewidth=3.0, solid_capstyle="round", zorder=zorder + 3.0)


def _draw_balance(axes: Axes, plan: Plan, points: Sequence[int], scale: float) -> None:
    """Mark the centre of mass and both ZMPs at some swing points."""
    for order, point in enumerate(points):
        strength = style.strength(order, len(points))
        for x_y, look in (
            (plan.com[point, :2], style.center_of_mass_marker(strength)),
            (plan.assigned_zmp[point], style.assigned_zmp_marker(strength)),
            (plan.zmp[point], style.achieved_zmp_marker(strength)),
        ):
            size = scale * look["markersize"]
            axes.plot(*(1e3 * x_y)[:, None], zorder=201.0 + order, **(look | {"markersize": size}))
