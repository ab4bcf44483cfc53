"""How long one waits before anything happens: imports, the first plan ever, and the first plan of a process.

Every turn is a fresh process. "First ever" starts from an empty cache of compiled code, which later processes
find filled.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter

from benchmarks.report import Report, command_line

_MOST_ROUNDS = 5  # of whole processes
_FIRST_EVER_ROUNDS = 2
_SOURCE = Path(__file__).resolve().parents[1]
_PLAN = """
from agents.planner import make_planner
from jet_gym.courses import PAPER
make_planner("gas").plan(PAPER.side)
"""


def measure(rounds: int) -> Report:
    """Time imports within their process and plans from the start of the process to its end."""
    report = Report("Start-up, every turn a fresh process")
    rounds = min(rounds, _MOST_ROUNDS)
    imports: dict[str, list[float]] = {"numpy": [], "gymnasium": [], "numba": [], "jet_gym": []}
    for _ in range(rounds):
        for module, times in imports.items():
            times.append(_import_time(module))
    for module, times in imports.items():
        goal = 0.5 if module == "jet_gym" else None
        report.add(f"import {module}", median(times), "s", lowest=min(times), highest=max(times), goal=goal)

    empty: list[float] = []
    filled: list[float] = []
    for _ in range(min(rounds, _FIRST_EVER_ROUNDS)):
        with tempfile.TemporaryDirectory() as cache:
            empty.append(_process_time(_PLAN, cache))
            filled += [_process_time(_PLAN, cache) for _ in range(rounds)]
    for what, times, goal in (("first ever", empty, 15.0), ("first of a process", filled, 1.5)):
        report.add(
            f"plan PAPER.side by GAS, {what}",
            median(times), "s", lowest=min(times), highest=max(times), goal=goal,
        )  # fmt: skip
    return report


def _import_time(module: str) -> float:
    """Return how long an import takes [s], without the start of Python."""
    code = f"import time; t = time.perf_counter(); import {module}; print(time.perf_counter() - t)"
    return float(_run(code).stdout.split()[-1])


def _process_time(code: str, numba_cache: str) -> float:
    """Return how long a process takes from its start to its end [s]."""
    started = perf_counter()
    _run(code, NUMBA_CACHE_DIR=numba_cache)
    return perf_counter() - started


def _run(code: str, **variables: str) -> subprocess.CompletedProcess[str]:
    paths = [str(_SOURCE), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), **variables}
    return subprocess.run([sys.executable, "-c", code], env=environment, check=True, capture_output=True, text=True)


if __name__ == "__main__":
    command_line(__doc__, measure)
