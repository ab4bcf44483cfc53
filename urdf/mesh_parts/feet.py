"""Soles, and the fans beside them."""

from __future__ import annotations

import numpy as np

from mesh_parts.dimensions import Dimensions
from mesh_parts.plates import PLATE
from mesh_parts.solids import Array, Mesh, box, disc, lathe, loft, moved, rotation, slab, warp

# Decorative: no source gives these.
FAN_BORE = 0.035  # a 70 mm fan
BLADES = 7


def sole(d: Dimensions) -> Mesh:
    """Two plates over the sole's rectangle, with a notch under the left fan, where its air leaves."""
    (x0, y0, bottom), (x1, y1, top) = d.sole_low, d.sole_high
    notch, corner = d.fan_radius + 0.001, 0.014
    edge = np.arccos((d.fan[1] - y1) / notch)
    around = d.fan[0] + notch * np.sin(np.linspace(-edge, edge, 12))
    arc = corner * (1 - np.cos(np.linspace(0, np.pi / 2, 5)))
    x = np.unique(np.concatenate([x0 + arc, around, x1 - arc]))
    from_end = np.clip(np.minimum(x - x0, x1 - x), 0, corner)
    rounding = corner - np.sqrt(corner**2 - (corner - from_end) ** 2)
    room = np.sqrt(np.clip(notch**2 - (x - d.fan[0]) ** 2, 0, None))
    upper = np.minimum(y1 - rounding, np.where(room > 0, d.fan[1] - room, y1))
    grid = np.stack([np.column_stack([x, y0 + rounding]), np.column_stack([x, upper])], axis=1)
    return slab(grid, bottom, bottom + 0.006) + slab(grid, top - 0.004, top)


def sole_standoffs(d: Dimensions) -> Mesh:
    """Aluminium pillars between the plates of a sole, and their bolt heads."""
    (x0, y0, bottom), (x1, _, top) = d.sole_low, d.sole_high
    places = [(x, side * (-y0 - 0.010)) for x in (x0 + 0.010, x1 - 0.010) for side in (-1, 1)]
    pillar = disc(0.0045, bottom + 0.006, top + 0.002)
    return [polygon for x, y in [*places, (0.045, 0.0)] for polygon in moved(pillar, x, y, 0)]


def foot_bracket(d: Dimensions) -> Mesh:
    """Front and rear plate that carry the ankle roll axis, and the plate that holds the left fan."""
    base, shoulder = d.sole_high[2], d.sole_high[2] + 0.024
    angles = np.radians([9, 36, 63, 90])

    def upright(x: float, tip: float) -> Mesh:
        rows = [(base, -0.026, 0.034), (base + 0.008, -0.026, 0.034)]
        rows += [(shoulder, -tip, 0.030), (shoulder + 0.004, -tip, tip)]
        rows += [(tip * float(np.sin(a)), -tip * float(np.cos(a)), tip * float(np.cos(a))) for a in angles]
        grid = np.array([[(z, y0), (z, y1)] for z, y0, y1 in rows])
        return slab(grid, x - PLATE / 2, x + PLATE / 2, "zyx")

    theta = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    ear = np.minimum(0.043 / np.maximum(abs(np.cos(theta)), 1e-9), 0.032 / np.maximum(-np.sin(theta), 1e-9))
    inner = d.fan_radius - 0.0025
    reach = np.where(np.sin(theta) < 0, np.maximum(ear, d.fan_radius), d.fan_radius)
    ray = np.column_stack([np.cos(theta), np.sin(theta)])
    ring = np.stack([inner * ray, reach[:, None] * ray], axis=1) + d.fan[:2]
    holder = slab(ring, shoulder - 0.006, shoulder - 0.003, closed=True)
    return upright(0.0325, 0.011) + upright(-0.0415, 0.009) + holder


def fan_duct(d: Dimensions) -> Mesh:
    """A hollow duct with a rounded inlet lip above and stator vanes below."""
    outer, bottom, top = d.fan_radius, -d.fan_height / 2, d.fan_height / 2
    barrel = outer - 0.0024
    lip = [
        (barrel, top - 0.009),
        (outer - 0.0006, top - 0.0065),
        (outer, top - 0.0035),
        (outer - 0.0007, top - 0.001),
    ]
    mouth = [(outer - 0.002, top), (FAN_BORE + 0.0008, top - 0.0015), (FAN_BORE, top - 0.006)]
    mesh = lathe([(FAN_BORE, bottom), (barrel, bottom), *lip, *mouth], 32)
    vane = box((0.010, -0.0008, bottom + 0.002), (FAN_BORE + 0.0005, 0.0008, bottom + 0.014))
    for angle in np.linspace(0, 2 * np.pi, 5, endpoint=False):
        mesh += warp(vane, rotation(angle))
    return mesh


def fan_rotor(_: Dimensions) -> Mesh:
    """A spinner and twisted blades; the left fan's."""
    angles = np.linspace(0, 2 * np.pi, 14, endpoint=False)
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(14)])
    spinner = [(0.0135, -0.006), (0.0135, 0.003), (0.012, 0.008), (0.008, 0.0125), (0.003, 0.0148), (0.001, 0.015)]
    mesh = loft(np.array([circle * r + [0, 0, z] for r, z in spinner]))
    root, tip = 0.012, FAN_BORE - 0.0012
    radii, chord = np.meshgrid(np.linspace(root, tip, 4), np.linspace(-0.5, 0.5, 3), indexing="ij")
    flat = slab(np.stack([radii, chord], axis=2), -0.0006, 0.0006)

    def twist(points: Array) -> Array:
        r, s, thickness = points.T
        outboard = (r - root) / (tip - root)
        pitch = np.radians(42 - 20 * outboard)
        along = s * (0.013 + 0.005 * outboard)
        turn = (along * np.cos(pitch) - thickness * np.sin(pitch)) / r
        return np.column_stack(
            [r * np.cos(turn), r * np.sin(turn), along * np.sin(pitch) + thickness * np.cos(pitch)]
        )

    blade = warp(flat, twist)
    for angle in np.linspace(0, 2 * np.pi, BLADES, endpoint=False):
        mesh += warp(blade, rotation(angle))
    return mesh
