"""How robust an execution is: success rates with intervals, and which disturbance breaks it first."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jet_gym.leg import Vector
from jet_gym.simulation.disturbances import LINKS, Disturbance, DisturbanceRanges, Push
from jet_gym.simulation.execution import ThrustControl
from jet_gym.simulation.trials import Experiment, Progress, Trial

_LEAST_FAILURES = 3  # with fewer, nothing is said of what they have in common
_EVERY_DIRECTION = (("forward", 0.0), ("left", 0.5 * math.pi), ("back", math.pi), ("right", 1.5 * math.pi))


@dataclass(frozen=True)
class Rate:
    """A success rate with its 95 % interval by Wilson.

    Attributes:
        successes: How many trials succeeded.
        trials: Of how many.
        low: Lower end of the interval [1].
        high: Upper end of the interval [1].
    """

    successes: int
    trials: int
    low: float
    high: float

    @property
    def rate(self) -> float:
        """Share of the trials that succeeded [1]."""
        return self.successes / self.trials


@dataclass(frozen=True)
class Association:
    """How much a disturbed quantity has to do with failures.

    Attributes:
        quantity: Its name.
        probability: Probability [1] that a trial that failed had more of it than one that succeeded, the area under
            the receiver operating characteristic: 0.5 if it has nothing to do with it.
        p_value: Of Mann and Whitney's test that it is 0.5 [1], as many tests as there are quantities not counted.
    """

    quantity: str
    probability: float
    p_value: float


@dataclass(frozen=True)
class Extreme:
    """One quantity at an end of its range while nothing else is disturbed.

    Attributes:
        quantity: Its name.
        value: What it was, with its unit.
        trial: What happened.
    """

    quantity: str
    value: str
    trial: Trial


def success_rate(trials: Sequence[Trial], control: ThrustControl) -> Rate:
    """Return the success rate of one way to control the thrust.

    Raises:
        ValueError: If there is no trial of it.
    """
    from scipy.stats import binomtest

    successes = [trial.success for trial in trials if trial.control == control]
    if not successes:
        raise ValueError(f"there is no trial with {control}")
    interval = binomtest(sum(successes), len(successes)).proportion_ci(0.95, method="wilson")
    return Rate(sum(successes), len(successes), float(interval.low), float(interval.high))


def causes(trials: Sequence[Trial], control: ThrustControl) -> Counter[str]:
    """Count what gave way in the trials that failed."""
    return Counter(trial.cause for trial in trials if trial.control == control and not trial.success)


def quantities(disturbance: Disturbance) -> dict[str, float]:
    """Return a disturbance as one number a quantity, in SI units; what has a direction also by its size."""
    factors = np.array(disturbance.mass_factors)
    left, right = factors[1:7].mean(), factors[7:].mean()
    x, y, z = disturbance.pelvis_com
    numbers = {
        "pelvis mass": float(factors[0]),
        "left leg mass": float(left),
        "right leg mass": float(right),
        "pelvis CoM forward": x,
        "pelvis CoM left": y,
        "pelvis CoM up": z,
        "friction": _known(disturbance.friction),
        "sole stiffness": _known(disturbance.contact_stiffness),
        "IMU noise": disturbance.imu_noise,
        "IMU delay": _known(disturbance.imu_delay),
        "fan lag": _known(disturbance.fan_lag),
        "thrust gain": disturbance.thrust_gain,
    }
    numbers |= {f"block height {k + 1}": height for k, height in enumerate(disturbance.block_heights)}
    impulses = [push.duration * math.hypot(*push.force) for push in disturbance.pushes]
    numbers["largest push"] = max(impulses, default=0.0)
    return numbers


def associations(trials: Sequence[Trial], control: ThrustControl) -> list[Association]:
    """Rank the disturbed quantities by how much they have to do with failures, the most telling first.

    Empty if fewer than three trials failed, or fewer than three succeeded.
    """
    from scipy.stats import mannwhitneyu

    chosen = [trial for trial in trials if trial.control == control]
    drawn = {True: [quantities(t.disturbance) for t in chosen if t.success]}
    drawn[False] = [quantities(t.disturbance) for t in chosen if not t.success]
    if min(len(drawn[True]), len(drawn[False])) < _LEAST_FAILURES:
        return []
    ranked = []
    for name in drawn[True][0]:
        failed, succeeded = ([numbers[name] for numbers in drawn[outcome]] for outcome in (False, True))
        test = mannwhitneyu(failed, succeeded)
        probability = float(test.statistic) / (len(failed) * len(succeeded))
        ranked.append(Association(name, probability, float(test.pvalue)))
    return sorted(ranked, key=lambda entry: (entry.p_value, entry.quantity))


def extremes(ranges: DisturbanceRanges, duration: float, steps: int) -> list[tuple[str, str, Disturbance]]:
    """Return the disturbances in which one quantity is at an end of its range, with its name and its value.

    A push comes in the middle of each of the equal parts of the time in which one would be drawn.
    """
    found: list[tuple[str, str, Disturbance]] = []

    def add(name: str, value: str, **change: Any) -> None:
        found.append((name, value, Disturbance(**change)))

    for sign in (-1.0, 1.0):
        for name, links in (("pelvis mass", range(1)), ("leg masses", range(1, LINKS))):
            factors = tuple(1.0 + sign * ranges.mass * (k in links) for k in range(LINKS))
            add(name, f"{100.0 * sign * ranges.mass:+.0f} %", mass_factors=factors)
        for axis, name in enumerate(("pelvis CoM forward", "pelvis CoM left", "pelvis CoM up")):
            shift = [0.0, 0.0, 0.0]
            shift[axis] = sign * ranges.pelvis_com
            add(name, f"{1e3 * shift[axis]:+.0f} mm", pelvis_com=tuple(shift))
        add(
            "thrust gain",
            f"{100.0 * sign * ranges.thrust_gain:+.0f} %",
            thrust_gain=1.0 + sign * ranges.thrust_gain,
        )
        for step in range(steps):
            heights = tuple(sign * ranges.block_height * (k == step) for k in range(steps))
            add(f"block height {step + 1}", f"{1e3 * heights[step]:+.0f} mm", block_heights=heights)
    for name, field, scale, unit in (
        ("friction", "friction", 1.0, ""),
        ("sole stiffness", "contact_stiffness", 1e-3, " N/mm"),
        ("IMU noise", "imu_noise", 1.0, " times"),
        ("IMU delay", "imu_delay", 1e3, " ms"),
        ("fan lag", "fan_lag", 1e3, " ms"),
    ):
        for value in getattr(ranges, field):
            add(name, f"{scale * value:g}{unit}", **{field: value})
    impulse = ranges.push_impulse[1]
    for direction, angle in _EVERY_DIRECTION if ranges.pushes else ():
        force: Vector = (math.cos(angle) * impulse / ranges.push_duration, 0.0, 0.0)
        force = (force[0], math.sin(angle) * impulse / ranges.push_duration, 0.0)
        times = duration * (np.arange(ranges.pushes) + 0.5) / ranges.pushes
        pushes = tuple(Push(float(time), ranges.push_duration, force) for time in times)
        add("push", f"{impulse:g} N s {direction}", pushes=pushes)
    return sorted(found, key=lambda entry: entry[0])


def run_extremes(experiment: Experiment, jobs: int = -1, progress: Progress | None = None) -> list[Extreme]:
    """Execute with one quantity after the other at the ends of its range, through joblib.

    Args:
        experiment: What is executed.
        jobs: Processes; -1 is one a core.
        progress: Called with how many executions are done and how many there are.
    """
    import joblib

    from jet_gym.simulation.course import make_course

    duration = make_course(experiment.plans, experiment.settings.course).duration
    found = extremes(experiment.ranges, duration, len(experiment.plans))
    wanted = [(entry, control) for control in experiment.controls for entry in found]
    parallel = joblib.Parallel(n_jobs=jobs, return_as="generator")
    results = []
    for number, trial in enumerate(
        parallel(joblib.delayed(experiment.run)(0, control, entry[2]) for entry, control in wanted), start=1
    ):
        results.append(trial)
        if progress is not None:
            progress(number, len(wanted))
    return [Extreme(entry[0], entry[1], trial) for (entry, _), trial in zip(wanted, results, strict=True)]


def _known(value: float | None) -> float:
    return math.nan if value is None else value
