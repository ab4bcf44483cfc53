"""Films of what a page shows, as it is drawn in the browser."""

from __future__ import annotations

import io
import itertools
import tempfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from jet_gym.errors import SettingsError
from jet_gym.simulation.pictures.encoding import write_mp4

FilmKind = Literal["mp4", "gif"]
FILM_KINDS = get_args(FilmKind)

Picture = NDArray[np.uint8]
"""Red, green and blue (height, width, 3) from 0 to 255."""


def encode_film(pictures: Iterable[Picture], kind: FilmKind, frames_per_second: float) -> bytes:
    """Make a film of pictures of one size.

    Args:
        pictures: The pictures, one at least.
        kind: ``"mp4"`` (H.264) or ``"gif"`` (endless, colours reduced to 256).
        frames_per_second: How fast it is played.

    Raises:
        SettingsError: If the kind is another or there is no picture.
    """
    if kind not in FILM_KINDS:
        raise SettingsError(f"a film is one of {', '.join(FILM_KINDS)}, not {kind!r}")
    remaining = iter(pictures)
    first = next(remaining, None)
    if first is None:
        raise SettingsError("a film needs one picture at least")
    everything = _even_sized(itertools.chain([first], remaining))
    return _gif(everything, frames_per_second) if kind == "gif" else _mp4(everything, frames_per_second)


def film_times(start: float, end: float, speed: float, frames_per_second: float) -> list[float]:
    """Return the times [s] that a film's frames show, both ends included."""
    count = max(round((end - start) / speed * frames_per_second), 1) + 1
    return [float(time) for time in np.linspace(start, end, count)]


def shoot(times: Iterable[float], show: Callable[[float], None], take: Callable[[], Picture]) -> Iterator[Picture]:
    """Yield a picture of each time.

    Args:
        times: The times [s].
        show: Shows a time.
        take: Takes a picture of what is shown.
    """
    for time in times:
        show(time)
        yield np.ascontiguousarray(take()[..., :3])


def _even_sized(pictures: Iterable[Picture]) -> Iterator[Picture]:
    """Cut pictures to an even width and height, which H.264 wants."""
    for picture in pictures:
        height, width = picture.shape[:2]
        yield np.ascontiguousarray(picture[: height - height % 2, : width - width % 2])


def _mp4(pictures: Iterator[Picture], frames_per_second: float) -> bytes:
    first = next(pictures)
    size = first.shape[1], first.shape[0]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "film.mp4"
        write_mp4(file, itertools.chain([first], pictures), size, frames_per_second)
        return file.read_bytes()


def _gif(pictures: Iterator[Picture], frames_per_second: float) -> bytes:
    from PIL import Image

    images = [Image.fromarray(picture).quantize(colors=256, dither=Image.Dither.NONE) for picture in pictures]
    file = io.BytesIO()
    images[0].save(
        file, format="GIF", save_all=True, append_images=images[1:], duration=round(1e3 / frames_per_second), loop=0
    )
    return file.getvalue()
