"""Floor, ditch and soft shadows, computed pixel by pixel from depths.

PyBullet's software renderer spends most of its time on the floor, if there is one, and shades all of it instead of
the shadows on it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter

from jet_gym.courses import CARTON_LENGTH, CARTON_WIDTH
from jet_gym.simulation.camera import Camera, Pixels
from jet_gym.step import Step
from jet_gym.urdf import Array

BACKGROUND = np.array([236.0, 239.0, 243.0], dtype=np.float32)
_FLOOR = np.array([205.0, 210.0, 217.0], dtype=np.float32)
_DITCH = np.array([126.0, 156.0, 178.0], dtype=np.float32)
_DITCH_EDGE = np.array([84.0, 112.0, 134.0], dtype=np.float32)
_SHADE = np.array([0.50, 0.53, 0.60], dtype=np.float32)  # what is left of the light in a shadow

_FADE_FROM, _FADE_TO = 0.7, 2.6  # [m] from the middle, where the floor becomes background
_DITCH_HALF_WIDTH, _DITCH_FADE = 0.30, 0.25  # [m]
_EDGE_WIDTH = 0.006  # [m]
_HATCH = 0.05  # [m]
_BIAS = 0.025  # [m] by which a surface must lie behind what shades it
_SOFTNESS = 2.2  # [px] of the light's picture


@dataclass(frozen=True)
class Ditch:
    """The clear gap on the floor between the cartons of start and landing.

    Attributes:
        axis: 0 if it separates them along x, 1 if along y.
        edges: Where it begins and ends on that axis [m].
        across: Its middle on the other axis [m].
    """

    axis: int
    edges: tuple[float, float]
    across: float


def ditch_of(step: Step) -> Ditch | None:
    """Return the gap that the swing foot crosses, the wider one of x and y; ``None`` if there is none."""
    gaps = []
    for axis, size in enumerate((CARTON_LENGTH, CARTON_WIDTH)):
        low, high = sorted((step.start[axis], step.landing[axis]))
        gaps.append((high - low - size, axis, (low + 0.5 * size, high - 0.5 * size)))
    width, axis, edges = max(gaps)
    if width <= 0.0:
        return None
    leg = step.robot.leg(step.swing)
    middle = 0.5 * sum(leg.sole_rectangle[2 * axis : 2 * axis + 2])
    other_middle = 0.5 * sum(leg.sole_rectangle[2 - 2 * axis : 4 - 2 * axis])
    across = 0.5 * (step.start[1 - axis] + step.landing[1 - axis]) + other_middle
    return Ditch(axis, (edges[0] + middle, edges[1] + middle), across)


def floor_points(camera: Camera, height: float) -> tuple[Pixels, Pixels]:
    """Return where the lines of sight meet the floor.

    Args:
        camera: The camera.
        height: Height of the floor [m].

    Returns:
        Points (height, width, 3) [m] and depths (height, width) [m]; far away where there is no floor in sight.
    """
    rays = camera.rays()
    depth = np.float32(camera.eye[2] - height) / np.maximum(-rays[..., 2], np.float32(1e-3))
    return rays * depth[..., None] + camera.eye.astype(np.float32), depth


def floor_colors(points: Pixels, depth: Pixels, middle: Array, ditch: Ditch | None) -> Pixels:
    """Return the colours (height, width, 3) of the floor, fading into the background.

    Args:
        points: Points of the floor (height, width, 3) [m].
        depth: Their depths (height, width) [m].
        middle: Middle of the scene (3,) [m].
        ditch: The ditch, if there is one.
    """
    distance = np.hypot(points[..., 0] - np.float32(middle[0]), points[..., 1] - np.float32(middle[1]))
    fade = 1.0 - _smooth((distance - _FADE_FROM) / (_FADE_TO - _FADE_FROM))
    colors = BACKGROUND + fade[..., None] * (_FLOOR - BACKGROUND)
    if ditch is None:
        return colors
    near = np.abs(points[..., 1 - ditch.axis] - ditch.across) < _DITCH_HALF_WIDTH + _DITCH_FADE
    near &= np.abs(points[..., ditch.axis] - sum(ditch.edges) / 2.0) < ditch.edges[1] - ditch.edges[0]
    colors[near] = _ditch_colors(colors[near], points[near], depth[near], fade[near], ditch)
    return colors


def _ditch_colors(colors: Pixels, points: Pixels, depth: Pixels, fade: Pixels, ditch: Ditch) -> Pixels:
    along, across = points[:, ditch.axis], np.abs(points[:, 1 - ditch.axis] - ditch.across)
    pixel = 1.5e-3 * depth  # [m] about the size of a pixel: edges this soft are not ragged
    inside = np.minimum(along - ditch.edges[0], ditch.edges[1] - along)
    fade = fade * (1.0 - _smooth((across - _DITCH_HALF_WIDTH) / _DITCH_FADE))
    within = fade * _smooth(inside / pixel + 0.5)
    edge = fade * _smooth((_EDGE_WIDTH - np.abs(inside)) / pixel + 0.5)
    stripe = np.abs((points[:, 0] + points[:, 1]) / (math.sqrt(2.0) * _HATCH) % 1.0 - 0.5)
    hatch = within * _smooth((stripe - 0.33) * _HATCH / pixel + 0.5)
    for share, color in ((0.8 * within, _DITCH), (0.22 * hatch, _DITCH_EDGE), (0.7 * edge, _DITCH_EDGE)):
        colors = colors + share[:, None] * (color - colors)
    return colors


def shadow(points: Pixels, light: Camera, light_depth: Pixels) -> Pixels:
    """Return how much of each point lies in the shadow (N,), from 0 to 1.

    Args:
        points: Points (N, 3) [m].
        light: A camera where the light is.
        light_depth: How far it sees (light.height, light.width) [m].
    """
    pixels, depth = light.project(points)
    reach = depth.astype(np.float32) - np.float32(_BIAS)
    # Most points lie in front of all that the light sees around them, or behind it.
    around = 2 * math.ceil(_SOFTNESS) + 1
    x, y = _within(pixels[:, 0], light.width), _within(pixels[:, 1], light.height)
    shaded: Pixels = (reach > minimum_filter(light_depth, around)[y, x]).astype(np.float32)
    unclear = np.flatnonzero((shaded > 0.0) & (reach <= maximum_filter(light_depth, around)[y, x]))
    pixels, reach, total = pixels[unclear], reach[unclear], np.zeros(len(unclear), dtype=np.float32)
    circle = [(math.cos(k * math.pi / 4.0), math.sin(k * math.pi / 4.0)) for k in range(8)]
    for dx, dy in ((0.0, 0.0), *circle):
        x = _within(pixels[:, 0] + _SOFTNESS * dx, light.width)
        y = _within(pixels[:, 1] + _SOFTNESS * dy, light.height)
        total += light_depth[y, x] < reach
    shaded[unclear] = total / (1 + len(circle))
    return shaded


def _within(pixels: Array, size: int) -> NDArray[np.int32]:
    return np.clip(pixels, 0, size - 1).astype(np.int32)


def darken(colors: Pixels, share: Pixels) -> Pixels:
    """Return colours (N, 3) in a shadow of a share (N,)."""
    return np.asarray(colors * (1.0 - share[:, None] * (1.0 - _SHADE)), dtype=np.float32)


def _smooth(value: Pixels) -> Pixels:
    """Step from 0 to 1 without corners while the value goes from 0 to 1."""
    clipped = np.clip(value, 0.0, 1.0)
    return np.asarray(clipped * clipped * (3.0 - 2.0 * clipped), dtype=np.float32)
