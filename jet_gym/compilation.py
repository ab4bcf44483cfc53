"""How the numerical core is compiled: numba, cached on disk, the same bits for one posture and for a million.

Two choices matter to whoever reads or edits compiled code:

* ``fastmath`` grants no re-association and no fused multiply-add, so a vectorised loop gives bit for bit
  what the scalar code gives. It only assumes that there is no NaN and no infinity: entry points refuse them.
* numba's disk cache looks only at the file of the cached function itself, and would serve old machine code
  after an edit of a function that it calls. Here a cached function belongs to the source of the whole package.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba

Function = TypeVar("Function", bound=Callable[..., Any])

_FLAGS: dict[str, Any] = {"fastmath": {"nsz", "nnan", "ninf"}, "error_model": "numpy"}


def inlined(function: Function) -> Function:
    """Compile a building block that other compiled functions call."""
    compiled: Function = numba.njit(forceinline=True, **_FLAGS)(function)
    return compiled


def entry_point(function: Function) -> Function:
    """Compile a function that Python calls, and keep its machine code on disk."""
    dispatcher = numba.njit(cache=True, nogil=True, **_FLAGS)(function)
    cache_file = dispatcher._cache._cache_file
    cache_file._source_stamp = (_source_fingerprint(), cache_file._source_stamp)
    entry: Function = dispatcher
    return entry


@functools.cache
def _source_fingerprint() -> str:
    """Return a hash of every source file that compiled code may come from."""
    digest = hashlib.sha256()
    package = Path(__file__).resolve().parent
    for path in sorted((*package.rglob("*.py"), *(package.parent / "agents").rglob("*.py"))):
        digest.update(path.read_bytes())
    return digest.hexdigest()
