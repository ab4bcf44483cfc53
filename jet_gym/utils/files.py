"""Files that are written whole or not at all, and read without waiting for a pipe or unpickling anything."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


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
    path = Path(path).resolve()  # a link stays, and what it leads to is written
    check_writable(path)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}-", suffix=path.suffix)
    os.close(handle)
    temporary = Path(name)
    try:
        write(temporary)
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        temporary.replace(path)
    except OSError as error:
        if error.errno is None or error.filename not in (None, name):
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        with contextlib.suppress(FileNotFoundError):
            temporary.unlink()


def check_writable(path: str | Path) -> None:
    """Refuse a path that cannot be written, before the work whose result it is to hold.

    Args:
        path: The file; it need not exist.

    Raises:
        OSError: If its folder does not exist or cannot be written to, or the path is a folder.
    """
    path = Path(path)
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    _refuse_pipe_or_device(path)
    if not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "its folder does not exist", str(path))
    if not os.access(path.parent, os.W_OK) or (path.exists() and not os.access(path, os.W_OK)):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))


def read_whole(path: str | Path) -> bytes:
    """Read a file, and refuse what may have no end: a pipe that nobody writes to, a device.

    Args:
        path: The file.

    Raises:
        OSError: If it cannot be read, or is no ordinary file.
    """
    path = Path(path)
    if not path.is_dir():  # which reading refuses
        _refuse_pipe_or_device(path)
    return path.read_bytes()


def _refuse_pipe_or_device(path: Path) -> None:
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, "it is not an ordinary file", str(path))


def read_arrays(path: str | Path) -> dict[str, NDArray[Any]]:
    """Read the arrays of an ``.npz`` file; nothing is unpickled, and no file stays open.

    Args:
        path: The file.

    Returns:
        The arrays by name.

    Raises:
        OSError: If the file cannot be read.
        ValueError: If it is no such file, is damaged, or holds objects; a sentence of one line.
    """
    content = read_whole(path)
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except Exception as error:  # NumPy, zipfile and zlib raise what they like on a damaged file
        raise ValueError(" ".join(str(error).split()) or type(error).__name__) from error
    strangers = [name for name, array in arrays.items() if not isinstance(array, np.ndarray)]
    if strangers:  # of what is no array, NumPy returns the bytes
        raise ValueError(f"its part {strangers[0]!r} is no array")
    return arrays
