"""Cores: work divided among threads, as compiled code lets go of Python's lock, and work that keeps to one."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from typing import TypeVar

from jet_gym.utils.progress import Progress

Share = TypeVar("Share")


def available_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def one_core() -> Iterator[None]:
    """Keep this process to one core, where the system lets it choose, so that times compare."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def for_each(
    work: Callable[[Share], object],
    shares: Iterable[Share],
    threads: int | None = None,
    progress: Progress | None = None,
) -> None:
    """Do work on shares in any order, as many at a time as there are threads.

    The first share is done alone, by the caller itself: what it compiles, for a minute at the first use, Ctrl-C
    ends at once, while a thread that compiles would have to be waited for.

    Args:
        work: What is done with a share; it spends its time in compiled code.
        shares: The shares, each so small that Ctrl-C, which lets those under way finish, is not kept waiting.
        threads: Number of threads; as many as there are cores where omitted.
        progress: Called with how many of how many shares are done.

    Raises:
        Exception: The first that a share raises; shares that have not begun then never do.
    """
    shares = list(shares)
    for first in shares[:1]:
        work(first)
        if progress is not None:
            progress(1, len(shares))
    pool = ThreadPoolExecutor(threads or available_cores(), thread_name_prefix="jet_gym")
    try:
        futures = [pool.submit(work, share) for share in shares[1:]]
        for done, future in enumerate(as_completed(futures), start=2):
            future.result()
            if progress is not None:
                progress(done, len(shares))
    finally:
        pool.shutdown(cancel_futures=True)
