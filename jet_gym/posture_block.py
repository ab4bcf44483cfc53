"""Postures of different swing points side by side in SIMD lanes: 16 at a time, through two scratch arrays.

The straight-line arithmetic of :func:`~jet_gym.posture_state.posture_at` runs in SIMD lanes only if it reads and
writes plain columns. So whoever has many postures to evaluate fills a block of them with :func:`put`, calls
:func:`evaluate_block`, or :func:`evaluate_blocks` from Python, and reads the block with the getters.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jet_gym.arrays import Array
from jet_gym.balance import BalanceParameters, Stance, edge_vectors
from jet_gym.compilation import entry_point, inlined
from jet_gym.kinematics import from_middle
from jet_gym.leg import Leg, Vector
from jet_gym.posture_state import posture_at
from jet_gym.robot import Trunk

BLOCK = 16
GIVEN_ROWS = 19  # a stance of 16 numbers and a pelvis
FOUND_ROWS = 34  # what follows, and then cosines and sines of the joints of swing and support leg
COM, FOUND_THRUST, FOUND_ZMP, OUT_OF_REACH, EDGE, COSINES, SINES = 0, 3, 4, 6, 7, 10, 22


@inlined
def put(given: Array, column: int, stance: Stance, pelvis: Vector) -> None:
    """Write a swing point and a pelvis position into a column of the block."""
    given[0, column], given[1, column] = stance.cos_yaw, stance.sin_yaw
    for axis in range(3):
        given[2 + axis, column] = stance.swing_ankle[axis]
        given[5 + axis, column] = stance.support_ankle[axis]
        given[16 + axis, column] = pelvis[axis]
    for axis in range(2):
        given[8 + axis, column] = stance.fan[axis]
        given[10 + axis, column] = stance.assigned_zmp[axis]
    for edge in range(4):
        given[12 + edge, column] = stance.support[edge]


@inlined
def stance_in(given: Array, column: int) -> Stance:
    """Read the swing point of a column back."""
    return Stance(
        given[0, column],
        given[1, column],
        (given[2, column], given[3, column], given[4, column]),
        (given[5, column], given[6, column], given[7, column]),
        (given[8, column], given[9, column]),
        (given[10, column], given[11, column]),
        (given[12, column], given[13, column], given[14, column], given[15, column]),
    )


@entry_point
def evaluate_blocks(
    swing_leg: Leg,
    support_leg: Leg,
    trunk: Trunk,
    balance: BalanceParameters,
    given: Array,
    found: Array,
    violations: NDArray[np.int64],
) -> None:
    """Evaluate the postures of B blocks, all columns of each whether they were put or not.

    Args:
        swing_leg: The swing leg.
        support_leg: The support leg.
        trunk: The rest of the robot.
        balance: Balance settings.
        given: Swing points and pelvis positions (B, GIVEN_ROWS, BLOCK).
        found: Receives the postures (B, FOUND_ROWS, BLOCK).
        violations: Receives the violated constraints (B, BLOCK) as flags.
    """
    # Arrays made here have a shape that the compiler knows and overlap with nothing: that makes SIMD possible.
    own_given, own_found = np.empty((GIVEN_ROWS, BLOCK)), np.empty((FOUND_ROWS, BLOCK))
    own_violations = np.empty(BLOCK, np.int64)
    for block in range(len(given)):
        for row in range(GIVEN_ROWS):
            for column in range(BLOCK):
                own_given[row, column] = given[block, row, column]
        evaluate_block(swing_leg, support_leg, trunk, balance, own_given, own_found, own_violations)
        for row in range(FOUND_ROWS):
            for column in range(BLOCK):
                found[block, row, column] = own_found[row, column]
        for column in range(BLOCK):
            violations[block, column] = own_violations[column]


@inlined
def evaluate_block(
    swing_leg: Leg,
    support_leg: Leg,
    trunk: Trunk,
    balance: BalanceParameters,
    given: Array,
    found: Array,
    violations: NDArray[np.int64],
) -> None:
    """Evaluate the postures of a block, in SIMD lanes if the caller made the three arrays itself."""
    for i in range(BLOCK):
        stance = stance_in(given, i)
        pelvis = (given[16, i], given[17, i], given[18, i])
        state = posture_at(swing_leg, support_leg, trunk, balance, stance, pelvis)
        com = state.center_of_mass
        found[COM, i], found[COM + 1, i], found[COM + 2, i] = com
        found[FOUND_THRUST, i] = state.thrust
        found[FOUND_ZMP, i], found[FOUND_ZMP + 1, i] = state.zmp
        found[OUT_OF_REACH, i] = state.out_of_reach
        found[EDGE, i], found[EDGE + 1, i], found[EDGE + 2, i] = edge_vectors(stance, com[0], com[1])
        a, b = state.swing_cosines, state.swing_sines
        found[COSINES, i], found[SINES, i] = from_middle(swing_leg, 0, a[0], b[0])
        found[COSINES + 1, i], found[SINES + 1, i] = from_middle(swing_leg, 1, a[1], b[1])
        found[COSINES + 2, i], found[SINES + 2, i] = from_middle(swing_leg, 2, a[2], b[2])
        found[COSINES + 3, i], found[SINES + 3, i] = from_middle(swing_leg, 3, a[3], b[3])
        found[COSINES + 4, i], found[SINES + 4, i] = from_middle(swing_leg, 4, a[4], b[4])
        found[COSINES + 5, i], found[SINES + 5, i] = from_middle(swing_leg, 5, a[5], b[5])
        a, b = state.support_cosines, state.support_sines
        found[COSINES + 6, i], found[SINES + 6, i] = from_middle(support_leg, 0, a[0], b[0])
        found[COSINES + 7, i], found[SINES + 7, i] = from_middle(support_leg, 1, a[1], b[1])
        found[COSINES + 8, i], found[SINES + 8, i] = from_middle(support_leg, 2, a[2], b[2])
        found[COSINES + 9, i], found[SINES + 9, i] = from_middle(support_leg, 3, a[3], b[3])
        found[COSINES + 10, i], found[SINES + 10, i] = from_middle(support_leg, 4, a[4], b[4])
        found[COSINES + 11, i], found[SINES + 11, i] = from_middle(support_leg, 5, a[5], b[5])
        violations[i] = state.violations


@inlined
def joint_from_middle(found: Array, column: int, swing_is_left: bool, joint: int) -> tuple[float, float]:
    """Return cosine and sine of one of the twelve joints, left leg first, counted from its range's middle."""
    of_swing_leg = (joint < 6) == swing_is_left
    row = (joint % 6) + (0 if of_swing_leg else 6)
    return found[COSINES + row, column], found[SINES + row, column]
