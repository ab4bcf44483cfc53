"""One disturbance at a time: how far beyond its range it may reach before the robot fails."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jet_gym.simulation.course import make_course
from jet_gym.simulation.disturbances import LINKS, Disturbance, DisturbanceRanges, Push
from jet_gym.simulation.execution import ThrustControl
from jet_gym.simulation.parallel import run_in_parallel
from jet_gym.simulation.results_file import ResultsFile
from jet_gym.simulation.trials import Experiment
from jet_gym.utils.progress import Progress

FACTORS = (1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0)
"""How much further than its range a disturbance reaches; at five times the thrust gain is off by half."""
_EVERY_DIRECTION = (("forward", 0.0), ("left", 0.5 * math.pi), ("back", math.pi), ("right", 1.5 * math.pi))


@dataclass(frozen=True)
class End:
    """One quantity at an end of its range while nothing else is disturbed.

    Attributes:
        quantity: Its name.
        end: Which end: ``"low"``, ``"high"``, or the direction of a push.
        value: What it is there, with its unit.
        disturbance: The same for the simulation.
    """

    quantity: str
    end: str
    value: str
    disturbance: Disturbance


@dataclass(frozen=True)
class Limit:
    """How far one quantity may go towards one end.

    Attributes:
        quantity: Its name.
        end: Which end.
        control: How the thrust was controlled.
        factor: How many times its range it reaches where the robot first fails; ``None`` if it does not up to the
            largest of :data:`FACTORS`.
        value: What it is there, or at the last factor that was tried, with its unit.
        cause: What gave way; empty if nothing did.
        outcome: The sentence that says so.
    """

    quantity: str
    end: str
    control: ThrustControl
    factor: float | None
    value: str
    cause: str
    outcome: str

    @property
    def key(self) -> tuple[str, str, str]:
        """What tells it from the others."""
        return self.quantity, self.end, self.control

    @property
    def text(self) -> str:
        """Where the robot fails, in a few words."""
        if self.factor is None:
            return f"not at {self.value}"
        return f"{self.factor:g}: {self.value}, {self.cause}"


_FILE = ResultsFile("jet-gym-limits/2", "limits", Limit)
save_limits = _FILE.save
"""Writes limits to a file: :meth:`~jet_gym.simulation.results_file.ResultsFile.save`."""
load_limits = _FILE.load
"""Reads them: :meth:`~jet_gym.simulation.results_file.ResultsFile.load`."""


def range_ends(ranges: DisturbanceRanges, duration: float, steps: int) -> list[End]:
    """Return the disturbances in which one quantity is at an end of its range.

    A push comes in the middle of each of the equal parts of the time in which one would be drawn.

    Args:
        ranges: The ranges.
        duration: Time over which the pushes are spread [s].
        steps: Number of steps, each with a carton to land on.
    """
    found: list[End] = []

    def add(quantity: str, end: str, value: str, **change: Any) -> None:
        found.append(End(quantity, end, value, Disturbance(**change)))

    for end, sign in (("low", -1.0), ("high", 1.0)):
        for name, links in (("pelvis mass", range(1)), ("leg masses", range(1, LINKS))):
            factors = tuple(1.0 + sign * ranges.mass * (k in links) for k in range(LINKS))
            add(name, end, f"{100.0 * sign * ranges.mass:+.3g} %", mass_factors=factors)
        for axis, name in enumerate(("pelvis CoM forward", "pelvis CoM left", "pelvis CoM up")):
            shift = [0.0, 0.0, 0.0]
            shift[axis] = sign * ranges.pelvis_com
            add(name, end, f"{1e3 * shift[axis]:+.3g} mm", pelvis_com=tuple(shift))
        gain = sign * ranges.thrust_gain
        add("thrust gain", end, f"{100.0 * gain:+.3g} %", thrust_gain=1.0 + gain)
        for step in range(steps):
            heights = tuple(sign * ranges.block_height * (k == step) for k in range(steps))
            add(f"block height {step + 1}", end, f"{1e3 * heights[step]:+.3g} mm", block_heights=heights)
        for name, field, scale, unit in (
            ("friction", "friction", 1.0, ""),
            ("sole stiffness", "contact_stiffness", 1e-3, " N/mm"),
            ("IMU noise", "imu_noise", 1.0, " times"),
            ("IMU delay", "imu_delay", 1e3, " ms"),
            ("fan lag", "fan_lag", 1e3, " ms"),
        ):
            value = getattr(ranges, field)[0 if end == "low" else 1]
            add(name, end, f"{scale * value:.3g}{unit}", **{field: value})
    impulse = ranges.push_impulse[1]
    for direction, angle in _EVERY_DIRECTION if ranges.pushes else ():
        force = impulse / ranges.push_duration
        times = duration * (np.arange(ranges.pushes) + 0.5) / ranges.pushes
        along = (force * math.cos(angle), force * math.sin(angle), 0.0)
        pushes = tuple(Push(float(time), ranges.push_duration, along) for time in times)
        add("push", direction, f"{impulse:.3g} N s", pushes=pushes)
    return sorted(found, key=lambda entry: entry.quantity)


def find_limits(
    experiment: Experiment,
    jobs: int = -1,
    done: Sequence[Limit] = (),
    progress: Progress | None = None,
    save: Callable[[Sequence[Limit]], None] | None = None,
) -> list[Limit]:
    """Find for each quantity, end and control how far it may go, through joblib.

    Tried are the largest factor, then by bisection those of :data:`FACTORS`, on the assumption that what is too
    much once stays too much.

    Args:
        experiment: What is executed, and the ranges.
        jobs: Processes; -1 is one a core.
        done: Limits that need not be found again.
        progress: Called with how many limits are found and how many there are.
        save: Called with what there is every few seconds, at the end, and on Ctrl-C.
    """
    kept = {limit.key: limit for limit in done}
    ends = ends_by_factor(experiment)
    asks = {
        (end.quantity, end.end, control): ({factor: ends[factor][place] for factor in FACTORS}, control)
        for control in experiment.controls
        for place, end in enumerate(ends[1.0])
    }

    def found() -> list[Limit]:
        return [kept[key] for key in asks if key in kept]

    def take(limit: Limit) -> None:
        kept[limit.key] = limit
        if progress is not None:
            progress(len(found()), len(asks))

    missing = [(experiment, *ask) for key, ask in asks.items() if key not in kept]
    run_in_parallel(_find_limit, missing, jobs, take, None if save is None else lambda: save(found()))
    return found()


def ends_by_factor(experiment: Experiment) -> dict[float, list[End]]:
    """Return the ends of all quantities for each of :data:`FACTORS`, always in the same order."""
    duration = make_course(experiment.plans, experiment.settings.course).duration
    steps = len(experiment.plans)
    return {f: range_ends(experiment.ranges.scaled(f), duration, steps) for f in FACTORS}


def _find_limit(experiment: Experiment, ends: dict[float, End], control: ThrustControl) -> Limit:
    """Find how far one quantity may go; an end that does not move with the factor is tried once."""
    tried: dict[int, tuple[str, str]] = {}

    def fails(place: int) -> bool:
        trial = experiment.run(0, control, ends[FACTORS[place]].disturbance)
        tried[place] = trial.cause, trial.outcome
        return not trial.success

    last = len(FACTORS) - 1
    moves = ends[FACTORS[0]].disturbance != ends[FACTORS[last]].disturbance
    high = last if moves else 0
    factor: float | None = None
    if fails(high):
        low = -1  # stands at the model's own values
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if fails(middle) else (middle, high)
        factor = FACTORS[high]
    end = ends[FACTORS[high]]
    cause, outcome = tried[high]
    return Limit(end.quantity, end.end, control, factor, end.value, cause, outcome)


def in_order_of_breaking(limits: Sequence[Limit], control: ThrustControl) -> list[Limit]:
    """Return the limits of one way to control the thrust that were reached, the first to break first."""
    broken = [limit for limit in limits if limit.control == control and limit.factor is not None]
    return sorted(broken, key=lambda limit: (limit.factor or 0.0, limit.quantity, limit.end))


def ends_by_limit(limits: Sequence[Limit]) -> list[tuple[str, str]]:
    """Return quantities and ends, those first that break the last way to control the thrust first."""
    last = limits[-1].control
    reached = {(limit.quantity, limit.end): limit.factor or math.inf for limit in limits}
    reached |= {(limit.quantity, limit.end): limit.factor or math.inf for limit in limits if limit.control == last}
    others = {end: min((x.factor or math.inf) for x in limits if (x.quantity, x.end) == end) for end in reached}
    return sorted(reached, key=lambda end: (reached[end], others[end], end))
