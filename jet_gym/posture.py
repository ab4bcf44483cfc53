"""From where the pelvis is to the whole posture and the constraints that it meets or breaks, for one or a million.

Preconditions 1 and 2 of the paper: the pelvis is level and turned to its yaw, eq. (4); both soles are level and
point forward. So the position of the pelvis fixes all twelve joints, the centre of mass and the thrust.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jet_gym.arrays import Array, finite_array
from jet_gym.balance import BalanceSettings, edge_undefined, stance_of
from jet_gym.compilation import entry_point
from jet_gym.kinematics import axis_signs, range_middles
from jet_gym.leg import Leg, Side
from jet_gym.posture_block import (
    BLOCK,
    COM,
    EDGE,
    FOUND_ROWS,
    FOUND_THRUST,
    FOUND_ZMP,
    GIVEN_ROWS,
    OUT_OF_REACH,
    evaluate_blocks,
    joint_from_middle,
    put,
    stance_in,
)
from jet_gym.robot import Robot

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
    balance = (settings or BalanceSettings()).parameters(robot)
    named = {"swing_sole": swing_sole, "support_sole": support_sole, "pelvis": pelvis}
    arrays = [finite_array(values, name, 3) for name, values in named.items()]
    shape = np.broadcast_shapes(*(array.shape for array in arrays))[:-1]
    soles, supports, pelvises = (
        np.array(np.broadcast_to(array, (*shape, 3)), order="C").reshape(-1, 3) for array in arrays
    )
    count = len(pelvises)
    com, fan, angles = np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 14))
    scalars, points = np.empty((count, 2)), np.empty((count, 2, 2))
    violations = np.empty(count, dtype=np.int64)
    swing_leg, support_leg, side = swing_and_support(robot, swing)
    chunk = min(_CHUNK, -(-count // BLOCK) * BLOCK)  # what is worked on at a time stays in the processor's cache
    cosines, sines = np.empty((chunk, 14)), np.empty((chunk, 14))
    given, found = np.zeros((chunk // BLOCK, GIVEN_ROWS, BLOCK)), np.empty((chunk // BLOCK, FOUND_ROWS, BLOCK))
    flags = np.empty((chunk // BLOCK, BLOCK), dtype=np.int64)
    for first in range(0, count, max(chunk, 1)):
        last = min(first + chunk, count)
        rows, size = slice(first, last), last - first
        _fill(swing_leg, support_leg, side, balance.zmp_margin, soles[rows], supports[rows], pelvises[rows], given)
        evaluate_blocks(swing_leg, support_leg, robot.trunk, balance, given, found, flags)
        _read(
            side, swing_leg.fan[2], given, found, flags,
            cosines, sines, com[rows], fan[rows], scalars[rows], points[rows], violations[rows],
        )  # fmt: skip
        np.arctan2(sines[:size], cosines[:size], out=angles[rows])  # in SIMD lanes, unlike the compiler's
    joints = (angles[:, :12] + range_middles(robot)) * axis_signs(robot)
    yaw, edge_angle = (column.reshape(shape) for column in angles[:, 12:].T)
    thrust, out_of_reach = (column.reshape(shape) for column in scalars.T)
    zmp, assigned_zmp = (points[:, which].reshape(*shape, 2) for which in range(2))
    return Postures(
        pelvis=pelvises.reshape(*shape, 3),
        pelvis_yaw=yaw,
        joint_positions=joints.reshape(*shape, 12),
        center_of_mass=com.reshape(*shape, 3),
        thrust=thrust,
        zmp=zmp,
        assigned_zmp=assigned_zmp,
        fan=fan.reshape(*shape, 3),
        edge_angle=edge_angle,
        out_of_reach=out_of_reach,
        violations=violations.reshape(shape),
    )


def swing_and_support(robot: Robot, swing: Side) -> tuple[Leg, Leg, float]:
    """Return the swing leg, the support leg, and +1 or -1 for a left or right swing."""
    if swing == "left":
        return robot.left, robot.right, 1.0
    if swing == "right":
        return robot.right, robot.left, -1.0
    raise ValueError(f"swing must be 'left' or 'right', not {swing!r}")


@entry_point
def _fill(
    swing_leg: Leg,
    support_leg: Leg,
    side: float,
    zmp_margin: float,
    swing_sole: Array,
    support_sole: Array,
    pelvis: Array,
    given: Array,
) -> None:
    """Put swing points and pelvis positions into blocks."""
    for i in range(len(pelvis)):
        sole = (swing_sole[i, 0], swing_sole[i, 1], swing_sole[i, 2])
        support = (support_sole[i, 0], support_sole[i, 1], support_sole[i, 2])
        stance = stance_of(swing_leg, support_leg, side, zmp_margin, sole, support)
        put(given[i // BLOCK], i % BLOCK, stance, (pelvis[i, 0], pelvis[i, 1], pelvis[i, 2]))


@entry_point
def _read(
    side: float,
    fan_height: float,
    given: Array,
    found: Array,
    flags: NDArray[np.int64],
    cosines: Array,
    sines: Array,
    center_of_mass: Array,
    fan: Array,
    scalars: Array,
    points: Array,
    violations: NDArray[np.int64],
) -> None:
    """Read postures out of blocks."""
    for i in range(len(violations)):
        block, column = i // BLOCK, i % BLOCK
        of_block = found[block]
        stance = stance_in(given[block], column)
        for joint in range(12):
            cosines[i, joint], sines[i, joint] = joint_from_middle(of_block, column, side > 0.0, joint)
        cosines[i, 12], sines[i, 12] = stance.cos_yaw, stance.sin_yaw
        undefined = edge_undefined(of_block[EDGE + 2, column])
        cosines[i, 13] = 1.0 if undefined else of_block[EDGE + 1, column]
        sines[i, 13] = 0.0 if undefined else of_block[EDGE, column]
        scalars[i, 0], scalars[i, 1] = of_block[FOUND_THRUST, column], of_block[OUT_OF_REACH, column]
        violations[i] = flags[block, column]
        for axis in range(2):
            points[i, 0, axis] = of_block[FOUND_ZMP + axis, column]
            points[i, 1, axis] = stance.assigned_zmp[axis]
            fan[i, axis] = stance.fan[axis]
        fan[i, 2] = stance.swing_ankle[2] + fan_height
        for axis in range(3):
            center_of_mass[i, axis] = of_block[COM + axis, column]
