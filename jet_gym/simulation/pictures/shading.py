"""Floor, ditch, soft shadows and smooth edges, computed pixel by pixel from what the software renderer saw.

PyBullet's software renderer spends most of its time on the floor, if there is one, and shades all of it instead of
the shadows on it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jet_gym.ground import ditch_of
from jet_gym.leg import Vector
from jet_gym.simulation.pictures.lens import Lens, point_of, ray_of, seen_by
from jet_gym.step import Step
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined

FAR_AWAY = 1e6  # [m] depth of nothing; compiled code takes no infinity

Pixels = NDArray[np.float32]
Color = tuple[float, float, float]
"""Red, green and blue from 0 to 255."""

_BACKGROUND: Color = (236.0, 239.0, 243.0)
_FLOOR: Color = (205.0, 210.0, 217.0)
_DITCH: Color = (126.0, 156.0, 178.0)
_DITCH_EDGE: Color = (84.0, 112.0, 134.0)
SHADE = (0.50, 0.53, 0.60)  # what is left of the light in a shadow

_FADE_FROM, _FADE_TO = 0.7, 2.6  # [m] from the middle, where the floor becomes background
_DITCH_HALF_WIDTH, _DITCH_FADE = 0.30, 0.25  # [m]
_EDGE_WIDTH = 0.006  # [m]
_HATCH = 0.05  # [m]
_BIAS = 0.025  # [m] by which a surface must lie behind what shades it
_SOFTNESS = 1.4  # [px] of the light's picture
_AROUND = tuple((math.cos(k * math.pi / 4.0), math.sin(k * math.pi / 4.0)) for k in range(8))
_ON_BODIES = 0.8  # share of a shadow's darkness that it has on bodies
_SHADOWS_REACH = 1.5  # [m] around the middle of the scene
_GROUND_LEVEL = 1e-3  # [m] what lies deeper is below the floor
_TILE = 16  # [px]


class Floor(NamedTuple):
    """The floor in numbers that compiled code takes."""

    height: float  # [m]
    middle: tuple[float, float]  # [m] of the scene
    has_ditch: bool
    axis: int  # those of :class:`~jet_gym.ground.Ditch`
    near_edge: float
    far_edge: float
    across: float


def floor_of(step: Step, height: float, middle: Array) -> Floor:
    """Return the floor below a step.

    Args:
        step: The step.
        height: Its height [m].
        middle: Middle of the scene (3,) [m].
    """
    ditch, around = ditch_of(step), (float(middle[0]), float(middle[1]))
    if ditch is None:
        return Floor(height, around, False, 0, 0.0, 0.0, 0.0)
    near, far = ditch.edges
    return Floor(height, around, True, ditch.axis, float(near), float(far), float(ditch.across))


@entry_point
def shade(
    lens: Lens,
    floor: Floor,
    light: Lens,
    light_depth: Pixels,
    color: NDArray[np.uint8],
    buffer: Pixels,
    bodies: NDArray[np.int32],
    picture: NDArray[np.uint8],
) -> None:
    """Draw the floor and the bodies on it.

    Args:
        lens: The camera.
        floor: The floor.
        light: A camera where the light is.
        light_depth: How far it sees (light.height, light.width) [m], :data:`FAR_AWAY` where there is nothing.
        color: Bodies as the camera sees them (s * height, s * width, 4), each pixel of the picture s times s.
        buffer: What OpenGL keeps of their depths (s * height, s * width).
        bodies: Negative where there is none (s * height, s * width).
        picture: Receives the picture (height, width, 3).
    """
    scale = len(buffer) // lens.height
    nearest, farthest = _tiles(light_depth)
    for row in range(lens.height):
        for column in range(lens.width):
            ray = ray_of(lens, row + 0.5, column + 0.5)
            ground = _floor_color(lens, floor, light, light_depth, nearest, farthest, ray)
            count, red, green, blue, depth = 0, 0.0, 0.0, 0.0, 0.0
            for y in range(scale * row, scale * (row + 1)):
                for x in range(scale * column, scale * (column + 1)):
                    if bodies[y, x] < 0:
                        continue
                    far = lens.far * lens.near / (lens.far - (lens.far - lens.near) * buffer[y, x])
                    _, _, down = ray_of(lens, (y + 0.5) / scale, (x + 0.5) / scale)
                    if lens.eye[2] + far * down > floor.height - _GROUND_LEVEL:  # plinths go through the floor
                        count += 1
                        red, green, blue = red + color[y, x, 0], green + color[y, x, 1], blue + color[y, x, 2]
                        depth += far
            if count > 0:
                point = point_of(lens, ray, depth / count)
                share = _ON_BODIES * _shadow(light, light_depth, nearest, farthest, point)
                body = _darkened((red / count, green / count, blue / count), share)
                ground = _mixed(ground, body, count / (scale * scale))
            for channel in range(3):
                picture[row, column, channel] = int(min(max(ground[channel], 0.0), 255.0) + 0.5)


@inlined
def _floor_color(
    lens: Lens, floor: Floor, light: Lens, light_depth: Pixels, nearest: Pixels, farthest: Pixels, ray: Vector
) -> Color:
    """Return the colour of the floor along a line of sight, fading into the background."""
    depth = (lens.eye[2] - floor.height) / max(-ray[2], 1e-3)  # far away where there is no floor in sight
    point = point_of(lens, ray, depth)
    x, y = point[0] - floor.middle[0], point[1] - floor.middle[1]
    distance = math.sqrt(x * x + y * y)
    fade = 1.0 - _smooth((distance - _FADE_FROM) / (_FADE_TO - _FADE_FROM))
    color = _mixed(_BACKGROUND, _FLOOR, fade)
    if floor.has_ditch:
        color = _ditch_color(color, floor, point, depth, fade)
    if distance < _SHADOWS_REACH:
        color = _darkened(color, _shadow(light, light_depth, nearest, farthest, point))
    return color


@inlined
def _ditch_color(color: Color, floor: Floor, point: Vector, depth: float, fade: float) -> Color:
    along, across = (point[0], point[1]) if floor.axis == 0 else (point[1], point[0])
    across = abs(across - floor.across)
    pixel = 1.5e-3 * depth  # [m] about the size of a pixel: edges this soft are not ragged
    inside = min(along - floor.near_edge, floor.far_edge - along)
    if across > _DITCH_HALF_WIDTH + _DITCH_FADE or inside < -_EDGE_WIDTH - pixel:
        return color
    fade = fade * (1.0 - _smooth((across - _DITCH_HALF_WIDTH) / _DITCH_FADE))
    within = fade * _smooth(inside / pixel + 0.5)
    edge = fade * _smooth((_EDGE_WIDTH - abs(inside)) / pixel + 0.5)
    stripe = (point[0] + point[1]) / (math.sqrt(2.0) * _HATCH)
    stripe = abs(stripe - math.floor(stripe) - 0.5)
    hatch = within * _smooth((stripe - 0.33) * _HATCH / pixel + 0.5)
    color = _mixed(color, _DITCH, 0.8 * within)
    color = _mixed(color, _DITCH_EDGE, 0.22 * hatch)
    return _mixed(color, _DITCH_EDGE, 0.7 * edge)


@inlined
def _shadow(light: Lens, light_depth: Pixels, nearest: Pixels, farthest: Pixels, point: Vector) -> float:
    """Return how much of a point lies in the shadow, from 0 to 1."""
    x, y, depth = seen_by(light, point)
    reach = depth - _BIAS
    row, column = _within(y, light.height), _within(x, light.width)
    if reach <= nearest[row // _TILE, column // _TILE]:
        return 0.0
    if reach > farthest[row // _TILE, column // _TILE]:
        return 1.0
    total = 1.0 if light_depth[row, column] < reach else 0.0
    for dx, dy in _AROUND:
        row, column = _within(y + _SOFTNESS * dy, light.height), _within(x + _SOFTNESS * dx, light.width)
        total += 1.0 if light_depth[row, column] < reach else 0.0
    return total / (1 + len(_AROUND))


@inlined
def _tiles(light_depth: Pixels) -> tuple[Pixels, Pixels]:
    """Return the least and the greatest depth in and around each tile of the light's picture.

    Most points lie in front of all that the light sees around them, or behind it.
    """
    height, width = light_depth.shape
    rows, columns, around = (height - 1) // _TILE + 1, (width - 1) // _TILE + 1, math.ceil(_SOFTNESS)
    nearest, farthest = np.empty((rows, columns), np.float32), np.empty((rows, columns), np.float32)
    for row in range(rows):
        for column in range(columns):
            least, most = light_depth[row * _TILE, column * _TILE], light_depth[row * _TILE, column * _TILE]
            for y in range(max(row * _TILE - around, 0), min((row + 1) * _TILE + around, height)):
                for x in range(max(column * _TILE - around, 0), min((column + 1) * _TILE + around, width)):
                    least, most = min(least, light_depth[y, x]), max(most, light_depth[y, x])
            nearest[row, column], farthest[row, column] = least, most
    return nearest, farthest


@inlined
def _within(pixel: float, size: int) -> int:
    return int(min(max(pixel, 0.0), size - 1.0))


@inlined
def _darkened(color: Color, share: float) -> Color:
    """Return a colour in a shadow of a share."""
    return (
        color[0] * (1.0 - share * (1.0 - SHADE[0])),
        color[1] * (1.0 - share * (1.0 - SHADE[1])),
        color[2] * (1.0 - share * (1.0 - SHADE[2])),
    )


@inlined
def _mixed(color: Color, other: Color, share: float) -> Color:
    """Return a colour with a share of another one in it."""
    return (
        color[0] + share * (other[0] - color[0]),
        color[1] + share * (other[1] - color[1]),
        color[2] + share * (other[2] - color[2]),
    )


@inlined
def _smooth(value: float) -> float:
    """Step from 0 to 1 without corners while the value goes from 0 to 1."""
    clipped = min(max(value, 0.0), 1.0)
    return clipped * clipped * (3.0 - 2.0 * clipped)
