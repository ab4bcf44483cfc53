"""The numbers of the task in one array: a compiled function takes an array in no time, and nested tuples slowly."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from jet_gym.balance import BalanceParameters
from jet_gym.fitness import FitnessParameters
from jet_gym.leg import Leg, Six
from jet_gym.robot import Trunk
from jet_gym.single_support import SingleSupport
from jet_gym.task.lanes import three
from jet_gym.task.settings import TaskParameters
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import inlined

_LEG_NUMBERS = 80


class TaskNumbers(NamedTuple):
    """All that a compiled function needs to know of the task."""

    robot: SingleSupport
    fitness: FitnessParameters
    task: TaskParameters


def pack(numbers: TaskNumbers) -> Array:
    """Return the numbers in one array, in the order of their fields."""
    flat: list[float] = []

    def append(value: Any) -> None:
        if isinstance(value, tuple):
            for part in value:
                append(part)
        else:
            flat.append(float(value))

    append(numbers)
    return np.array(flat)


@inlined
def unpack(n: Array) -> TaskNumbers:
    """Return the numbers that were packed."""
    at = 2 * _LEG_NUMBERS
    return TaskNumbers(
        SingleSupport(
            _leg(n, 0),
            _leg(n, _LEG_NUMBERS),
            Trunk(three(n, at), n[at + 3]),
            n[at + 4],
            BalanceParameters(n[at + 5] != 0.0, n[at + 6], n[at + 7], n[at + 8], n[at + 9]),
        ),
        FitnessParameters(n[at + 10], n[at + 11], n[at + 12], n[at + 13], n[at + 14]),
        TaskParameters(
            n[at + 15], n[at + 16], n[at + 17], n[at + 18], n[at + 19], n[at + 20], n[at + 21], n[at + 22]
        ),
    )  # fmt: skip


@inlined
def _leg(n: Array, i: int) -> Leg:
    return Leg(
        three(n, i),
        three(n, i + 3),
        three(n, i + 6),
        three(n, i + 9),
        three(n, i + 12),
        (n[i + 15], n[i + 16], n[i + 17], n[i + 18]),
        n[i + 19],
        _six(n, i + 20),
        _six(n, i + 26),
        _six(n, i + 32),
        _six(n, i + 38),
        _six(n, i + 44),
        _six(n, i + 50),
        _six(n, i + 56),
        (
            three(n, i + 62), three(n, i + 65), three(n, i + 68),
            three(n, i + 71), three(n, i + 74), three(n, i + 77),
        ),
    )  # fmt: skip


@inlined
def _six(n: Array, i: int) -> Six:
    return n[i], n[i + 1], n[i + 2], n[i + 3], n[i + 4], n[i + 5]
