"""Which pelvis brings the centre of mass where it is to be, at a wished height: Broyden's method, in blocks.

It is searched in the plane; the height follows the wish, within what the legs allow (:mod:`jet_gym.leg_heights`).
Where they allow none, or the pelvis would have to go farther than it may, the centre of mass has to give way.

Source: Broyden, "A class of methods for solving nonlinear simultaneous equations", 1965.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from jet_gym.edge_polygon import edge_axis
from jet_gym.leg_heights import hip_heights
from jet_gym.posture_block import BLOCK, COM, GIVEN_PELVIS, Block, evaluate_block, new_block, stance_in
from jet_gym.single_support import SingleSupport, hip_from_ankle
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import inlined

_DIFFERENCE = 1e-5  # [m] of the derivatives
_YIELDING = 0.5  # of what the legs miss, in each correction: a longer step would yield more than they need
_NEAR = 5e-6  # [m] that legs may miss; the room that is kept to their limits is more
_CLOSE = 2e-8  # [m] from where the centre of mass has to be
_LONGEST = 0.05  # [m] of a correction, per axis
_LEAST_DETERMINANT = 0.05  # of the derivatives, 0.5 or so in ordinary postures


class PelvisSearch(NamedTuple):
    """A search for a block of pelvis positions, a column each."""

    block: Block  # the swing points, and the pelvis as far as it is found
    origin: Array  # (3, BLOCK) [m] where the pelvis is before
    reach: Array  # (BLOCK,) [m] how far it may go, per axis
    wished: Array  # (BLOCK,) [m] its height, if the legs allow it
    target: Array  # (2, BLOCK) [m] where the centre of mass has to be
    farther: Array  # (BLOCK,) [m] how much farther from the assigned ZMP than it was chosen
    missing: Array  # (BLOCK,) [m] what the legs miss of allowing any height, or the pelvis would go too far
    com: Array  # (2, BLOCK) [m] the centre of mass before the last move
    move: Array  # (2, BLOCK) [m] the last move of the pelvis
    jacobian: Array  # (4, BLOCK) of the centre of mass by the pelvis: xx, xy, yx, yy


@inlined
def new_pelvis_search() -> PelvisSearch:
    """Return room for a search."""
    return PelvisSearch(
        block=new_block(),
        origin=np.empty((3, BLOCK)),
        reach=np.empty(BLOCK),
        wished=np.empty(BLOCK),
        target=np.empty((2, BLOCK)),
        farther=np.empty(BLOCK),
        missing=np.empty(BLOCK),
        com=np.empty((2, BLOCK)),
        move=np.empty((2, BLOCK)),
        jacobian=np.empty((4, BLOCK)),
    )


@inlined
def differentiate(robot: SingleSupport, search: PelvisSearch) -> None:
    """Evaluate the postures, and compute the derivatives of the centre of mass by the pelvis."""
    block, jacobian = search.block, search.jacobian
    _limit_heights(robot, search)
    for axis in range(2):
        for i in range(BLOCK):
            block.given[GIVEN_PELVIS + axis, i] -= _DIFFERENCE
        _limit_heights(robot, search)
        evaluate_block(robot, block)
        for i in range(BLOCK):
            block.given[GIVEN_PELVIS + axis, i] += _DIFFERENCE
            jacobian[axis, i], jacobian[2 + axis, i] = block.found[COM, i], block.found[COM + 1, i]
    _limit_heights(robot, search)
    evaluate_block(robot, block)
    for i in range(BLOCK):
        for axis in range(2):
            jacobian[axis, i] = (block.found[COM, i] - jacobian[axis, i]) / _DIFFERENCE
            jacobian[2 + axis, i] = (block.found[COM + 1, i] - jacobian[2 + axis, i]) / _DIFFERENCE


@inlined
def give_way(search: PelvisSearch) -> None:
    """Change how far off the centre of mass is where legs do not reach, or the pelvis would go too far."""
    given, missing = search.block.given, search.missing
    for i in range(BLOCK):
        axis = edge_axis(stance_in(given, i))
        dx, dy = given[GIVEN_PELVIS, i] - search.origin[0, i], given[GIVEN_PELVIS + 1, i] - search.origin[1, i]
        too_far_x = dx - min(max(dx, -search.reach[i]), search.reach[i])
        too_far_y = dy - min(max(dy, -search.reach[i]), search.reach[i])
        back = -(axis.x * too_far_x + axis.y * too_far_y)
        search.farther[i] += _YIELDING * missing[i] if missing[i] > 0.0 else back
        missing[i] = max(missing[i], abs(too_far_x), abs(too_far_y))


@inlined
def correct(search: PelvisSearch) -> int:
    """Move the pelvis in the plane by what the centre of mass misses its target; remember both.

    Those that have arrived stay, so that what is found for one does not depend on the others in its block.

    Returns:
        How many have arrived.
    """
    given, found, _ = search.block
    com, move, jacobian, target = search.com, search.move, search.jacobian, search.target
    arrived = 0
    for i in range(BLOCK):
        com[0, i], com[1, i] = found[COM, i], found[COM + 1, i]
        missing_x, missing_y = target[0, i] - com[0, i], target[1, i] - com[1, i]
        determinant = jacobian[0, i] * jacobian[3, i] - jacobian[1, i] * jacobian[2, i]
        regular = determinant > _LEAST_DETERMINANT
        jacobian[0, i], jacobian[1, i] = (jacobian[0, i] if regular else 1.0), (jacobian[1, i] if regular else 0.0)
        jacobian[2, i], jacobian[3, i] = (jacobian[2, i] if regular else 0.0), (jacobian[3, i] if regular else 1.0)
        determinant = determinant if regular else 1.0
        stays = (abs(missing_x) + abs(missing_y) < _CLOSE) & (search.missing[i] < _NEAR)
        arrived += 1 if stays else 0
        scale = 0.0 if stays else 1.0 / determinant
        dx = (jacobian[3, i] * missing_x - jacobian[1, i] * missing_y) * scale
        dy = (jacobian[0, i] * missing_y - jacobian[2, i] * missing_x) * scale
        move[0, i], move[1, i] = min(max(dx, -_LONGEST), _LONGEST), min(max(dy, -_LONGEST), _LONGEST)
        given[GIVEN_PELVIS, i] += move[0, i]
        given[GIVEN_PELVIS + 1, i] += move[1, i]
    return arrived


@inlined
def follow(robot: SingleSupport, search: PelvisSearch) -> None:
    """Evaluate the postures after a move, and learn from it: Broyden's update of the derivatives."""
    _limit_heights(robot, search)
    evaluate_block(robot, search.block)
    found, com, move, jacobian = search.block.found, search.com, search.move, search.jacobian
    for i in range(BLOCK):
        dx, dy = move[0, i], move[1, i]
        scale = 1.0 / max(dx * dx + dy * dy, 1e-16)
        for axis in range(2):
            a, b = jacobian[2 * axis, i], jacobian[2 * axis + 1, i]
            surplus = (found[COM + axis, i] - com[axis, i] - a * dx - b * dy) * scale
            jacobian[2 * axis, i] = a + surplus * dx
            jacobian[2 * axis + 1, i] = b + surplus * dy


@inlined
def _limit_heights(robot: SingleSupport, search: PelvisSearch) -> None:
    """Set the pelvis to the wished heights [m], within what the legs allow; their reach comes first."""
    given = search.block.given
    for i in range(BLOCK):
        stance = stance_in(given, i)
        pelvis = (given[GIVEN_PELVIS, i], given[GIVEN_PELVIS + 1, i], 0.0)
        leg, ankle = robot.swing_leg, stance.swing_ankle
        dx, dy, _ = hip_from_ankle(leg, stance, ankle, pelvis)
        low, high = hip_heights(leg, dx, dy)
        least, most = ankle[2] - leg.hip[2] + low, ankle[2] - leg.hip[2] + high
        leg, ankle = robot.support_leg, stance.support_ankle
        dx, dy, _ = hip_from_ankle(leg, stance, ankle, pelvis)
        low, high = hip_heights(leg, dx, dy)
        least, most = max(least, ankle[2] - leg.hip[2] + low), min(most, ankle[2] - leg.hip[2] + high)
        given[GIVEN_PELVIS + 2, i] = min(max(search.wished[i], least), most)
        search.missing[i] = least - most
