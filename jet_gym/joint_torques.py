"""What the servos have to hold: static joint torques from gravity, the fan's thrust and the ground's force.

All three forces are vertical and the pelvis is level, so that each joint holds the moment, about its own axis, of
the weight of everything beyond it and of the one force that acts there: the thrust on the swing foot, or the
ground's ``Mg - F`` at the ZMP of the support foot. Seen from the pelvis, a vertical force ``f`` at ``r`` has about
an axis ``a`` through ``p`` the moment ``f (a_x (r_y - p_y) - a_y (r_x - p_x))``; the hip yaw holds nothing.
"""

from __future__ import annotations

import math

import numpy as np

from jet_gym.balance import GRAVITY, Point
from jet_gym.kinematics import turned_pitch
from jet_gym.leg import SIDES, Leg, Side, Six
from jet_gym.posture import Postures
from jet_gym.robot import Robot
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined


def static_torques(robot: Robot, swing: Side, postures: Postures) -> Array:
    """Return the joint torques that hold postures still, in the URDF's joint directions.

    Args:
        robot: The robot.
        swing: The swing leg, whose fan blows with the postures' thrust.
        postures: Postures of any leading shape ``(...)``; the ground's force acts at their ZMP.

    Returns:
        Joint torques (..., 12) [N m], left leg then right leg.
    """
    shape = postures.thrust.shape
    joints = np.ascontiguousarray(postures.joint_positions).reshape(-1, 2, 6)
    torques = np.empty((len(joints), 2, 6))
    thrust = postures.thrust.reshape(-1)
    yaw = postures.pelvis_yaw.reshape(-1)
    cosine, sine = np.cos(yaw), np.sin(yaw)
    for index, side in enumerate(SIDES):
        on_swing_foot = side == swing
        force = thrust if on_swing_foot else robot.mass * GRAVITY - thrust
        place = postures.fan[..., :2] if on_swing_foot else postures.zmp
        away = (place - postures.pelvis[..., :2]).reshape(-1, 2)
        from_pelvis = np.column_stack(
            [cosine * away[:, 0] + sine * away[:, 1], cosine * away[:, 1] - sine * away[:, 0]]
        )
        leg = robot.left if side == "left" else robot.right
        _torques(leg, np.ascontiguousarray(joints[:, index]), force, from_pelvis, torques[:, index])
    return torques.reshape(*shape, 12)


@inlined
def leg_torques(leg: Leg, cosines: Six, sines: Six, force: float, place: Point) -> Six:
    """Return the torques [N m] that hold one leg of a level pelvis, counted about +z, +x, +y, +y, +y, +x.

    Args:
        leg: The leg.
        cosines: Cosines of its joint angles.
        sines: Sines of its joint angles.
        force: Upward force on its foot [N].
        place: Where that force acts (x, y) [m], pelvis frame.
    """
    c1, c2, c3, c4, c5, c6 = cosines
    s1, s2, s3, s4, s5, s6 = sines
    _, w2, w3, w4, w5, w6 = leg.mass_moments
    _, _, _, m4, m5, m6 = leg.masses
    hx, hy = leg.hip[0], leg.hip[1]
    ex, ey = place

    # Columns of the axes after yaw and roll, as in kinematics.leg_forward; x and y components alone.
    x0, x1, x2 = c1, s1, 0.0
    y0, y1 = -s1 * c2, c1 * c2
    z0, z1, z2 = s1 * s2, -c1 * s2, c2
    roll_x, roll_y = x0 * w2[0] + y0 * w2[1] + z0 * w2[2], x1 * w2[0] + y1 * w2[1] + z1 * w2[2]
    x0, x1, x2, z0, z1, z2 = turned_pitch(x0, x1, x2, z0, z1, z2, c3, s3)
    thigh_x, thigh_y = x0 * w3[0] + y0 * w3[1] + z0 * w3[2], x1 * w3[0] + y1 * w3[1] + z1 * w3[2]
    kx = hx + x0 * leg.thigh[0] + y0 * leg.thigh[1] + z0 * leg.thigh[2]
    ky = hy + x1 * leg.thigh[0] + y1 * leg.thigh[1] + z1 * leg.thigh[2]
    x0, x1, x2, z0, z1, z2 = turned_pitch(x0, x1, x2, z0, z1, z2, c4, s4)
    shank_x, shank_y = x0 * w4[0] + y0 * w4[1] + z0 * w4[2], x1 * w4[0] + y1 * w4[1] + z1 * w4[2]
    ax = kx + x0 * leg.shank[0] + y0 * leg.shank[1] + z0 * leg.shank[2]
    ay = ky + x1 * leg.shank[0] + y1 * leg.shank[1] + z1 * leg.shank[2]
    x0, x1, x2, z0, z1, z2 = turned_pitch(x0, x1, x2, z0, z1, z2, c5, s5)
    ankle_x, ankle_y = x0 * w5[0] + y0 * w5[1] + z0 * w5[2], x1 * w5[0] + y1 * w5[1] + z1 * w5[2]
    v0, v1 = c6 * y0 + s6 * z0, c6 * y1 + s6 * z1
    z0, z1 = c6 * z0 - s6 * y0, c6 * z1 - s6 * y1
    foot_x, foot_y = x0 * w6[0] + v0 * w6[1] + z0 * w6[2], x1 * w6[0] + v1 * w6[1] + z1 * w6[2]

    # From the foot upwards: the moment M of what is beyond each joint, x and y components about the point on its
    # axis, is (r_y, -r_x) times each upward force; the joint holds -a.M.
    g = GRAVITY
    mx = force * (ey - ay) - g * foot_y
    my = -force * (ex - ax) + g * foot_x
    ankle_roll = -(x0 * mx + x1 * my)
    mx -= g * ankle_y
    my += g * ankle_x
    ankle_pitch = -(y0 * mx + y1 * my)
    lower = force - g * (m5 + m6)
    mx += lower * (ay - ky) - g * shank_y
    my += -lower * (ax - kx) + g * shank_x
    knee = -(y0 * mx + y1 * my)
    lower -= g * m4
    mx += lower * (ky - hy) - g * thigh_y
    my += -lower * (kx - hx) + g * thigh_x
    hip_pitch = -(y0 * mx + y1 * my)
    mx -= g * roll_y
    my += g * roll_x
    hip_roll = -(c1 * mx + s1 * my)
    return 0.0, hip_roll, hip_pitch, knee, ankle_pitch, ankle_roll


@inlined
def largest_share(torques: Six, largest: Six) -> float:
    """Return the largest share of its largest torque that any of six joints holds; a joint may have none."""
    hip = max(_share(torques[0], largest[0]), _share(torques[1], largest[1]), _share(torques[2], largest[2]))
    ankle = max(_share(torques[3], largest[3]), _share(torques[4], largest[4]), _share(torques[5], largest[5]))
    return max(hip, ankle)


@inlined
def _share(torque: float, largest: float) -> float:
    return abs(torque) / max(largest, 1e-9)


@entry_point
def _torques(leg: Leg, angles: Array, force: Array, place: Array, torques: Array) -> None:
    a = leg.axis_signs
    for i in range(len(angles)):
        q = angles[i]
        q0, q1, q2, q3, q4, q5 = a[0] * q[0], a[1] * q[1], a[2] * q[2], a[3] * q[3], a[4] * q[4], a[5] * q[5]
        cosines = (math.cos(q0), math.cos(q1), math.cos(q2), math.cos(q3), math.cos(q4), math.cos(q5))
        sines = (math.sin(q0), math.sin(q1), math.sin(q2), math.sin(q3), math.sin(q4), math.sin(q5))
        held = leg_torques(leg, cosines, sines, force[i], (place[i, 0], place[i, 1]))
        for joint in range(6):
            torques[i, joint] = a[joint] * held[joint]
