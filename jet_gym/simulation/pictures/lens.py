"""A camera in numbers that compiled code takes."""

from __future__ import annotations

from typing import NamedTuple

from jet_gym.leg import Vector
from jet_gym.utils.compilation import inlined


class Lens(NamedTuple):
    """Where a camera is, what its axes are and how far it sees; see :mod:`jet_gym.simulation.pictures.camera`."""

    eye: Vector  # [m]
    right: Vector
    up: Vector
    forward: Vector
    slope_x: float  # of the line of sight at the picture's edge
    slope_y: float
    width: int  # [px]
    height: int  # [px]
    near: float  # [m]
    far: float  # [m]


@inlined
def ray_of(lens: Lens, row: float, column: float) -> Vector:
    """Return the line of sight through a place in the picture [px], of depth 1."""
    x = lens.slope_x * (2.0 * column / lens.width - 1.0)
    y = lens.slope_y * (1.0 - 2.0 * row / lens.height)
    return (
        x * lens.right[0] + y * lens.up[0] + lens.forward[0],
        x * lens.right[1] + y * lens.up[1] + lens.forward[1],
        x * lens.right[2] + y * lens.up[2] + lens.forward[2],
    )


@inlined
def point_of(lens: Lens, ray: Vector, depth: float) -> Vector:
    """Return the point [m] at a depth [m] along a line of sight."""
    return lens.eye[0] + depth * ray[0], lens.eye[1] + depth * ray[1], lens.eye[2] + depth * ray[2]


@inlined
def seen_by(lens: Lens, point: Vector) -> Vector:
    """Return where a point [m] lands in the picture, x and y [px], and how deep it lies [m]."""
    x, y, z = point[0] - lens.eye[0], point[1] - lens.eye[1], point[2] - lens.eye[2]
    depth = max(x * lens.forward[0] + y * lens.forward[1] + z * lens.forward[2], lens.near)
    right = x * lens.right[0] + y * lens.right[1] + z * lens.right[2]
    up = x * lens.up[0] + y * lens.up[1] + z * lens.up[2]
    return (
        0.5 * lens.width * (1.0 + right / (depth * lens.slope_x)),
        0.5 * lens.height * (1.0 - up / (depth * lens.slope_y)),
        depth,
    )
