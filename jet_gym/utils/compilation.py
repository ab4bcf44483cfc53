"""How the numerical core is compiled: numba, cached on disk, the same bits for one posture and for a million.

Two choices matter to whoever reads or edits compiled code:

* ``fastmath`` grants no re-association and no fused multiply-add, so a vectorised loop gives bit for bit
  what the scalar code gives. It only assumes that there is no NaN and no infinity: entry points refuse them.
* numba's disk cache looks only at the file of the cached function itself, and would serve old machine code
  after an edit of a function that it calls. Here a cached function belongs to the source of its own file and
  of all that this one imports from the project, directly or through others.

With ``NUMBA_DISABLE_JIT=1`` in the environment nothing is compiled: what would be runs as plain Python, where a
debugger stops, coverage counts and a mutant needs no compiler. It is slow, and gives what machine code gives.
"""

from __future__ import annotations

import ast
import contextlib
import functools
import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np

Function = TypeVar("Function", bound=Callable[..., Any])

_FLAGS: dict[str, Any] = {"fastmath": {"nsz", "nnan", "ninf"}, "error_model": "numpy"}
_ROOT = Path(__file__).resolve().parents[2]
_PACKAGES = ("jet_gym", "agents")


def inlined(function: Function) -> Function:
    """Compile a building block that other compiled functions call."""
    compiled: Function = numba.njit(forceinline=True, **_FLAGS)(function)
    return compiled


def entry_point(function: Function) -> Function:
    """Compile a function that Python calls, and keep its machine code on disk."""
    dispatcher = numba.njit(cache=True, nogil=True, **_FLAGS)(function)
    if dispatcher is function:
        return _as_machine_code(function)
    cache_file, save = dispatcher._cache._cache_file, dispatcher._cache.save_overload

    def save_if_it_can(signature: Any, machine_code: Any) -> None:
        with contextlib.suppress(OSError):  # on a full disk it is compiled anew each time
            save(signature, machine_code)

    dispatcher._cache.save_overload = save_if_it_can
    fingerprint = source_fingerprint(Path(function.__code__.co_filename).resolve())
    cache_file._source_stamp = (fingerprint, cache_file._source_stamp)
    entry: Function = dispatcher
    return entry


def _as_machine_code(function: Function) -> Function:
    """Let plain Python count as machine code does, whose numbers overflow and divide by zero without a warning."""

    @functools.wraps(function)
    def entry(*arguments: Any) -> Any:
        with np.errstate(all="ignore"):
            return function(*arguments)

    return cast(Function, entry)


@functools.cache
def source_fingerprint(file: Path) -> str:
    """Return a hash of a source file and of all that are behind it."""
    digest = hashlib.sha256()
    for source in sorted(sources_behind(file)):
        digest.update(source.read_bytes())
    return digest.hexdigest()


def sources_behind(file: Path) -> set[Path]:
    """Return a source file and all of the project's that it imports, directly or through others."""
    sources, waiting = {file}, [file]
    while waiting:
        new = _imported(waiting.pop()) - sources
        sources |= new
        waiting += new
    return sources


@functools.cache
def _imported(file: Path) -> set[Path]:
    """Return the files of the project that a source file imports from at its top level.

    What a function imports for itself never gets into compiled code.
    """
    names: set[str] = set()
    statements = ast.parse(file.read_bytes()).body
    top_level = (s for s in statements if not isinstance(s, ast.FunctionDef | ast.ClassDef))
    for node in (node for statement in top_level for node in ast.walk(statement)):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module)
            names.update(f"{node.module}.{alias.name}" for alias in node.names)  # it may be a module
    paths = [_ROOT.joinpath(*name.split(".")) for name in names if name.partition(".")[0] in _PACKAGES]
    return {file for path in paths for file in (path.with_suffix(".py"), path / "__init__.py") if file.is_file()}
