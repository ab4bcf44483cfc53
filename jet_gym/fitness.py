"""What a planner minimises at a swing point: eqs (15) to (22)."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jet_gym.constraints import EDGE_POLYGON, JOINT_LIMITS, THRUST
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined
from jet_gym.utils.settings import require_within


@dataclass(frozen=True)
class FitnessSettings:
    """Weights and penalties of the fitness.

    Attributes:
        smoothness_weight: omega [1/m^2] of eq. (18), per axis. The paper prints 50 without a unit; the
            default is 50 per cm^2, chosen from the sweep that ``jet-gym sweep`` prints.
        joint_limit_penalty: C1 of eq. (16).
        edge_penalty: C2 of eq. (17).
        thrust_penalty: C4-1 of eq. (22).
        thrust_weight: C4-2 [1/N] of eq. (22).
    """

    smoothness_weight: float = 50e4
    joint_limit_penalty: float = 11000.0
    edge_penalty: float = 9000.0
    thrust_penalty: float = 5000.0
    thrust_weight: float = 10.0

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed."""
        for name in (field.name for field in fields(self)):
            require_within(name, getattr(self, name))

    def parameters(self) -> FitnessParameters:
        """Return the numbers for compiled code."""
        return FitnessParameters(
            self.smoothness_weight,
            self.joint_limit_penalty,
            self.edge_penalty,
            self.thrust_penalty,
            self.thrust_weight,
        )


class FitnessParameters(NamedTuple):
    """Fitness settings in numbers that compiled code takes by value."""

    smoothness_weight: float  # [1/m^2]
    joint_limit_penalty: float
    edge_penalty: float
    thrust_penalty: float
    thrust_weight: float  # [1/N]


@inlined
def fitness_terms(
    parameters: FitnessParameters, violations: int, thrust: float, moved_squared: float
) -> tuple[float, float, float, float]:
    r"""Return f1 to f4 of eqs (16) to (22); the fitness, eq. (15), is their sum.

    Where the joint limits, eq. (8), or the edge polygon, eq. (10), fail, f1 and f2 are their penalties, else zero.
    Of the pelvis :math:`P_k` and the thrust :math:`F`

    .. math:: f_3 = \omega |P_k - P_{k-1}|^2, \qquad f_4 = C_{4,2} F

    or f4 is the penalty of the thrust's limits, eq. (9).

    Args:
        parameters: Weights and penalties.
        violations: Violated constraints, as flags.
        thrust: Thrust [N].
        moved_squared: Squared distance [m^2] of the pelvis from the last swing point's, zero at the first.
    """
    f1 = 0.0 if violations & JOINT_LIMITS == 0 else parameters.joint_limit_penalty
    f2 = 0.0 if violations & EDGE_POLYGON == 0 else parameters.edge_penalty
    f3 = parameters.smoothness_weight * moved_squared
    f4 = parameters.thrust_weight * thrust if violations & THRUST == 0 else parameters.thrust_penalty
    return f1, f2, f3, f4


def fitness_of_postures(
    violations: ArrayLike,
    thrust: ArrayLike,
    pelvis: ArrayLike,
    settings: FitnessSettings | None = None,
    starts: ArrayLike = 0,
) -> Array:
    """Return the fitness terms along trajectories of postures; f3 is zero at the first point of each.

    Args:
        violations: Violated constraints (N,) as flags.
        thrust: Thrust (N,) [N].
        pelvis: Pelvis path (N, 3) [m].
        settings: Weights and penalties; the defaults where omitted.
        starts: Where trajectories begin, one after the other.

    Returns:
        f1 to f4 (N, 4) of eqs (16) to (22).
    """
    parameters = (settings or FitnessSettings()).parameters()
    path = np.asarray(pelvis, dtype=np.float64)
    moved_squared = np.zeros(len(path))
    moved_squared[1:] = (np.diff(path, axis=0) ** 2).sum(axis=1)
    moved_squared[np.asarray(starts)] = 0.0
    terms = np.empty((len(path), 4))
    flags = np.ascontiguousarray(violations, dtype=np.int64)
    _terms(parameters, flags, np.ascontiguousarray(thrust, dtype=np.float64), moved_squared, terms)
    return terms


@entry_point
def _terms(
    parameters: FitnessParameters, violations: NDArray[np.int64], thrust: Array, moved_squared: Array, terms: Array
) -> None:
    for i in range(len(violations)):
        f1, f2, f3, f4 = fitness_terms(parameters, violations[i], thrust[i], moved_squared[i])
        terms[i, 0], terms[i, 1], terms[i, 2], terms[i, 3] = f1, f2, f3, f4
