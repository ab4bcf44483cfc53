"""Rotations, as quaternions x, y, z, w in double precision; PyBullet's own helpers round to single."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from jet_gym.leg import Vector
from jet_gym.utils.arrays import Array

Quaternion = tuple[float, float, float, float]


def from_yaw(yaw: float) -> Quaternion:
    """Return the rotation about z by an angle [rad]."""
    return 0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation ``a b``: first b, then a."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def inverse(quaternion: Quaternion) -> Quaternion:
    """Return the rotation back."""
    x, y, z, w = quaternion
    return -x, -y, -z, w


def cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    """Return the cross product of two vectors (3,)."""
    (ax, ay, az), (bx, by, bz) = a, b
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def matrix(quaternion: Quaternion) -> Array:
    """Return the rotation as a matrix (3, 3)."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def roll_pitch_tilt(rotation: Array) -> tuple[float, float, float]:
    """Split an orientation (3, 3) into roll and pitch [rad] in the frame that shares its yaw, and tilt [rad].

    Tilt is the angle between the z axis and the vertical.
    """
    roll = math.atan2(rotation[2, 1], rotation[2, 2])
    pitch = math.atan2(-rotation[2, 0], math.hypot(rotation[2, 1], rotation[2, 2]))
    tilt = math.atan2(math.hypot(rotation[0, 2], rotation[1, 2]), rotation[2, 2])
    return roll, pitch, tilt
