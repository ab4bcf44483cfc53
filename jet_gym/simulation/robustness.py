"""How robust an execution is: success rates with intervals, and what failures have to do with."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jet_gym.simulation.disturbances import Disturbance
from jet_gym.simulation.execution import ThrustControl
from jet_gym.simulation.trials import Trial

_LEAST_FAILURES = 3  # with fewer, nothing is said of what they have in common


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
    """Return a disturbance as one number a quantity, in SI units.

    Of the shift of the pelvis' centre of mass these are the components, of the pushes the largest impulse, whatever
    its direction.
    """
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


def _known(value: float | None) -> float:
    return math.nan if value is None else value
