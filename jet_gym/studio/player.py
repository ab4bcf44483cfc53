"""The clock that plays a motion."""

from __future__ import annotations

import threading
from collections.abc import Callable
from time import monotonic

TICK = 0.04  # [s] between two poses


class Player:
    """Lets time pass in its own thread while it is told to play.

    Args:
        advance: Called with the time that has passed on the page's clock [s].
        name: Name of the thread.
    """

    def __init__(self, advance: Callable[[float], None], name: str) -> None:
        self._advance = advance
        self._changed = threading.Condition()
        self._advancing = threading.Lock()
        self._playing = False
        self._closed = False
        self.speed = 1.0
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @property
    def playing(self) -> bool:
        """Whether time passes; once set to false, no call of ``advance`` is under way any more."""
        return self._playing

    @playing.setter
    def playing(self, playing: bool) -> None:
        with self._changed:
            self._playing = playing
            self._changed.notify_all()
        if not playing and threading.current_thread() is not self._thread:
            with self._advancing:
                return

    def close(self) -> None:
        """End the thread; may be called twice."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _run(self) -> None:
        last = monotonic()
        while True:
            with self._changed:
                if not self._playing:
                    self._changed.wait_for(lambda: self._playing or self._closed)
                    last = monotonic()
                elif not self._closed:
                    self._changed.wait(TICK)
                if self._closed:
                    return
            with self._advancing:
                if self._playing:
                    now = monotonic()
                    self._advance(self.speed * (now - last))
                    last = now
