"""Films that the studio makes of its page."""

from __future__ import annotations

import io
import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest
from PIL import Image
from waiting import wait_for

from jet_gym.studio.outputs import Outputs
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


class Page:
    """A page that shows times, and a browser that draws a picture whenever it is let.

    Attributes:
        shown: The times [s] that were shown.
        outputs: What records films of it.
    """

    def __init__(self) -> None:
        self.shown: list[float] = []
        self.drawing, self.let = threading.Event(), threading.Event()
        self.client = MagicMock(client_id="film-test")
        self.client.get_render = self.draw
        player = SimpleNamespace(speed=1.0)
        self.session = MagicMock(lock=threading.RLock(), seek=self.shown.append, closed=False)
        self.session.playback = SimpleNamespace(motion=SimpleNamespace(start=0.0, end=1.0), player=player)
        self.outputs = Outputs(self.session, self.client)

    def draw(self, height: int, width: int, **_: Any) -> np.ndarray:
        self.drawing.set()
        assert self.let.wait(60.0)
        return np.zeros((height, width, 3), dtype=np.uint8)

    @property
    def films(self) -> list[str]:
        """Names of the films that the browser was given."""
        return [call.args[0] for call in self.client.send_file_download.call_args_list]

    @property
    def progress(self) -> bool:
        """Whether a progress bar is shown."""
        return bool(self.outputs.panel.progress.visible)


@pytest.fixture
def filmed(monkeypatch: pytest.MonkeyPatch) -> Iterator[Page]:
    """A page whose first film waits for its first picture."""
    monkeypatch.setattr("jet_gym.studio.outputs._FILM_SIZE", (8, 8))
    monkeypatch.setattr("jet_gym.studio.outputs._FILM_RATE", 4.0)
    page = Page()
    page.outputs.record("gif")
    assert page.drawing.wait(60.0)
    assert page.progress
    yield page
    page.let.set()
    page.outputs.close()
    wait_for(lambda: not any("film" in thread.name for thread in threading.enumerate()))


def test_newer_film_stops_the_older_and_is_recorded_alone(filmed: Page) -> None:
    filmed.outputs.record("gif")
    filmed.let.set()
    wait_for(lambda: filmed.films and not filmed.progress)
    assert filmed.shown == [0.0, 0.0, 0.25, 0.5, 0.75, 1.0]
    assert filmed.films == ["jet-hr1.gif"]


def test_film_of_a_plan_that_is_there_no_more_leaves_nothing(filmed: Page) -> None:
    filmed.outputs.forget()
    assert not filmed.progress
    filmed.let.set()
    wait_for(lambda: filmed.outputs._films.wait_until_idle(60.0))
    assert filmed.shown == [0.0]
    assert not filmed.progress
    assert filmed.films == []


def test_film_of_a_closed_page_ends_with_its_thread(filmed: Page) -> None:
    filmed.outputs.close()
    filmed.let.set()
    wait_for(lambda: not any("film" in thread.name for thread in threading.enumerate()))
    assert filmed.shown == [0.0]
    assert filmed.films == []


def test_film_ends_where_another_motion_is_shown(filmed: Page) -> None:
    filmed.session.playback.motion = SimpleNamespace(start=0.0, end=2.0)
    filmed.let.set()
    wait_for(lambda: not filmed.progress)
    assert filmed.shown == [0.0]
    assert "another motion is shown" in filmed.outputs.panel.outcome.content
    assert filmed.films == []
