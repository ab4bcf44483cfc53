"""From plans to a timed course: stand, shift the weight, step, change the support foot, step, stand.

The planner says where the joints are at each swing point; this module says when. Between the plans' own points and
postures of double support (:mod:`jet_gym.simulation.double_support`) the joints follow shape-preserving cubics, so
that they never overshoot what was planned; every phase begins and ends at rest, and where a joint would be faster
than its servo, time is stretched.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from jet_gym.errors import StepError
from jet_gym.leg import SIDES, Side
from jet_gym.plan import Plan
from jet_gym.robot import Robot
from jet_gym.simulation.double_support import (
    double_support_joints,
    reachable_pelvis,
    reachable_target,
    soles_after,
    soles_before,
    soles_with,
)
from jet_gym.utils.arrays import Array
from jet_gym.utils.settings import require_within

PhaseKind = Literal["stand", "shift", "motion", "transition", "finish"]

_SAMPLE_TIME = 0.01  # [s]
_SAME_PLACE = 1e-3  # [m] a step begins where the last one ended


@dataclass(frozen=True)
class CourseSettings:
    """How the plans are put into time. The paper gives 24 s for its two steps and the transition; the rest is ours.

    Attributes:
        stand_time: Time [s] that the robot stands between its feet at first.
        shift_time: Time [s] in which the pelvis goes from there to the first plan's first posture, which brings
            the weight on the support foot before the other one lifts off.
        time_scale: Duration of a motion over that of its plan [1].
        ease_time: Time [s] in which a motion gets up to speed after lift-off, and slows down before landing.
        clearance: By how much the swing foot is higher than planned [m] on the way, as far as the joints' ranges
            let it, so that it leaves its carton and comes down on the next one nearly straight, even if they are
            not as high as expected.
        clearance_time: Time [s] in which it gets there after lift-off, and comes down from there before landing.
        transition_time: Time [s] from one support foot to the other.
        finish_time: Time [s] in which the pelvis goes between the feet at the end and the thrust dies away.
        rest_time: Time [s] that the robot stands at the end.
        speed_share: Share [1] of the servos' largest speed that the joints may need.
    """

    stand_time: float = 0.5
    shift_time: float = 2.0
    time_scale: float = 0.8
    ease_time: float = 1.0
    clearance: float = 0.008
    clearance_time: float = 0.5
    transition_time: float = 3.0
    finish_time: float = 1.5
    rest_time: float = 0.5
    speed_share: float = 0.7

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed.

        Raises:
            SettingsError: A ``ValueError`` that names the setting and what it may be.
        """
        for field in dataclasses.fields(self):
            most = {"speed_share": 1.0, "clearance": 0.05}.get(field.name, 1e3)
            require_within(field.name, getattr(self, field.name), 0.0, most, above=field.name != "clearance")


@dataclass(frozen=True, eq=False)
class Phase:
    """A part of the course. Its rows are K moments, 10 ms apart or more where time is stretched.

    Attributes:
        name: What it is called, such as ``"motion 1"``.
        kind: What it is.
        plan: Index of the plan whose swing foot blows: of a transition the one that ended.
        time: Time since the phase began (K,) [s], from 0.
        joint_positions: Joint positions (K, 12) [rad].
        thrust: Feed-forward thrust of the swing foot's fan (K,) [N].
        next_thrust: Thrust of the next plan's swing foot's fan (K,) [N], for after the support foot has changed.
    """

    name: str
    kind: PhaseKind
    plan: int
    time: Array
    joint_positions: Array
    thrust: Array
    next_thrust: Array

    @property
    def duration(self) -> float:
        """How long it takes [s]."""
        return float(self.time[-1])

    def at(self, time: float) -> tuple[Array, float, float]:
        """Return joint positions (12,), thrust and the next plan's thrust at a time [s] since the phase began."""
        last = len(self.time) - 1
        row = min(max(int(np.searchsorted(self.time, time, side="right")) - 1, 0), last - 1)
        share = float(np.clip((time - self.time[row]) / (self.time[row + 1] - self.time[row]), 0.0, 1.0))

        def between(values: Array) -> Array:
            return np.asarray((1.0 - share) * values[row] + share * values[row + 1])

        return between(self.joint_positions), float(between(self.thrust)), float(between(self.next_thrust))


@dataclass(frozen=True, eq=False)
class Course:
    """Plans in time.

    Attributes:
        plans: The plans, in order.
        phases: The phases, in order.
        pelvis: Where the pelvis is at first (3,) [m].
        pelvis_yaw: Its yaw [rad].
    """

    plans: tuple[Plan, ...]
    phases: tuple[Phase, ...]
    pelvis: Array
    pelvis_yaw: float

    @property
    def duration(self) -> float:
        """How long it takes [s], if no foot is waited for."""
        return math.fsum(phase.duration for phase in self.phases)


def make_course(plans: Sequence[Plan], settings: CourseSettings | None = None) -> Course:
    """Put plans into time.

    Args:
        plans: One plan or several, each beginning where the one before it ended.
        settings: How; the defaults where omitted.

    Raises:
        ValueError: If there is no plan, or if they are for different robots.
        StepError: If a plan begins elsewhere than the one before it ended, or with the same foot.
    """
    settings = settings or CourseSettings()
    _refuse_broken_course(plans)
    first, last = plans[0], plans[-1]
    step, yaw = first.step, float(first.pelvis_yaw[0])
    pelvis = reachable_pelvis(step.robot, soles_before(step), step.nominal_pelvis, yaw)
    builder = _Builder(settings, step.robot)
    shift = builder.double_support(soles_before(step), pelvis, first.pelvis[0], yaw, yaw, settings.shift_time)
    phases = [
        builder.stand("stand", "stand", 0, shift[1][0], settings.stand_time),
        _phase("shift", "shift", 0, *shift, first.thrust[0] * _shares(shift[0])),
    ]
    for k, plan in enumerate(plans):
        phases.append(builder.motion(f"motion {k + 1}", k, plan))
        if k + 1 < len(plans):
            phases.append(builder.transition(f"transition {k + 1}", k, plan, plans[k + 1]))
    phases.append(builder.finish(len(plans) - 1, last))
    phases.append(
        builder.stand("rest", "finish", len(plans) - 1, phases[-1].joint_positions[-1], settings.rest_time)
    )
    return Course(tuple(plans), tuple(phases), pelvis, yaw)


class _Builder:
    """Makes phases."""

    def __init__(self, settings: CourseSettings, robot: Robot) -> None:
        self._settings = settings
        self._robot = robot

    def stand(self, name: str, kind: PhaseKind, plan: int, joints: Array, duration: float) -> Phase:
        time = np.array([0.0, duration])
        return _phase(name, kind, plan, time, np.tile(joints, (2, 1)), np.zeros(2))

    def motion(self, name: str, index: int, plan: Plan) -> Phase:
        """Follow a plan from rest to rest."""
        from scipy.interpolate import PchipInterpolator

        duration = self._settings.time_scale * plan.step.duration
        time = _grid(duration)
        along = plan.time[-1] * _eased(time / duration, min(self._settings.ease_time / duration, 0.5))
        joints = PchipInterpolator(plan.time, plan.joint_positions)(along)
        rise = min(self._settings.clearance_time, 0.5 * duration)
        raised = self._settings.clearance * _smooth(time / rise) * _smooth((duration - time) / rise)
        joints = joints + self._bend(plan, along, raised)
        joints = np.clip(joints, self._robot.lower, self._robot.upper)
        thrust = PchipInterpolator(plan.time, plan.thrust)(along)
        return _phase(name, "motion", index, self._stretched(time, joints), joints, thrust)

    def _bend(self, plan: Plan, along: Array, raised: Array) -> Array:
        """Return by how much the joints (K, 12) [rad] raise the swing sole (K,) [m] at times (K,) of a plan."""
        from scipy.interpolate import PchipInterpolator

        path = np.column_stack([plan.pelvis, np.unwrap(plan.pelvis_yaw), plan.swing_sole])
        path = PchipInterpolator(plan.time, path)(along)
        pelvis, yaw, sole = path[:, :3], path[:, 3], path[:, 4:]
        higher = sole + raised[:, None] * [0.0, 0.0, 1.0]
        joints = [
            double_support_joints(self._robot, soles_with(plan.step, place), pelvis, yaw)[0]
            for place in (higher, sole)
        ]
        return joints[0] - joints[1]

    def transition(self, name: str, index: int, plan: Plan, following: Plan) -> Phase:
        """Move the pelvis from one support to the other; one fan dies away before the other's rises."""
        time, joints = self.double_support(
            soles_before(following.step),
            plan.pelvis[-1],
            following.pelvis[0],
            float(plan.pelvis_yaw[-1]),
            float(following.pelvis_yaw[0]),
            self._settings.transition_time,
        )
        share = time / time[-1]
        fading = plan.thrust[-1] * (1.0 - _smooth(2.0 * share))
        rising = following.thrust[0] * _smooth(2.0 * share - 1.0)
        return _phase(name, "transition", index, time, joints, fading, rising)

    def finish(self, index: int, plan: Plan) -> Phase:
        """Move the pelvis between the feet while the thrust dies away."""
        yaw = float(plan.pelvis_yaw[-1])
        soles = soles_after(plan.step)
        middle = 0.5 * (np.asarray(plan.step.landing) + np.asarray(plan.step.support))
        # The centre of mass goes between the feet; from there to the pelvis it is as far as at landing.
        target = np.append(middle[:2] + plan.pelvis[-1, :2] - plan.com[-1, :2], plan.pelvis[-1, 2])
        target = reachable_target(self._robot, soles, plan.pelvis[-1], target, yaw)
        time, joints = self.double_support(soles, plan.pelvis[-1], target, yaw, yaw, self._settings.finish_time)
        return _phase("finish", "finish", index, time, joints, plan.thrust[-1] * (1.0 - _shares(time)))

    def double_support(
        self,
        soles: dict[Side, ArrayLike],
        pelvis: Array,
        target: Array,
        yaw: float,
        target_yaw: float,
        duration: float,
    ) -> tuple[Array, Array]:
        """Return times (K,) and joints (K, 12) of a pelvis that moves over planted soles."""
        time = _grid(duration)
        share = _smooth(time / duration)
        turn = math.remainder(target_yaw - yaw, math.tau)
        path = pelvis + share[:, None] * (target - pelvis)
        joints, _ = double_support_joints(self._robot, soles, path, yaw + share * turn)
        joints = np.clip(joints, self._robot.lower, self._robot.upper)
        return self._stretched(time, joints), joints

    def _stretched(self, time: Array, joints: Array) -> Array:
        """Stretch times (K,) where a joint would be too fast."""
        speed_limit = self._settings.speed_share * self._robot.velocity
        needed = (np.abs(np.diff(joints, axis=0)) / speed_limit).max(axis=1)
        return np.concatenate([[0.0], np.cumsum(np.maximum(np.diff(time), needed))])


def _phase(
    name: str,
    kind: PhaseKind,
    plan: int,
    time: Array,
    joints: Array,
    thrust: Array,
    next_thrust: Array | None = None,
) -> Phase:
    return Phase(
        name, kind, plan, time, joints, thrust, np.zeros(len(time)) if next_thrust is None else next_thrust
    )


def _grid(duration: float) -> Array:
    return np.linspace(0.0, duration, max(math.ceil(duration / _SAMPLE_TIME), 1) + 1)


def _smooth(share: Array) -> Array:
    """Go from 0 to 1 with speed and acceleration zero at both ends: the polynomial of least jerk."""
    s = np.clip(share, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s**2))


def _shares(time: Array) -> Array:
    return _smooth(time / time[-1])


def _eased(share: Array, ramp: float) -> Array:
    """Go from 0 to 1 with constant speed but for ramps of a share of the time at both ends, smooth in speed."""
    up = np.clip(share / ramp, 0.0, 1.0)
    down = np.clip((1.0 - share) / ramp, 0.0, 1.0)
    # Integrals of the smooth step 3 u^2 - 2 u^3.
    starting, ending = up**3 - 0.5 * up**4, 0.5 - (down**3 - 0.5 * down**4)
    distance = ramp * (starting + ending) + np.clip(share - ramp, 0.0, 1.0 - 2.0 * ramp)
    return np.asarray(distance / (1.0 - ramp))


def _refuse_broken_course(plans: Sequence[Plan]) -> None:
    if not plans:
        raise ValueError("a course needs at least one plan")
    for k, (before, after) in enumerate(itertools.pairwise(plans), start=2):
        if after.step.robot is not before.step.robot:
            raise ValueError(f"plan {k} is for another robot than the one before it")
        ends, begins = soles_after(before.step), soles_before(after.step)
        for side in SIDES:
            if math.dist(np.asarray(ends[side]), np.asarray(begins[side])) > _SAME_PLACE:
                raise StepError(
                    f"plan {k} begins with the {side} sole at {_place(begins[side])} m, "
                    f"but the plan before it leaves it at {_place(ends[side])} m"
                )
        if after.step.swing == before.step.swing:
            raise StepError(f"plan {k} swings the {after.step.swing} foot again; the steps of a course take turns")


def _place(sole: object) -> str:
    return "(" + ", ".join(f"{value:g}" for value in np.asarray(sole, dtype=np.float64).tolist()) + ")"
