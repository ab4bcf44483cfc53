"""Files that are written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path


def write_whole(path: str | Path, content: bytes) -> None:
    """Write a file so that a crash, a full disk or Ctrl-C leaves the old one or none, never half of one.

    Args:
        path: The file; its folder must exist.
        content: What to write.

    Raises:
        OSError: If the file cannot be written.
    """
    write_whole_with(path, lambda temporary: temporary.write_bytes(content))


def write_whole_with(path: str | Path, write: Callable[[Path], object]) -> None:
    """Let a function write a file under another name beside it, then move it into place.

    Args:
        path: The file; its folder must exist.
        write: Writes to the path that it is given, which has the same suffix.

    Raises:
        OSError: If the file cannot be written.
    """
    path = Path(path)
    if path.is_dir():
        raise IsADirectoryError(21, "it is a folder", str(path))
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}-", suffix=path.suffix)
    os.close(handle)
    temporary = Path(name)
    try:
        write(temporary)
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        temporary.replace(path)
    finally:
        with contextlib.suppress(FileNotFoundError):
            temporary.unlink()
