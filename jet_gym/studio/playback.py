"""Which moment of a motion is shown, and how it passes."""

from __future__ import annotations

from collections.abc import Callable
from threading import RLock
from time import monotonic

from jet_gym.studio.motion import Motion
from jet_gym.studio.player import Player

_PAUSE_AT_END = 1.2  # [s] before a motion that plays begins again
_PLOT_INTERVAL = 0.12  # [s] between two places of the plots' cursor while time passes


class Playback:
    """The motion that is played, and the moment of it that is shown.

    Attributes:
        motion: The plan's motion or the simulated one; none at first.
        player: The clock.

    Args:
        show: Shows the moment; told whether the plots' cursor is to move with it.
        lock: Held while time passes.
        name: Name of the clock's thread.
    """

    def __init__(self, show: Callable[[bool], None], lock: RLock, name: str) -> None:
        self.motion: Motion | None = None
        self._time = 0.0  # [s]
        self._show, self._lock = show, lock
        self._cursor_moved = 0.0  # [s] when the plots' cursor was last moved while time passed
        self.player = Player(self._advance, name)

    @property
    def time(self) -> float:
        """The moment [s]; where there is a motion, one of its own."""
        if self.motion is None:
            return self._time
        return min(max(self._time, self.motion.start), self.motion.end)

    @time.setter
    def time(self, time: float) -> None:
        self._time = time

    def _advance(self, elapsed: float) -> None:
        """Let time pass; at the end, after a pause, the motion begins again."""
        with self._lock:
            if self.motion is None:
                return
            self._time += elapsed
            if self._time > self.motion.end + _PAUSE_AT_END * self.player.speed:
                self._time = self.motion.start
            now = monotonic()
            move_cursor = now - self._cursor_moved > _PLOT_INTERVAL
            self._cursor_moved = now if move_cursor else self._cursor_moved
            self._show(move_cursor)
