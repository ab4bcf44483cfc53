"""A race of several contestants that stays fair on a machine with other work to do.

The contestants take turns in every round, so that a busy moment hits all of them, and what counts are medians
and their ratios. One core for everybody, no garbage collection while the clock runs, and where the system's
clock is fine enough it counts processor time, which stands still while another process has the core.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from time import get_clock_info, perf_counter, process_time
from typing import Any

_clock = process_time if get_clock_info("process_time").resolution < 1e-5 else perf_counter


@dataclass(frozen=True)
class Contestant:
    """One way to do the work.

    Attributes:
        name: What it is called in the table.
        run: Does the work once.
        units: Units of work that one call does, postures for example.
    """

    name: str
    run: Callable[[], Any]
    units: int = 1


@dataclass(frozen=True)
class Timing:
    """How a contestant did.

    Attributes:
        name: The contestant.
        seconds: Median time a unit of work [s].
        ratio: That time over the first contestant's.
        lowest: Smallest ratio of any round.
        highest: Largest ratio of any round.
    """

    name: str
    seconds: float
    ratio: float
    lowest: float
    highest: float


def race(contestants: Sequence[Contestant], rounds: int = 15, least_duration: float = 0.02) -> list[Timing]:
    """Time contestants against each other.

    Args:
        contestants: Who takes part; ratios are to the first.
        rounds: How often everybody has a turn.
        least_duration: A turn repeats its call until it lasts about this long [s].
    """
    calls = [_calls_that_last(contestant, least_duration) for contestant in contestants]
    seconds: list[list[float]] = [[] for _ in contestants]
    collecting = gc.isenabled()
    gc.disable()
    try:
        for _ in range(rounds):
            for contestant, count, times in zip(contestants, calls, seconds, strict=True):
                times.append(_time(contestant.run, count) / (count * contestant.units))
            gc.collect()
    finally:
        if collecting:
            gc.enable()
    first = median(seconds[0])
    timings = []
    for contestant, times in zip(contestants, seconds, strict=True):
        ratios = [time / reference for time, reference in zip(times, seconds[0], strict=True)]
        timings.append(
            Timing(contestant.name, median(times), median(times) / first, min(ratios), max(ratios)),
        )
    return timings


def _calls_that_last(contestant: Contestant, least_duration: float) -> int:
    contestant.run()  # loads and compiles what is not yet
    count = 1
    while (duration := _time(contestant.run, count)) < least_duration:
        count = max(2 * count, int(count * least_duration / max(duration, 1e-9)))
    return count


def _time(run: Callable[[], Any], count: int) -> float:
    started = _clock()
    for _ in range(count):
        run()
    return _clock() - started
