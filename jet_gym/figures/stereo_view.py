"""The perspective view of a locomotion figure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from jet_gym.figures import style
from jet_gym.figures.scene import Bodies, Scene
from jet_gym.leg import SIDES
from jet_gym.plan import Plan
from jet_gym.step import Step
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.gridspec import SubplotSpec

THRUST_SCALE = 10.0  # [mm/N]
SCALE_ARROW = 10.0  # [N]

_ELEVATION = 20.0  # [deg]
_TURN_TOWARDS_FRONT = 32.0  # [deg] from the view square on the step
_FILL = (1.02, 0.89)  # of the width and the height of the axes; numbers and labels stand outside of the box
_MARGIN = 25.0  # [mm] around what is drawn
_FACES = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
_CARTON_SHADES = ("#C9A66B", "#E6CFA3", "#D5B57F", "#DDC191", "#D5B57F", "#DDC191")


def draw_stereo_view(
    figure: Figure, place: SubplotSpec, plan: Plan, bodies: Bodies, points: Sequence[int], scene: Scene
) -> Any:
    """Draw the robot at some swing points in perspective; positions in mm, the same scale on all axes.

    Args:
        figure: The figure.
        place: Where in it.
        plan: The plan.
        bodies: The robot at every swing point.
        points: Swing points to draw, in order.
        scene: What stands around it.

    Returns:
        The axes.
    """
    axes = style.add_3d_axes(figure, place)
    azimuth = _azimuth(plan.step)
    axes.set_proj_type("persp", focal_length=0.9)
    axes.view_init(elev=_ELEVATION, azim=azimuth)
    towards_camera = np.array([math.cos(math.radians(azimuth)), math.sin(math.radians(azimuth)), 0.0])
    low, high = _limits(plan, bodies, points, scene)
    _prepare_axes(axes, low, high)
    _draw_ditch(axes, scene, low, high, towards_camera)
    _draw_cartons(axes, scene, towards_camera)
    swing_color = style.LEG_COLORS[plan.step.swing]
    axes.plot(*(1e3 * plan.swing_sole.T), color=swing_color, zorder=5.0, **style.SWING_PATH)
    for order, point in enumerate(points):
        strength = style.strength(order, len(points))
        with_trunk = order in (0, len(points) - 1)
        _draw_body(axes, bodies, point, strength, 10.0 + 10.0 * order, towards_camera, with_trunk)
        _draw_thrust(axes, 1e3 * plan.fan[point], plan.thrust[point], strength, 18.0 + 10.0 * order, towards_camera)
    axes.plot(*(1e3 * plan.pelvis.T), color=style.INK, zorder=300.0, **style.PELVIS_PATH)
    for order, point in enumerate(points):
        look = style.center_of_mass_marker(style.strength(order, len(points)))
        axes.plot(*(1e3 * plan.com[point])[:, None], zorder=301.0 + order, **look)
    _draw_scale(axes, low, high, towards_camera)
    return axes


def _azimuth(step: Step) -> float:
    """Return where the camera stands [deg]: beside the step on the swing foot's side, turned to the front."""
    ahead, leftward = step.landing[0] - step.start[0], step.landing[1] - step.start[1]
    if math.hypot(ahead, leftward) < 1e-9:
        return -60.0
    normal = np.array([leftward, -ahead]) / math.hypot(ahead, leftward)
    outward = 0.5 * (np.array(step.start) + np.array(step.landing))[:2] - np.array(step.support[:2])
    side = float(normal @ outward)
    if abs(side) < 1e-3:  # the step leads straight away from the support foot: look from the front
        side = float(normal[0])
    x, y = normal if side >= 0.0 else -normal
    square_on = math.degrees(math.atan2(y, x))
    return square_on + (_TURN_TOWARDS_FRONT if square_on < -20.0 else -_TURN_TOWARDS_FRONT)


def _limits(plan: Plan, bodies: Bodies, points: Sequence[int], scene: Scene) -> tuple[Array, Array]:
    """Return the lower and the upper corner of what is drawn [mm]."""
    clouds = (bodies.trunk_corners, bodies.sole_corners, bodies.ducts, bodies.knees)
    cloud = [cloud[list(points)].reshape(-1, 3) for cloud in clouds]
    cartons = [np.column_stack([carton.x, carton.y, carton.z]) for carton in scene.cartons]
    everything = 1e3 * np.concatenate([*cloud, *cartons, plan.swing_sole])
    low, high = everything.min(axis=0) - _MARGIN, everything.max(axis=0) + _MARGIN
    low[2] += _MARGIN  # the cartons stand on the floor of the axes
    return low, high


def _prepare_axes(axes: Any, low: Array, high: Array) -> None:
    from matplotlib.ticker import MultipleLocator

    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=_zoom(axes, low, high))
    for axis, name, size in zip((axes.xaxis, axes.yaxis, axes.zaxis), "xyz", high - low, strict=True):
        axis.set_label_text(f"{name} [mm]", fontsize=style.LABEL_SIZE, color=style.INK)
        axis.labelpad = 5.0 if name != "z" else 2.0
        axis.set_major_locator(MultipleLocator(100.0 if size < 450.0 else 200.0))


def _zoom(axes: Any, low: Array, high: Array) -> float:
    """Return the zoom at which the box between two corners fills most of the axes."""
    from mpl_toolkits.mplot3d.proj3d import proj_transform  # type: ignore[import-untyped]

    axes.set_box_aspect(high - low)
    corners = [(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    x, y, _ = proj_transform(*np.transpose(corners), axes.get_proj())
    return min(
        _FILL[0] * float(axes.viewLim.width / np.ptp(x)),
        _FILL[1] * float(axes.viewLim.height / np.ptp(y)),
    )


def _draw_ditch(axes: Any, scene: Scene, low: Array, high: Array, towards_camera: Array) -> None:
    ditch = scene.ditch
    if ditch is None:
        return
    along, across = ditch.axis, 1 - ditch.axis
    near, far = 1e3 * np.array(ditch.edges)
    band = np.full((4, 3), low[2])
    band[:, along] = near, far, far, near
    band[:, across] = low[across], low[across], high[across], high[across]
    _add_faces(axes, [band], facecolors=style.DITCH_COLOR, edgecolors="none", zorder=0.5)
    towards = 1.0 if towards_camera[across] > 0.0 else -1.0
    rule = np.full((2, 3), low[2])
    rule[:, along] = near, far
    rule[:, across] = (low if towards < 0.0 else high)[across] - 0.5 * _MARGIN * towards
    axes.plot(*rule.T, color=style.INK, linewidth=1.1, marker="|", markersize=8.0, zorder=2.0)
    middle = rule.mean(axis=0)
    middle[across] -= 2.4 * _MARGIN * towards
    axes.text(*middle, ditch.label, ha="center", va="center", fontsize=style.TEXT_SIZE, zorder=2.0)


def _draw_cartons(axes: Any, scene: Scene, towards_camera: Array) -> None:
    far_first = sorted(scene.cartons, key=lambda c: c.x[0] * towards_camera[0] + c.y[0] * towards_camera[1])
    for order, carton in enumerate(far_first):
        corners = 1e3 * carton.corners
        look = {"facecolors": _CARTON_SHADES, "edgecolors": style.CARTON_EDGE, "linewidths": 0.7}
        _add_faces(axes, [corners[list(face)] for face in _FACES], zorder=1.0 + 0.1 * order, **look)


def _draw_body(
    axes: Any, bodies: Bodies, point: int, strength: float, zorder: float, towards_camera: Array, with_trunk: bool
) -> None:
    """Draw a stick figure between ``zorder`` and ``zorder + 8``."""
    hips = 1e3 * bodies.hips[point]
    ink = style.tint(style.INK, strength)
    far_first = sorted((0, 1), key=lambda side: float(hips[side] @ towards_camera))
    for side, level in zip(far_first, (zorder, zorder + 4.0), strict=True):
        leg_color = style.LEG_COLORS[SIDES[side]]
        color = style.tint(leg_color, strength)
        corners = 1e3 * bodies.sole_corners[point, side]
        fill = (*style.tint(leg_color, strength), 0.3)
        _add_faces(axes, [corners], facecolors=[fill], edgecolors="none", zorder=level)
        axes.plot(*corners[[0, 1, 2, 3, 0]].T, color=color, linewidth=1.3, zorder=level)
        axes.plot(*(1e3 * bodies.ducts[point, side]).T, color=color, linewidth=1.6, zorder=level)
        axes.plot(*(1e3 * bodies.leg_chain(point, side)).T, color=color, zorder=level + 1.0, **style.LEG_LINE)
    axes.plot(*hips.T, color=ink, linewidth=4.0, solid_capstyle="round", zorder=zorder + 3.0)
    if with_trunk:
        trunk = 1e3 * bodies.trunk_corners[point]
        fill = (*style.tint(style.FAINT_INK, strength), 0.16)
        look = {"facecolors": [fill], "edgecolors": [(*ink, 0.8)], "linewidths": 0.8}
        _add_faces(axes, [trunk[list(face)] for face in _FACES], zorder=zorder + 2.0, **look)


def _draw_thrust(
    axes: Any, foot: Array, thrust: float, strength: float, zorder: float, towards_camera: Array
) -> None:
    """Draw a thrust [N] as an upright arrow from ``foot`` [mm], its flat head turned to the camera."""
    length = THRUST_SCALE * thrust
    head = math.copysign(min(26.0, 0.6 * abs(length)), length)
    aside = 0.32 * abs(head) * np.array([-towards_camera[1], towards_camera[0], 0.0])
    up = np.array([0.0, 0.0, 1.0])
    tip, neck = foot + length * up, foot + (length - head) * up
    color = style.tint(style.THRUST_COLOR, strength)
    axes.plot(*np.column_stack([foot, neck]), color=color, linewidth=2.4, solid_capstyle="butt", zorder=zorder)
    _add_faces(axes, [[tip, neck - aside, neck + aside]], facecolors=[color], edgecolors="none", zorder=zorder)


def _draw_scale(axes: Any, low: Array, high: Array, towards_camera: Array) -> None:
    """Stand an arrow of a known thrust in the corner of the floor that is leftmost in the picture."""
    rightwards = (-towards_camera[1], towards_camera[0])
    corner = np.array([(low if right >= 0.0 else high)[i] for i, right in enumerate(rightwards)] + [low[2]])
    _draw_thrust(axes, corner, SCALE_ARROW, 1.0, 6.0, towards_camera)
    x, y, floor = corner
    look = {"color": style.THRUST_COLOR, "fontsize": style.TEXT_SIZE, "ha": "center", "va": "bottom"}
    axes.text(x, y, floor + THRUST_SCALE * SCALE_ARROW + 6.0, f"{SCALE_ARROW:g} N", zorder=6.0, **look)


def _add_faces(axes: Any, faces: Sequence[Any], **look: Any) -> None:
    """Add polygons [mm] to the view, which sorts them by depth among themselves."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    axes.add_collection3d(Poly3DCollection(faces, **look))
