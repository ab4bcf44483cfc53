"""Goes through the chapters, and writes what they found."""

from __future__ import annotations

import csv
import errno
import io
import json
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from jet_gym import __version__
from jet_gym.reproduction.estimates import estimates_chapter
from jet_gym.reproduction.experiment import experiment_chapter
from jet_gym.reproduction.model import Chapter, Settings, Table
from jet_gym.reproduction.page import render_page
from jet_gym.reproduction.planning import planning_chapter
from jet_gym.reproduction.robot import robot_chapter
from jet_gym.reproduction.robustness import robustness_chapter
from jet_gym.reproduction.smoothness import smoothness_chapter
from jet_gym.reproduction.space import space_chapter
from jet_gym.reproduction.timing import timing_chapter
from jet_gym.utils.files import check_writable, write_whole
from jet_gym.utils.machine import machine
from jet_gym.utils.progress import Progress

FORMAT = "jet-gym-reproduction/1"
PAGE = "index.html"
_FIGURES, _TABLES, _RESULTS = "figures", "tables", "results.json"


@dataclass(frozen=True)
class Part:
    """A chapter to be made.

    Attributes:
        title: What is being done.
        make: Does it.
    """

    title: str
    make: Callable[[Settings, Progress], Chapter]


PARTS = (
    Part("the robot", robot_chapter),
    Part("balance space, Fig. 5", space_chapter),
    Part("planners, Figs. 6 to 9", planning_chapter),
    Part("calculation time, Fig. 10", timing_chapter),
    Part("experiment in simulation, Fig. 11", experiment_chapter),
    Part("robustness", robustness_chapter),
    Part("smoothness weight", smoothness_chapter),
    Part("estimates", estimates_chapter),
)


def check_output(folder: Path) -> None:
    """Refuse a folder that cannot be written, before the work whose result it is to hold.

    Raises:
        OSError: If it is no folder, cannot be written to, or the folder that it is in does not exist.
    """
    if folder.exists() and not folder.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(folder))
    check_writable(folder / PAGE if folder.exists() else folder)
    for name in (_FIGURES, _TABLES):
        inner = folder / name
        if inner.exists() and not inner.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(inner))


def write_reproduction(
    folder: Path, chapters: Sequence[Chapter], settings: Settings, title: str = "", duration: float = 0.0
) -> Path:
    """Write page, pictures, tables and numbers; each file whole or not at all, and the page last.

    Args:
        folder: Where; it is made if it does not exist.
        chapters: What was found.
        settings: With which settings.
        title: How the work is called on the page, such as a command.
        duration: How long it took [s].

    Returns:
        The page.

    Raises:
        OSError: If a file cannot be written.
    """
    for name in (_FIGURES, _TABLES):
        (folder / name).mkdir(parents=True, exist_ok=True)
    for chapter in chapters:
        for picture in chapter.pictures:
            write_whole(folder / _FIGURES / f"{picture.name}.png", picture.png)
        for table in chapter.tables:
            write_whole(folder / _TABLES / f"{table.name}.csv", _csv(table))
    facts = {"command": title, "version": __version__, "duration": f"{duration:.0f} s", **machine()}
    write_whole(folder / _RESULTS, _json(chapters, settings, facts))
    write_whole(folder / PAGE, render_page(chapters, settings, facts).encode())
    return folder / PAGE


def _csv(table: Table) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows((table.headings, *table.rows))
    return text.getvalue().encode()


def _json(chapters: Sequence[Chapter], settings: Settings, facts: dict[str, str]) -> bytes:
    claims = [asdict(claim) for chapter in chapters for claim in chapter.claims]
    tables = {table.name: asdict(table) for chapter in chapters for table in chapter.tables}
    content = {"format": FORMAT, "settings": asdict(settings), "machine": facts, "claims": claims, "tables": tables}
    return (json.dumps(content, indent=1, ensure_ascii=False) + "\n").encode()
