"""What the legends of a figure say."""

from __future__ import annotations

from typing import Any


def legend_texts(figure: Any) -> list[str]:
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]
