"""What is drawn over a picture: support, centre of mass, ZMP, thrust and the swing foot's path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jet_gym.balance import BalanceSettings
from jet_gym.ground import sole_corners
from jet_gym.leg import opposite
from jet_gym.simulation.pictures.camera import Camera
from jet_gym.step import Step
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from PIL.Image import Image

METERS_PER_NEWTON = 0.012  # [m/N] length of the thrust arrow

_SCALE = 3  # the drawing is this much larger before it is made smaller
_INK = (34, 34, 34)
_PAPER = (255, 255, 255)
_SUPPORT = (0, 114, 178)
_ACHIEVED = (0, 158, 115)
_ASSIGNED = (230, 130, 0)
_THRUST = (181, 51, 138)
_PATH = (213, 94, 0)
_LEAST_ARROW = 0.25  # [N] a smaller thrust has no arrow

Color = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Overlay:
    """What to draw over a picture, as far as it is given. World frame.

    Attributes:
        support: Corners of the support sole (N, 3) [m].
        safe_support: Corners of what the margin leaves of it (N, 3) [m].
        center_of_mass: Centre of mass (3,) [m].
        ground: Height [m] to which centre of mass and ZMP are projected.
        assigned_zmp: Assigned ZMP (2,) [m].
        zmp: Achieved ZMP (2,) [m]; NaN is not drawn.
        fan: Where the thrust acts (3,) [m].
        thrust: Thrust [N].
        fan_axis: Direction of the thrust (3,).
        swing_path: Path of the swing sole (N, 3) [m].
        caption: A line of text at the top.
    """

    support: ArrayLike | None = None
    safe_support: ArrayLike | None = None
    center_of_mass: ArrayLike | None = None
    ground: float = 0.0
    assigned_zmp: ArrayLike | None = None
    zmp: ArrayLike | None = None
    fan: ArrayLike | None = None
    thrust: float | None = None
    fan_axis: ArrayLike = (0.0, 0.0, 1.0)
    swing_path: ArrayLike | None = None
    caption: str = ""

    @classmethod
    def of_step(
        cls,
        step: Step,
        zmp_margin: float = BalanceSettings.zmp_margin,
        *,
        center_of_mass: ArrayLike | None = None,
        assigned_zmp: ArrayLike | None = None,
        zmp: ArrayLike | None = None,
        fan: ArrayLike | None = None,
        thrust: float | None = None,
        fan_axis: ArrayLike = (0.0, 0.0, 1.0),
        caption: str = "",
    ) -> Overlay:
        """Return an overlay with the support sole and the swing path of a step.

        Args:
            step: The step.
            zmp_margin: Distance that planning keeps between ZMP and the sole's edge [m].
            center_of_mass: See the class, and so on.
        """
        support_leg = step.robot.leg(opposite(step.swing))
        return cls(
            support=sole_corners(support_leg) + step.support,
            safe_support=sole_corners(support_leg, zmp_margin) + step.support,
            center_of_mass=center_of_mass,
            ground=step.support[2],
            assigned_zmp=assigned_zmp,
            zmp=zmp,
            fan=fan,
            thrust=thrust,
            fan_axis=fan_axis,
            swing_path=step.swing_sole,
            caption=caption,
        )


def draw_overlay(picture: NDArray[np.uint8], camera: Camera, overlay: Overlay) -> NDArray[np.uint8]:
    """Draw over a picture.

    Args:
        picture: The picture (height, width, 3).
        camera: The camera that took it.
        overlay: What to draw.

    Returns:
        A new picture (height, width, 3).
    """
    from PIL import Image as Images

    height, width = picture.shape[:2]
    sheet = Images.fromarray(picture).resize((_SCALE * width, _SCALE * height), Images.Resampling.NEAREST)
    pen = _Pen(sheet, camera)
    _draw_support(pen, overlay)
    _draw_path(pen, overlay)
    _draw_balance(pen, overlay)
    _draw_thrust(pen, overlay)
    _draw_text(pen, overlay)
    return np.asarray(sheet.reduce(_SCALE))


class _Pen:
    """Draws on an enlarged sheet; lengths are those of a picture 480 pixels high."""

    def __init__(self, sheet: Image, camera: Camera) -> None:
        from PIL import ImageDraw

        self._draw = ImageDraw.Draw(sheet, "RGBA")  # blends
        self._camera = camera
        self._unit = sheet.height / 480.0
        self.width, self.height = sheet.width / self._unit, 480.0

    def at(self, points: ArrayLike) -> Array:
        """Return where points (..., 3) [m] are on the sheet."""
        return self._camera.project(points)[0] * (480.0 / self._camera.height)

    def polygon(self, corners: Array, fill: Color) -> None:
        self._draw.polygon(self._flat(corners), fill=fill)

    def line(self, points: Array, color: Color, width: float) -> None:
        self._draw.line(self._flat(points), fill=color, width=round(self._unit * width), joint="curve")

    def disc(self, middle: Array, radius: float, fill: Color | None, outline: Color, width: float = 1.0) -> None:
        self._draw.ellipse(self._box(middle, radius), fill=fill, outline=outline, width=round(self._unit * width))

    def quarters(self, middle: Array, radius: float) -> None:
        """Draw the usual sign of a centre of mass."""
        self.disc(middle, radius + 1.0, _PAPER, _PAPER)
        for start in (0.0, 180.0):
            self._draw.pieslice(self._box(middle, radius), start, start + 90.0, fill=_INK)
        self.disc(middle, radius, None, _INK, 1.2)

    def text(self, place: Sequence[float], text: str, color: Color, size: float, anchor: str = "lm") -> None:
        from PIL import ImageFont

        font = ImageFont.load_default(self._unit * size)
        x, y = (self._unit * value for value in place)
        halo = round(1.6 * self._unit)
        self._draw.text((x, y), text, color, font, anchor, stroke_width=halo, stroke_fill=(*_PAPER, 215))

    def _flat(self, points: Array) -> list[float]:
        return [float(value) for value in (self._unit * points).ravel()]

    def _box(self, middle: Array, radius: float) -> list[float]:
        x, y = middle
        return [self._unit * value for value in (x - radius, y - radius, x + radius, y + radius)]


def _draw_support(pen: _Pen, overlay: Overlay) -> None:
    if overlay.support is not None:
        corners = pen.at(overlay.support)
        pen.polygon(corners, (*_SUPPORT, 70))
        pen.line(np.vstack([corners, corners[:2]]), (*_SUPPORT, 235), 1.6)
    if overlay.safe_support is not None:
        corners = pen.at(overlay.safe_support)
        for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            for share in np.arange(0.0, 1.0, 0.125):
                dash = [start + (share + part) * (end - start) for part in (0.0, 0.07)]
                pen.line(np.array(dash), (*_SUPPORT, 235), 1.1)


def _draw_path(pen: _Pen, overlay: Overlay) -> None:
    if overlay.swing_path is None:
        return
    path = pen.at(overlay.swing_path)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    for place in np.arange(0.0, length[-1] + 1e-6, 6.0):
        dot = np.array([np.interp(place, length, path[:, axis]) for axis in (0, 1)])
        pen.disc(dot, 1.5, (*_PATH, 230), (*_PATH, 0), 0.0)


def _draw_balance(pen: _Pen, overlay: Overlay) -> None:
    if overlay.center_of_mass is not None:
        center = np.asarray(overlay.center_of_mass)
        below = np.array([center[0], center[1], overlay.ground])
        plumb = pen.at(np.array([center, below]))
        pen.line(plumb, (*_INK, 150), 1.0)
        cross = pen.at(below + 0.008 * np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0]]))
        pen.line(cross[:2], _INK, 1.6)
        pen.line(cross[2:], _INK, 1.6)
        pen.quarters(plumb[0], 5.5)
    if overlay.assigned_zmp is not None:
        _ring(pen, pen.at((*np.asarray(overlay.assigned_zmp), overlay.ground)))
    if overlay.zmp is not None and np.isfinite(overlay.zmp).all():
        _dot(pen, pen.at((*np.asarray(overlay.zmp), overlay.ground)))


def _ring(pen: _Pen, place: Array) -> None:
    """Sign of the assigned ZMP."""
    pen.disc(place, 6.0, None, _PAPER, 3.6)
    pen.disc(place, 5.2, None, _ASSIGNED, 2.0)


def _dot(pen: _Pen, place: Array) -> None:
    """Sign of the achieved ZMP."""
    pen.disc(place, 3.4, _ACHIEVED, _PAPER, 0.8)


def _draw_thrust(pen: _Pen, overlay: Overlay) -> None:
    if overlay.fan is None or overlay.thrust is None or not overlay.thrust > _LEAST_ARROW:
        return
    fan = np.asarray(overlay.fan, dtype=np.float64)
    tail, tip = pen.at(np.array([fan, fan + METERS_PER_NEWTON * overlay.thrust * np.asarray(overlay.fan_axis)]))
    size = min(9.0, 0.7 * float(np.hypot(*(tip - tail))))
    along = (tip - tail) / max(float(np.hypot(*(tip - tail))), 1e-9)
    side = np.array([-along[1], along[0]])
    neck = tip - size * along
    for color, extra in (((*_PAPER, 220), 1.2), ((*_THRUST, 255), 0.0)):
        pen.line(np.array([tail, neck]), color, 3.4 + 2.0 * extra)
        head = [tip + 1.6 * extra * along, neck - extra * along + (0.5 * size + 1.4 * extra) * side]
        head.append(neck - extra * along - (0.5 * size + 1.4 * extra) * side)
        pen.polygon(np.array(head), color)
    pen.text((tip[0], tip[1] - 9.0), f"{overlay.thrust:.1f} N", _THRUST, 13.0, "mm")


def _draw_text(pen: _Pen, overlay: Overlay) -> None:
    """Write the caption, and what the signs mean."""
    if overlay.caption:
        pen.text((12.0, 18.0), overlay.caption, _INK, 15.0)
    row = pen.height - 14.0
    signs = (
        (overlay.zmp, _dot, "ZMP"),
        (overlay.assigned_zmp, _ring, "assigned ZMP"),
        (overlay.center_of_mass, lambda pen, place: pen.quarters(place, 5.5), "centre of mass"),
    )
    for given, sign, name in signs:
        if given is not None:
            sign(pen, np.array([18.0, row]))
            pen.text((29.0, row), name, _INK, 11.0)
            row -= 16.0
