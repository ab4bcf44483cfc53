"""Many episodes side by side, each a lane: the state of the task, a row of one array a lane.

The single environment is one lane, the batch is thousands; both run the same compiled functions on this array, so
that they agree to the last bit. Compiled code takes one array in no time, and many slowly.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jet_gym.leg import Vector
from jet_gym.robot import Robot
from jet_gym.step import Step
from jet_gym.swing_path import arc_of
from jet_gym.trigonometry import sine_cosine
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import inlined

# Columns of the array; three of them where it is a position or a vector.
SIDE, START, LANDING, SUPPORT, APEX, POINTS, POINT = 0, 1, 4, 7, 10, 11, 12
PELVIS, THRUST, VIOLATED, ATTITUDE = 13, 16, 17, 18
ARC_CENTER, ARC_ALONG, ARC_UP, ARC_HALF_ANGLE = 20, 23, 26, 29
LANE_WIDTH = 30

_compiled_arc_of = inlined(arc_of)


class Lanes:
    """State of N lanes, in the world frame: one array and views of it.

    Args:
        count: Number of lanes; none of them has an episode yet.

    Attributes:
        array: All of it (N, LANE_WIDTH).
        side: +1 where the left leg swings, -1 where the right one does (N,).
        start: Swing sole at the start (N, 3) [m].
        landing: Swing sole at the landing (N, 3) [m].
        support: Support sole (N, 3) [m].
        apex: Height of the arc's middle above its chord (N,) [m].
        points: Number of swing points (N,); 0 before the first episode.
        point: The swing point that the next action chooses a posture for (N,).
        pelvis: The last pelvis; the nominal one before the first action (N, 3) [m].
        thrust: The last thrust asked for (N,) [N].
        violated: 1 where a constraint was violated at any point so far, else 0 (N,).
        attitude: Measured roll and pitch of the pelvis, about its own axes (N, 2) [rad].
    """

    def __init__(self, count: int) -> None:
        array = np.zeros((count, LANE_WIDTH))
        self.array: Array = array
        self.side: Array = array[:, SIDE]
        self.start: Array = array[:, START : START + 3]
        self.landing: Array = array[:, LANDING : LANDING + 3]
        self.support: Array = array[:, SUPPORT : SUPPORT + 3]
        self.apex: Array = array[:, APEX]
        self.points: Array = array[:, POINTS]
        self.point: Array = array[:, POINT]
        self.pelvis: Array = array[:, PELVIS : PELVIS + 3]
        self.thrust: Array = array[:, THRUST]
        self.violated: Array = array[:, VIOLATED]
        self.attitude: Array = array[:, ATTITUDE : ATTITUDE + 2]

    def begin(self, selected: NDArray[np.int64], step: Step) -> None:
        """Set selected lanes to the beginning of a step."""
        row = np.zeros(LANE_WIDTH)
        row[SIDE] = 1.0 if step.swing == "left" else -1.0
        row[START : START + 3], row[LANDING : LANDING + 3], row[SUPPORT : SUPPORT + 3] = (
            step.start, step.landing, step.support,
        )  # fmt: skip
        row[APEX], row[POINTS] = step.apex, step.points
        row[PELVIS : PELVIS + 3] = step.nominal_pelvis
        arc = step.arc
        row[ARC_CENTER : ARC_CENTER + 3], row[ARC_ALONG : ARC_ALONG + 3] = arc.center, arc.along
        row[ARC_UP : ARC_UP + 3], row[ARC_HALF_ANGLE] = arc.up, arc.half_angle
        self.array[selected] = row

    def step_of(self, lane: int, robot: Robot) -> Step:
        """Return the step of a lane."""
        start, landing, support = (
            (float(x), float(y), float(z)) for x, y, z in (self.start[lane], self.landing[lane], self.support[lane])
        )
        return Step(
            "left" if self.side[lane] > 0.0 else "right",
            start,
            landing,
            support,
            apex=float(self.apex[lane]),
            points=int(self.points[lane]),
            robot=robot,
        )


@inlined
def lay_arc(row: Array) -> None:
    """Find the arc of a lane's swing sole from start, landing and apex."""
    start, landing = (
        (row[START], row[START + 1], row[START + 2]),
        (row[LANDING], row[LANDING + 1], row[LANDING + 2]),
    )
    arc = _compiled_arc_of(start, landing, row[APEX], row[SIDE])
    for axis in range(3):
        row[ARC_CENTER + axis] = arc.center[axis]
        row[ARC_ALONG + axis] = arc.along[axis]
        row[ARC_UP + axis] = arc.up[axis]
    row[ARC_HALF_ANGLE] = arc.half_angle


@inlined
def swing_sole(row: Array, fraction: float) -> Vector:
    """Return a lane's swing sole at a fraction of its arc, exactly start and landing at the ends and beyond.

    What :func:`~jet_gym.swing_path.arc_points` does, in straight-line arithmetic. ``row`` may be a column of lanes.
    """
    s, c = sine_cosine(row[ARC_HALF_ANGLE] * (2.0 * min(max(fraction, 0.0), 1.0) - 1.0))
    before, after = fraction <= 0.0, fraction >= 1.0
    x = row[ARC_CENTER] + s * row[ARC_ALONG] + c * row[ARC_UP]
    y = row[ARC_CENTER + 1] + s * row[ARC_ALONG + 1] + c * row[ARC_UP + 1]
    z = row[ARC_CENTER + 2] + s * row[ARC_ALONG + 2] + c * row[ARC_UP + 2]
    x = row[START] if before else row[LANDING] if after else x
    y = row[START + 1] if before else row[LANDING + 1] if after else y
    z = row[START + 2] if before else row[LANDING + 2] if after else z
    return x, y, z


@inlined
def three(row: Array, column: int) -> Vector:
    """Return three numbers of a lane, or of another array, from a place on."""
    return row[column], row[column + 1], row[column + 2]


@inlined
def lanes_of_side(lanes: Array, selected: NDArray[np.int64], side: float) -> NDArray[np.int64]:
    """Return those of the selected lanes whose swing leg is of one side."""
    chosen, count = np.empty(len(selected), np.int64), 0
    for lane in selected:
        if lanes[lane, SIDE] == side:
            chosen[count] = lane
            count += 1
    return chosen[:count]


@inlined
def gather(lanes: Array, selected: NDArray[np.int64], start: int, count: int, block: Array) -> None:
    """Copy some lanes into the columns of a block."""
    for column in range(count):
        lane = selected[start + column]
        for row in range(LANE_WIDTH):
            block[row, column] = lanes[lane, row]
