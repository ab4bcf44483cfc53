"""Names beside the points of a plot, none over another, over a point or over what is drawn of one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from jet_gym.figures import style
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MARKER = 6.0  # [pt] around the middle of a marker and the ends of a bar
_CLEAR = 2.0  # [pt] around a label
_NEAR = 14.0  # [pt] between a point and the middle of its label, beyond which a line leads there


@dataclass(frozen=True)
class LabelledPoint:
    """A point with its error bars and what it is called, in the data's coordinates.

    Attributes:
        name: The label.
        color: Its colour.
        x: From where to where the horizontal error bar goes, the point between them.
        y: Likewise the vertical one.
    """

    name: str
    color: str
    x: tuple[float, float, float]
    y: tuple[float, float, float]


def label_points(axes: Axes, points: Sequence[LabelledPoint]) -> None:
    """Write each point's name where it is free: right or left of it, as near to its height as others let it.

    It is called when all else of the figure is in place, as labels are placed in the finished layout. A label that
    finds no free place, in axes full of points, takes the first one.

    Args:
        axes: The axes, whose limits are final.
        points: The points.
    """
    figure = axes.get_figure(root=True)
    assert figure is not None
    figure.draw_without_rendering()  # which lays it out
    scale = 72.0 / figure.dpi  # [pt] of a pixel
    frame = scale * axes.get_window_extent().get_points().ravel()
    drawn = [_boxes(axes, point, scale) for point in points]
    taken = [box for boxes in drawn for box in boxes]
    for point, (_, across, _) in zip(points, drawn, strict=True):
        at = scale * axes.transData.transform((point.x[1], point.y[1]))
        width, height = _size(axes, point.name, scale)
        places = list(_places(at, across, width, height))
        free = (
            place for place in places if _is_inside(place, frame) and not any(_overlap(place, b) for b in taken)
        )
        place = next(free, places[0])
        taken.append(place)
        middle = 0.5 * (place[:2] + place[2:])
        side = "left" if middle[0] > at[0] else "right"
        start = place[0] + _CLEAR if side == "left" else place[2] - _CLEAR
        far = abs(middle[1] - at[1]) > _NEAR
        leader = {"arrowstyle": "-", "color": point.color, "linewidth": 0.7, "shrinkA": 0.0, "shrinkB": _MARKER}
        axes.annotate(
            point.name, (point.x[1], point.y[1]), xytext=(start - at[0], middle[1] - at[1]),
            textcoords="offset points", ha=side, va="center", fontsize=style.TEXT_SIZE, color=point.color,
            arrowprops=leader if far else None,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5},
        )  # fmt: skip


def _boxes(axes: Axes, point: LabelledPoint, scale: float) -> list[Array]:
    """Return the boxes (left, bottom, right, top) [pt] that a point and its bars take."""
    (left, x, right), (low, y, high) = point.x, point.y
    ends = scale * axes.transData.transform([(x, y), (left, y), (right, y), (x, low), (x, high)])
    around = np.array([-_MARKER, -_MARKER, _MARKER, _MARKER])
    boxes = ((ends[0], ends[0]), (ends[1], ends[2]), (ends[3], ends[4]))
    return [np.concatenate(box) + around for box in boxes]


def _size(axes: Axes, name: str, scale: float) -> tuple[float, float]:
    """Return width and height [pt] of a label with what is to stay clear around it."""
    text = axes.text(0.0, 0.0, name, fontsize=style.TEXT_SIZE, transform=axes.transAxes)
    extent = text.get_window_extent()
    text.remove()
    return scale * extent.width + 2.0 * _CLEAR, scale * extent.height + 2.0 * _CLEAR


def _places(at: Array, across: Array, width: float, height: float) -> Iterator[Array]:
    """Yield boxes for a label beside a point's horizontal bar, nearest heights first, right of it before left."""
    heights = (sign * 3.0 * k for k in range(120) for sign in (1.0, -1.0))
    for up, side in product(heights, (1.0, -1.0)):
        left = across[2] if side > 0.0 else across[0] - width
        bottom = at[1] + up - 0.5 * height
        yield np.array([left, bottom, left + width, bottom + height])


def _is_inside(box: Array, frame: Array) -> bool:
    return bool((box[:2] >= frame[:2]).all() and (box[2:] <= frame[2:]).all())


def _overlap(one: Array, other: Array) -> bool:
    return bool((one[:2] < other[2:]).all() and (other[:2] < one[2:]).all())
