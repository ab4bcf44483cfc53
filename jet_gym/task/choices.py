"""What is left to choose once balance is kept: the thrust, a place across the edge polygon, and the height.

A policy that chose the pelvis itself would have to hit the edge polygon, eq. (10), which is 0.08 mm wide for each
0.1 N of thrust. Turned round, every choice meets eqs (9) and (10): the thrust says how far from the assigned ZMP
the centre of mass is, eqs (1) to (3), the place across says where in the polygon's width, and the pelvis is what
brings the centre of mass there. Its height is raised or lowered from the last by what is chosen, within what the
legs allow (:mod:`jet_gym.leg_heights`). Where they allow none, or the pelvis would have to go farther than it may,
the thrust yields. Broyden's method finds the pelvis, from nothing but what an agent observes.

A choice has three numbers in [-1, 1]:

* thrust: idle up to -0.7; from there to 1 its square root rises evenly to that of the largest thrust;
* aside: across the edge polygon, from its right edge, seen from the assigned ZMP, to its left one;
* height: the pelvis' move upwards over the search range, as the action's third number.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from jet_gym.arrays import Array
from jet_gym.balance import BalanceParameters, Stance, assigned_thrust, stance_of
from jet_gym.compilation import entry_point, inlined
from jet_gym.leg import Leg
from jet_gym.leg_heights import hip_heights
from jet_gym.posture_block import BLOCK, COM, FOUND_ROWS, GIVEN_ROWS, evaluate_block, put, stance_in
from jet_gym.task.observation import FIRST_POINT, OBSERVED_PELVIS, OBSERVED_SWING_SOLE
from jet_gym.task.packing import unpack

THRUST, ASIDE, HEIGHT = 0, 1, 2
IDLE = -0.7
"""Choice of the thrust up to which the fan idles."""

_IDLE_THRUST = 2e-3  # [N]; with less, the edge polygon is too narrow for numbers of 32 bits
_IDLE_BELOW = 0.05  # [N] thrust that counts as idle when choices are read off an action
_MOST_THRUST = 0.9999  # of the largest one
_WIDEST = 0.95  # of half the edge polygon's width
_FURTHEST = 0.98  # of the edge polygon's length
_NARROW = 1e-7  # [m] width below which there is no place across
_DIFFERENCE = 1e-5  # [m] of the derivatives
_MOST_CORRECTIONS = 24  # of the pelvis; a step of some millimetres takes five
_YIELDING = 0.5  # of what the legs miss, in each correction: a longer step would yield more than they need
_NEAR = 5e-6  # [m] that legs may miss; the room that is kept to their limits is more
_CLOSE = 2e-8  # [m] from where the centre of mass has to be
_UNTOUCHED = 3  # of them before the thrust is raised where the legs need it
_LONGEST = 0.05  # [m] of a correction, per axis
_LEAST_DETERMINANT = 0.05  # of the derivatives, 0.5 or so in ordinary postures
_PELVIS = 16  # row of a block of postures


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
    given, found, flags = np.zeros((GIVEN_ROWS, BLOCK)), np.empty((FOUND_ROWS, BLOCK)), np.empty(BLOCK, np.int64)
    target, wished, range_ = np.empty((2, BLOCK)), np.empty(BLOCK), np.empty(BLOCK)
    chosen, missing, farther = np.empty((2, BLOCK)), np.empty(BLOCK), np.empty(BLOCK)
    origin = np.empty((3, BLOCK))
    com, jacobian, move = np.empty((2, BLOCK)), np.empty((4, BLOCK)), np.empty((2, BLOCK))
    swing_leg, support_leg, trunk, _, balance, _, task = unpack(numbers)
    for start in range(0, len(observations), BLOCK):
        count = min(BLOCK, len(observations) - start)
        for i in range(BLOCK):
            row = observations[start + min(i, count - 1)]
            choice = choices[start + min(i, count - 1)]
            stance = _observed_stance(swing_leg, support_leg, balance, row)
            range_[i] = task.first_range if row[FIRST_POINT] > 0.5 else task.later_range
            x, y, z = _three(row, OBSERVED_PELVIS)
            origin[0, i], origin[1, i], origin[2, i] = x, y, z
            wished[i] = z + range_[i] * _bounded(choice[HEIGHT])
            put(given, i, stance, (x, y, wished[i]))
            chosen[0, i], chosen[1, i], farther[i] = _bounded(choice[THRUST]), _bounded(choice[ASIDE]), 0.0
        _aim(balance, given, chosen, farther, target)
        _limit_heights(swing_leg, support_leg, wished, given, missing)
        for axis in range(2):
            for i in range(BLOCK):
                given[_PELVIS + axis, i] -= _DIFFERENCE
            _limit_heights(swing_leg, support_leg, wished, given, missing)
            evaluate_block(swing_leg, support_leg, trunk, balance, given, found, flags)
            for i in range(BLOCK):
                given[_PELVIS + axis, i] += _DIFFERENCE
                jacobian[axis, i], jacobian[2 + axis, i] = found[COM, i], found[COM + 1, i]
        _limit_heights(swing_leg, support_leg, wished, given, missing)
        evaluate_block(swing_leg, support_leg, trunk, balance, given, found, flags)
        _finish_jacobian(found, jacobian)
        for correction in range(_MOST_CORRECTIONS):
            if correction >= _UNTOUCHED:
                _yield(given, origin, range_, missing, farther)
                _aim(balance, given, chosen, farther, target)
            if _correct(target, found, missing, jacobian, given, com, move) == BLOCK:
                break
            _limit_heights(swing_leg, support_leg, wished, given, missing)
            evaluate_block(swing_leg, support_leg, trunk, balance, given, found, flags)
            _update_jacobian(found, com, move, jacobian)
        for i in range(count):
            for axis in range(3):
                actions[start + i, axis] = _bounded((given[_PELVIS + axis, i] - origin[axis, i]) / range_[i])


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
    given, found, flags = np.zeros((GIVEN_ROWS, BLOCK)), np.empty((FOUND_ROWS, BLOCK)), np.empty(BLOCK, np.int64)
    swing_leg, support_leg, trunk, _, balance, _, task = unpack(numbers)
    for start in range(0, len(observations), BLOCK):
        count = min(BLOCK, len(observations) - start)
        for i in range(BLOCK):
            row, action = observations[start + min(i, count - 1)], actions[start + min(i, count - 1)]
            half = task.first_range if row[FIRST_POINT] > 0.5 else task.later_range
            x, y, z = _three(row, OBSERVED_PELVIS)
            pelvis = (x + half * action[0], y + half * action[1], z + half * action[2])
            put(given, i, _observed_stance(swing_leg, support_leg, balance, row), pelvis)
        evaluate_block(swing_leg, support_leg, trunk, balance, given, found, flags)
        for i in range(count):
            thrust, aside = _read(balance, stance_in(given, i), found[COM, i], found[COM + 1, i])
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
def _observed_stance(
    swing_leg: Leg, support_leg: Leg, balance: BalanceParameters, row: NDArray[np.float32]
) -> Stance:
    """Return the coming swing point, mirrored to a left swing, the support sole at the origin."""
    sole = _three(row, OBSERVED_SWING_SOLE)
    return stance_of(swing_leg, support_leg, 1.0, balance.zmp_margin, sole, (0.0, 0.0, 0.0))


@inlined
def _axis(stance: Stance) -> tuple[float, float, float]:
    """Return the edge polygon's direction from the assigned ZMP to the swing ankle, and its length [m]."""
    x, y = stance.swing_ankle[0] - stance.assigned_zmp[0], stance.swing_ankle[1] - stance.assigned_zmp[1]
    length = max(math.sqrt(x * x + y * y), 1e-6)
    return x / length, y / length, length


@inlined
def _lever(stance: Stance, ax: float, ay: float) -> tuple[float, float, float]:
    """Return the fan's place along and across that direction [m], and its distance squared [m^2]."""
    fx, fy = stance.fan[0] - stance.assigned_zmp[0], stance.fan[1] - stance.assigned_zmp[1]
    return max(ax * fx + ay * fy, 1e-6), ax * fy - ay * fx, fx * fx + fy * fy


@inlined
def _half_width(balance: BalanceParameters, length: float, along: float) -> float:
    """Return how far aside the centre of mass may be [m] at a distance from the assigned ZMP [m]."""
    return _WIDEST * balance.edge_slope * along * (length - along) / length


@inlined
def _yield(given: Array, origin: Array, range_: Array, missing: Array, farther: Array) -> None:
    """Change the thrust where the legs do not reach, or the pelvis would have to go farther than it may.

    Args:
        given: The block of postures.
        origin: Where the pelvis is before the action (3, BLOCK) [m].
        range_: How far it may go, per axis (BLOCK,) [m].
        missing: What the legs miss (BLOCK,) [m]; what the pelvis would go too far is added.
        farther: How much farther from the assigned ZMP the centre of mass is to be (BLOCK,) [m].
    """
    for i in range(BLOCK):
        ax, ay, _ = _axis(stance_in(given, i))
        dx, dy = given[_PELVIS, i] - origin[0, i], given[_PELVIS + 1, i] - origin[1, i]
        too_far_x = dx - min(max(dx, -range_[i]), range_[i])
        too_far_y = dy - min(max(dy, -range_[i]), range_[i])
        farther[i] += _YIELDING * missing[i] if missing[i] > 0.0 else -(ax * too_far_x + ay * too_far_y)
        missing[i] = max(missing[i], abs(too_far_x), abs(too_far_y))


@inlined
def _aim(balance: BalanceParameters, given: Array, chosen: Array, farther: Array, target: Array) -> None:
    """Set where the centre of mass has to be for what is chosen [m]."""
    for i in range(BLOCK):
        target[0, i], target[1, i] = _place(balance, stance_in(given, i), chosen[0, i], chosen[1, i], farther[i])


@inlined
def _place(
    balance: BalanceParameters, stance: Stance, thrust_choice: float, aside_choice: float, farther: float
) -> tuple[float, float]:
    """Return where the centre of mass has to be [m], eq. (3) turned round, or farther from the assigned ZMP."""
    share = max(thrust_choice - IDLE, 0.0) / (1.0 - IDLE)
    thrust = _IDLE_THRUST + max(_MOST_THRUST * balance.max_thrust - _IDLE_THRUST, 0.0) * share * share
    ax, ay, length = _axis(stance)
    fan_along, fan_aside, fan_squared = _lever(stance, ax, ay)
    per_thrust = fan_squared / (balance.weight * fan_along)
    along = max(thrust * per_thrust + farther, _IDLE_THRUST * per_thrust)
    along = min(along, _MOST_THRUST * balance.max_thrust * per_thrust, _FURTHEST * length)
    aside = aside_choice * _half_width(balance, length, along)
    along -= aside * fan_aside / fan_along
    zx, zy = stance.assigned_zmp
    return zx + along * ax - aside * ay, zy + along * ay + aside * ax


@inlined
def _read(balance: BalanceParameters, stance: Stance, com_x: float, com_y: float) -> tuple[float, float]:
    """Return the choices of thrust and place across that :func:`_place` leads to a centre of mass [m] from."""
    ax, ay, length = _axis(stance)
    fan_along, _, fan_squared = _lever(stance, ax, ay)
    thrust = assigned_thrust(balance.weight, com_x, com_y, stance.fan, stance.assigned_zmp)
    along = min(max(thrust, 0.0) * fan_squared / (balance.weight * fan_along), _FURTHEST * length)
    aside = (com_y - stance.assigned_zmp[1]) * ax - (com_x - stance.assigned_zmp[0]) * ay
    width = max(_half_width(balance, length, along), _NARROW)
    share = max(thrust - _IDLE_THRUST, 0.0) / max(_MOST_THRUST * balance.max_thrust - _IDLE_THRUST, _IDLE_BELOW)
    thrust_choice = _bounded(IDLE + (1.0 - IDLE) * math.sqrt(share)) if thrust > _IDLE_BELOW else -1.0
    return thrust_choice, _bounded(aside / width)


@inlined
def _limit_heights(swing_leg: Leg, support_leg: Leg, wished: Array, given: Array, missing: Array) -> None:
    """Set the pelvis to the wished heights [m], within what the legs allow; their reach comes first.

    What the legs miss of allowing any height, where they do, is written to ``missing`` [m].
    """
    for i in range(BLOCK):
        c, s, x, y = given[0, i], given[1, i], given[_PELVIS, i], given[_PELVIS + 1, i]
        hip = swing_leg.hip
        low, high = hip_heights(
            swing_leg, x + c * hip[0] - s * hip[1] - given[2, i], y + s * hip[0] + c * hip[1] - given[3, i]
        )
        least, most = given[4, i] - hip[2] + low, given[4, i] - hip[2] + high
        hip = support_leg.hip
        low, high = hip_heights(
            support_leg, x + c * hip[0] - s * hip[1] - given[5, i], y + s * hip[0] + c * hip[1] - given[6, i]
        )
        least, most = max(least, given[7, i] - hip[2] + low), min(most, given[7, i] - hip[2] + high)
        given[_PELVIS + 2, i] = min(max(wished[i], least), most)
        missing[i] = least - most


@inlined
def _finish_jacobian(found: Array, jacobian: Array) -> None:
    """Make derivatives of the centre of mass by the pelvis of where it was before the differences."""
    for i in range(BLOCK):
        for axis in range(2):
            jacobian[axis, i] = (found[COM, i] - jacobian[axis, i]) / _DIFFERENCE
            jacobian[2 + axis, i] = (found[COM + 1, i] - jacobian[2 + axis, i]) / _DIFFERENCE


@inlined
def _correct(
    target: Array, found: Array, missing: Array, jacobian: Array, given: Array, com: Array, move: Array
) -> int:
    """Move the pelvis in the plane by what the centre of mass misses its target; remember both.

    Those that have arrived stay, so that what is found for one does not depend on the others in its block.

    Returns:
        How many have arrived.
    """
    arrived = 0
    for i in range(BLOCK):
        com[0, i], com[1, i] = found[COM, i], found[COM + 1, i]
        missing_x, missing_y = target[0, i] - com[0, i], target[1, i] - com[1, i]
        determinant = jacobian[0, i] * jacobian[3, i] - jacobian[1, i] * jacobian[2, i]
        regular = determinant > _LEAST_DETERMINANT
        jacobian[0, i], jacobian[1, i] = (jacobian[0, i] if regular else 1.0), (jacobian[1, i] if regular else 0.0)
        jacobian[2, i], jacobian[3, i] = (jacobian[2, i] if regular else 0.0), (jacobian[3, i] if regular else 1.0)
        determinant = determinant if regular else 1.0
        stays = (abs(missing_x) + abs(missing_y) < _CLOSE) & (missing[i] < _NEAR)
        arrived += 1 if stays else 0
        scale = 0.0 if stays else 1.0 / determinant
        dx = (jacobian[3, i] * missing_x - jacobian[1, i] * missing_y) * scale
        dy = (jacobian[0, i] * missing_y - jacobian[2, i] * missing_x) * scale
        move[0, i], move[1, i] = min(max(dx, -_LONGEST), _LONGEST), min(max(dy, -_LONGEST), _LONGEST)
        given[_PELVIS, i] += move[0, i]
        given[_PELVIS + 1, i] += move[1, i]
    return arrived


@inlined
def _update_jacobian(found: Array, com: Array, move: Array, jacobian: Array) -> None:
    """Broyden's update (Broyden, "A class of methods for solving nonlinear simultaneous equations", 1965)."""
    for i in range(BLOCK):
        dx, dy = move[0, i], move[1, i]
        scale = 1.0 / max(dx * dx + dy * dy, 1e-16)
        for axis in range(2):
            a, b = jacobian[2 * axis, i], jacobian[2 * axis + 1, i]
            surplus = (found[COM + axis, i] - com[axis, i] - a * dx - b * dy) * scale
            jacobian[2 * axis, i] = a + surplus * dx
            jacobian[2 * axis + 1, i] = b + surplus * dy
