"""From where the pelvis is to the whole posture and the constraints that it meets or breaks.

Preconditions 1 and 2 of the paper: the pelvis is level and turned to its yaw, eq. (4); both soles are level and
point forward. So the position of the pelvis fixes all twelve joints, the centre of mass and the thrust.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jet_gym.balance import (
    BalanceParameters,
    BalanceSettings,
    Point,
    Stance,
    assigned_thrust,
    edge_undefined,
    edge_vectors,
    least_thrust,
    stance_of,
    within_edge_polygon,
    within_support,
    zmp_of,
)
from jet_gym.compilation import entry_point, inlined
from jet_gym.constraints import EDGE_POLYGON, JOINT_LIMITS, REACH, THRUST, ZMP
from jet_gym.fitness import FitnessParameters, fitness_terms
from jet_gym.kinematics import finite_array, from_middle, leg_forward, leg_inverse, within_limits
from jet_gym.robot import Leg, Robot, Side, Six, Trunk, Vector
from jet_gym.urdf import Array


class PostureState(NamedTuple):
    """A posture as compiled code sees it."""

    swing_cosines: Six
    swing_sines: Six
    support_cosines: Six
    support_sines: Six
    center_of_mass: Vector  # [m] world
    thrust: float  # [N]
    zmp: Point  # [m] world
    out_of_reach: float  # [m]
    violations: int


@inlined
def posture_at(
    swing_leg: Leg, support_leg: Leg, trunk: Trunk, balance: BalanceParameters, stance: Stance, pelvis: Vector
) -> PostureState:
    """Find the posture that a pelvis position [m] fixes, and the constraints (8) to (11) that it violates."""
    px, py, pz = pelvis
    c, s = stance.cos_yaw, stance.sin_yaw
    foot_rotation = (c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0)  # the world's axes, seen from the pelvis
    swing_hip = _hip_from_ankle(swing_leg.hip, px, py, pz, c, s, stance.swing_ankle)
    support_hip = _hip_from_ankle(support_leg.hip, px, py, pz, c, s, stance.support_ankle)
    swing_cosines, swing_sines, swing_missing = leg_inverse(swing_leg, swing_hip, foot_rotation)
    support_cosines, support_sines, support_missing = leg_inverse(support_leg, support_hip, foot_rotation)
    out_of_reach = max(swing_missing, support_missing)

    _, _, _, swing_moment = leg_forward(swing_leg, swing_cosines, swing_sines)
    _, _, _, support_moment = leg_forward(support_leg, support_cosines, support_sines)
    mx = (swing_moment[0] + support_moment[0] + trunk.mass_moment[0]) / trunk.robot_mass
    my = (swing_moment[1] + support_moment[1] + trunk.mass_moment[1]) / trunk.robot_mass
    mz = (swing_moment[2] + support_moment[2] + trunk.mass_moment[2]) / trunk.robot_mass
    com_x, com_y = px + c * mx - s * my, py + s * mx + c * my

    weight = balance.weight
    assigned = assigned_thrust(weight, com_x, com_y, stance.fan, stance.assigned_zmp)
    least = least_thrust(weight, com_x, com_y, stance.fan, stance.support, balance.zmp_margin)
    thrust = least if balance.least_thrust else assigned
    zmp = zmp_of(weight, com_x, com_y, stance.fan, thrust)
    sine, cosine, length_squared = edge_vectors(stance, com_x, com_y)

    reachable = out_of_reach <= 0.0
    in_limits = within_limits(swing_leg, swing_cosines, swing_sines)
    in_limits = in_limits & within_limits(support_leg, support_cosines, support_sines)
    in_polygon = within_edge_polygon(balance.edge_slope, sine, cosine, length_squared)
    thrust_given = (thrust >= 0.0) & (thrust <= balance.max_thrust)
    violations = (
        (0 if reachable else REACH)
        | (0 if reachable & in_limits else JOINT_LIMITS)
        | (0 if reachable & thrust_given else THRUST)
        | (0 if reachable & in_polygon else EDGE_POLYGON)
        | (0 if reachable & within_support(zmp, stance.support) else ZMP)
    )
    return PostureState(
        swing_cosines,
        swing_sines,
        support_cosines,
        support_sines,
        (com_x, com_y, pz + mz),
        thrust,
        zmp,
        out_of_reach,
        violations,
    )


@inlined
def _hip_from_ankle(hip: Vector, px: float, py: float, pz: float, c: float, s: float, ankle: Vector) -> Vector:
    return (
        px + c * hip[0] - s * hip[1] - ankle[0],
        py + s * hip[0] + c * hip[1] - ankle[1],
        pz + hip[2] - ankle[2],
    )


@entry_point
def fitness_of_candidates(
    swing_leg: Leg,
    support_leg: Leg,
    trunk: Trunk,
    balance: BalanceParameters,
    parameters: FitnessParameters,
    stance: Stance,
    previous: Vector,
    candidates: Array,
    fitness: Array,
    violations: NDArray[np.int64],
) -> None:
    """Compute the fitness, eq. (15), of many pelvis positions at one swing point: the planners' inner loop.

    A straight line of arithmetic without a trigonometric function, so that the loop runs in SIMD lanes.

    Args:
        swing_leg: The swing leg.
        support_leg: The support leg.
        trunk: The rest of the robot.
        balance: Balance settings.
        parameters: Fitness settings; a smoothness weight of zero leaves out f3.
        stance: The swing point.
        previous: Pelvis [m] at the last swing point.
        candidates: Pelvis positions (3, N) [m], world.
        fitness: Receives the fitness (N,).
        violations: Receives the violated constraints (N,) as flags.
    """
    for i in range(candidates.shape[1]):
        pelvis = (candidates[0, i], candidates[1, i], candidates[2, i])
        state = posture_at(swing_leg, support_leg, trunk, balance, stance, pelvis)
        dx, dy, dz = pelvis[0] - previous[0], pelvis[1] - previous[1], pelvis[2] - previous[2]
        f1, f2, f3, f4 = fitness_terms(parameters, state.violations, state.thrust, dx * dx + dy * dy + dz * dz)
        fitness[i] = f1 + f2 + f3 + f4
        violations[i] = state.violations


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
        edge_angle: Angle of eq. (10) (...) [rad], in (-pi, pi]; 0 where it is undefined.
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
        np.ascontiguousarray(np.broadcast_to(array, (*shape, 3)).reshape(-1, 3)) for array in arrays
    )
    count = len(pelvises)
    com, fan = np.empty((count, 3)), np.empty((count, 3))
    cosines, sines = np.empty((14, count)), np.empty((14, count))
    scalars, points = np.empty((2, count)), np.empty((2, count, 2))
    violations = np.empty(count, dtype=np.int64)
    swing_leg, support_leg, side = swing_and_support(robot, swing)
    _evaluate(
        swing_leg, support_leg, robot.trunk, balance, side, soles, supports, pelvises,
        cosines, sines, com, fan, scalars, points, violations,
    )  # fmt: skip
    angles = np.arctan2(sines, cosines)  # NumPy's runs in SIMD lanes, the compiler's does not
    joints = _joint_positions(robot, angles[:12])
    yaw, edge_angle = (row.reshape(shape) for row in angles[12:])
    thrust, out_of_reach = (row.reshape(shape) for row in scalars)
    zmp, assigned_zmp = (row.reshape(*shape, 2) for row in points)
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


def _joint_positions(robot: Robot, from_middle: Array) -> Array:
    """Return joint positions (N, 12) from angles (12, N) counted from the middles of their ranges."""
    legs = (robot.left, robot.right)
    signs = np.array([sign for leg in legs for sign in leg.axis_signs])
    middles = np.array([0.5 * (low + high) for leg in legs for low, high in zip(leg.lower, leg.upper, strict=True)])
    joints = np.empty(from_middle.shape[::-1])
    np.add(from_middle.T, middles, out=joints)
    joints *= signs
    return joints


def swing_and_support(robot: Robot, swing: Side) -> tuple[Leg, Leg, float]:
    """Return the swing leg, the support leg, and +1 or -1 for a left or right swing."""
    if swing == "left":
        return robot.left, robot.right, 1.0
    if swing == "right":
        return robot.right, robot.left, -1.0
    raise ValueError(f"swing must be 'left' or 'right', not {swing!r}")


@entry_point
def _evaluate(
    swing_leg: Leg,
    support_leg: Leg,
    trunk: Trunk,
    balance: BalanceParameters,
    side: float,
    swing_sole: Array,
    support_sole: Array,
    pelvis: Array,
    cosines: Array,
    sines: Array,
    center_of_mass: Array,
    fan: Array,
    scalars: Array,
    points: Array,
    violations: NDArray[np.int64],
) -> None:
    swing_joint = 0 if side > 0.0 else 6
    for i in range(len(pelvis)):
        sole = (swing_sole[i, 0], swing_sole[i, 1], swing_sole[i, 2])
        support = (support_sole[i, 0], support_sole[i, 1], support_sole[i, 2])
        stance = stance_of(swing_leg, support_leg, side, balance.zmp_margin, sole, support)
        state = posture_at(
            swing_leg, support_leg, trunk, balance, stance, (pelvis[i, 0], pelvis[i, 1], pelvis[i, 2])
        )
        for joint in range(6):
            row = swing_joint + joint
            cosines[row, i], sines[row, i] = from_middle(
                swing_leg, joint, state.swing_cosines[joint], state.swing_sines[joint]
            )
            row = 6 - swing_joint + joint
            cosines[row, i], sines[row, i] = from_middle(
                support_leg, joint, state.support_cosines[joint], state.support_sines[joint]
            )
        cosines[12, i], sines[12, i] = stance.cos_yaw, stance.sin_yaw
        sine, cosine, length_squared = edge_vectors(stance, state.center_of_mass[0], state.center_of_mass[1])
        undefined = edge_undefined(length_squared)
        cosines[13, i], sines[13, i] = 1.0 if undefined else cosine, 0.0 if undefined else sine
        scalars[0, i], scalars[1, i] = state.thrust, state.out_of_reach
        violations[i] = state.violations
        for axis in range(2):
            points[0, i, axis] = state.zmp[axis]
            points[1, i, axis] = stance.assigned_zmp[axis]
            fan[i, axis] = stance.fan[axis]
        fan[i, 2] = stance.swing_ankle[2] + swing_leg.fan[2]
        for axis in range(3):
            center_of_mass[i, axis] = state.center_of_mass[axis]
