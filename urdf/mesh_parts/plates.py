"""The carbon plates of pelvis and legs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mesh_parts.dimensions import Dimensions
from mesh_parts.solids import Mesh, box, mirrored, slab

# Decorative: no source gives these.
PLATE = 0.0025  # thickness of a carbon plate
SHANK_INSET = 0.0028  # shank plates inside the thigh plates, so that the knee can fold
ANKLE_FORK = 0.0165  # half width of the fork around the ankle: clears the fan duct beside it


def plate(
    outline: Sequence[tuple[float, float]],
    low: float,
    high: float,
    axes: str,
    windows: Sequence[tuple[float, float, float]] = (),
) -> Mesh:
    """A symmetric carbon plate.

    Args:
        outline: Stations along the first axis and the half width at each, in ascending order [m].
        low: Lower face along the third axis [m].
        high: Upper face along it [m].
        axes: Axis of the stations, of the width and of the thickness.
        windows: First and last station and half width of each hole; its corners are cut off.
    """
    at, width = np.array(outline).T
    corner = 0.006
    cuts = [(a, a + corner, b - corner, b) for a, b, _ in windows]
    stations = np.unique(np.round(np.concatenate([at, *map(np.array, cuts)]), 6))
    half = np.interp(stations, at, width)
    inner = half * 0.5
    keep = np.ones((len(stations) - 1, 3), dtype=bool)
    middles = (stations[1:] + stations[:-1]) / 2
    for (first, last, opening), cut in zip(windows, cuts, strict=True):
        inside = (stations > first - 1e-6) & (stations < last + 1e-6)
        inner[inside] = np.interp(stations[inside], cut, opening * np.array([0.5, 1, 1, 0.5]))
        keep[(middles > first) & (middles < last), 1] = False
    across = np.stack([-half, -inner, inner, half], axis=1)
    return slab(np.stack([np.repeat(stations[:, None], 4, 1), across], axis=2), low, high, axes, keep=keep)


def round_end(centre: float, radius: float, neck: float, towards: int) -> list[tuple[float, float]]:
    """Outline of a plate's round end: from the neck's half width about a joint axis to the tip."""
    angles = np.linspace(np.pi - np.arcsin(neck / radius), 0.0, 6)
    points = [(centre + towards * radius * float(np.cos(a)), radius * float(np.sin(a))) for a in angles]
    return points if towards > 0 else points[::-1]


def both_sides(mesh: Mesh) -> Mesh:
    """A left plate and its mirror image."""
    return mesh + mirrored(mesh)


def thigh_plates(d: Dimensions) -> Mesh:
    """Two bone-shaped side plates from hip to knee."""
    outline = round_end(-d.thigh, 0.020, 0.0165, -1) + round_end(0.0, 0.0165, 0.0160, 1)
    windows = [(-d.thigh + 0.027, -d.thigh + 0.077, 0.009), (-0.114, -0.088, 0.009), (-0.080, -0.054, 0.009)]
    return both_sides(plate(outline, d.leg_half_width - PLATE, d.leg_half_width, "zxy", windows))


def shank_plates(d: Dimensions) -> Mesh:
    """Two side plates from the knee down, and the narrower fork around the ankle."""
    outer = d.leg_half_width - SHANK_INSET
    shelf = -d.shank + 0.042
    outline = [(shelf, 0.0175), (-0.12, 0.0175), *round_end(0.0, 0.0180, 0.0155, 1)]
    windows = [(-0.149, -0.121, 0.009), (-0.112, -0.084, 0.009), (-0.076, -0.026, 0.009)]
    side = plate(outline, outer - PLATE, outer, "zxy", windows)
    fork_outline = [*round_end(-d.shank, 0.013, 0.0125, -1), (shelf, 0.015)]
    fork = plate(fork_outline, ANKLE_FORK - PLATE, ANKLE_FORK, "zxy")
    return both_sides(side) + both_sides(fork) + box((-0.015, -outer, shelf), (0.015, outer, shelf + PLATE))


def pelvis_frame(d: Dimensions) -> Mesh:
    """Hip plate across both yaw axes, a battery bay below it, an electronics rack above it."""
    depth, width, top = d.pelvis[0] / 2, d.pelvis[1] / 2, d.pelvis[2]
    hip, bay = 0.056, 0.058
    end = round_end(d.hip_y, 0.030, 0.027, 1)
    hip_outline = [(-s, w) for s, w in reversed(end)] + [(-0.075, 0.045), (0.075, 0.045), *end]
    mesh = plate(hip_outline, hip, hip + 0.004, "yxz")
    bay_side = [(0.0, 0.032), (0.010, 0.042), (hip, 0.042)]
    mesh += both_sides(plate(bay_side, bay - PLATE, bay, "zxy", [(0.012, 0.046, 0.030)]))
    mesh += box((-0.032, -bay, 0.0), (0.032, bay, PLATE))
    rack_side = [(hip + 0.004, 0.045), (hip + 0.014, 0.052), (top - 0.020, 0.052), (top - PLATE, 0.044)]
    mesh += both_sides(plate(rack_side, width - 0.003 - PLATE, width - 0.003, "zxy", [(0.074, top - 0.016, 0.036)]))
    lid = [(-width, depth - 0.012), (-width + 0.012, depth), (width - 0.012, depth), (width, depth - 0.012)]
    return mesh + plate(lid, top - 0.003, top, "yxz", [(-0.032, 0.032, 0.030)])


def hip_yoke(_: Dimensions) -> Mesh:
    """Front and rear plate that carry the hip roll axis, under a shelf at the yaw axis."""
    outline = [*round_end(0.0, 0.013, 0.0125, -1), (0.030, 0.018), (0.056, 0.018)]
    ends = plate(outline, 0.030, 0.030 + PLATE, "zyx")
    ends += plate(outline, -0.030 - PLATE, -0.030, "zyx")
    return ends + box((-0.030, -0.018, 0.0535), (0.030, 0.018, 0.056))
