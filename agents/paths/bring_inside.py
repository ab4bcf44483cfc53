"""A path brought back into the edge polygon where it misses it: what the interior-point method cannot do.

That method (:mod:`agents.paths.barrier`) keeps constraints that hold; one that is violated it leaves out. Along a
lattice's path a swing point may lie beside the polygon's thin tip all the same, where a place inside is near.
"""

from __future__ import annotations

import numpy as np

from agents.paths.cost import SearchModel, SwingPoints, exact_costs, stance_at
from agents.paths.slacks import COM_X, COM_Y, FILLED, UNKNOWNS, fill_slacks
from jet_gym.balance import BalanceParameters, Point, Stance
from jet_gym.constraints import EDGE_POLYGON, REACH, THRUST
from jet_gym.edge_polygon import along_and_aside, edge_axis, half_width, point_in_world
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined

_CORRECTIONS = 16  # of the pelvis, to bring the centre of mass where it is to be
_ROOM = 5e-4  # [m] kept from the ends of the polygon
_WIDEST = 0.5  # of half the polygon's width


@entry_point
def bring_inside(model: SearchModel, points: SwingPoints, path: Array) -> int:
    """Move the pelvis where the edge polygon or the thrust's limits are missed, where that is cheaper.

    The centre of mass goes into the middle half of the polygon, at least ``_ROOM`` from its ends.

    Args:
        model: The robot and what is minimised.
        points: The swing points.
        path: The path (N, 3) [m]; changed in place.

    Returns:
        How many swing points were moved.
    """
    moved, costs, candidates = 0, np.empty(2), np.empty((3, 2))
    x, slacks = np.zeros(UNKNOWNS), np.empty(FILLED)
    for point in range(len(path)):
        stance = stance_at(model, points, point)
        x[:3] = path[point]
        _, violations = fill_slacks(model, stance, x, slacks)
        if violations & (EDGE_POLYGON | THRUST) == 0 or violations & REACH:
            continue
        target_x, target_y = _place_inside(model.robot.balance, stance, slacks[COM_X], slacks[COM_Y])
        for _ in range(_CORRECTIONS):
            x[0] += target_x - slacks[COM_X]
            x[1] += target_y - slacks[COM_Y]
            fill_slacks(model, stance, x, slacks)
        candidates[:, 0], candidates[:, 1] = path[point], x[:3]
        exact_costs(model, stance, candidates, costs)
        if costs[1] < costs[0]:
            path[point] = x[:3]
            moved += 1
    return moved


@inlined
def _place_inside(balance: BalanceParameters, stance: Stance, com_x: float, com_y: float) -> Point:
    """Return the place of the centre of mass [m] inside of the edge polygon that is nearest, or nearly so."""
    axis = edge_axis(stance)
    fan_x, fan_y = stance.fan[0] - axis.tip[0], stance.fan[1] - axis.tip[1]
    lever = axis.x * fan_x + axis.y * fan_y
    thrust_along = balance.weight * lever / max(fan_x * fan_x + fan_y * fan_y, _ROOM * _ROOM)  # [N/m]
    furthest = axis.length
    if not balance.least_thrust:
        furthest = min(axis.length, balance.max_thrust / max(thrust_along, 1e-9))
    along, aside = along_and_aside(axis, com_x, com_y)
    along = min(max(along, _ROOM), furthest - _ROOM)
    width = half_width(_WIDEST * balance.edge_slope, axis, along)
    return point_in_world(axis, along, min(max(aside, -width), width))
