"""Ctrl-C and SIGTERM: heard once, by the process that was started, and never lost in a finaliser."""

from __future__ import annotations

import _thread
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

_LATER = 0.05  # [s] after a lost Ctrl-C at which it is raised again
Result = TypeVar("Result")


def call_in_worker(parent: int, function: Callable[..., Result], *arguments: Any) -> Result:
    """Call a function, deaf to Ctrl-C where this is a process other than the parent, which ends its workers.

    A terminal sends Ctrl-C to workers too, and they would print where they were.

    Args:
        parent: Process that waits for the result, ``os.getpid()`` there.
        function: What is called.
        arguments: Its arguments.
    """
    if os.getpid() != parent and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    return function(*arguments)


@contextmanager
def no_interrupt_lost() -> Iterator[None]:
    """Raise a Ctrl-C again that came while an object was finalised, where Python prints exceptions and goes on.

    PyBullet's client is such an object; so are others.
    """
    before = sys.unraisablehook

    def hook(lost: Any) -> None:
        if lost.exc_type is KeyboardInterrupt:
            again = threading.Timer(_LATER, _thread.interrupt_main)  # here and now it would be lost again
            again.daemon = True
            again.start()
        else:
            before(lost)

    sys.unraisablehook = hook
    try:
        yield
    finally:
        sys.unraisablehook = before


@contextmanager
def terminated_as_interrupted() -> Iterator[None]:
    """Let SIGTERM, with which a cluster or a service ends a process, end the work as Ctrl-C does.

    By itself it would end the process on the spot, with workers, their semaphores and unfinished files left over.
    It is ours where nobody else has taken it, and only in the main thread, where Python lets it be taken.
    """
    in_main = threading.current_thread() is threading.main_thread()
    if not in_main or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
