"""Calls in parallel through joblib, whose results are kept as they come."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from time import monotonic
from typing import Any, TypeVar

from jet_gym.utils.interrupts import call_in_worker

SAVE_EVERY = 5.0  # [s]
Result = TypeVar("Result")


def run_in_parallel(
    function: Callable[..., Result],
    calls: Sequence[tuple[Any, ...]],
    jobs: int,
    take: Callable[[Result], None],
    save: Callable[[], None] | None = None,
) -> None:
    """Call a function with each of many arguments, in any order.

    Another backend of joblib, such as Dask's, takes the work where one is chosen (``joblib.parallel_config``).

    Args:
        function: What is called.
        calls: Its arguments, one tuple a call.
        jobs: Processes; -1 is one a core.
        take: Called with each result as it comes.
        save: Called every few seconds, at the end, and on Ctrl-C.
    """
    import joblib

    parallel = joblib.Parallel(n_jobs=jobs, return_as="generator_unordered", pre_dispatch="2 * n_jobs")
    saved = monotonic()
    try:
        if calls:
            call = joblib.delayed(call_in_worker)
            results: Iterator[Result] = parallel(call(os.getpid(), function, *arguments) for arguments in calls)
            with closing(results):  # type: ignore[type-var]
                for result in results:
                    take(result)
                    if save is not None and monotonic() - saved > SAVE_EVERY:
                        save()
                        saved = monotonic()
    finally:
        if save is not None:
            save()
