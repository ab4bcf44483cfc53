"""What a benchmark found, as a table for people and as JSON for machines."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from agents.studies.off_the_shelf import missing_note
from jet_gym.utils.files import check_writable, write_whole
from jet_gym.utils.machine import machine
from jet_gym.utils.threads import one_core

_PREFIXES = {-5: "f", -4: "p", -3: "n", -2: "µ", -1: "m", 0: "", 1: "k", 2: "M", 3: "G"}


@dataclass(frozen=True)
class Finding:
    """One number.

    Attributes:
        what: What was measured.
        value: The median.
        unit: ``"s"``, ``"m"`` or another that takes SI prefixes; ``"x"`` for a ratio, ``"%"``, or none.
        lowest: Smallest value of any round, where that is known.
        highest: Largest value of any round.
        goal: What it should be.
        at_least: Whether more is better than the goal.
    """

    what: str
    value: float
    unit: str = ""
    lowest: float | None = None
    highest: float | None = None
    goal: float | None = None
    at_least: bool = False

    @property
    def met(self) -> bool | None:
        """Whether the goal is met; nothing where there is none."""
        if self.goal is None:
            return None
        return self.value >= self.goal if self.at_least else self.value <= self.goal

    def row(self) -> tuple[str, str, str, str, str]:
        """Return the cells of the table."""
        spread = goal = ""
        if self.lowest is not None and self.highest is not None:
            spread = f"{with_unit(self.lowest, self.unit)} to {with_unit(self.highest, self.unit)}"
        if self.goal is not None:
            goal = f"{'at least' if self.at_least else 'at most'} {with_unit(self.goal, self.unit)}"
        verdict = {None: "", True: "[green]met[/]", False: "[red]missed[/]"}[self.met]
        return self.what, with_unit(self.value, self.unit), spread, goal, verdict


@dataclass
class Report:
    """What one benchmark found.

    Attributes:
        title: Its heading.
        findings: The numbers.
        notes: What a reader should know besides.
    """

    title: str
    findings: list[Finding] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add(self, what: str, value: float, unit: str = "", **more: Any) -> None:
        """Add a number; see :class:`Finding`."""
        self.findings.append(Finding(what, float(value), unit, **more))

    def to_dict(self) -> dict[str, Any]:
        """Return the report as plain data, for JSON."""
        findings = [{**asdict(finding), "met": finding.met} for finding in self.findings]
        return {"title": self.title, "findings": findings, "notes": self.notes}

    def has(self, module: str) -> bool:
        """Tell whether an optional library is there; note it if not."""
        note = missing_note(module)
        if note is not None:
            self.notes.append(note)
        return note is None


def with_unit(value: float, unit: str) -> str:
    """Write a number with three digits and an SI prefix."""
    if unit in ("x", "%", ""):
        return f"{value:.3g}" + unit if abs(value) < 999.5 else f"{value:,.0f}{unit}"
    step = math.floor(math.log10(1.0005 * abs(value)) / 3.0) if value else 0
    step = min(max(step, min(_PREFIXES)), max(_PREFIXES))
    return f"{value / 1000.0**step:.3g} {_PREFIXES[step]}{unit}"


def show(reports: Sequence[Report]) -> None:
    """Print the machine and one table of all findings."""
    console = Console()
    for name, value in machine("one of them used").items():
        console.print(f"{name}: {value}", highlight=False)
    table = Table("What", "Measured", "Spread", "Goal", "")
    for column in table.columns[1:4]:
        column.justify = "right"
    for report in reports:
        table.add_section()
        table.add_row(f"[bold]{report.title}[/]")
        for finding in report.findings:
            table.add_row(*finding.row())
    console.print(table)
    for note in (note for report in reports for note in report.notes):
        console.print(f"* {note}", highlight=False, markup=False)


def write(reports: Sequence[Report], json_file: Path | None, page: Path | None) -> None:
    """Write the machine and all findings as JSON, and as a page of the documentation, each where asked.

    Raises:
        OSError: If a file cannot be written.
    """
    if json_file is not None:
        content = {"machine": machine("one of them used"), "benchmarks": [report.to_dict() for report in reports]}
        write_whole(json_file, (json.dumps(content, indent=2) + "\n").encode())
    if page is not None:
        write_whole(page, markdown(reports).encode())


def markdown(reports: Sequence[Report]) -> str:
    """Return a page of the documentation with the machine, the table of all findings, and the notes."""
    lines = ["# Benchmarks", ""]
    lines += ["Written by `make benchmarks`, on this machine:", "", "| | |", "|---|---|"]
    lines += [f"| {name} | {value} |" for name, value in machine("one of them used").items()]
    for report in reports:
        lines += ["", f"## {report.title}", "", "| What | Measured | Spread | Goal | |", "|---|--:|--:|--:|---|"]
        for finding in report.findings:
            cells = [Text.from_markup(cell).plain.replace("|", "\\|") for cell in finding.row()]
            lines.append(f"| {' | '.join(cells)} |")
        lines += ["", *(f"* {note}" for note in report.notes)] if report.notes else []
    return "\n".join(lines) + "\n"


def command_line(description: str, *benchmarks: Callable[[int], Report]) -> None:
    """Run benchmarks from the command line.

    Args:
        description: What ``--help`` says.
        benchmarks: Called with the number of rounds, one after the other.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--rounds", type=int, default=15, help="turns of each contestant (default: %(default)s)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the numbers to this file too")
    parser.add_argument("--page", type=Path, metavar="FILE", help="write them as a page of the documentation too")
    arguments = parser.parse_args()
    if arguments.rounds < 1:
        parser.error(f"--rounds must be 1 or more, not {arguments.rounds}")
    try:
        for path in filter(None, (arguments.json, arguments.page)):
            check_writable(path)
        with one_core():
            reports = [benchmark(arguments.rounds) for benchmark in benchmarks]
        show(reports)
        write(reports, arguments.json, arguments.page)
    except OSError as error:
        parser.error(f"{error.filename}: {error.strerror}")
    except KeyboardInterrupt:
        parser.exit(130, "interrupted\n")
