"""What a reproduction consists of: settings, and chapters of claims, tables and pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Literal

from jet_gym.utils.progress import Progress
from jet_gym.utils.settings import require_within
from jet_gym.utils.statistics import Interval

Verdict = Literal["holds", "differs", "not tested"]


@dataclass(frozen=True)
class Settings:
    """How much work a reproduction does.

    Attributes:
        seed: The first seed of plans, executions and statistics; further ones follow it.
        plans: Plans of each planner and motion.
        space_resolution: Spacing of the balance space's grids [mm].
        study_plans: Plans of each motion and variant in the studies of omega and of the estimates.
        thrust_resolution: Spacing of the pelvis' places [mm] where the least thrust is looked for.
        trials: Trials of the experiment in simulation.
        draws: Draws of the disturbances under which it is repeated.
        rounds: Rounds of the race of calculation times.
    """

    seed: int = 0
    plans: int = 20
    space_resolution: float = 20.0
    study_plans: int = 10
    thrust_resolution: float = 5.0
    trials: int = 5
    draws: int = 30
    rounds: int = 7

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed."""
        for name in (field.name for field in fields(self)):
            least = {"seed": 0, "plans": 2, "space_resolution": 5.0, "thrust_resolution": 5.0}.get(name, 1)
            require_within(name, getattr(self, name), least, 1e6)

    def quick(self) -> Settings:
        """Return settings that take about half of the time."""
        return replace(
            self, plans=5, space_resolution=40.0, study_plans=3, thrust_resolution=10.0, trials=2, draws=2, rounds=3
        )

    def seeds(self, count: int) -> range:
        """Return so many seeds."""
        return range(self.seed, self.seed + count)


@dataclass(frozen=True)
class Claim:
    """What the paper says, and what was measured.

    Attributes:
        where: Where the paper says it.
        statement: What it says, in its own words or close to them.
        measured: What was measured, in a sentence.
        verdict: Whether it holds.
    """

    where: str
    statement: str
    measured: str
    verdict: Verdict


@dataclass(frozen=True)
class Table:
    """A table in words and numbers.

    Attributes:
        name: File name without its ending.
        title: What it is.
        headings: Of the columns.
        rows: Of cells, as many each as there are headings.
        note: What a reader should know besides.
    """

    name: str
    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


@dataclass(frozen=True)
class Picture:
    """A picture.

    Attributes:
        name: File name without its ending.
        title: What it is, with the number of the paper's figure.
        caption: What it shows, for those who cannot see it too.
        png: The picture.
    """

    name: str
    title: str
    caption: str
    png: bytes


@dataclass(frozen=True)
class Chapter:
    """One part of the paper.

    Attributes:
        name: Of its anchor in the page.
        title: Its heading.
        text: Its paragraphs.
        claims: What the paper says there.
        tables: Tables.
        pictures: Pictures.
    """

    name: str
    title: str
    text: tuple[str, ...] = ()
    claims: tuple[Claim, ...] = ()
    tables: tuple[Table, ...] = ()
    pictures: tuple[Picture, ...] = ()


def verdict(holds: bool) -> Verdict:
    """Return the verdict on a claim that was tested."""
    return "holds" if holds else "differs"


def with_interval(interval: Interval, digits: int, scale: float = 1.0) -> str:
    """Return a mean and how far its 95 % interval reaches on its longer side."""
    mean = f"{scale * interval.mean:.{digits}f}"
    return f"{mean} ± {scale * interval.reach:.{digits}f}" if interval.reach > 0.0 else mean


def listed(words: Sequence[str]) -> str:
    """Return words as a list in a sentence."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def share_of(report: Progress, number: int, count: int) -> Progress:
    """Return what the ``number``-th of ``count`` equal parts of some work reports its own progress to."""

    def report_part(done: int, total: int) -> None:
        report(done + number * total, count * total)

    return report_part
