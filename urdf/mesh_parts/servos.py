"""Servos, and the gears of the roll joints."""

from __future__ import annotations

import numpy as np

from mesh_parts.dimensions import Dimensions
from mesh_parts.solids import Mesh, loft, moved, slab

# Decorative: no source gives these.
SERVO = (0.051, 0.0395, 0.032)  # a servo of the B3M class; its output axis is y
GEAR_MODULE = 0.0016  # pitch diameter of a gear per tooth
PINION_TEETH = 14


def servo(_: Dimensions) -> Mesh:
    """A servo case with chamfered edges and the seams between its three parts, output axis y."""
    length, width, height = SERVO
    chamfer = 0.003
    x, z = length / 2, height / 2
    quarter = np.array([(x, z - chamfer), (x - chamfer, z)])
    half = np.concatenate([quarter, quarter[::-1] * [-1, 1]])
    octagon = np.concatenate([half, half[::-1] * [1, -1]])
    seam, inset = width / 6, 0.0012
    levels = [(-width / 2, 2 * inset), (-width / 2 + 2 * inset, 0.0)]
    for y in (-seam, seam):
        levels += [(y - inset, 0.0), (y, inset), (y + inset, 0.0)]
    levels += [(width / 2 - 2 * inset, 0.0), (width / 2, 2 * inset)]
    shrink = [1 - cut / np.array([x, z]) for _, cut in levels]
    rings = [np.insert(octagon * scale, 1, y, axis=1) for (y, _), scale in zip(levels, shrink, strict=True)]
    return loft(np.array(rings))


def servo_pair(d: Dimensions) -> Mesh:
    """The two servos of a pitch joint, one above the other."""
    step = SERVO[2] / 2 + 0.001
    return moved(servo(d), 0, 0, step) + moved(servo(d), 0, 0, -step)


def spur_gear(teeth: int, thickness: float, *, gap_below: bool = False) -> Mesh:
    """A gear about the x axis with a tooth at the top, or, if ``gap_below``, a gap at the bottom."""
    pitch = 2 * np.pi / teeth
    start = -np.pi / 2 + pitch / 2 if gap_below else np.pi / 2
    angles = start + (np.arange(teeth)[:, None] + np.array([-0.32, -0.14, 0.14, 0.32])).ravel() * pitch
    radii = GEAR_MODULE * (teeth / 2 + np.tile([-1.2, 1.0, 1.0, -1.2], teeth))
    rim = radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    return slab(np.stack([0 * rim, rim], axis=1), -thickness / 2, thickness / 2, "yzx", closed=True)


def roll_gear(d: Dimensions) -> Mesh:
    """The carbon gear of a roll joint."""
    return spur_gear(round(PINION_TEETH * d.gear_ratio), 0.005)


def roll_pinion(_: Dimensions) -> Mesh:
    """The pinion on the servo of a roll joint; it meets the gear below it."""
    return spur_gear(PINION_TEETH, 0.007, gap_below=True)
