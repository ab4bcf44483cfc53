"""What commands print with: the console, tables of summaries, a progress bar that comes when it is needed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

from rich import box
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

if TYPE_CHECKING:
    from agents.summary import PlanSummary
    from jet_gym.utils.progress import Progress as ProgressCallback
    from jet_gym.utils.statistics import Interval

console = Console(highlight=False)
_PATIENCE = 1.0  # [s] without a progress bar


@contextmanager
def progress_bar(description: str) -> Iterator[ProgressCallback]:
    """Yield a callback (done, total) that shows a progress bar, in a terminal, once the work has taken a second."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    terminal = Console(stderr=True)
    progress = Progress(*columns, console=terminal, transient=True, disable=not terminal.is_terminal)
    task = progress.add_task(description, total=None)
    started = monotonic()

    def report(done: int, total: int) -> None:
        progress.update(task, completed=done, total=total)
        if monotonic() - started > _PATIENCE and not progress.live.is_started:
            progress.start()

    try:
        yield report
    finally:
        if progress.live.is_started:
            progress.stop()


def say_written(*files: Path | None) -> None:
    """Name the files that were written, those that were asked for."""
    written = [str(file) for file in files if file is not None]
    if written:
        console.print("wrote " + ", ".join(written), soft_wrap=True)


def summary_table(title: str, summaries: Sequence[PlanSummary]) -> Table:
    """Return the table that compares planners on one step."""
    table = plain_table(title)
    table.add_column("planner", no_wrap=True, min_width=13)
    for heading in (
        "mean\nthrust\n(N)",
        "peak\nthrust\n(N)",
        "pelvis\nrough.\n(mm)",
        "thrust\nrough.\n(N)",
        "total\nfitness",
        "violated\npoints",
        "a point\ntakes\n(µs)",
    ):
        table.add_column(heading, justify="right")
    for s in summaries:
        table.add_row(
            s.planner,
            number(s.mean_thrust, 2),
            number(s.peak_thrust, 2),
            number(s.pelvis_roughness, 2, 1e3),
            number(s.thrust_roughness, 3),
            number(s.total_fitness, 0),
            number(s.violated_points, 0 if s.violated_points.mean == int(s.violated_points.mean) else 1),
            number(s.milliseconds_per_point, 0, 1e3),
        )
    return table


def number(interval: Interval, digits: int, scale: float = 1.0) -> str:
    """Return a mean and, where it has a 95 % interval, below it how far that reaches on its longer side."""
    mean = f"{scale * interval.mean:.{digits}f}"
    return f"{mean}\n[dim]±{scale * interval.reach:.{digits}f}[/dim]" if interval.reach > 0.0 else mean


def plain_table(title: str) -> Table:
    """Return an empty table in the look of this command line."""
    return Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
