"""Means and other statistics with bootstrap intervals, as every table and plot of this package reports them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from jet_gym.utils.arrays import Array

_RESAMPLES = 2000
_CHUNK = 200  # resamples at a time


@dataclass(frozen=True)
class Interval:
    """A mean with its 95 % bootstrap interval.

    Attributes:
        mean: Mean of the sample.
        low: Lower end of the interval.
        high: Upper end of the interval.
    """

    mean: float
    low: float
    high: float

    @property
    def reach(self) -> float:
        """How far it reaches from the mean, on its longer side."""
        return max(self.high - self.mean, self.mean - self.low)


def bootstrap_mean(values: Sequence[float], seed: int = 0) -> Interval:
    """Return the mean of a sample and its 95 % percentile bootstrap interval.

    Args:
        values: The sample; of one value, or of equal ones, the interval is a point.
        seed: Seed of the resampling.

    Raises:
        ValueError: If the sample is empty.
    """
    sample = np.asarray(values, dtype=np.float64)
    if sample.size == 0:
        raise ValueError("a mean needs at least one value")
    mean = float(sample.mean())
    if np.ptp(sample) == 0.0:
        return Interval(mean, mean, mean)
    from scipy.stats import bootstrap

    interval = bootstrap(
        (sample,), np.mean, n_resamples=_RESAMPLES, method="percentile", rng=np.random.default_rng(seed)
    ).confidence_interval
    return Interval(mean, float(interval.low), float(interval.high))


def interquartile_mean(values: Array, axis: int = -1) -> Array:
    """Return the mean of the middle half of a sample, along an axis: 25 % are left out at either end.

    Source: Agarwal et al., "Deep reinforcement learning at the edge of the statistical precipice", 2021.
    """
    from scipy.stats import trim_mean

    return np.asarray(trim_mean(values, 0.25, axis=axis))


Statistic = Callable[[Array], Array]
"""Takes resamples (R, values) to one number each (R,)."""

STATISTICS: dict[str, Statistic] = {
    "mean": lambda values: values.mean(axis=-1),
    "iqm": interquartile_mean,
    "median": lambda values: np.asarray(np.median(values, axis=-1)),
}


def bootstrap_steps(
    values: ArrayLike, statistic: Statistic, seed: int = 0, resamples: int = _RESAMPLES
) -> Interval:
    """Return a statistic of what was measured on many steps, and its 95 % interval over steps and seeds.

    Steps are drawn with replacement, and for each step drawn its seeds are: a bootstrap stratified by step, as the
    one of Agarwal et al. (2021) is by task, with the steps a sample as well.

    Args:
        values: Measurements (steps, seeds).
        statistic: The statistic.
        seed: Seed of the resampling.
        resamples: How many resamples.

    Raises:
        ValueError: If there is no value.
    """
    sample = np.asarray(values, dtype=np.float64)
    if sample.ndim != 2 or sample.size == 0:
        raise ValueError(f"values must have shape (steps, seeds), not {sample.shape}")
    value = float(statistic(sample.reshape(1, -1))[0])
    if np.ptp(sample) == 0.0:
        return Interval(value, value, value)
    generator, (steps, seeds) = np.random.default_rng(seed), sample.shape
    found = np.empty(resamples)
    for first in range(0, resamples, _CHUNK):
        count = min(_CHUNK, resamples - first)
        which = generator.integers(steps, size=(count, steps, 1))
        run = generator.integers(seeds, size=(count, steps, seeds)) if seeds > 1 else np.zeros((1, 1, 1), np.int64)
        found[first : first + count] = statistic(sample[which, run].reshape(count, -1))
    low, high = np.percentile(found, (2.5, 97.5))
    return Interval(value, float(low), float(high))


def improvement(ours: ArrayLike, theirs: ArrayLike) -> Array:
    """Return, step by step, the probability that we have less than they, ties counting half.

    Args:
        ours: Measurements (steps, seeds).
        theirs: Measurements of the same steps (steps, other seeds).

    Returns:
        Probabilities (steps, 1) over pairs of seeds; their mean is the probability of improvement of Agarwal et
        al. (2021).
    """
    a, b = np.asarray(ours, dtype=np.float64)[:, :, None], np.asarray(theirs, dtype=np.float64)[:, None, :]
    less: Array = (a < b) + 0.5 * (a == b)
    return np.asarray(less.mean(axis=(1, 2))[:, None])
