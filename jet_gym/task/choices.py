"""What is left to choose once balance is kept: the thrust, a place across the edge polygon, and the height.

A policy that chose the pelvis itself would have to hit the edge polygon, eq. (10), which is 0.08 mm wide for each
0.1 N of thrust. Turned round, every choice meets eqs (9) and (10): the thrust says how far from the assigned ZMP
the centre of mass is, eqs (1) to (3), the place across says where in the polygon's width, and the pelvis is what
brings the centre of mass there. Its height is raised or lowered from the last by what is chosen, within what the
legs allow (:mod:`jet_gym.leg_heights`). Where they allow none, or the pelvis would have to go farther than it may,
the thrust yields. The pelvis is searched (:mod:`jet_gym.task.pelvis_search`) from nothing but what an agent
observes.

A choice has three numbers in [-1, 1]:

* thrust: idle up to -0.7; from there to 1 its square root rises evenly to that of the largest thrust;
* aside: across the edge polygon, from its right edge, seen from the assigned ZMP, to its left one;
* height: the pelvis' move upwards over the search range, as the action's third number.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from jet_gym.balance import BalanceParameters, Point, Stance, assigned_thrust
from jet_gym.edge_polygon import EdgeAxis, along_and_aside, edge_axis, half_width, point_in_world
from jet_gym.posture_block import BLOCK, COM, GIVEN_PELVIS, evaluate_block, new_block, put, stance_in
from jet_gym.single_support import SingleSupport, stance_between
from jet_gym.task.observation import FIRST_POINT, OBSERVED_PELVIS, OBSERVED_SWING_SOLE
from jet_gym.task.packing import unpack
from jet_gym.task.pelvis_search import PelvisSearch, correct, differentiate, follow, give_way, new_pelvis_search
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined

THRUST, ASIDE, HEIGHT = 0, 1, 2
IDLE = -0.7
"""Choice of the thrust up to which the fan idles."""

_IDLE_THRUST = 2e-3  # [N]; with less, the edge polygon is too narrow for numbers of 32 bits
_IDLE_BELOW = 0.05  # [N] thrust that counts as idle when choices are read off an action
_MOST_THRUST = 0.9999  # of the largest one
_WIDEST = 0.95  # of half the edge polygon's width
_FURTHEST = 0.98  # of the edge polygon's length
_NARROW = 1e-7  # [m] width below which there is no place across
_MOST_CORRECTIONS = 24  # of the pelvis; a step of some millimetres takes five
_UNTOUCHED = 3  # of them before the thrust is raised where the legs need it


@entry_point
def actions_of_choices(
    numbers: Array, observations: NDArray[np.float32], choices: NDArray[np.float32], actions: NDArray[np.float32]
) -> None:
    """Find the actions that carry choices out.

    Args:
        numbers: The task with left swing, packed.
        observations: What was observed (N, C).
        choices: What is chosen (N, 3).
        actions: Receives the actions (N, 3).
    """
    search, chosen = new_pelvis_search(), np.empty((2, BLOCK))
    robot, _, task = unpack(numbers)
    for start in range(0, len(observations), BLOCK):
        count = min(BLOCK, len(observations) - start)
        for i in range(BLOCK):
            row = observations[start + min(i, count - 1)]
            choice = choices[start + min(i, count - 1)]
            x, y, z = _three(row, OBSERVED_PELVIS)
            search.origin[0, i], search.origin[1, i], search.origin[2, i] = x, y, z
            search.reach[i] = task.first_range if row[FIRST_POINT] > 0.5 else task.later_range
            search.wished[i] = z + search.reach[i] * _bounded(choice[HEIGHT])
            search.farther[i] = 0.0
            put(search.block.given, i, _observed_stance(robot, row), (x, y, search.wished[i]))
            chosen[0, i], chosen[1, i] = _bounded(choice[THRUST]), _bounded(choice[ASIDE])
        _aim(robot.balance, chosen, search)
        differentiate(robot, search)
        for correction in range(_MOST_CORRECTIONS):
            if correction >= _UNTOUCHED:
                give_way(search)
                _aim(robot.balance, chosen, search)
            if correct(search) == BLOCK:
                break
            follow(robot, search)
        for i in range(count):
            for axis in range(3):
                moved = search.block.given[GIVEN_PELVIS + axis, i] - search.origin[axis, i]
                actions[start + i, axis] = _bounded(moved / search.reach[i])


@entry_point
def choices_of_actions(
    numbers: Array, observations: NDArray[np.float32], actions: Array, choices: NDArray[np.float32]
) -> None:
    """Read off actions what they choose, bounded to what can be chosen.

    Args:
        numbers: The task with left swing, packed.
        observations: What was observed (N, C).
        actions: Actions (N, 3); they may be beyond the search range.
        choices: Receives the choices (N, 3).
    """
    block = new_block()
    robot, _, task = unpack(numbers)
    for start in range(0, len(observations), BLOCK):
        count = min(BLOCK, len(observations) - start)
        for i in range(BLOCK):
            row, action = observations[start + min(i, count - 1)], actions[start + min(i, count - 1)]
            half = task.first_range if row[FIRST_POINT] > 0.5 else task.later_range
            x, y, z = _three(row, OBSERVED_PELVIS)
            pelvis = (x + half * action[0], y + half * action[1], z + half * action[2])
            put(block.given, i, _observed_stance(robot, row), pelvis)
        evaluate_block(robot, block)
        for i in range(count):
            com_x, com_y = block.found[COM, i], block.found[COM + 1, i]
            thrust, aside = _read(robot.balance, stance_in(block.given, i), com_x, com_y)
            choices[start + i, THRUST], choices[start + i, ASIDE] = thrust, aside
            choices[start + i, HEIGHT] = _bounded(actions[start + i, 2])


@inlined
def _bounded(value: float) -> float:
    bounded: float = min(max(np.float64(value), -1.0), 1.0)
    return bounded


@inlined
def _three(row: NDArray[np.float32], column: int) -> tuple[float, float, float]:
    return np.float64(row[column]), np.float64(row[column + 1]), np.float64(row[column + 2])


@inlined
def _observed_stance(robot: SingleSupport, row: NDArray[np.float32]) -> Stance:
    """Return the coming swing point, mirrored to a left swing, the support sole at the origin."""
    return stance_between(robot, _three(row, OBSERVED_SWING_SOLE), (0.0, 0.0, 0.0))


@inlined
def _aim(balance: BalanceParameters, chosen: Array, search: PelvisSearch) -> None:
    """Set where the centre of mass has to be for what is chosen (2, BLOCK)."""
    for i in range(BLOCK):
        search.target[0, i], search.target[1, i] = _place(
            balance, stance_in(search.block.given, i), chosen[0, i], chosen[1, i], search.farther[i]
        )


@inlined
def _lever(stance: Stance, axis: EdgeAxis) -> tuple[float, float, float]:
    """Return the fan's place along the edge polygon's axis and aside [m], and its distance squared [m^2]."""
    fx, fy = stance.fan[0] - axis.tip[0], stance.fan[1] - axis.tip[1]
    return max(axis.x * fx + axis.y * fy, 1e-6), axis.x * fy - axis.y * fx, fx * fx + fy * fy


@inlined
def _place(
    balance: BalanceParameters, stance: Stance, thrust_choice: float, aside_choice: float, farther: float
) -> Point:
    """Return where the centre of mass has to be [m], eq. (3) turned round, or farther from the assigned ZMP."""
    share = max(thrust_choice - IDLE, 0.0) / (1.0 - IDLE)
    thrust = _IDLE_THRUST + max(_MOST_THRUST * balance.max_thrust - _IDLE_THRUST, 0.0) * share * share
    axis = edge_axis(stance)
    fan_along, fan_aside, fan_squared = _lever(stance, axis)
    per_thrust = fan_squared / (balance.weight * fan_along)
    along = max(thrust * per_thrust + farther, _IDLE_THRUST * per_thrust)
    along = min(along, _MOST_THRUST * balance.max_thrust * per_thrust, _FURTHEST * axis.length)
    aside = aside_choice * half_width(_WIDEST * balance.edge_slope, axis, along)
    along -= aside * fan_aside / fan_along
    return point_in_world(axis, along, aside)


@inlined
def _read(balance: BalanceParameters, stance: Stance, com_x: float, com_y: float) -> tuple[float, float]:
    """Return the choices of thrust and place across that :func:`_place` leads to a centre of mass [m] from."""
    axis = edge_axis(stance)
    fan_along, _, fan_squared = _lever(stance, axis)
    thrust = assigned_thrust(balance.weight, com_x, com_y, stance.fan, stance.assigned_zmp)
    along = min(max(thrust, 0.0) * fan_squared / (balance.weight * fan_along), _FURTHEST * axis.length)
    _, aside = along_and_aside(axis, com_x, com_y)
    width = max(half_width(_WIDEST * balance.edge_slope, axis, along), _NARROW)
    share = max(thrust - _IDLE_THRUST, 0.0) / max(_MOST_THRUST * balance.max_thrust - _IDLE_THRUST, _IDLE_BELOW)
    thrust_choice = _bounded(IDLE + (1.0 - IDLE) * math.sqrt(share)) if thrust > _IDLE_BELOW else -1.0
    return thrust_choice, _bounded(aside / width)
