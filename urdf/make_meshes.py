"""Make the meshes that the visuals of ``jet_hr1.urdf`` show: ``python urdf/make_meshes.py``.

For the eye only: no mesh takes part in collisions or inertias. What a mesh must agree with (lengths, the sole,
the fan, the gear ratio) is read from the URDF; the constants below are decorative, chosen to look like the
robot of the paper's Fig. 1. Units: m. Link meshes stand in the frame of their link; servos and gears about
their own centre. Run it again after a change of the URDF's lengths; the boxes and cylinders among the visuals
stand in the URDF itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mesh = list[Array]
"""Polygons (k, 3) [m], anticlockwise seen from outside, k = 3 or 4 unless they are convex and flat."""

HERE = Path(__file__).parent

# Decorative: no source gives these.
PLATE = 0.0025  # thickness of a carbon plate
SHANK_INSET = 0.0028  # shank plates inside the thigh plates, so that the knee can fold
ANKLE_FORK = 0.0165  # half width of the fork around the ankle: clears the fan duct beside it
SERVO = (0.051, 0.0395, 0.032)  # a servo of the B3M class; its output axis is y
GEAR_MODULE = 0.0016  # pitch diameter of a gear per tooth
PINION_TEETH = 14
FAN_BORE = 0.035  # a 70 mm fan
BLADES = 7


@dataclass(frozen=True)
class Dimensions:
    """What the meshes must agree with, as it stands in the URDF.

    Attributes:
        pelvis: Edges (3,) of the pelvis box, which stands on the hip axes [m].
        hip_y: Distance of a hip yaw axis from the pelvis origin [m].
        thigh: Length of the thigh [m].
        shank: Length of the shank [m].
        leg_half_width: Half width of thigh and shank [m].
        sole_low: Lower corner (3,) of the sole box in the foot frame [m].
        sole_high: Upper corner (3,) of it [m].
        fan: Centre (3,) of the left fan in the foot frame [m].
        fan_radius: Outer radius of the duct [m].
        fan_height: Height of the duct [m].
        gear_ratio: Of the roll joints.
    """

    pelvis: Array
    hip_y: float
    thigh: float
    shank: float
    leg_half_width: float
    sole_low: Array
    sole_high: Array
    fan: Array
    fan_radius: float
    fan_height: float
    gear_ratio: float


def read_dimensions(urdf: Path) -> Dimensions:
    """Read the left leg, the pelvis and the gear ratio from the URDF's collision shapes, joints and servos."""
    robot = ElementTree.parse(urdf).getroot()

    def numbers(path: str, attribute: str) -> Array:
        element = robot.find(path)
        if element is None:
            raise ValueError(f"{urdf.name} has no {path}: the meshes take {attribute!r} from it")
        return np.array(element.get(attribute, "").split(), dtype=float)

    def collision_box(link: str) -> Array:
        return numbers(f"link[@name='{link}']/collision/geometry/box", "size")

    def joint_origin(joint: str) -> Array:
        return numbers(f"joint[@name='{joint}']/origin", "xyz")

    sole_size, sole_centre = collision_box("left_foot"), numbers("link[@name='left_foot']/collision/origin", "xyz")
    duct = "link[@name='left_fan']/collision/geometry/cylinder"
    return Dimensions(
        pelvis=collision_box("pelvis"),
        hip_y=joint_origin("left_hip_yaw")[1],
        thigh=-joint_origin("left_knee_pitch")[2],
        shank=-joint_origin("left_ankle_pitch")[2],
        leg_half_width=collision_box("left_thigh")[1] / 2,
        sole_low=sole_centre - sole_size / 2,
        sole_high=sole_centre + sole_size / 2,
        fan=joint_origin("left_fan_mount"),
        fan_radius=numbers(duct, "radius")[0],
        fan_height=numbers(duct, "length")[0],
        gear_ratio=numbers("servo[@joint='left_hip_roll']", "gear_ratio")[0],
    )


# ---------------------------------------------------------------------------------------- solids


def outward(polygons: Iterable[Array]) -> Mesh:
    """Drop repeated corners, and turn a closed, consistently oriented surface right side out."""
    mesh = []
    for polygon in polygons:
        corners = polygon[np.linalg.norm(polygon - np.roll(polygon, 1, axis=0), axis=1) > 1e-6]
        if len(corners) > 2:
            mesh.append(corners)
    volume = sum(np.linalg.det(p[[0, i, i + 1]]) for p in mesh for i in range(1, len(p) - 1))
    return mesh if volume > 0 else [polygon[::-1] for polygon in mesh]


def warp(mesh: Mesh, function: Callable[[Array], Array]) -> Mesh:
    """Map the corners (k, 3) of every polygon."""
    return outward(function(polygon) for polygon in mesh)


def moved(mesh: Mesh, *offset: float) -> Mesh:
    """Shift a mesh."""
    return [polygon + np.array(offset) for polygon in mesh]


def mirrored(mesh: Mesh) -> Mesh:
    """A left part as a right one."""
    return warp(mesh, lambda corners: corners * np.array([1.0, -1.0, 1.0]))


def slab(
    grid: Array, low: float, high: float, axes: str = "xyz", *, keep: Array | None = None, closed: bool = False
) -> Mesh:
    """Extrude the cells of a plane grid into a plate with holes.

    Args:
        grid: Nodes (m, n, 2), along the first two of ``axes``.
        low: Lower face along the third axis [m].
        high: Upper face along it [m].
        axes: Which axes the two grid coordinates and the height run along.
        keep: Cells (m - 1, n - 1), or (m, n - 1) if closed, that are not a hole; None keeps all.
        closed: The last row of nodes joins the first.
    """
    nodes = np.concatenate([grid, grid[:1]]) if closed else grid
    rows, columns = nodes.shape[0] - 1, nodes.shape[1] - 1
    solid = np.ones((rows, columns), dtype=bool) if keep is None else keep.astype(bool)
    order = np.argsort([*axes])

    def lift(corners: Sequence[Array], heights: Sequence[float]) -> Array:
        return np.column_stack([np.array(corners), heights])[:, order]

    def is_solid(row: int, column: int) -> bool:
        row = row % rows if closed else row
        return 0 <= row < rows and 0 <= column < columns and bool(solid[row, column])

    polygons = []
    for i, j in np.argwhere(solid):
        a, b, c, d = nodes[i, j], nodes[i + 1, j], nodes[i + 1, j + 1], nodes[i, j + 1]
        polygons += [lift([a, b, c, d], [high] * 4), lift([d, c, b, a], [low] * 4)]
        for start, end, beside in ((a, b, (i, j - 1)), (b, c, (i + 1, j)), (c, d, (i, j + 1)), (d, a, (i - 1, j))):
            if not is_solid(*beside):
                polygons.append(lift([end, start, start, end], [high, high, low, low]))
    return outward(polygons)


def loft(rings: Array) -> Mesh:
    """Join rings (m, n, 3) of corners, each convex, into a solid with flat ends."""
    polygons = [rings[0][::-1], rings[-1]]
    for lower, upper in pairwise(rings):
        polygons += _band(lower, upper)
    return outward(polygons)


def lathe(profile: Sequence[tuple[float, float]], segments: int) -> Mesh:
    """Turn a closed profile of (radius, z) about the z axis into a ring."""
    angles = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    rings = [np.column_stack([r * np.cos(angles), r * np.sin(angles), np.full(segments, z)]) for r, z in profile]
    return outward(quad for lower, upper in pairwise([*rings, rings[0]]) for quad in _band(lower, upper))


def _band(lower: Array, upper: Array) -> Mesh:
    return [np.array(q) for q in zip(lower, np.roll(lower, -1, 0), np.roll(upper, -1, 0), upper, strict=True)]


def box(low: Sequence[float], high: Sequence[float]) -> Mesh:
    """A box between two corners."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    return loft(np.array([[(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)] for z in (z0, z1)]))


def disc(radius: float, low: float, high: float, sides: int = 8) -> Mesh:
    """A cylinder about the z axis."""
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    circle = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return loft(np.array([np.column_stack([circle, np.full(sides, z)]) for z in (low, high)]))


# ----------------------------------------------------------------------------------------- plates


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


# ---------------------------------------------------------------------------------- servos, gears


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


# ------------------------------------------------------------------------------------ foot and fan


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


def rotation(angle: float) -> Callable[[Array], Array]:
    """Rotation of points (k, 3) about the z axis by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return lambda points: points @ matrix


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


# ----------------------------------------------------------------------------------------- files

COMMON = (
    *(thigh_plates, shank_plates, pelvis_frame, hip_yoke),
    *(servo, servo_pair, roll_gear, roll_pinion),
    *(sole_standoffs, fan_duct),
)
SIDED = (sole, foot_bracket, fan_rotor)
"""Their left version is made, the right one mirrored."""


def write_obj(path: Path, mesh: Mesh) -> None:
    """Write a Wavefront file: corners to a tenth of a millimetre, colours left to the URDF."""
    corners = np.round(np.concatenate(mesh), 4) + 0.0
    vertices, index = np.unique(corners, axis=0, return_inverse=True)
    faces = np.split(index.ravel() + 1, np.cumsum([len(polygon) for polygon in mesh])[:-1])
    lines = [f"# {path.stem}: made by make_meshes.py, visual only, m", f"o {path.stem}"]
    lines += [f"v {x:.5g} {y:.5g} {z:.5g}" for x, y, z in vertices]
    lines += ["f " + " ".join(map(str, face)) for face in faces]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def main() -> None:
    """Write all meshes beside this file."""
    folder = HERE / "meshes"
    folder.mkdir(exist_ok=True)
    dimensions = read_dimensions(HERE / "jet_hr1.urdf")
    for make in COMMON:
        write_obj(folder / f"{make.__name__}.obj", make(dimensions))
    for make in SIDED:
        left = make(dimensions)
        write_obj(folder / f"{make.__name__}_left.obj", left)
        write_obj(folder / f"{make.__name__}_right.obj", mirrored(left))


if __name__ == "__main__":
    main()
