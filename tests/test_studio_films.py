"""Films that the studio makes of its page."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from jet_gym.studio.recording import encode_film, film_times

PICTURES = [np.full((33, 47, 3), 40 * k, dtype=np.uint8) for k in range(5)]


def test_mp4_has_every_frame(tmp_path: Path) -> None:
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    file = tmp_path / "film.mp4"
    file.write_bytes(encode_film(PICTURES, "mp4", 20.0))
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(file))
    assert (frames, seconds) == (5, pytest.approx(0.25, abs=0.06))


def test_gif_has_every_frame_at_an_even_size() -> None:
    with Image.open(io.BytesIO(encode_film(PICTURES, "gif", 20.0))) as film:
        assert (film.format, film.n_frames, film.size) == ("GIF", 5, (46, 32))
        film.seek(3)
        assert film.convert("RGB").getpixel((10, 10)) == (120, 120, 120)


def test_film_of_nothing_or_of_another_kind_is_refused() -> None:
    with pytest.raises(ValueError, match="one picture at least"):
        encode_film([], "mp4", 20.0)
    with pytest.raises(ValueError, match="one of mp4, gif"):
        encode_film([np.zeros((8, 8, 3), np.uint8)], "avi", 20.0)  # type: ignore[arg-type]


def test_film_lasts_as_long_as_the_motion_at_its_speed() -> None:
    times = film_times(-1.0, 3.0, speed=2.0, frames_per_second=10.0)
    assert (times[0], times[-1], len(times)) == (-1.0, 3.0, 21)
