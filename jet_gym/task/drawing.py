"""Random steps: how they are distributed, and a cheap check that they can be made.

Seen from the support foot and mirrored to a left swing, with the difficulty ``d`` from 0 to 1 and ``U`` uniform:

* start: ``x = U(-0.08, 0.08) d``, ``y = 0.225 + U(0, 0.12) d``, ``z = U(-0.03, 0.03) d`` m;
* landing: at the angle ``U(-100, 100)`` degrees from straight aside (90 is straight ahead, -90 straight back) and
  the distance ``0.225 + U(0, 0.575) d`` m, its height ``U(-0.06, 0.06) d`` m, or that of the start where the two
  cartons would overlap;
* apex ``U(0.05, 0.12)`` m above the chord; 30 to 60 swing points, equally likely; either leg.

A draw is refused and repeated if the feet would overlap, if start and landing are closer than 50 mm, or if the
check finds no posture at the start, half way or at the landing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from jet_gym.balance import BalanceSettings, Stance
from jet_gym.courses import CARTON_LENGTH, CARTON_WIDTH
from jet_gym.fitness import FitnessSettings
from jet_gym.leg import SIDES, Leg, Vector
from jet_gym.posture_state import posture_at
from jet_gym.robot import Robot, jet_hr1
from jet_gym.single_support import SingleSupport, hip_from_ankle, single_support, stance_between, straight_length
from jet_gym.step import NOMINAL_KNEE_BEND, Step
from jet_gym.swing_path import PATH_CHECKS, feet_apart, nominal_pelvis
from jet_gym.task.lanes import (
    APEX,
    ATTITUDE,
    LANDING,
    PELVIS,
    POINT,
    POINTS,
    SIDE,
    START,
    SUPPORT,
    THRUST,
    VIOLATED,
    Lanes,
    lay_arc,
    swing_sole,
    three,
)
from jet_gym.task.packing import TaskNumbers, pack, unpack
from jet_gym.task.settings import TaskSettings
from jet_gym.utils.arrays import Array
from jet_gym.utils.compilation import entry_point, inlined

TRIES = 8  # draws that one block of random numbers holds
NUMBERS = 10  # of one draw; the last is not used, and dropping it would change every drawn step
LEAST_DRAWN_POINTS, MOST_DRAWN_POINTS = 30, 60

_STANCE = 0.225  # [m] between the soles, aside: the paper's Fig. 5
_FURTHEST = 0.8  # [m] from the support sole to the landing
_WIDEST = math.radians(100.0)
_LEAST_STEP = 0.05  # [m]
_HEIGHTS = 8  # that the check tries
_THRUSTS = 6  # likewise
_CORRECTIONS = 4  # of the pelvis, for each height and thrust

_feet_apart, _nominal_pelvis = inlined(feet_apart), inlined(nominal_pelvis)


class Drawer(Protocol):
    """Begins steps in lanes."""

    def draw(self, lanes: Lanes, selected: NDArray[np.int64], generators: Sequence[np.random.Generator]) -> None:
        """Begin a step in each selected lane; see :meth:`StepDrawer.draw`."""


class StepDrawer:
    """Begins random feasible steps in lanes, each from its own generator.

    Args:
        robot: The robot.
        balance: What counts as balanced.
        difficulty: From 0 to 1.
    """

    def __init__(self, robot: Robot, balance: BalanceSettings, difficulty: float) -> None:
        hip = robot.left.hip
        unused = FitnessSettings().parameters(), TaskSettings().parameters()
        self._numbers = (
            np.array([pack(TaskNumbers(single_support(robot, swing, balance), *unused)) for swing in SIDES]),
            difficulty,
            math.hypot(hip[0], hip[1]),
            NOMINAL_KNEE_BEND * robot.leg_length,
        )

    def draw(self, lanes: Lanes, selected: NDArray[np.int64], generators: Sequence[np.random.Generator]) -> None:
        """Begin a step in each selected lane.

        Args:
            lanes: The lanes.
            selected: Which lanes (M,).
            generators: Their sources of random numbers, M of them; a lane's steps depend on its own alone.
        """
        waiting = np.arange(len(selected))
        while len(waiting):
            uniform = np.empty((len(waiting), TRIES, NUMBERS))
            for row, which in zip(uniform, waiting.tolist(), strict=True):
                generators[which].random(out=row)
            drawn = np.zeros(len(waiting), dtype=np.bool_)
            draw_steps(*self._numbers, uniform, lanes.array, selected[waiting], drawn)
            waiting = waiting[~drawn]


def draw_random_steps(
    count: int, seed: int, settings: BalanceSettings | None = None, difficulty: float = 1.0
) -> list[Step]:
    """Draw random steps of Jet-HR1; step number k depends on the seed and k alone.

    Args:
        count: How many.
        seed: A whole number of 0 or more.
        settings: What counts as balanced; the defaults where omitted.
        difficulty: From 0 to 1.
    """
    robot, lanes = jet_hr1(), Lanes(count)
    drawer = StepDrawer(robot, settings or BalanceSettings(), difficulty)
    drawer.draw(lanes, np.arange(count), [np.random.default_rng([seed, number]) for number in range(count)])
    return [lanes.step_of(number, robot) for number in range(count)]


@entry_point
def draw_steps(
    numbers: Array,
    difficulty: float,
    hip_offset: float,
    standing_height: float,
    uniform: Array,
    lanes: Array,
    selected: NDArray[np.int64],
    drawn: NDArray[np.bool_],
) -> None:
    """Begin the first feasible of some random steps in each selected lane.

    Args:
        numbers: The task with left and with right swing, each packed (2, ...).
        difficulty: From 0 to 1.
        hip_offset: Horizontal distance from the pelvis origin to a hip [m].
        standing_height: Height of the nominal pelvis above the soles [m].
        uniform: Uniform random numbers (M, TRIES, NUMBERS) in [0, 1).
        lanes: The lanes (N, LANE_WIDTH).
        selected: Lanes to begin (M,).
        drawn: Receives whether one of the tries was feasible (M,).
    """
    left_swings, right_swings = unpack(numbers[0]).robot, unpack(numbers[1]).robot
    for i in range(len(selected)):
        row = lanes[selected[i]]
        for attempt in range(uniform.shape[1]):
            _propose(difficulty, uniform[i, attempt], row)
            if _feasible(left_swings if row[SIDE] > 0.0 else right_swings, row):
                pelvis = _nominal_pelvis(three(row, START), three(row, SUPPORT), hip_offset, standing_height)
                row[PELVIS], row[PELVIS + 1], row[PELVIS + 2] = pelvis
                row[POINT], row[THRUST], row[VIOLATED] = 0.0, 0.0, 0.0
                row[ATTITUDE], row[ATTITUDE + 1] = 0.0, 0.0
                drawn[i] = True
                break


@inlined
def _propose(difficulty: float, u: Array, row: Array) -> None:
    """Write the step that nine random numbers stand for into a lane."""
    side = 1.0 if u[0] < 0.5 else -1.0
    support_y = -0.5 * side * _STANCE
    start_x = 0.16 * (u[1] - 0.5) * difficulty
    start_y = _STANCE + 0.12 * u[2] * difficulty
    start_z = 0.06 * (u[3] - 0.5) * difficulty
    angle = _WIDEST * (2.0 * u[4] - 1.0)
    distance = _STANCE + (_FURTHEST - _STANCE) * u[5] * difficulty
    landing_x, landing_y = distance * math.sin(angle), distance * math.cos(angle)
    cartons_overlap = (abs(landing_x - start_x) < CARTON_LENGTH) & (abs(landing_y - start_y) < CARTON_WIDTH)
    landing_z = start_z if cartons_overlap else 0.12 * (u[6] - 0.5) * difficulty
    row[SIDE] = side
    row[SUPPORT], row[SUPPORT + 1], row[SUPPORT + 2] = 0.0, support_y, 0.0
    row[START], row[START + 1], row[START + 2] = start_x, support_y + side * start_y, start_z
    row[LANDING], row[LANDING + 1], row[LANDING + 2] = landing_x, support_y + side * landing_y, landing_z
    row[APEX] = 0.05 + 0.07 * u[7]
    row[POINTS] = LEAST_DRAWN_POINTS + int((MOST_DRAWN_POINTS + 1 - LEAST_DRAWN_POINTS) * u[8])
    lay_arc(row)


@inlined
def _feasible(robot: SingleSupport, row: Array) -> bool:
    """Check a proposed step: long enough, no feet that overlap, a posture at both ends and half way."""
    start, landing, support, last = three(row, START), three(row, LANDING), three(row, SUPPORT), row[POINTS] - 1.0
    dx, dy, dz = landing[0] - start[0], landing[1] - start[1], landing[2] - start[2]
    if dx * dx + dy * dy + dz * dz < _LEAST_STEP * _LEAST_STEP:
        return False
    soles = robot.swing_leg.sole_rectangle, robot.support_leg.sole_rectangle
    checks, apart = max(int(last) + 1, PATH_CHECKS), 1e300
    for k in range(checks):
        x, y, _ = swing_sole(row, k / (checks - 1))
        apart = min(apart, _feet_apart(*soles, x - support[0], y - support[1]))
    if apart < 0.0:  # a drawn step keeps clear of what a Step may overlap by
        return False
    for point in (last, last // 2, 0.0):
        if not _posture_exists(robot, stance_between(robot, swing_sole(row, point / last), support)):
            return False
    return True


@entry_point
def _posture_exists(robot: SingleSupport, stance: Stance) -> bool:
    """Look for a posture that satisfies (8) to (11), the centre of mass between assigned ZMP and swing ankle.

    For each thrust, and each height up to where a leg is straight, the pelvis is moved a few times by what the
    centre of mass misses the place where this thrust balances it. Finding none is no proof that there is none.
    """
    balance, (zmp_x, zmp_y) = robot.balance, stance.assigned_zmp
    to_fan_x, to_fan_y = stance.fan[0] - zmp_x, stance.fan[1] - zmp_y
    to_ankle_x, to_ankle_y = stance.swing_ankle[0] - zmp_x, stance.swing_ankle[1] - zmp_y
    stretch = (to_fan_x**2 + to_fan_y**2) / max(to_ankle_x * to_fan_x + to_ankle_y * to_fan_y, 1e-9)
    for i in range(_HEIGHTS):
        for j in range(_THRUSTS):
            share = stretch * (0.02 + 0.97 * j / (_THRUSTS - 1)) * balance.max_thrust / balance.weight
            target_x, target_y = zmp_x + share * to_ankle_x, zmp_y + share * to_ankle_y
            px, py = target_x, target_y
            for _ in range(_CORRECTIONS):
                highest = min(
                    _straight_height(robot.swing_leg, stance, stance.swing_ankle, px, py),
                    _straight_height(robot.support_leg, stance, stance.support_ankle, px, py),
                )
                lowest = max(stance.swing_ankle[2], stance.support_ankle[2])
                pz = lowest + (0.995 - 0.09 * i) * (highest - lowest)
                state = posture_at(robot, stance, (px, py, pz))
                if state.violations == 0:
                    return True
                px += target_x - state.center_of_mass[0]
                py += target_y - state.center_of_mass[1]
    return False


@inlined
def _straight_height(leg: Leg, stance: Stance, ankle: Vector, px: float, py: float) -> float:
    """Return the pelvis height [m] at which a leg is straight; that of its ankle if it cannot reach."""
    dx, dy, _ = hip_from_ankle(leg, stance, ankle, (px, py, 0.0))
    length = straight_length(leg)
    return ankle[2] - leg.hip[2] + math.sqrt(max(length * length - dx * dx - dy * dy, 0.0))
