"""How what changes in the course of a training changes."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Geometric:
    """Goes from one value to another by equal factors, as a schedule of Stable-Baselines3.

    Attributes:
        first: Value at the beginning, above 0.
        last: Value at the end, above 0.
    """

    first: float
    last: float

    def __call__(self, remaining: float) -> float:
        """Return the value where this share of the training remains, from 1 to 0."""
        value: float = self.first * (self.last / self.first) ** (1.0 - remaining)
        return value
