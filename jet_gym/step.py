"""One step of the robot: which foot swings, from where to where, past which support foot."""

from __future__ import annotations

import math
import numbers
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from jet_gym.errors import StepError
from jet_gym.leg import SIDES, Side, Vector, opposite
from jet_gym.robot import Robot, jet_hr1
from jet_gym.swing_path import PATH_CHECKS, Arc, arc_of, arc_points, feet_apart, nominal_pelvis
from jet_gym.utils.arrays import Array

NOMINAL_KNEE_BEND = 0.9  # height of the nominal pelvis above the soles over the leg length
_LEAST_STEP = 1e-3  # [m] start and landing closer than this are one place
_FARTHEST = 100.0  # [m] from the world's origin
_LOWEST_APEX = 1e-4  # [m]
MOST_POINTS = 100_000
LARGEST_OVERLAP = 1e-4  # [m] feet that overlap by no more only touch


@dataclass(frozen=True)
class Step:
    """A step: the swing sole moves on an arc of a circle while the support sole stays.

    The arc lies in the vertical plane through start and landing and rises ``apex`` above the chord between
    them; the swing points are equally spaced in arc angle. If the landing is straight above or below the
    start, the arc bulges away from the support foot. Positions are those of the sole frames, in the world.

    Attributes:
        swing: The leg that swings, ``"left"`` or ``"right"``.
        start: Where the swing sole leaves (x, y, z) [m].
        landing: Where it lands (x, y, z) [m].
        support: Where the support sole stands (x, y, z) [m].
        apex: Height of the arc's middle above the chord [m].
        points: Number of swing points, both ends included.
        duration: Time from the first to the last swing point [s]. The paper's two steps and the transition
            between them take 24 s; 10 s a step leaves 4 s for the transition (estimated).
        robot: The robot that steps; Jet-HR1 where omitted.
    """

    swing: Side
    start: Vector
    landing: Vector
    support: Vector
    apex: float = 0.08
    points: int = 30
    duration: float = 10.0
    robot: Robot = field(default_factory=jet_hr1, repr=False)

    def __post_init__(self) -> None:
        """Refuse a step that makes no sense.

        Raises:
            StepError: A ``ValueError`` that says what is wrong.
        """
        if self.swing not in SIDES:
            raise StepError(f"swing must be 'left' or 'right', not {self.swing!r}")
        for name in ("start", "landing", "support"):
            object.__setattr__(self, name, _position(getattr(self, name), name))
        for name, least, most in (("apex", _LOWEST_APEX, _FARTHEST), ("duration", 1e-3, 1e6)):
            value = _number(getattr(self, name), name)
            if not least <= value <= most:
                raise StepError(f"{name} must lie between {least:g} and {most:g}, not {value:g}")
            object.__setattr__(self, name, value)
        if isinstance(self.points, bool) or not isinstance(self.points, int | np.integer) or self.points < 2:
            raise StepError(f"points must be a whole number of 2 or more, not {self.points!r}")
        if self.points > MOST_POINTS:
            raise StepError(f"points must be {MOST_POINTS} or fewer, not {self.points}")
        object.__setattr__(self, "points", int(self.points))
        if math.dist(self.start, self.landing) < _LEAST_STEP:
            raise StepError(f"start and landing are the same place, {self.start} m")
        self._refuse_overlapping_feet()

    @property
    def arc(self) -> Arc:
        """The arc of the swing sole."""
        return arc_of(self.start, self.landing, self.apex, 1.0 if self.swing == "left" else -1.0)

    @property
    def swing_sole(self) -> Array:
        """Positions of the swing sole at the swing points (points, 3) [m]."""
        arc, last = self.arc, self.points - 1
        return arc_points(arc, np.arange(self.points) / last)

    @property
    def time(self) -> Array:
        """Time of each swing point (points,) [s]."""
        return np.linspace(0.0, self.duration, self.points)

    @property
    def nominal_pelvis(self) -> Array:
        """Centre of the first search (3,) [m], see :func:`jet_gym.swing_path.nominal_pelvis`."""
        hip = self.robot.leg(opposite(self.swing)).hip
        standing_height = NOMINAL_KNEE_BEND * self.robot.leg_length
        return np.array(nominal_pelvis(self.start, self.support, math.hypot(hip[0], hip[1]), standing_height))

    def require_robot(self, robot: Robot) -> None:
        """Refuse to be a step of another robot, or of one that was read from another file.

        Raises:
            StepError: With the files of both.
        """
        if self.robot is not robot:
            raise StepError(f"the step is of the robot of {self.robot.urdf_path}, not of that of {robot.urdf_path}")

    def to_dict(self) -> dict[str, Any]:
        """Return the step as plain data, for JSON."""
        return {
            "swing": self.swing,
            "start": list(self.start),
            "landing": list(self.landing),
            "support": list(self.support),
            "apex": self.apex,
            "points": self.points,
            "duration": self.duration,
        }

    def _refuse_overlapping_feet(self) -> None:
        swing_leg = self.robot.leg(self.swing)
        support_leg = self.robot.leg(opposite(self.swing))
        arc, checks = self.arc, max(self.points, PATH_CHECKS)
        path = arc_points(arc, np.arange(checks) / (checks - 1))
        support = np.array(self.support)
        dx, dy = (path - support)[:, 0], (path - support)[:, 1]
        overlap = -feet_apart(swing_leg.sole_rectangle, support_leg.sole_rectangle, dx, dy)
        worst = int(np.argmax(overlap))
        if overlap[worst] > LARGEST_OVERLAP:
            where = {0: "at the start", checks - 1: "at the landing"}.get(worst, "on the way")
            raise StepError(
                f"the feet overlap {where}: the swing sole at "
                f"({path[worst, 0]:.3g}, {path[worst, 1]:.3g}) m reaches {1e3 * overlap[worst]:.3g} mm into "
                f"the space of the support foot at ({support[0]:.3g}, {support[1]:.3g}) m"
            )


def _number(value: Any, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise StepError(f"{name} must be a number, not {value!r}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise StepError(f"{name} must be finite, not {number}")
    return number


def _position(value: Sequence[float], name: str) -> Vector:
    given = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(given, list | tuple) or len(given) != 3:
        raise StepError(f"{name} must be three numbers x, y, z in m, not {value!r}")
    x, y, z = (_number(number, name) for number in given)
    if max(map(abs, (x, y, z))) > _FARTHEST:
        raise StepError(f"{name} must be within {_FARTHEST:g} m of the origin, not {(x, y, z)}")
    return x, y, z
