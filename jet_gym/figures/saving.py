"""How a figure is saved: whole or not at all, and the same figure to the same bytes."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jet_gym.errors import SettingsError
from jet_gym.utils.files import check_writable, write_whole_with

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".pdf", ".svg")
"""What a figure can be saved as."""


def check_figure_path(path: str | Path) -> Path:
    """Refuse a path that no figure can be saved to, before the long computation that it is to show.

    Args:
        path: The file to be.

    Returns:
        The path.

    Raises:
        SettingsError: A ``ValueError``, if the suffix is none of :data:`SUFFIXES`.
        OSError: If the folder does not exist or cannot be written to, or the path is a folder.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise SettingsError(f"a figure cannot be saved as '{path}'; its name must end in {', '.join(SUFFIXES)}")
    check_writable(path)
    return path


def save_figure(figure: Figure, path: str | Path, dots_per_inch: float = 200.0) -> None:
    """Save a figure, whole or not at all; the same figure gives the same bytes.

    Args:
        figure: The figure.
        path: The file; its suffix says the format and its folder must exist.
        dots_per_inch: Resolution of a PNG.

    Raises:
        SettingsError: A ``ValueError``, if the suffix is none of :data:`SUFFIXES`.
        OSError: If the file cannot be written.
    """
    from matplotlib import rc_context

    path = check_figure_path(path)
    suffix = path.suffix.lower()
    no_date: dict[str, Any] = {".png": {}, ".pdf": {"CreationDate": None}, ".svg": {"Date": None}}[suffix]
    with rc_context({"svg.hashsalt": "jet_gym", "svg.fonttype": "path", "pdf.fonttype": 42}):
        write_whole_with(
            path,
            lambda temporary: figure.savefig(
                temporary, format=suffix[1:], dpi=dots_per_inch, facecolor="white", metadata=no_date
            ),
        )


def png_bytes(figure: Figure, dots_per_inch: float = 110.0) -> bytes:
    """Return a figure as a PNG; the same figure gives the same bytes.

    Args:
        figure: The figure.
        dots_per_inch: Resolution.
    """
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=dots_per_inch, facecolor="white", metadata={})
    return picture.getvalue()
