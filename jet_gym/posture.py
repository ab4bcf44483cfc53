"""From where the pelvis is to the whole posture and the constraints that it meets or breaks, for one or a million.

Preconditions 1 and 2 of the paper: the pelvis is level and turned to its yaw, eq. (4); both soles are level and
point forward. So the position of the pelvis fixes all twelve joints, the centre of mass and the thrust.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jet_gym.balance import BalanceSettings, edge_undefined
from jet_gym.kinematics import axis_signs, range_middles
from jet_gym.leg import Side
from jet_gym.posture_block import (
    BLOCK,
    COM,
    EDGE,
    FOUND_THRUST,
    FOUND_ZMP,
    OUT_OF_REACH,
    Blocks,
    evaluate_blocks,
    joint_from_middle,
    new_blocks,
    put,
    stance_in,
)
from jet_gym.robot import Robot
from jet_gym.single_support import SingleSupport, single_support, stance_between
from jet_gym.utils.arrays import Array, finite_array
from jet_gym.utils.compilation import entry_point

_CHUNK = 64 * BLOCK


@dataclass(frozen=True, eq=False)
class Postures:
    """One posture or a batch of them with the leading shape ``(...)``; world frame.

    Attributes:
        pelvis: Position of the pelvis origin (..., 3) [m].
        pelvis_yaw: Yaw of the level pelvis (...) [rad], eq. (4).
        joint_positions: Joint positions (..., 12) [rad]; where the reach fails, of the leg stretched or
            folded towards its sole.
        center_of_mass: Centre of mass (..., 3) [m].
        thrust: Thrust [N] (...) that the thrust model asks for, be it possible or not.
        zmp: Zero-moment point (..., 2) [m] that the robot gets with this thrust, eqs (1) and (2).
        assigned_zmp: The assigned ZMP Z (..., 2) [m].
        fan: Where the swing foot's thrust acts (..., 3) [m], P_T.
        edge_angle: theta_ZC - theta_CA of eq. (10) (...) [rad], in (-pi, pi]; 0 where it is undefined.
        out_of_reach: By how much a sole is out of reach (...) [m].
        violations: Violated constraints (...) as flags of :mod:`jet_gym.constraints`.
    """

    pelvis: Array
    pelvis_yaw: Array
    joint_positions: Array
    center_of_mass: Array
    thrust: Array
    zmp: Array
    assigned_zmp: Array
    fan: Array
    edge_angle: Array
    out_of_reach: Array
    violations: NDArray[np.int64]


def evaluate_postures(
    robot: Robot,
    swing: Side,
    swing_sole: ArrayLike,
    support_sole: ArrayLike,
    pelvis: ArrayLike,
    settings: BalanceSettings | None = None,
) -> Postures:
    """Evaluate one posture or a million: joint positions, balance, thrust and violated constraints.

    The three positions broadcast against each other.

    Args:
        robot: The robot.
        swing: The swing leg.
        swing_sole: Position of the swing sole (..., 3) [m], world.
        support_sole: Position of the support sole (..., 3) [m], world.
        pelvis: Position of the pelvis origin (..., 3) [m], world.
        settings: What counts as balanced; the defaults where omitted.

    Raises:
        ValueError: If a shape is wrong or a number is not finite.
        SettingsError: If the settings do not fit the robot's feet.
    """
    numbers = single_support(robot, swing, settings)
    named = {"swing_sole": swing_sole, "support_sole": support_sole, "pelvis": pelvis}
    arrays = [finite_array(values, name, 3) for name, values in named.items()]
    shape = np.broadcast_shapes(*(array.shape for array in arrays))[:-1]
    soles, supports, pelvises = (
        np.array(np.broadcast_to(array, (*shape, 3)), order="C").reshape(-1, 3) for array in arrays
    )
    count = len(pelvises)
    rows, angles = _Rows.empty(count), np.empty((count, 14))
    chunk = min(_CHUNK, -(-count // BLOCK) * BLOCK)  # what is worked on at a time stays in the processor's cache
    directions, blocks = _Directions(np.empty((chunk, 14)), np.empty((chunk, 14))), new_blocks(chunk // BLOCK)
    for first in range(0, count, max(chunk, 1)):
        last = min(first + chunk, count)
        part, size = slice(first, last), last - first
        _fill(numbers, soles[part], supports[part], pelvises[part], blocks.given)
        evaluate_blocks(numbers, blocks)
        _read(numbers.side, numbers.swing_leg.fan[2], blocks, directions, rows.part(part))
        np.arctan2(directions.sines[:size], directions.cosines[:size], out=angles[part])  # runs in SIMD lanes
    joints = (angles[:, :12] + range_middles(robot)) * axis_signs(robot)
    yaw, edge_angle = (column.reshape(shape) for column in angles[:, 12:].T)
    return Postures(
        pelvis=pelvises.reshape(*shape, 3),
        pelvis_yaw=yaw,
        joint_positions=joints.reshape(*shape, 12),
        center_of_mass=rows.center_of_mass.reshape(*shape, 3),
        thrust=rows.thrust.reshape(shape),
        zmp=rows.zmp.reshape(*shape, 2),
        assigned_zmp=rows.assigned_zmp.reshape(*shape, 2),
        fan=rows.fan.reshape(*shape, 3),
        edge_angle=edge_angle,
        out_of_reach=rows.out_of_reach.reshape(shape),
        violations=rows.violations.reshape(shape),
    )


class _Directions(NamedTuple):
    """Joint angles, the yaw and the angle of eq. (10), as cosines and sines, of N postures or more."""

    cosines: Array  # (N, 14)
    sines: Array  # (N, 14)


class _Rows(NamedTuple):
    """What else there is to say of N postures, a row each; as :class:`Postures` has it."""

    center_of_mass: Array  # (N, 3)
    fan: Array  # (N, 3)
    thrust: Array  # (N,)
    out_of_reach: Array  # (N,)
    zmp: Array  # (N, 2)
    assigned_zmp: Array  # (N, 2)
    violations: NDArray[np.int64]  # (N,)

    @classmethod
    def empty(cls, count: int) -> _Rows:
        """Return room for as many postures."""
        vectors, scalars, points = np.empty((2, count, 3)), np.empty((2, count)), np.empty((2, count, 2))
        (com, fan), (thrust, out_of_reach), (zmp, assigned_zmp) = vectors, scalars, points
        return cls(com, fan, thrust, out_of_reach, zmp, assigned_zmp, np.empty(count, dtype=np.int64))

    def part(self, rows: slice) -> _Rows:
        """Return a view of some of the rows."""
        return _Rows._make(values[rows] for values in self)


@entry_point
def _fill(robot: SingleSupport, swing_sole: Array, support_sole: Array, pelvis: Array, given: Array) -> None:
    """Put swing points and pelvis positions into blocks."""
    for i in range(len(pelvis)):
        sole = (swing_sole[i, 0], swing_sole[i, 1], swing_sole[i, 2])
        support = (support_sole[i, 0], support_sole[i, 1], support_sole[i, 2])
        stance = stance_between(robot, sole, support)
        put(given[i // BLOCK], i % BLOCK, stance, (pelvis[i, 0], pelvis[i, 1], pelvis[i, 2]))


@entry_point
def _read(side: float, fan_height: float, blocks: Blocks, directions: _Directions, rows: _Rows) -> None:
    """Read postures out of blocks; the two numbers alone, as to hand a whole robot over takes a while."""
    cosines, sines = directions
    for i in range(len(rows.thrust)):
        block, column = i // BLOCK, i % BLOCK
        found, stance = blocks.found[block], stance_in(blocks.given[block], column)
        for joint in range(12):
            cosines[i, joint], sines[i, joint] = joint_from_middle(found, column, side > 0.0, joint)
        cosines[i, 12], sines[i, 12] = stance.cos_yaw, stance.sin_yaw
        undefined = edge_undefined(found[EDGE + 2, column])
        cosines[i, 13] = 1.0 if undefined else found[EDGE + 1, column]
        sines[i, 13] = 0.0 if undefined else found[EDGE, column]
        rows.thrust[i], rows.out_of_reach[i] = found[FOUND_THRUST, column], found[OUT_OF_REACH, column]
        rows.violations[i] = blocks.violations[block, column]
        for axis in range(2):
            rows.zmp[i, axis] = found[FOUND_ZMP + axis, column]
            rows.assigned_zmp[i, axis] = stance.assigned_zmp[axis]
            rows.fan[i, axis] = stance.fan[axis]
        rows.fan[i, 2] = stance.swing_ankle[2] + fan_height
        for axis in range(3):
            rows.center_of_mass[i, axis] = found[COM + axis, column]
