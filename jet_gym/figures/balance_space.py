"""Fig. 5 of the paper, the balance space as clouds of points, and what lies in it at the height of the ground."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from jet_gym.balance_space import BalanceSpace
from jet_gym.figures import style
from jet_gym.ground import sole_corners
from jet_gym.kinematics import forward_kinematics
from jet_gym.leg import opposite
from jet_gym.robot import Robot, jet_hr1
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_CLOUD_COLORS = ("#7A0010", "#FF6F61")  # near the ground, high up
_ELEVATION, _AZIMUTH = 22.0, -52.0  # [deg]
_TALLEST = 480.0  # [mm] the hips of the robot in the picture, or below
_THRUST_STEPS = 2.5  # [N]
_SHARE_LEVELS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)


def plot_balance_space(space: BalanceSpace, robot: Robot | None = None) -> Figure:
    """Draw the places of the swing foot, without thrust beside with it, as the paper's Fig. 5 does.

    Args:
        space: The balance space.
        robot: The robot that stands in the picture, on straight legs; Jet-HR1 where omitted.
    """
    robot = robot or jet_hr1()
    figure = style.new_figure(12.6, 5.5)
    limits = _limits(space)
    for panel, with_thrust in enumerate((False, True)):
        axes = style.add_3d_axes(figure, 1, 2, panel + 1)
        _prepare(axes, limits)
        reachable = space.reachable(with_thrust=with_thrust)
        points = 1e3 * _places(space, reachable)
        _draw_cloud(axes, points, limits[1][2])
        _draw_robot(axes, space, robot)
        name = f"with up to {space.settings.max_thrust:g} N" if with_thrust else "without thrust"
        volume = 1e3 * space.volume(with_thrust=with_thrust)
        axes.set_title(
            f"({'ab'[panel]}) {name}: {volume:.0f} litres, {len(points)} points",
            fontsize=style.LABEL_SIZE + 0.5, color=style.INK, y=1.0,
        )  # fmt: skip
    style.add_heading(
        figure,
        f"Where {space.robot} can have its {space.swing} foot and balance on the other",
        f"every place of a grid of {1e3 * space.resolution:g} mm at which some posture balances; "
        f"thrust model: {_MODEL_NAMES[space.settings.thrust_model]}",
    )
    return figure


_MODEL_NAMES = {"assigned": "assigned ZMP", "least": "least thrust"}


def plot_balance_section(space: BalanceSpace, robot: Robot | None = None) -> Figure:
    """Draw the places of the swing foot at the support sole's height: the thrust and the torque that they take.

    Args:
        space: The balance space; its grid has the height of the support sole.
        robot: The robot, whose soles are drawn; Jet-HR1 where omitted.
    """
    robot = robot or jet_hr1()
    level = int(np.argmin(np.abs(space.z - space.support[2])))
    figure = style.new_figure(12.6, 5.5)
    left, right = figure.subplots(1, 2, sharey=True)
    largest = space.settings.max_thrust or robot.max_thrust
    levels = np.append(np.arange(0.0, largest, _THRUST_STEPS), largest)
    _contours(figure, left, space, space.thrust[:, :, level], levels, "viridis_r", "least thrust [N]")
    _contours(
        figure, right, space, space.torque_share[:, :, level], np.array(_SHARE_LEVELS), "cividis_r",
        "least share of the servos' torque",
    )  # fmt: skip
    reachable = _shown(space.reachable(with_thrust=False)[:, :, level]).astype(float)
    for axes in (left, right):
        if 0.0 < reachable.mean() < 1.0:
            axes.contour(
                *_axes_mm(space), reachable, levels=[0.5], colors=[style.LIMIT_COLOR], linewidths=1.6, zorder=3.0
            )
        _draw_support(axes, space, robot)
        style.label_axes(axes, "forward x [mm]", "to the left y [mm]" if axes is left else "")
        axes.set_aspect("equal")
    _frame(left, space, level)
    left.set_title("thrust", fontsize=style.LABEL_SIZE + 0.5, color=style.INK)
    right.set_title("torque, with thrust or without", fontsize=style.LABEL_SIZE + 0.5, color=style.INK)
    style.add_heading(
        figure,
        f"The {space.swing} foot on level ground: the least that any posture takes at each place",
        f"within the red line the robot balances without thrust; grid of {1e3 * space.resolution:g} mm, "
        f"thrust model: {_MODEL_NAMES[space.settings.thrust_model]}",
    )
    return figure


def _places(space: BalanceSpace, reachable: Any) -> Array:
    """Return the chosen places (N, 3) [m]."""
    i, j, k = np.nonzero(reachable)
    return np.column_stack([space.x[i], space.y[j], space.z[k]])


def _limits(space: BalanceSpace) -> tuple[Array, Array]:
    """Return the corners of a box [mm] around the larger of both spaces and the support foot."""
    points = np.vstack([_places(space, space.reachable(with_thrust=True)), [space.support]])
    low, high = 1e3 * points.min(axis=0), 1e3 * points.max(axis=0)
    return low - (60.0, 60.0, 0.0), np.maximum(high, (0.0, 0.0, _TALLEST)) + 40.0


def _prepare(axes: Any, limits: tuple[Array, Array]) -> None:
    low, high = limits
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=1.27)
    axes.view_init(elev=_ELEVATION, azim=_AZIMUTH)
    for axis, name in ((axes.xaxis, "x"), (axes.yaxis, "y")):
        axis.set_label_text(f"{name} [mm]", fontsize=style.LABEL_SIZE, color=style.INK)
    above = (*high[:2], high[2] + 0.09 * (high[2] - low[2]))  # matplotlib's own label falls upon the numbers
    axes.text(*above, "z [mm]", fontsize=style.LABEL_SIZE, color=style.INK, ha="center")


def _draw_cloud(axes: Any, points: Array, top: float) -> None:
    """Draw the points, higher ones lighter, so that the shape can be read."""
    from matplotlib.colors import LinearSegmentedColormap

    colors = LinearSegmentedColormap.from_list("height", _CLOUD_COLORS)
    axes.scatter(
        *points.T, c=points[:, 2], cmap=colors, vmin=0.0, vmax=0.7 * top, s=3.0, linewidths=0.0, alpha=0.55,
        depthshade=False, zorder=2.0, rasterized=True,
    )  # fmt: skip


def _draw_robot(axes: Any, space: BalanceSpace, robot: Robot) -> None:
    """Stand the robot on straight legs, its support sole in place."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    body = forward_kinematics(robot, np.zeros(12))
    side = 1 if space.swing == "left" else 0
    shift = np.array(space.support) - body.soles[side]
    for foot, color in enumerate(style.LEG_COLORS.values()):
        chain = 1e3 * (np.stack([body.hips[foot], body.knees[foot], body.ankles[foot], body.soles[foot]]) + shift)
        axes.plot(*chain.T, color=color, zorder=6.0, **(style.LEG_LINE | {"linewidth": 2.4, "markersize": 3.2}))
    hips = 1e3 * (body.hips + shift)
    axes.plot(*hips.T, color=style.INK, linewidth=3.2, solid_capstyle="round", zorder=6.0)
    sole = np.column_stack([_sole(space, robot), np.full(4, 1e3 * space.support[2])])
    color = list(style.LEG_COLORS.values())[side]
    axes.add_collection3d(Poly3DCollection([sole], facecolors=[color], edgecolors=[style.INK], zorder=5.0))
    x, y, z = (f"{1e3 * value + 0.0:g}".replace("-", "\u2212") for value in space.support)
    place = 1e3 * np.array(space.support)
    axes.text(
        place[0] - 110.0, place[1] - 120.0, place[2], f"support foot\n({x}, {y}, {z}) mm", fontsize=style.TEXT_SIZE,
        color=style.INK, zorder=7.0, ha="right", va="center",
        bbox={"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 1.5},
    )  # fmt: skip


def _sole(space: BalanceSpace, robot: Robot) -> Array:
    """Return the corners of the support sole (4, 2) [mm]."""
    corners = sole_corners(robot.leg(opposite(space.swing)))
    return np.asarray(1e3 * (corners[:, :2] + space.support[:2]))


def _axes_mm(space: BalanceSpace) -> tuple[Array, Array]:
    return 1e3 * space.x, 1e3 * space.y


def _shown(values: Any) -> Array:
    """Return values as contour plots want them, y down the rows."""
    return np.asarray(np.transpose(values))


def _contours(
    figure: Figure, axes: Axes, space: BalanceSpace, values: Array, levels: Array, colors: str, label: str
) -> None:
    drawn = axes.contourf(
        *_axes_mm(space), np.ma.masked_invalid(_shown(values)), levels=levels, cmap=colors, extend="max"
    )
    bar = figure.colorbar(drawn, ax=axes, shrink=0.82, pad=0.02)
    bar.set_label(label, fontsize=style.LABEL_SIZE, color=style.INK)
    bar.ax.tick_params(labelsize=style.TEXT_SIZE)


def _draw_support(axes: Axes, space: BalanceSpace, robot: Robot) -> None:
    from matplotlib.patches import Polygon

    color = style.LEG_COLORS[opposite(space.swing)]
    axes.add_patch(
        Polygon([(x, y) for x, y in _sole(space, robot)], facecolor=color, edgecolor=style.INK, zorder=4.0)
    )
    axes.annotate(
        "support foot", (1e3 * space.support[0], 1e3 * space.support[1]),
        xytext=(0.0, -34.0), textcoords="offset points", ha="center",
        fontsize=style.TEXT_SIZE, color=style.INK, zorder=5.0,
    )  # fmt: skip


def _frame(axes: Axes, space: BalanceSpace, level: int) -> None:
    """Limit shared axes to what is reachable."""
    shown = space.reachable(with_thrust=True)[:, :, level]
    x = 1e3 * np.append(space.x[shown.any(axis=1)], space.support[0])
    y = 1e3 * np.append(space.y[shown.any(axis=0)], space.support[1])
    for other in axes.figure.axes[:2]:
        other.set(xlim=(x.min() - 60.0, x.max() + 60.0), ylim=(y.min() - 90.0, y.max() + 60.0))
