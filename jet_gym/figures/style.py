"""One look for every figure: colours that colour-blind readers tell apart, lines, sizes, labels and headings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from jet_gym.leg import opposite
from jet_gym.step import Step
from jet_gym.utils.arrays import Array
from jet_gym.utils.statistics import Interval

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TITLE_SIZE = 12.0  # [pt]
LABEL_SIZE = 10.5  # [pt]
TEXT_SIZE = 9.5  # [pt]

INK = "#222222"
FAINT_INK = "#8A8A8A"
GRID = "#DDDDDD"

# Okabe and Ito's palette, which holds for the three common kinds of colour blindness.
LEG_COLORS = {"left": "#0072B2", "right": "#D55E00"}
ACHIEVED_COLOR = "#009E73"  # the ZMP as achieved
THRUST_COLOR = "#B5338A"
LIMIT_COLOR = "#B00020"

DITCH_COLOR = "#C3D3DC"
CARTON_COLOR = "#EBD9B4"
CARTON_EDGE = "#8B6B3A"

# Lines that figures share, as keyword arguments of ``Axes.plot``.
SWING_PATH: dict[str, Any] = {"linewidth": 1.4, "linestyle": (0, (4.0, 2.0))}
PELVIS_PATH: dict[str, Any] = {"linewidth": 1.8, "linestyle": (0, (0.9, 0.9))}
LEG_LINE: dict[str, Any] = {"linewidth": 3.2, "marker": "o", "markersize": 4.4, "solid_capstyle": "round"}
SUPPORT_FILL: dict[str, Any] = {"hatch": "////", "linewidth": 0.0, "alpha": 0.55}

LIMIT_LINE: dict[str, Any] = {"color": LIMIT_COLOR, "linewidth": 1.2, "linestyle": (0, (4, 2))}

LineStyle = str | tuple[int, tuple[float, ...]]


@dataclass(frozen=True)
class CurveStyle:
    """How a planner's curves look.

    Attributes:
        label: The planner's name in a legend.
        color: Colour as ``#RRGGBB``.
        line: Line style of matplotlib.
        width: Line width [pt].
    """

    label: str
    color: str
    line: LineStyle
    width: float


_PLANNER_STYLES = {
    "gas": CurveStyle("GAS", "#0072B2", "-", 2.2),
    "ga": CurveStyle("GA", "#E69F00", "-", 1.3),
    "gaex": CurveStyle("GAEx", "#009E73", (0, (5.0, 1.5)), 1.6),
    "optimal": CurveStyle("optimal", "#000000", (0, (1.5, 1.2)), 2.0),
    "policy": CurveStyle("policy", "#CC79A7", (0, (6.0, 1.5, 1.5, 1.5)), 2.0),
}
_OTHER_COLORS = ("#56B4E9", "#D55E00", "#7A5C00", "#6A4C93", "#5B5B5B")


def planner_styles(planners: Iterable[str]) -> dict[str, CurveStyle]:
    """Return how each planner's curves look; planners without a look of their own share out what is left.

    Args:
        planners: Names of planners; the same name more than once counts once.
    """
    styles: dict[str, CurveStyle] = {}
    for name in planners:
        if name not in styles:
            others = sum(known not in _PLANNER_STYLES for known in styles)
            other = CurveStyle(name, _OTHER_COLORS[others % len(_OTHER_COLORS)], "-", 1.6)
            styles[name] = _PLANNER_STYLES.get(name, other)
    return styles


def planner_style(planner: str) -> CurveStyle:
    """Return how one planner's curves look."""
    return planner_styles([planner])[planner]


def tint(color: str, strength: float) -> tuple[float, float, float]:
    """Mix a colour with white: strength 1 is the colour itself, 0 is white."""
    from matplotlib.colors import to_rgb

    red, green, blue = (1.0 - strength * (1.0 - channel) for channel in to_rgb(color))
    return red, green, blue


def strength(order: int, count: int) -> float:
    """Return how strong a frame of a sequence is drawn: early ones faint, the last one full."""
    return 1.0 if count == 1 else float(0.38 + 0.62 * (order / (count - 1)) ** 1.4)


def center_of_mass_marker(strength: float) -> dict[str, Any]:
    """Return keyword arguments of ``Axes.plot`` for a centre of mass: a disc, half dark."""
    dark = tint(INK, strength)
    return {
        "linestyle": "none",
        "marker": "o",
        "markersize": 7.5,
        "fillstyle": "left",
        "markerfacecolor": dark,
        "markerfacecoloralt": "white",
        "markeredgecolor": dark,
    }


def assigned_zmp_marker(strength: float) -> dict[str, Any]:
    """Return keyword arguments of ``Axes.plot`` for an assigned ZMP: a cross."""
    color = tint(LIMIT_COLOR, strength)
    return {"linestyle": "none", "marker": "x", "markersize": 6.5, "markeredgecolor": color, "markeredgewidth": 1.6}


def achieved_zmp_marker(strength: float) -> dict[str, Any]:
    """Return keyword arguments of ``Axes.plot`` for an achieved ZMP: a diamond."""
    color = tint(ACHIEVED_COLOR, strength)
    return {
        "linestyle": "none",
        "marker": "D",
        "markersize": 5.0,
        "markerfacecolor": color,
        "markeredgecolor": "white",
        "markeredgewidth": 0.6,
    }


def error_bars(intervals: Sequence[Interval], scale: float = 1.0) -> Array:
    """Return how far intervals reach below and above their means (2, N), as ``Axes.errorbar`` takes them."""
    below = [max(interval.mean - interval.low, 0.0) for interval in intervals]
    above = [max(interval.high - interval.mean, 0.0) for interval in intervals]
    return scale * np.array([below, above])


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure that belongs to no window and no global list.

    Args:
        width: Width [inch].
        height: Height [inch].
    """
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained", facecolor="white")


def label_axes(axes: Axes, x_label: str = "", y_label: str = "") -> None:
    """Give plane axes their labels, a quiet grid and no box.

    Args:
        axes: The axes.
        x_label: What x is, with its unit.
        y_label: What y is, with its unit.
    """
    axes.set_xlabel(x_label, fontsize=LABEL_SIZE, color=INK)
    axes.set_ylabel(y_label, fontsize=LABEL_SIZE, color=INK)
    axes.tick_params(labelsize=TEXT_SIZE, color=FAINT_INK, labelcolor=INK)
    axes.grid(True, color=GRID, linewidth=0.7)
    axes.set_axisbelow(True)
    for name, spine in axes.spines.items():
        spine.set_visible(name in ("left", "bottom"))
        spine.set_color(FAINT_INK)


def add_3d_axes(figure: Figure, *place: Any) -> Any:
    """Add axes in space with quiet panes, grid and numbers; in them ``zorder`` alone says what covers what.

    Args:
        figure: The figure.
        place: Where in it, as ``Figure.add_subplot`` takes it.
    """
    from matplotlib import rc_context

    with rc_context({"grid.color": GRID, "grid.linewidth": 0.7}):  # 3D axes take them from nowhere else
        axes: Any = figure.add_subplot(*place, projection="3d", computed_zorder=False)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color("#F7F7F7")
        axis.line.set_color(FAINT_INK)
    axes.tick_params(labelsize=TEXT_SIZE - 1.0, labelcolor=INK, pad=1.0)
    return axes


def describe_step(step: Step) -> tuple[str, str]:
    """Name a step in plain words.

    Returns:
        Which foot goes how far and whither; from where to where [mm], past which foot.
    """
    forward, leftward, upward = (1e3 * (b - a) for a, b in zip(step.start, step.landing, strict=True))
    ways = (
        (forward, "forward", "backward"),
        (leftward, "to the left", "to the right"),
        (upward, "up", "down"),
    )
    moves = [f"{abs(by):.4g} mm {more if by > 0.0 else less}" for by, more, less in ways if abs(by) >= 0.5]
    other = opposite(step.swing)
    return (
        f"{step.swing.capitalize()} foot steps {' and '.join(moves)}",
        f"from {_millimetres(step.start)} to {_millimetres(step.landing)} mm; "
        f"the {other} foot stands at {_millimetres(step.support)} mm",
    )


def add_heading(figure: Figure, *lines: str) -> None:
    """Head a figure with a bold line and plain ones below it; what is drawn makes room for them."""
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    height = float(figure.get_figheight())
    below = 0.16  # [inch] from the upper edge
    for number, line in enumerate(lines):
        size, weight = (TITLE_SIZE, "bold") if number == 0 else (LABEL_SIZE, "normal")
        figure.text(0.5, 1.0 - below / height, line, ha="center", va="top", fontsize=size, weight=weight, color=INK)
        below += 1.55 * size / 72.0
    engine = figure.get_layout_engine()
    if isinstance(engine, ConstrainedLayoutEngine):
        engine.set(rect=(0.0, 0.0, 1.0, 1.0 - (below + 0.02) / height), w_pad=0.1, h_pad=0.06)


def _millimetres(position: Iterable[float]) -> str:
    numbers = ", ".join(f"{1e3 * value + 0.0:.4g}" for value in position)
    return f"({numbers})".replace("-", "\u2212")
