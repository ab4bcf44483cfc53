"""One posture, as compiled code sees it: what a pelvis position fixes, and the constraints it meets or breaks.

Preconditions 1 and 2 of the paper: the pelvis is level and turned to its yaw, eq. (4); both soles are level and
point forward. So the position of the pelvis fixes all twelve joints, the centre of mass and the thrust.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jet_gym.balance import (
    Point,
    Stance,
    assigned_thrust,
    edge_vectors,
    least_thrust,
    within_edge_polygon,
    within_support,
    zmp_of,
)
from jet_gym.constraints import EDGE_POLYGON, JOINT_LIMITS, REACH, THRUST, ZMP
from jet_gym.fitness import FitnessParameters, fitness_terms
from jet_gym.kinematics import leg_forward, leg_inverse, within_limits
from jet_gym.leg import Six, Vector
from jet_gym.single_support import SingleSupport, hip_from_ankle
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined


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
def posture_at(robot: SingleSupport, stance: Stance, pelvis: Vector) -> PostureState:
    """Find the posture that a pelvis position [m] fixes, and the constraints (8) to (11) that it violates."""
    swing_leg, support_leg, trunk, _, balance = robot
    px, py, pz = pelvis
    c, s = stance.cos_yaw, stance.sin_yaw
    foot_rotation = (c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0)  # the world's axes, seen from the pelvis
    swing_hip = hip_from_ankle(swing_leg, stance, stance.swing_ankle, pelvis)
    support_hip = hip_from_ankle(support_leg, stance, stance.support_ankle, pelvis)
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


@entry_point
def fitness_of_candidates(
    robot: SingleSupport,
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
        robot: The robot.
        parameters: Fitness settings; a smoothness weight of zero leaves out f3.
        stance: The swing point.
        previous: Pelvis [m] at the last swing point.
        candidates: Pelvis positions (3, N) [m], world.
        fitness: Receives the fitness (N,).
        violations: Receives the violated constraints (N,) as flags.
    """
    for i in range(candidates.shape[1]):
        pelvis = (candidates[0, i], candidates[1, i], candidates[2, i])
        state = posture_at(robot, stance, pelvis)
        dx, dy, dz = pelvis[0] - previous[0], pelvis[1] - previous[1], pelvis[2] - previous[2]
        f1, f2, f3, f4 = fitness_terms(parameters, state.violations, state.thrust, dx * dx + dy * dy + dz * dz)
        fitness[i] = f1 + f2 + f3 + f4
        violations[i] = state.violations
