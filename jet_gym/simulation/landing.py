"""Where and when the swing feet touch down."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jet_gym.leg import Side
from jet_gym.plan import Plan
from jet_gym.step import Step
from jet_gym.utils.arrays import Array


@dataclass(frozen=True)
class Landing:
    """A swing foot touches the ground again.

    Attributes:
        step: Index of the plan.
        side: Which foot.
        row: Row of the series in which it first carries something.
        time: When that is [s].
        early: How long before the end of the plan's motion that is [s], negative if it is after it; NaN if the
            robot fell before the motion ended.
        distance: How far its sole then is from its planned place [m], seen from above.
    """

    step: int
    side: Side
    row: int
    time: float
    early: float
    distance: float


def find_landings(
    plans: Sequence[Plan], series: Mapping[str, Any], least_force: float, tolerance: float
) -> tuple[Landing, ...]:
    """Find the touchdown of each step that has one.

    The swing foot has touched down when it carries something after it was in the air. As long as it is at its start
    it only lifts off; anywhere else it counts, on the way too.

    Args:
        plans: What was executed.
        series: The series of :class:`~jet_gym.simulation.history.Execution` by name.
        least_force: Vertical force [N] from which on a foot carries something.
        tolerance: Distance from its start [m] up to which a foot is still at its start.
    """
    found = []
    for step, plan in enumerate(plans):
        rows = np.flatnonzero(
            (series["plan"] == step) & (series["phase"] != "stand") & (series["phase"] != "shift")
        )
        name = f"motion {step + 1}"
        motion = rows[series["phase"][rows] == name]
        if not len(motion):
            continue
        row = _touchdown(plan.step, rows[rows >= motion[0]], series, least_force, tolerance)
        if row is None:
            continue
        time = float(series["time"][row])
        ended = series["phase"][-1] != name
        early = float(series["time"][motion[-1]]) - time if ended else math.nan
        distance = float(_distance(series, row, plan.step.swing, plan.step.landing))
        found.append(Landing(step, plan.step.swing, row, time, early, distance))
    return tuple(found)


def _touchdown(
    step: Step, rows: Array, series: Mapping[str, Any], least_force: float, tolerance: float
) -> int | None:
    """Return the row of the touchdown among the rows from the motion's begin on."""
    carries = series["foot_forces"][rows, 0 if step.swing == "left" else 1] >= least_force
    if carries.all():
        return None
    rows, carries = (values[int(np.argmin(carries)) :] for values in (rows, carries))
    from_start = _distance(series, rows, step.swing, step.start)
    from_landing = _distance(series, rows, step.swing, step.landing)
    lifting = (from_start <= tolerance) & (from_start < from_landing)
    down = np.flatnonzero(carries & ~lifting)
    return int(rows[down[0]]) if len(down) else None


def _distance(series: Mapping[str, Any], rows: Any, side: Side, place: Sequence[float]) -> Any:
    """Return how far a sole is from a place [m], seen from above."""
    soles = series["soles"][rows, 0 if side == "left" else 1]
    return np.hypot(soles[..., 0] - place[0], soles[..., 1] - place[1])
