"""What one action led to: the posture it chose, its fitness and its reward, as the model judges them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from jet_gym.constraints import CONSTRAINT_NAMES, violation_names
from jet_gym.task.settings import FITNESS_TERMS, REWARD_TERMS
from jet_gym.utils.arrays import Array

# Rows of the array; several of them where it is a position, a vector or a list of terms.
JOINTS, CHOSEN_PELVIS, YAW, CENTER_OF_MASS, ZMP, ASSIGNED_ZMP, EDGE_ANGLE, ASKED_THRUST = (
    0,
    12,
    15,
    16,
    19,
    21,
    23,
    24,
)
FIRST_FITNESS_TERM = 25
FITNESS = FIRST_FITNESS_TERM + len(FITNESS_TERMS)
FIRST_GRADED_TERM = FITNESS + 1
GRADED = FIRST_GRADED_TERM + len(REWARD_TERMS)
VIOLATIONS, TRANSITION_ROWS = GRADED + 1, GRADED + 2

_NAMES_OF_FLAGS = np.empty(2 * max(CONSTRAINT_NAMES), dtype=object)
for _flags in range(len(_NAMES_OF_FLAGS)):
    _NAMES_OF_FLAGS[_flags] = violation_names(_flags)


class Transition:
    """What one action led to in each of N lanes, in the world frame: one array and views of it.

    Args:
        count: Number of lanes.

    Attributes:
        array: All of it, a row a quantity.
        joint_positions: (N, 12) [rad]
        pelvis: (N, 3) [m]
        pelvis_yaw: (N,) [rad]
        com: Centre of mass (N, 3) [m].
        zmp: ZMP under the thrust (N, 2) [m].
        assigned_zmp: (N, 2) [m]
        edge_angle: Angle of eq. (10) (N,) [rad]; 0 where it is undefined.
        thrust: (N,) [N]
        fitness_terms: f1 to f4 (4, N).
        fitness: Eq. (15), their sum (N,).
        graded_terms: Terms of the graded reward (len(REWARD_TERMS), N).
        graded: The graded reward, their sum (N,).
        violations: Flags of :mod:`jet_gym.constraints` (N,), whole numbers.
    """

    def __init__(self, count: int) -> None:
        array = np.zeros((TRANSITION_ROWS, count))
        self.array: Array = array
        self.joint_positions: Array = array[JOINTS : JOINTS + 12].T
        self.pelvis: Array = array[CHOSEN_PELVIS : CHOSEN_PELVIS + 3].T
        self.pelvis_yaw: Array = array[YAW]
        self.com: Array = array[CENTER_OF_MASS : CENTER_OF_MASS + 3].T
        self.zmp: Array = array[ZMP : ZMP + 2].T
        self.assigned_zmp: Array = array[ASSIGNED_ZMP : ASSIGNED_ZMP + 2].T
        self.edge_angle: Array = array[EDGE_ANGLE]
        self.thrust: Array = array[ASKED_THRUST]
        self.fitness_terms: Array = array[FIRST_FITNESS_TERM:FITNESS]
        self.fitness: Array = array[FITNESS]
        self.graded_terms: Array = array[FIRST_GRADED_TERM:GRADED]
        self.graded: Array = array[GRADED]
        self.violations: Array = array[VIOLATIONS]

    def take(self, lanes: NDArray[np.int64]) -> Transition:
        """Return a transition of as many lanes that has these alone, and erase them here; zeros are left."""
        taken = Transition(self.array.shape[1])
        taken.array[:, lanes], self.array[:, lanes] = self.array[:, lanes], 0.0
        return taken

    def infos(self, present: NDArray[np.bool_]) -> dict[str, Any]:
        """Return the infos of the lanes that are present, the reward's terms left out, in arrays of their own."""
        names = _NAMES_OF_FLAGS[self.violations.astype(np.intp)]
        names[~present] = None
        return {
            "thrust": self.thrust.copy(),
            "fitness": self.fitness.copy(),
            "fitness_terms": dict(zip(FITNESS_TERMS, self.fitness_terms.copy(), strict=True)),
            "pelvis": self.pelvis.copy("C"),
            "joint_positions": self.joint_positions.copy("C"),
            "com": self.com.copy("C"),
            "zmp": self.zmp.copy("C"),
            "assigned_zmp": self.assigned_zmp.copy("C"),
            "edge_angle": self.edge_angle.copy(),
            "violations": names,
        }

    def info(self) -> tuple[dict[str, Any], list[float]]:
        """Return the info of the only lane, the reward's terms left out, and its column as plain numbers."""
        column = self.array[:, 0].copy()
        numbers: list[float] = column.tolist()
        info = {
            "thrust": numbers[ASKED_THRUST],
            "fitness": numbers[FITNESS],
            "fitness_terms": dict(zip(FITNESS_TERMS, numbers[FIRST_FITNESS_TERM:FITNESS], strict=True)),
            "pelvis": column[CHOSEN_PELVIS : CHOSEN_PELVIS + 3],
            "joint_positions": column[JOINTS : JOINTS + 12],
            "com": column[CENTER_OF_MASS : CENTER_OF_MASS + 3],
            "zmp": column[ZMP : ZMP + 2],
            "assigned_zmp": column[ASSIGNED_ZMP : ASSIGNED_ZMP + 2],
            "edge_angle": numbers[EDGE_ANGLE],
            "violations": _NAMES_OF_FLAGS[int(numbers[VIOLATIONS])],
        }
        return info, numbers
