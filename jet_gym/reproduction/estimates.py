"""Not in the paper: what the numbers that it does not state do."""

from __future__ import annotations

import math

from agents.studies.estimates import EstimateRow, study_estimates
from jet_gym.courses import DITCH_SPAN
from jet_gym.figures import plot_estimates, png_bytes
from jet_gym.reproduction.model import Chapter, Claim, Picture, Settings, Table, verdict, with_interval
from jet_gym.robot import jet_hr1
from jet_gym.utils.progress import Progress


def estimates_chapter(settings: Settings, report: Progress) -> Chapter:
    """Vary mass split, fan offset, foot length and ZMP margin."""
    rows = study_estimates(settings.seeds(settings.study_plans), progress=report)
    limit = jet_hr1().max_thrust
    return Chapter(
        "estimates",
        "What the estimates do",
        (
            "The paper does not state how the mass is split, how far outward of the ankle the fan sits, how long "
            "the foot is, or how far the ZMP stays from its edge. Each of them varies here about the estimate that "
            "this package takes, the others as they are: legs and pelvis keep their sum of 6.8 kg, toe and heel "
            "their proportion.",
            "GA, which looks at thrust alone, shows how little the robot could do with. The greatest ditch is the "
            "widest that GAS plans to cross without violating a constraint, by bisection to 2 mm.",
        ),
        claims=(_fan_claim(rows), _ditch_claim(rows)),
        tables=(_table(rows),),
        pictures=(
            Picture(
                "estimates",
                "What the estimates do",
                "Peak thrust and greatest ditch over mass split, fan offset, foot length and ZMP margin.",
                png_bytes(plot_estimates(rows, limit, DITCH_SPAN)),
            ),
        ),
    )


def _fan_claim(rows: list[EstimateRow]) -> Claim:
    fans = [row for row in rows if row.quantity == "fan offset"]
    inmost, ours = fans[0], next(row for row in fans if row.is_estimate)
    side, forward = (
        [getattr(row, f"{motion}_ga").peak_thrust for row in (inmost, ours)] for motion in ("side", "forward")
    )
    return Claim(
        "II",
        "The fan's new location on the side of the feet extends the force arm to balance the capsizing moment of "
        "gravity in the side direction.",
        f"With the fan at the ankle the step to the side takes a peak of {with_interval(side[0], 2)} N, with it "
        f"{ours.value:g} mm outward, as is estimated here, {with_interval(side[1], 2)} N; the step forward "
        f"{with_interval(forward[0], 2)} and {with_interval(forward[1], 2)} N (GA, which looks at thrust alone).",
        verdict(side[1].high < side[0].low),
    )


def _ditch_claim(rows: list[EstimateRow]) -> Claim:
    ours = next(row for row in rows if row.is_estimate)
    crossed = [row for row in rows if row.greatest_ditch >= DITCH_SPAN]
    failing = [f"{row.quantity} {row.value:g} {row.unit}" for row in rows if row not in crossed]
    return Claim(
        "I, V",
        "The robot is enabled to step over a ditch as wide as possible with limited thrust, 450 mm.",
        f"With the estimates taken here the widest ditch is {1e3 * ours.greatest_ditch:.0f} mm; 450 mm can be "
        "crossed "
        f"in {len(crossed)} of {len(rows)} variants" + (f", but not with {', '.join(failing)}" if failing else ""),
        verdict(ours.greatest_ditch >= DITCH_SPAN),
    )


def _table(rows: list[EstimateRow]) -> Table:
    cells = tuple(
        (
            row.quantity,
            f"{row.value:g} {row.unit}" + (" (taken)" if row.is_estimate else ""),
            with_interval(row.side.peak_thrust, 2),
            with_interval(row.side_ga.peak_thrust, 2),
            with_interval(row.forward.peak_thrust, 2),
            with_interval(row.forward_ga.peak_thrust, 2),
            with_interval(row.forward.violated_points, 1),
            _number(1e3 * row.greatest_ditch, 0),
        )
        for row in rows
    )
    headings = (
        "quantity", "value", "peak thrust, side, GAS (N)", "GA (N)", "peak thrust, forward, GAS (N)", "GA (N)",
        "violated points, forward", "greatest ditch (mm)",
    )  # fmt: skip
    return Table("estimates", "Peak thrust and greatest ditch", headings, cells)


def _number(value: float, digits: int) -> str:
    return "none" if math.isnan(value) else f"{value:.{digits}f}"
