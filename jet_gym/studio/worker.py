"""A background thread that does the latest job and forgets the ones before it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from jet_gym.utils.progress import Progress

Job = TypeVar("Job")
Stale = Callable[[], bool]
"""Tells whether a newer job has arrived, so that the work on this one can be given up."""


class StaleError(Exception):
    """A newer job has arrived, and the work on this one is given up."""


def give_up_if(stale: Stale) -> Progress:
    """Return what work is to tell its progress to; it raises :class:`StaleError` once the job is stale."""

    def told(_done: int, _parts: int) -> None:
        if stale():
            raise StaleError

    return told


class LatestWorker(Generic[Job]):
    """Works on one job at a time in its own thread, and always on the newest next.

    A job that arrives while another is worked on waits in a single place, where a still newer one replaces it; the
    work learns of it through the function that it is given. So however fast jobs arrive, the result is at most
    two jobs' work behind.

    Args:
        work: Does a job; called in the thread with the job and a function that tells whether it is stale. It
            must not raise.
        name: Name of the thread.
        patience: How long no newer job must have arrived before one is begun [s].
    """

    def __init__(self, work: Callable[[Job, Stale], None], name: str, patience: float = 0.0) -> None:
        self._work = work
        self._patience = patience
        self._changed = threading.Condition()
        self._waiting: tuple[int, Job] | None = None
        self._latest = 0  # number of the newest job; a job with another number is stale
        self._closed = False
        self._busy = False
        threading.Thread(target=self._run, name=name, daemon=True).start()

    def submit(self, job: Job) -> None:
        """Ask for a job in place of every one before it; nothing happens after :meth:`close`."""
        with self._changed:
            if not self._closed:
                self._latest += 1
                self._waiting = self._latest, job
                self._changed.notify_all()

    def drop(self) -> None:
        """Forget the job that waits, and let the one that is worked on know that it is stale."""
        with self._changed:
            self._latest += 1
            self._waiting = None
            self._changed.notify_all()

    def close(self) -> None:
        """End the thread as soon as its work lets it; may be called twice, and from the thread itself."""
        self.drop()
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def wait_until_idle(self, timeout: float) -> bool:
        """Wait until nothing waits or is worked on; return whether that came about in time [s]."""
        with self._changed:
            return self._changed.wait_for(lambda: self._waiting is None and not self._busy, timeout)

    def _run(self) -> None:
        while (taken := self._take()) is not None:
            number, job = taken
            self._work(job, lambda number=number: number != self._latest)  # type: ignore[misc]
            with self._changed:
                self._busy = False
                self._changed.notify_all()

    def _take(self) -> tuple[int, Job] | None:
        """Wait for a job that no newer one replaces for as long as the patience; ``None`` once closed."""
        with self._changed:
            while not self._closed:
                taken = self._waiting
                if taken is None:
                    self._changed.wait()
                elif self._patience and self._changed.wait_for(lambda: self._waiting is not taken, self._patience):  # noqa: B023
                    continue
                else:
                    self._waiting = None
                    self._busy = True
                    return taken
            return None
