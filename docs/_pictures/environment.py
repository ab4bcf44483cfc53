"""What an agent sees and moves in ``JetHR1Step-v0``: the robot with its axes and quantities at one swing point.

python docs/_pictures/environment.py docs/images/environment.png
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon

from agents import make_planner
from jet_gym.figures import save_figure, style
from jet_gym.figures.scene import Bodies, bodies_of
from jet_gym.plan import Plan
from jet_gym.step import Step
from jet_gym.task.settings import TaskSettings
from jet_gym.utils.arrays import Array

STEP = Step("left", start=(0, 0.1125, 0), landing=(0.56, 0.04, 0), support=(0, -0.2, 0), apex=0.1, points=24)
POINT = 18  # where the swing foot is
SIDES = (("right", 1), ("left", 0))  # the support leg is nearer, and drawn last
AZIMUTH, ELEVATION = np.radians((-62.0, 24.0))  # of the camera: right of the robot, in front of it and above
MOVE = (0.6, -0.2, -0.8)  # an action
METRES_OF_NEWTON = 0.013  # of the arrow
SWING, SUPPORT = style.LEG_COLORS["left"], style.LEG_COLORS["right"]


def main(path: str) -> None:
    """Draw the picture."""
    plan = make_planner("gas").plan(STEP, seed=1)
    bodies = bodies_of(plan)
    figure = style.new_figure(10.0, 7.8)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.5, 1.0), height_ratios=(1.3, 1.0))
    views = (figure.add_subplot(grid[0, :]), figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1]))
    for axes, title in zip(views, ("what is seen", "balance, from above", "what an action moves"), strict=True):
        axes.set_title(title, fontsize=style.LABEL_SIZE, color=style.INK, style="italic")
        axes.set_aspect("equal")
        axes.axis("off")
    draw_robot(views[0], plan, bodies)
    draw_balance(views[1], plan, bodies)
    draw_action(views[2])
    style.add_heading(
        figure,
        "JetHR1Step-v0 at a swing point of the left foot",
        "numbers in brackets are components of the observation; a step of the right foot is mirrored",
    )
    save_figure(figure, path)


def seen(points: Any) -> Array:
    """Project positions (..., 3) [m] onto the picture (..., 2), without perspective."""
    right = np.array([-np.sin(AZIMUTH), np.cos(AZIMUTH), 0.0])
    up = np.array([*(-np.sin(ELEVATION) * np.array([np.cos(AZIMUTH), np.sin(AZIMUTH)])), np.cos(ELEVATION)])
    projected: Array = np.asarray(points, dtype=np.float64) @ np.column_stack([right, up])
    return projected


def arrow(axes: Axes, start: Any, end: Any, color: str, width: float = 1.6, zorder: float = 30.0) -> None:
    """Draw an arrow between two places of the picture."""
    look = {"arrowstyle": "-|>,head_width=0.22,head_length=0.5", "color": color, "linewidth": width}
    axes.annotate("", end, start, arrowprops=look | {"shrinkA": 0.0, "shrinkB": 0.0}, zorder=zorder)


def label(axes: Axes, text: str, at: Any, aside: Any, color: str = style.INK, **look: Any) -> None:
    """Write a label some way aside of what it belongs to, and lead a line there."""
    leader = {"arrowstyle": "-", "color": style.FAINT_INK, "linewidth": 0.8, "shrinkA": 1.0, "shrinkB": 3.0}
    look = {"ha": "center", "va": "center", "linespacing": 1.25} | look
    axes.annotate(
        text, at, np.add(at, aside), color=color, fontsize=style.TEXT_SIZE, arrowprops=leader, zorder=40.0, **look
    )


def name(axes: Axes, text: str, place: Any, color: str = style.INK, **look: Any) -> None:
    """Write a label beside what it belongs to."""
    look = {"ha": "center", "va": "center", "linespacing": 1.25} | look
    axes.text(*place, text, color=color, fontsize=style.TEXT_SIZE, zorder=40.0, **look)


def draw_frame(axes: Axes, origin: Any, length: float, names: Sequence[str] = (), width: float = 1.6) -> None:
    """Draw the three axes of a frame that is parallel to the world's."""
    for axis in range(3):
        end = np.array(origin, dtype=np.float64)
        end[axis] += length
        arrow(axes, seen(origin), seen(end), style.INK, width)
        if names:
            aside = ((0.055, -0.008), (0.012, 0.01), (0.0, 0.018))[axis]
            name(axes, names[axis], seen(end) + aside, style="italic")


def draw_robot(axes: Axes, plan: Plan, bodies: Bodies) -> None:
    """Draw the robot, its swing path, and what of it is observed."""
    axes.plot(*seen(plan.swing_sole).T, color=SWING, zorder=2.0, **style.SWING_PATH)
    for sole, line in ((STEP.start, ":"), (STEP.landing, "-")):
        outline = bodies.sole_corners[0, 0] - plan.swing_sole[0] + sole
        axes.add_patch(Polygon(seen(outline), facecolor="none", edgecolor=SWING, linestyle=line, linewidth=0.9))
    for side, leg in reversed(SIDES):
        draw_leg(axes, bodies, side, leg)
    hips = seen(bodies.hips[POINT])
    axes.plot(*hips.T, color=style.INK, linewidth=4.0, solid_capstyle="round", zorder=12.0)
    pelvis, com, fan = seen(plan.pelvis[POINT]), seen(plan.com[POINT]), plan.fan[POINT]
    axes.plot(*pelvis, color=style.INK, marker="o", markersize=6.5, markerfacecolor="white", zorder=31.0)
    axes.plot(*com, zorder=32.0, **style.center_of_mass_marker(1.0))
    tip = seen(np.add(fan, (0.0, 0.0, METRES_OF_NEWTON * plan.thrust[POINT])))
    arrow(axes, seen(fan), tip, style.THRUST_COLOR, 2.6)
    now, one, three = (seen(plan.swing_sole[POINT + more]) for more in (0, 1, 3))
    axes.plot(
        *np.transpose([now, one, three]), color=SWING, linestyle="none", marker="o", markersize=5.0, zorder=31.0
    )
    draw_frame(axes, STEP.support, 0.13, ("x, forward", "y", "z"))
    draw_frame(axes, (0.0, 0.0, 0.0), 0.07, width=1.0)

    stretch = seen([bodies.hips[POINT, 1], bodies.ankles[POINT, 1]])
    axes.plot(*stretch.T, color=style.FAINT_INK, linewidth=1.0, linestyle="--", zorder=4.0)
    label(axes, "pelvis [2 to 4],\nits roll and pitch\nas measured [29, 30]", pelvis, (-0.07, 0.105))
    label(axes, "centre of mass [17, 18]", com, (0.13, 0.11))
    label(axes, "how far a leg is stretched:\nswing [21], support [22]", stretch.mean(axis=0), (-0.15, -0.005))
    label(axes, "thrust of the swing fan [19],\nthe last one [24]", tip, (0.02, 0.06), style.THRUST_COLOR)
    label(axes, "swing sole [5 to 7]", now, (-0.07, -0.12), SWING)
    label(axes, "in one point [8 to 10]", one, (0.17, 0.085), SWING)
    label(axes, "in three points [11 to 13]", three, (0.17, 0.065), SWING)
    landing = seen(STEP.landing)
    label(axes, "landing [14 to 16]", landing, (0.13, 0.045), SWING)
    label(axes, "support sole:\norigin of what is seen", seen(STEP.support), (-0.175, -0.035), SUPPORT)
    label(axes, "world", seen((0, 0, 0)), (0.15, -0.045))
    axes.set(xlim=(-0.42, 0.8), ylim=(-0.145, 0.4))


def draw_leg(axes: Axes, bodies: Bodies, side: str, leg: int) -> None:
    """Draw a leg with its sole and its duct."""
    color = style.LEG_COLORS[side]
    zorder = 10.0 if side == "right" else 5.0
    sole = seen(bodies.sole_corners[POINT, leg])
    axes.add_patch(Polygon(sole, facecolor=(*style.tint(color, 1.0), 0.22), edgecolor=color, zorder=zorder))
    axes.plot(*seen(bodies.ducts[POINT, leg]).T, color=color, linewidth=1.6, zorder=zorder)
    axes.plot(*seen(bodies.leg_chain(POINT, leg)).T, color=color, zorder=zorder + 1.0, **style.LEG_LINE)


def draw_balance(axes: Axes, plan: Plan, bodies: Bodies) -> None:
    """Draw both soles from above, forward to the right, with the zero-moment point and the angle of eq. (10)."""
    for side, leg in SIDES:
        color = style.LEG_COLORS[side]
        sole = bodies.sole_corners[POINT, leg, :, :2]
        axes.add_patch(Polygon(sole, facecolor=(*style.tint(color, 1.0), 0.22), edgecolor=color))
    axes.plot(*bodies.ducts[POINT, 0, :, :2].T, color=SWING, linewidth=1.6)
    axes.add_patch(Circle(plan.fan[POINT, :2], 0.012, color=style.THRUST_COLOR))
    zmp, com, ankle = plan.assigned_zmp[POINT], plan.com[POINT, :2], plan.swing_sole[POINT, :2]
    axes.plot(*np.transpose([zmp, ankle]), color=style.LIMIT_COLOR, linewidth=1.0, linestyle="--")
    axes.plot(*np.transpose([zmp, com, ankle]), color=style.INK, linewidth=1.4)
    axes.plot(*zmp, zorder=32.0, **style.assigned_zmp_marker(1.0))
    axes.plot(*com, zorder=32.0, **style.center_of_mass_marker(1.0))
    axes.plot(*ankle, color=SWING, marker="o", markersize=5.0, zorder=31.0)
    label(axes, "assigned ZMP", zmp, (-0.01, -0.105), style.LIMIT_COLOR)
    label(axes, "centre of mass:\nfrom the ZMP [25, 26],\nto the dashed line [27, 28]", com, (0.23, -0.06))
    label(
        axes, "angle between both parts\nof the line, at most 5° [20]", com + 0.25 * (ankle - com), (-0.125, 0.11)
    )
    name(axes, "thrust", np.add(plan.fan[POINT, :2], (0.085, 0.015)), style.THRUST_COLOR)
    name(axes, "swing sole", np.add(ankle, (0.02, -0.068)), SWING)
    name(axes, "support sole", (0.0, STEP.support[1] + 0.068), SUPPORT)
    axes.set(xlim=(-0.14, 0.6), ylim=(-0.3, 0.19))


def draw_action(axes: Axes) -> None:
    """Draw the cube that the pelvis may move in, enlarged, and one move."""
    half = TaskSettings().later_range
    corners = np.array(list(product((-1.0, 1.0), repeat=3)))
    for one, other in product(corners, corners):
        if np.abs(one - other).sum() == 2.0 and (one < other).any():
            axes.plot(*seen([one, other]).T, color=style.FAINT_INK, linewidth=0.8, zorder=1.0)
    asides = ((1.45, -0.55), (1.9, 0.5), (0.0, 1.05))
    for axis, text in enumerate(("action[0]\nforward", "action[1]\nto the swing side", "action[2], up")):
        tip = seen(np.eye(3)[axis])
        arrow(axes, (0.0, 0.0), tip, style.INK, 1.2)
        label(axes, text, tip, asides[axis])
    move = seen(MOVE)
    arrow(axes, (0.0, 0.0), move, style.ACHIEVED_COLOR, 2.6)
    axes.plot(0.0, 0.0, color=style.INK, marker="o", markersize=6.5, markerfacecolor="white", zorder=31.0)
    millimetres = f"{1e3 * half:g} mm"
    label(axes, "pelvis\nwhere it is", (0.0, 0.0), (-2.25, 0.1))
    label(axes, "a move", move, (1.9, -0.65), style.ACHIEVED_COLOR)
    first = 1e3 * TaskSettings().first_range
    name(axes, f"at most {millimetres} along each axis,\nat the first point {first:g} mm", (-0.6, -2.1))
    axes.set(xlim=(-2.8, 3.1), ylim=(-2.4, 2.3))


if __name__ == "__main__":
    main(sys.argv[1])
    print(f"wrote {sys.argv[1]}")
