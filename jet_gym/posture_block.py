"""Postures of different swing points side by side in SIMD lanes: 16 at a time, through two scratch arrays.

The straight-line arithmetic of :func:`~jet_gym.posture_state.posture_at` runs in SIMD lanes only if it reads and
writes plain columns. So whoever has many postures to evaluate fills a block of them with :func:`put`, calls
:func:`evaluate_block`, or :func:`evaluate_blocks` from Python, and reads the block with the getters.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jet_gym.balance import Stance, edge_vectors
from jet_gym.kinematics import from_middle
from jet_gym.leg import Vector
from jet_gym.posture_state import posture_at
from jet_gym.single_support import SingleSupport
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined

BLOCK = 16
GIVEN_PELVIS = 16  # row at which the pelvis begins, behind the 16 numbers of a stance
GIVEN_ROWS = 19
# Rows at which what is found begins; the last two are those of the joints of swing and support leg.
COM, FOUND_THRUST, FOUND_ZMP, OUT_OF_REACH, EDGE, COSINES, SINES = 0, 3, 4, 6, 7, 10, 22
FOUND_ROWS = 34


class Block(NamedTuple):
    """Postures side by side, a column each."""

    given: Array  # (GIVEN_ROWS, BLOCK) swing points and pelvis positions
    found: Array  # (FOUND_ROWS, BLOCK) the postures
    violations: NDArray[np.int64]  # (BLOCK,) the violated constraints, as flags


class Blocks(NamedTuple):
    """B blocks of postures, in arrays that Python makes."""

    given: Array  # (B, GIVEN_ROWS, BLOCK)
    found: Array  # (B, FOUND_ROWS, BLOCK)
    violations: NDArray[np.int64]  # (B, BLOCK)


@inlined
def new_block() -> Block:
    """Return a block of zeros.

    Arrays that compiled code makes itself have a shape that the compiler knows, and overlap with nothing: that
    makes SIMD possible.
    """
    return Block(np.zeros((GIVEN_ROWS, BLOCK)), np.zeros((FOUND_ROWS, BLOCK)), np.zeros(BLOCK, np.int64))


def new_blocks(count: int) -> Blocks:
    """Return as many blocks."""
    given, found = np.zeros((count, GIVEN_ROWS, BLOCK)), np.empty((count, FOUND_ROWS, BLOCK))
    return Blocks(given, found, np.empty((count, BLOCK), dtype=np.int64))


@inlined
def put(given: Array, column: int, stance: Stance, pelvis: Vector) -> None:
    """Write a swing point and a pelvis position into a column of the block."""
    given[0, column], given[1, column] = stance.cos_yaw, stance.sin_yaw
    for axis in range(3):
        given[2 + axis, column] = stance.swing_ankle[axis]
        given[5 + axis, column] = stance.support_ankle[axis]
        given[GIVEN_PELVIS + axis, column] = pelvis[axis]
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
def evaluate_blocks(robot: SingleSupport, blocks: Blocks) -> None:
    """Evaluate the postures of blocks, all columns of each whether they were put or not."""
    own = new_block()
    for block in range(len(blocks.given)):
        for row in range(GIVEN_ROWS):
            for column in range(BLOCK):
                own.given[row, column] = blocks.given[block, row, column]
        evaluate_block(robot, own)
        for row in range(FOUND_ROWS):
            for column in range(BLOCK):
                blocks.found[block, row, column] = own.found[row, column]
        for column in range(BLOCK):
            blocks.violations[block, column] = own.violations[column]


@inlined
def evaluate_block(robot: SingleSupport, block: Block) -> None:
    """Evaluate the postures of a block, in SIMD lanes if it is the caller's own :func:`new_block`."""
    swing_leg, support_leg = robot.swing_leg, robot.support_leg
    given, found, violations = block
    for i in range(BLOCK):
        stance = stance_in(given, i)
        pelvis = (given[GIVEN_PELVIS, i], given[GIVEN_PELVIS + 1, i], given[GIVEN_PELVIS + 2, i])
        state = posture_at(robot, stance, pelvis)
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
