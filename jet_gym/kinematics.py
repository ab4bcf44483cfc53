"""Forward and inverse kinematics of the legs, and the centre of mass, all in closed form.

Inside, a joint angle is its cosine and sine: inverse kinematics then needs square roots and divisions only,
and so does everything that planning asks of a posture. Angles appear where a person reads them.

The inverse works from the foot upwards (Kajita et al., Introduction to Humanoid Robotics, 2014, section 2.5):
seen from the foot, the hip's direction gives ankle roll, its distance the knee, and what remains of the
orientation the three hip joints.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from jet_gym.leg import Leg, Side, Six, Vector
from jet_gym.robot import Robot
from jet_gym.utils.arrays import Array, finite_array
from jet_gym.utils.compilation import entry_point, inlined

Rotation = tuple[float, float, float, float, float, float, float, float, float]  # 3x3, row by row

_TINY = 1e-300  # keeps a division by a length that may vanish finite
_SINGULAR = 1e-12  # [m] or a cosine: below it a joint has no definite angle, and zero is taken
LIMIT_TOLERANCE = 1e-12  # on the cosine by which a joint angle is held against its limits


@inlined
def leg_inverse(leg: Leg, hip_from_ankle: Vector, foot_rotation: Rotation) -> tuple[Six, Six, float]:
    """Find the joint angles that place one foot.

    Args:
        leg: The leg.
        hip_from_ankle: Vector from the ankle to the hip centre [m], foot axes.
        foot_rotation: Foot axes in the pelvis frame.

    Returns:
        Cosines (6), sines (6), and by how much the foot is out of reach [m]: 0 where it can be reached;
        else the knee is at its nearest (stretched or folded) and points the leg at the target.
    """
    rx, ry, rz = hip_from_ankle
    tx, _, tz = leg.thigh
    kx, lateral, kz = leg.shank

    # Ankle roll brings the hip into the plane in which knee and ankle pitch move it.
    radius_squared = ry * ry + rz * rz
    depth = math.sqrt(max(radius_squared - lateral * lateral, 0.0))
    scale = 1.0 / max(radius_squared, _TINY)
    definite = radius_squared > _SINGULAR * _SINGULAR
    cos_roll = (rz * depth - ry * lateral) * scale if definite else 1.0
    sin_roll = (ry * depth + rz * lateral) * scale if definite else 0.0

    # In that plane: the cosine law for the knee. (px, pz) leads from hip to ankle.
    px, pz = -rx, -depth
    distance_squared = px * px + pz * pz
    thigh = math.sqrt(tx * tx + tz * tz)
    shank = math.sqrt(kx * kx + kz * kz)
    distance = math.sqrt(distance_squared)
    product = thigh * shank
    cos_flexion = min(max((distance_squared - thigh * thigh - shank * shank) / (2.0 * product), -1.0), 1.0)
    sin_flexion = leg.knee_direction * math.sqrt((1.0 - cos_flexion) * (1.0 + cos_flexion))
    cos_straight = (tx * kx + tz * kz) / product
    sin_straight = (tx * kz - tz * kx) / product
    cos_knee = cos_flexion * cos_straight - sin_flexion * sin_straight
    sin_knee = sin_flexion * cos_straight + cos_flexion * sin_straight
    out_of_reach = max(distance - (thigh + shank), abs(thigh - shank) - distance, 0.0)
    out_of_reach = max(out_of_reach, abs(lateral) - math.sqrt(radius_squared))

    # Ankle pitch turns the leg, bent by the knee, onto (px, pz).
    vx = cos_knee * tx - sin_knee * tz + kx
    vz = sin_knee * tx + cos_knee * tz + kz
    scale = 1.0 / max(distance * math.sqrt(vx * vx + vz * vz), _TINY)
    definite = distance > _SINGULAR
    cos_ankle = (px * vx + pz * vz) * scale if definite else 1.0
    sin_ankle = (pz * vx - px * vz) * scale if definite else 0.0

    # The hip takes up the rest: Rz(yaw) Rx(roll) Ry(pitch) = foot_rotation Rx(-ankle_roll) Ry(-ankle-knee).
    cos_pitch = cos_ankle * cos_knee - sin_ankle * sin_knee
    sin_pitch = sin_ankle * cos_knee + cos_ankle * sin_knee
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = foot_rotation
    y0 = r01 * cos_roll - r02 * sin_roll
    y1 = r11 * cos_roll - r12 * sin_roll
    y2 = r21 * cos_roll - r22 * sin_roll
    z0 = r01 * sin_roll + r02 * cos_roll
    z1 = r11 * sin_roll + r12 * cos_roll
    z2 = r21 * sin_roll + r22 * cos_roll
    cos_hip_roll = math.sqrt(y0 * y0 + y1 * y1)
    scale = 1.0 / max(cos_hip_roll, _TINY)
    definite = cos_hip_roll > _SINGULAR  # else yaw and pitch turn about one line: yaw is zero, pitch does it all
    cos_hip_yaw = y1 * scale if definite else 1.0
    sin_hip_yaw = -y0 * scale if definite else 0.0
    cos_hip_pitch = (z2 * cos_pitch - r20 * sin_pitch) * scale if definite else r00 * cos_pitch + z0 * sin_pitch
    sin_hip_pitch = (
        -(r20 * cos_pitch + z2 * sin_pitch) * scale if definite else y2 * (r10 * cos_pitch + z1 * sin_pitch)
    )
    return (
        (cos_hip_yaw, cos_hip_roll, cos_hip_pitch, cos_knee, cos_ankle, cos_roll),
        (sin_hip_yaw, y2, sin_hip_pitch, sin_knee, sin_ankle, sin_roll),
        out_of_reach,
    )


@inlined
def leg_forward(leg: Leg, cosines: Six, sines: Six) -> tuple[Vector, Vector, Rotation, Vector]:
    """Place one leg from its joint angles, in the pelvis frame.

    Returns:
        Knee [m], ankle [m], foot axes, and the leg's first mass moment [kg m] about the pelvis origin.
    """
    hx, hy, hz = leg.hip
    c1, c2, c3, c4, c5, c6 = cosines
    s1, s2, s3, s4, s5, s6 = sines
    m1, m2, m3, m4, m5, m6 = leg.masses
    w1, w2, w3, w4, w5, w6 = leg.mass_moments

    upper = m1 + m2 + m3
    mx, my, mz = upper * hx, upper * hy, upper * hz
    # Hip yaw, Rz: columns (c1, s1, 0), (-s1, c1, 0), (0, 0, 1).
    mx += c1 * w1[0] - s1 * w1[1]
    my += s1 * w1[0] + c1 * w1[1]
    mz += w1[2]
    # Hip roll, Rz Rx: x column as before; y and z columns below.
    x0, x1, x2 = c1, s1, 0.0
    y0, y1, y2 = -s1 * c2, c1 * c2, s2
    z0, z1, z2 = s1 * s2, -c1 * s2, c2
    mx += x0 * w2[0] + y0 * w2[1] + z0 * w2[2]
    my += x1 * w2[0] + y1 * w2[1] + z1 * w2[2]
    mz += x2 * w2[0] + y2 * w2[1] + z2 * w2[2]
    # Hip pitch, knee and ankle pitch turn about the same y column.
    x0, x1, x2, z0, z1, z2 = turned_pitch(x0, x1, x2, z0, z1, z2, c3, s3)
    mx += x0 * w3[0] + y0 * w3[1] + z0 * w3[2]
    my += x1 * w3[0] + y1 * w3[1] + z1 * w3[2]
    mz += x2 * w3[0] + y2 * w3[1] + z2 * w3[2]
    kx = hx + x0 * leg.thigh[0] + y0 * leg.thigh[1] + z0 * leg.thigh[2]
    ky = hy + x1 * leg.thigh[0] + y1 * leg.thigh[1] + z1 * leg.thigh[2]
    kz = hz + x2 * leg.thigh[0] + y2 * leg.thigh[1] + z2 * leg.thigh[2]
    x0, x1, x2, z0, z1, z2 = turned_pitch(x0, x1, x2, z0, z1, z2, c4, s4)
    mx += m4 * kx + x0 * w4[0] + y0 * w4[1] + z0 * w4[2]
    my += m4 * ky + x1 * w4[0] + y1 * w4[1] + z1 * w4[2]
    mz += m4 * kz + x2 * w4[0] + y2 * w4[1] + z2 * w4[2]
    ax = kx + x0 * leg.shank[0] + y0 * leg.shank[1] + z0 * leg.shank[2]
    ay = ky + x1 * leg.shank[0] + y1 * leg.shank[1] + z1 * leg.shank[2]
    az = kz + x2 * leg.shank[0] + y2 * leg.shank[1] + z2 * leg.shank[2]
    x0, x1, x2, z0, z1, z2 = turned_pitch(x0, x1, x2, z0, z1, z2, c5, s5)
    lower = m5 + m6
    mx += lower * ax + x0 * w5[0] + y0 * w5[1] + z0 * w5[2]
    my += lower * ay + x1 * w5[0] + y1 * w5[1] + z1 * w5[2]
    mz += lower * az + x2 * w5[0] + y2 * w5[1] + z2 * w5[2]
    # Ankle roll turns about x.
    y0, z0 = c6 * y0 + s6 * z0, c6 * z0 - s6 * y0
    y1, z1 = c6 * y1 + s6 * z1, c6 * z1 - s6 * y1
    y2, z2 = c6 * y2 + s6 * z2, c6 * z2 - s6 * y2
    mx += x0 * w6[0] + y0 * w6[1] + z0 * w6[2]
    my += x1 * w6[0] + y1 * w6[1] + z1 * w6[2]
    mz += x2 * w6[0] + y2 * w6[1] + z2 * w6[2]
    return (kx, ky, kz), (ax, ay, az), (x0, y0, z0, x1, y1, z1, x2, y2, z2), (mx, my, mz)


@inlined
def turned_pitch(
    x0: float, x1: float, x2: float, z0: float, z1: float, z2: float, c: float, s: float
) -> tuple[float, float, float, float, float, float]:
    """Turn the x and z columns of a rotation about its y column."""
    return c * x0 - s * z0, c * x1 - s * z1, c * x2 - s * z2, s * x0 + c * z0, s * x1 + c * z1, s * x2 + c * z2


@inlined
def within_limits(leg: Leg, cosines: Six, sines: Six) -> bool:
    """Tell whether every joint of a leg is within its limits, eq. (8), without computing an angle.

    An angle lies within ``h`` of the middle ``m`` of its range exactly if ``cos(angle - m) >= cos(h)``.
    """
    c, s = leg.range_cosines, leg.range_sines
    least = leg.range_half_cosines
    return (
        (cosines[0] * c[0] + sines[0] * s[0] >= least[0] - LIMIT_TOLERANCE)
        & (cosines[1] * c[1] + sines[1] * s[1] >= least[1] - LIMIT_TOLERANCE)
        & (cosines[2] * c[2] + sines[2] * s[2] >= least[2] - LIMIT_TOLERANCE)
        & (cosines[3] * c[3] + sines[3] * s[3] >= least[3] - LIMIT_TOLERANCE)
        & (cosines[4] * c[4] + sines[4] * s[4] >= least[4] - LIMIT_TOLERANCE)
        & (cosines[5] * c[5] + sines[5] * s[5] >= least[5] - LIMIT_TOLERANCE)
    )


@inlined
def joint_angle(leg: Leg, joint: int, cosine: float, sine: float) -> float:
    """Return a joint's angle [rad] in the URDF's direction, the turn nearest to the middle of its range."""
    middle = 0.5 * (leg.lower[joint] + leg.upper[joint])
    cosine, sine = from_middle(leg, joint, cosine, sine)
    return leg.axis_signs[joint] * (middle + math.atan2(sine, cosine))


@inlined
def from_middle(leg: Leg, joint: int, cosine: float, sine: float) -> tuple[float, float]:
    """Return cosine and sine of a joint's angle as counted from the middle of its range."""
    c, s = leg.range_cosines[joint], leg.range_sines[joint]
    return cosine * c + sine * s, sine * c - cosine * s


def range_middles(robot: Robot) -> Array:
    """Return the middles of the joints' ranges (12,) [rad], counted about +z, +x, +y, +y, +y, +x."""
    legs = (robot.left, robot.right)
    return np.array([0.5 * (low + high) for leg in legs for low, high in zip(leg.lower, leg.upper, strict=True)])


def axis_signs(robot: Robot) -> Array:
    """Return the signs (12,) that lead from there to the URDF's own joint directions."""
    return np.array((*robot.left.axis_signs, *robot.right.axis_signs))


@dataclass(frozen=True, eq=False)
class BodyPoints:
    """Where a robot's points are, in the pelvis frame; a leading shape ``(...)`` for a batch.

    The axis of length 2 is left, right.

    Attributes:
        hips: Hip centres (..., 2, 3) [m].
        knees: Knees (..., 2, 3) [m], on the knee axis.
        ankles: Points where the ankle axes meet (..., 2, 3) [m].
        soles: Origins of the sole frames (..., 2, 3) [m].
        fans: Points where the thrust acts (..., 2, 3) [m].
        foot_rotations: Foot axes (..., 2, 3, 3).
        center_of_mass: Centre of mass of the robot (..., 3) [m].
    """

    hips: Array
    knees: Array
    ankles: Array
    soles: Array
    fans: Array
    foot_rotations: Array
    center_of_mass: Array


def forward_kinematics(robot: Robot, joint_positions: ArrayLike) -> BodyPoints:
    """Place a robot's points from its joint positions, in the pelvis frame.

    Args:
        robot: The robot.
        joint_positions: Joint positions (..., 12) [rad], left leg then right leg.

    Raises:
        ValueError: If the shape is wrong or a number is not finite.
    """
    joints = finite_array(joint_positions, "joint_positions", 12)
    shape = joints.shape[:-1]
    count = joints.size // 12
    points, moments = np.empty((count, 2, 5, 3)), np.empty((count, 2, 3))
    rotations = np.empty((count, 2, 3, 3))
    for side, leg in enumerate((robot.left, robot.right)):
        angles = np.ascontiguousarray(joints.reshape(count, 2, 6)[:, side])
        _forward(leg, angles, points[:, side], rotations[:, side], moments[:, side])
    center_of_mass = (moments.sum(axis=1) + robot.trunk.mass_moment) / robot.mass
    hips, knees, ankles, soles, fans = (points[:, :, i].reshape(*shape, 2, 3) for i in range(5))
    return BodyPoints(
        hips,
        knees,
        ankles,
        soles,
        fans,
        foot_rotations=rotations.reshape(*shape, 2, 3, 3),
        center_of_mass=center_of_mass.reshape(*shape, 3),
    )


def inverse_kinematics(
    robot: Robot, side: Side, sole_position: ArrayLike, sole_rotation: ArrayLike | None = None
) -> tuple[Array, Array]:
    """Find the joint positions of one leg that place its sole, in closed form.

    Of the several solutions it returns the one with the knee on the side of its range, the hip above the foot's
    sole and the hip roll within +-90 degrees. Joint limits are not looked at.

    Args:
        robot: The robot.
        side: Which leg.
        sole_position: Origin of the sole frame (..., 3) [m], pelvis frame.
        sole_rotation: Axes of the sole frame (..., 3, 3) in the pelvis frame; the pelvis' own where omitted.

    Returns:
        Joint positions (..., 6) [rad] and by how much the sole is out of reach (...) [m], zero where it can
        be reached; elsewhere the leg is stretched, or folded, towards it.

    Raises:
        ValueError: If a shape is wrong or a number is not finite.
    """
    position = finite_array(sole_position, "sole_position", 3)
    shape = position.shape[:-1]
    rotation = np.eye(3) if sole_rotation is None else np.asarray(sole_rotation, dtype=np.float64)
    if rotation.shape[-2:] != (3, 3) or not np.isfinite(rotation).all():
        raise ValueError(f"sole_rotation must be finite with shape (..., 3, 3), not {rotation.shape}")
    shape = np.broadcast_shapes(shape, rotation.shape[:-2])
    rotation = np.broadcast_to(rotation, (*shape, 3, 3)).reshape(-1, 3, 3)
    position = np.array(np.broadcast_to(position, (*shape, 3)), order="C").reshape(-1, 3)
    angles, out_of_reach = np.empty((len(position), 6)), np.empty(len(position))
    _inverse(robot.leg(side), position, np.ascontiguousarray(rotation), angles, out_of_reach)
    return angles.reshape(*shape, 6), out_of_reach.reshape(shape)


@entry_point
def _forward(leg: Leg, angles: Array, points: Array, rotations: Array, moments: Array) -> None:
    for i in range(len(angles)):
        q = angles[i]
        a = leg.axis_signs
        q0, q1, q2, q3, q4, q5 = a[0] * q[0], a[1] * q[1], a[2] * q[2], a[3] * q[3], a[4] * q[4], a[5] * q[5]
        cosines = (math.cos(q0), math.cos(q1), math.cos(q2), math.cos(q3), math.cos(q4), math.cos(q5))
        sines = (math.sin(q0), math.sin(q1), math.sin(q2), math.sin(q3), math.sin(q4), math.sin(q5))
        knee, ankle, foot, moment = leg_forward(leg, cosines, sines)
        for row in range(3):
            x, y, z = foot[3 * row], foot[3 * row + 1], foot[3 * row + 2]
            points[i, 0, row] = leg.hip[row]
            points[i, 1, row] = knee[row]
            points[i, 2, row] = ankle[row]
            points[i, 3, row] = ankle[row] + x * leg.sole[0] + y * leg.sole[1] + z * leg.sole[2]
            points[i, 4, row] = ankle[row] + x * leg.fan[0] + y * leg.fan[1] + z * leg.fan[2]
            rotations[i, row, 0], rotations[i, row, 1], rotations[i, row, 2] = x, y, z
            moments[i, row] = moment[row]


@entry_point
def _inverse(leg: Leg, position: Array, rotation: Array, angles: Array, out_of_reach: Array) -> None:
    for i in range(len(position)):
        r = rotation[i]
        foot = (r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 0], r[2, 1], r[2, 2])
        dx = leg.hip[0] - position[i, 0]
        dy = leg.hip[1] - position[i, 1]
        dz = leg.hip[2] - position[i, 2]
        hip_from_ankle = (
            foot[0] * dx + foot[3] * dy + foot[6] * dz + leg.sole[0],
            foot[1] * dx + foot[4] * dy + foot[7] * dz + leg.sole[1],
            foot[2] * dx + foot[5] * dy + foot[8] * dz + leg.sole[2],
        )
        cosines, sines, missing = leg_inverse(leg, hip_from_ankle, foot)
        out_of_reach[i] = missing
        for joint in range(6):
            angles[i, joint] = joint_angle(leg, joint, cosines[joint], sines[joint])
