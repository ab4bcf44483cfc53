"""Fig. 10: calculation time."""

from __future__ import annotations

from agents.studies.calculation_time import PointTime, measure_calculation_time
from agents.studies.off_the_shelf import EVALUATIONS
from jet_gym.figures import plot_calculation_time, png_bytes
from jet_gym.reproduction.model import Chapter, Claim, Picture, Settings, Table, verdict
from jet_gym.utils.progress import Progress

_NAMES = {"gas": "GAS", "ga": "GA", "gaex": "GAEx"}


def timing_chapter(settings: Settings, report: Progress) -> Chapter:
    """Let the planners and other libraries' optimisers solve one swing point."""
    rows, notes = measure_calculation_time(settings.rounds, 2 * settings.rounds + 1, progress=report)
    times = {row.name: row for row in rows}
    of_planners = ", ".join(f"{label} {1e6 * times[name].seconds:.0f} µs" for name, label in _NAMES.items())
    fastest = min(_NAMES, key=lambda name: times[name].seconds)
    return Chapter(
        "calculation-time",
        "Calculation time",
        (
            "The middle swing point of the step across the ditch. Everybody minimises the same compiled fitness in "
            f"the same cube with {EVALUATIONS:,} evaluations; GAEx goes through its cube of 13³ postures and stops "
            "at the first that balances. They take turns; what is printed is the median processor time, and its "
            "ratio to that of GAS. The fitness reached is a median over seeds; less is better.",
            *notes,
        ),
        claims=(
            Claim(
                "V, Fig. 10",
                "The calculation time for GAEx was the least among the three.",
                f"{of_planners} a swing point, the times over GAS's "
                + ", ".join(f"{label} {times[name].ratio:.2f}" for name, label in _NAMES.items())
                + ". The paper's times were MATLAB's on an i7-8700, and are printed only as a figure.",
                verdict(fastest == "gaex"),
            ),
        ),
        tables=(_table(rows),),
        pictures=(
            Picture(
                "fig-10-calculation-time",
                "Fig. 10: calculation time",
                "Processor time of one swing point for GAS, GA, GAEx and other libraries' optimisers.",
                png_bytes(plot_calculation_time(rows)),
            ),
        ),
    )


def _table(rows: list[PointTime]) -> Table:
    cells = tuple(
        (
            _NAMES.get(row.name, row.name),
            f"{1e3 * row.seconds:.3g}",
            _ratio(row.ratio),
            f"{_ratio(row.lowest)} to {_ratio(row.highest)}",
            f"{row.fitness:.1f}",
        )
        for row in rows
    )
    headings = ("", "time (ms)", "over GAS", "over the rounds", "fitness reached")
    return Table("fig-10-calculation-time", "Time of one swing point", headings, cells)


def _ratio(value: float) -> str:
    return f"{value:.2f}" if value < 10.0 else f"{value:,.0f}"
