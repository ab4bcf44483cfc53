"""One live plot: curves over time, with a line at the moment that is shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from jet_gym.figures.style import GRID, INK
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from viser import GuiApi, GuiTabHandle, GuiUplotHandle

_HEIGHT = 84  # [px]
_ROOM = 0.1  # of the range of values, above and below
_INSTANT = 1e-6  # [s] between the two ends of the cursor's line


@dataclass(frozen=True)
class Curve:
    """One line of a plot.

    Attributes:
        label: What it is.
        color: Its colour.
        dashed: Whether it is dashed, as a rival's lines and limits are.
        width: Its width [px].
    """

    label: str
    color: str
    dashed: bool = False
    width: float = 1.8


@dataclass(frozen=True, eq=False)
class Samples:
    """Values of one curve over time.

    Attributes:
        curve: The curve.
        time: Times (N,) [s].
        values: Values (N,).
    """

    curve: Curve
    time: Array
    values: Array


class Plot:
    """One plot under a line of HTML that names its curves in their colours.

    Args:
        gui: Where it is drawn.
        tab: The tab that it is drawn in.
        order: Its place in the tab; it takes two.
        title: What it shows.
        unit: In which unit; none where empty.
    """

    def __init__(self, gui: GuiApi, tab: GuiTabHandle, order: float, title: str, unit: str) -> None:
        self._gui, self._tab, self._order = gui, tab, order
        self._title, self._unit = title, unit
        with tab:
            self._heading = gui.add_html("", order=order)
        self._handle: GuiUplotHandle | None = None
        self._curves: tuple[Curve, ...] = ()
        self._time = np.zeros(2)
        self._values: list[Array] = []
        self._at = 0.0

    def show(self, samples: Sequence[Samples], time: float) -> None:
        """Draw curves, and the cursor at a time [s]."""
        self._at = time
        self._time = np.unique(np.concatenate([sample.time for sample in samples]))
        self._values = [
            np.interp(self._time, sample.time, sample.values, left=np.nan, right=np.nan) for sample in samples
        ]
        curves = tuple(sample.curve for sample in samples)
        if curves == self._curves and self._handle is not None:
            self._handle.data = self._data()
            if self._handle.scales != self._scales():
                self._handle.scales = self._scales()
            return
        self._curves = curves
        self._heading.content = _heading(self._title, self._unit, curves)
        if self._handle is not None:  # one with as many curves as data takes its place
            self._handle.remove()
        with self._tab:
            self._handle = self._gui.add_uplot(
                self._data(),
                _series(curves),
                axes=_axes(),
                scales=self._scales(),
                legend={"show": False},
                cursor={"drag": {"x": False, "y": False}},
                height=_HEIGHT,
                padding=(6, 8, 0, 0),
                order=self._order + 1.0,
            )

    def point_at(self, time: float) -> None:
        """Move the cursor's line to a time [s]."""
        self._at = time
        if self._handle is not None:
            self._handle.data = self._data()

    def _scales(self) -> dict[str, Any]:
        """Return the scales; where a curve ends before others, the page cannot find the range of values itself."""
        scales: dict[str, Any] = {"x": {"time": False}, "cursor": {"range": (0.0, 1.0)}}
        values = np.concatenate(self._values)
        if np.isnan(values).any():
            low, high = float(np.nanmin(values)), float(np.nanmax(values))
            room = max(_ROOM * (high - low), 1e-6)
            scales["x"]["range"] = (float(self._time[0]), float(self._time[-1]))
            scales["y"] = {"range": (low - room, high + room)}
        return scales

    def _data(self) -> tuple[Array, ...]:
        """Return the curves with two moments more, between which the cursor's line stands upright."""
        at = min(max(self._at, float(self._time[0])), float(self._time[-1]))
        instants = np.array([at, at + _INSTANT])
        where = np.searchsorted(self._time, instants)
        time = np.insert(self._time, where, instants)
        columns = [np.insert(v, where, np.interp(instants, self._time, v)) for v in self._values]
        cursor = np.full(len(time), np.nan)
        cursor[where + np.arange(2)] = 0.0, 1.0
        return (time, *columns, cursor)


def _heading(title: str, unit: str, curves: Sequence[Curve]) -> str:
    names = " ".join(
        f'<span style="color:{curve.color};white-space:nowrap">'
        f"{'╌' if curve.dashed else '━'}&thinsp;{curve.label}</span>"
        for curve in curves
        if curve.label
    )
    unit = f' <span style="color:#777">[{unit}]</span>' if unit else ""
    return (
        f'<div style="font-size:12px;line-height:1.25;padding:4px 12px 0"><b>{title}</b>{unit} &nbsp;{names}</div>'
    )


def _series(curves: Sequence[Curve]) -> tuple[Any, ...]:
    lines = tuple(
        {
            "label": curve.label or "limit",
            "stroke": curve.color,
            "width": curve.width,
            "points": {"show": False},
            **({"dash": (5.0, 4.0)} if curve.dashed else {}),
        }
        for curve in curves
    )
    cursor = {"label": "shown", "stroke": INK, "width": 1.2, "scale": "cursor", "points": {"show": False}}
    return ({"label": "time"}, *lines, cursor)


def _axes() -> tuple[Any, ...]:
    quiet = {
        "stroke": "#555",
        "grid": {"stroke": GRID, "width": 1.0},
        "font": "10px sans-serif",
        "ticks": {"show": False},
    }
    return {**quiet, "size": 20.0, "gap": 2.0}, {**quiet, "size": 40.0, "gap": 4.0, "space": 20.0}
