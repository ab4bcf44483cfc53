"""Colours of the figures and the simulation as viser wants them."""

from __future__ import annotations

from collections.abc import Sequence

Rgb = tuple[int, int, int]


def rgb(color: str | Sequence[float]) -> Rgb:
    """Return a colour as red, green and blue from 0 to 255.

    Args:
        color: ``"#RRGGBB"``, or red, green and blue from 0 to 1, with or without opacity.
    """
    if isinstance(color, str):
        digits = color.removeprefix("#")
        return int(digits[0:2], 16), int(digits[2:4], 16), int(digits[4:6], 16)
    red, green, blue = (round(255 * value) for value in color[:3])
    return red, green, blue
