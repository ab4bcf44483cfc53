"""What code did that it should not do: written elsewhere, unpickled, run a program, hung."""

from __future__ import annotations

import os
import signal
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_CHANGES = {"os.mkdir": 0, "os.rename": 1, "os.remove": 0, "os.rmdir": 0, "os.symlink": 1, "os.link": 1}
_RUNS = {"subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.fork", "socket.connect"}


class HungError(BaseException):
    """What was watched took too long; not an Exception, so that nothing takes it for an error of its own."""


@dataclass
class Deeds:
    """What was done while it was watched.

    Attributes:
        written: Files and folders made, opened for writing, renamed to or removed.
        unpickled: Globals that unpickling looked up.
        run: Programs and connections that were started.
    """

    written: list[Path] = field(default_factory=list)
    unpickled: list[str] = field(default_factory=list)
    run: list[str] = field(default_factory=list)

    def elsewhere(self, *allowed: Path) -> list[Path]:
        """Return what was written outside of folders, but for compiled code and what devices forget."""
        return [
            path
            for path in self.written
            if not any(path.is_relative_to(folder) for folder in allowed)
            and "__pycache__" not in path.parts
            and path not in (Path(os.devnull), Path("/dev/full"))
        ]


_watched: Deeds | None = None
_hooked = False


def _hook(event: str, arguments: tuple[Any, ...]) -> None:
    if _watched is None:
        return
    if event == "open":
        path, mode, flags = arguments
        for_writing = bool(set(mode) & set("wax+")) if isinstance(mode, str) else bool((flags or 0) & _WRITES)
        if for_writing and isinstance(path, str | bytes):
            _watched.written.append(_absolute(path))
    elif event in _CHANGES and isinstance(arguments[_CHANGES[event]], str | bytes):
        _watched.written.append(_absolute(arguments[_CHANGES[event]]))
    elif event == "pickle.find_class":
        _watched.unpickled.append(".".join(map(str, arguments)))
    elif event in _RUNS:
        _watched.run.append(f"{event} {arguments[:2]}")


def _absolute(path: str | bytes) -> Path:
    return Path(os.path.abspath(os.fsdecode(path)))  # noqa: PTH100  (without following links)


@contextmanager
def watched(seconds: int = 30) -> Iterator[Deeds]:
    """Note what is done within, and raise :class:`HungError` if it takes longer than so many seconds.

    It must be used in the main thread, one at a time.
    """
    global _watched, _hooked  # noqa: PLW0603  an audit hook cannot be taken away again
    if not _hooked:
        sys.addaudithook(_hook)
        _hooked = True

    def hung(*_: object) -> None:
        raise HungError(f"it takes longer than {seconds} s")

    before = signal.signal(signal.SIGALRM, hung)
    signal.alarm(seconds)
    _watched = deeds = Deeds()
    try:
        yield deeds
    finally:
        _watched = None
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


TEMPORARY = Path(tempfile.gettempdir()).resolve()
