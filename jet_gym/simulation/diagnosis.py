"""What an execution comes to: extremes, whether the robot did as planned, and if not, when and why."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jet_gym.leg import SIDES, Side, opposite
from jet_gym.plan import Plan
from jet_gym.robot import Robot
from jet_gym.simulation.double_support import soles_after
from jet_gym.simulation.landing import Landing, find_landings
from jet_gym.simulation.support import nearest_edge
from jet_gym.utils.arrays import Array

_UPRIGHT = math.radians(3.0)  # a robot that falls was last upright when it tilted by less
_BEFORE, _AFTER = 0.5, 0.1  # [s] around that moment the cause is looked for
_AT_LIMIT = 0.99
_SLID = 0.01  # [m] in the time around a fall
_ON_EDGE = 0.003  # [m] a ZMP this close to the edge of the soles means that the robot tips

Series = Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class Summary:
    """What an execution comes to.

    Attributes:
        success: Whether the robot made all steps as planned: it stands, each foot touched down within a tolerance
            of its place and ends there, and no support foot slid further than allowed.
        fallen: Whether it fell.
        outcome: One sentence that says so, or when it failed and which foot or limit gave way.
        cause: In a word or two what gave way first, such as ``"left foot"`` or ``"thrust limit"``; empty on
            success.
        landings: Where and when each swing foot touched down.
        duration: Simulated time [s].
        peak_thrust: Largest thrust that a fan delivered [N].
        mean_thrust: Mean of the thrust that both fans delivered together while a foot was in the air [N].
        worst_tilt: Largest tilt of the pelvis [rad].
        least_zmp_margin: Least distance of the ZMP from the edge of the soles that carry the robot [m].
        low_zmp_margin: The distance that it falls below for 1 % of the time [m].
        worst_slip: How far a support sole slid at most [m].
        touchdown_error: Largest distance of a sole from its planned place as it touches down [m].
        earliest_touchdown: How long before the end of its motion a foot touched down at most [s].
        landing_error: Largest distance of a sole from where it should be at the end [m].
        peak_torques: Largest magnitude of each servo's torque (12,) [N m].
        torque_limits: What each may be (12,) [N m].
    """

    success: bool
    fallen: bool
    outcome: str
    cause: str
    landings: tuple[Landing, ...]
    duration: float
    peak_thrust: float
    mean_thrust: float
    worst_tilt: float
    least_zmp_margin: float
    low_zmp_margin: float
    worst_slip: float
    touchdown_error: float
    earliest_touchdown: float
    landing_error: float
    peak_torques: Array
    torque_limits: Array

    @property
    def verdict(self) -> str:
        """The outcome in a few words, for tables."""
        if self.success:
            return "stands"
        return f"{'fell' if self.fallen else 'not as planned'}: {self.cause}"


@dataclass(frozen=True)
class Demands:
    """What is asked of an execution.

    Attributes:
        landing_tolerance: Largest distance of a foot from its planned place [m], at touchdown and at the end.
        slip_tolerance: Largest distance that a support foot may slide [m].
        least_force: Vertical force [N] from which on a foot has touched down.
    """

    landing_tolerance: float
    slip_tolerance: float
    least_force: float


@dataclass(frozen=True)
class Failure:
    """Why an execution ended before its course did.

    Attributes:
        reason: In a few words.
        fallen: Whether the robot fell; if not, it was given up.
        foot: The swing foot then.
    """

    reason: str
    fallen: bool
    foot: Side


def summarize(plans: Sequence[Plan], series: Series, failure: Failure | None, demands: Demands) -> Summary:
    """Summarize an execution.

    Args:
        plans: What was executed.
        series: The series of :class:`~jet_gym.simulation.history.Execution` by name.
        failure: Why it ended early, if it did.
        demands: What is asked of it.
    """
    robot = plans[0].step.robot
    errors = _landing_errors(plans[-1], series)
    landings = find_landings(plans, series, demands.least_force, demands.landing_tolerance)
    cause, sentence = _judge(robot, series, failure, landings, errors, demands)
    time = series["time"]
    thrust, margin = series["thrust_delivered"], series["zmp_margin"]
    airborne = np.isin(series["phase"], [name for name in np.unique(series["phase"]) if name.startswith("motion")])
    known = margin[np.isfinite(margin)]
    return Summary(
        success=not cause,
        fallen=failure is not None and failure.fallen,
        outcome=sentence or f"the robot made {_count(len(plans))} in {time[-1]:.1f} s and stands",
        cause=cause,
        landings=landings,
        duration=float(time[-1]),
        peak_thrust=float(thrust.max()),
        mean_thrust=float(thrust[airborne].sum(axis=1).mean()) if airborne.any() else 0.0,
        worst_tilt=float(np.nanmax(series["tilt"])),
        least_zmp_margin=float(known.min()) if known.size else math.nan,
        low_zmp_margin=float(np.percentile(known, 1.0)) if known.size else math.nan,
        worst_slip=float(np.nanmax(series["slip"])),
        touchdown_error=max((landing.distance for landing in landings), default=math.nan),
        earliest_touchdown=max((landing.early for landing in landings), default=math.nan),
        landing_error=max(errors.values()),
        peak_torques=series["joint_torques"].max(axis=0),
        torque_limits=robot.effort,
    )


def _judge(
    robot: Robot,
    series: Series,
    failure: Failure | None,
    landings: Sequence[Landing],
    errors: Mapping[Side, float],
    demands: Demands,
) -> tuple[str, str]:
    """Return what gave way first in a word or two, and a sentence; both are empty if all is as demanded."""
    mishaps = _mishaps(robot, series, landings, demands)
    if failure is not None:
        if failure.fallen:
            onset, cause, sentence = explain_fall(robot, series, failure.reason)
            before = [mishap for mishap in mishaps if series["plan"][mishap[0]] < series["plan"][onset]]
        else:
            cause, before = f"{failure.foot} foot", mishaps
            sentence = f"{failure.reason}, {_when(series, len(series['time']) - 1)}"
        if before:
            _, cause, first = before[0]
            sentence += f"; before that, {first}"
        return cause, sentence
    if mishaps:
        return mishaps[0][1:]
    for side, error in errors.items():
        if not error <= demands.landing_tolerance:
            return f"{side} foot misplaced", f"the {side} foot ended {1e3 * error:.0f} mm from its place"
    return "", ""


def _mishaps(
    robot: Robot, series: Series, landings: Sequence[Landing], demands: Demands
) -> list[tuple[int, str, str]]:
    """Return row, cause and sentence of what went wrong without a fall, in order of time."""
    found = [
        (landing.row, *_explain_landing(robot, series, landing))
        for landing in landings
        if not landing.distance <= demands.landing_tolerance
    ]
    slid = np.flatnonzero(series["slip"] > demands.slip_tolerance)
    if len(slid):
        row = int(slid[0])
        foot = "right" if series["swing_is_left"][row] else "left"
        sentence = f"the {foot} foot slid by more than {1e3 * demands.slip_tolerance:.0f} mm {_when(series, row)}"
        found.append((row, f"{foot} foot slip", sentence))
    return sorted(found)


def _explain_landing(robot: Robot, series: Series, landing: Landing) -> tuple[str, str]:
    """Return what gave way, and a sentence, of a foot that touched down in the wrong place."""
    time = series["time"]
    window = (time >= landing.time - _BEFORE) & (time <= landing.time)
    swing = landing.side
    support = opposite(swing)
    cause, how = _what_gave_way(robot, series, window, support, swing)
    sentence = (
        f"the {swing} foot touched down {1e3 * landing.distance:.0f} mm from its place "
        f"{_when(series, landing.row)}" + (f", {landing.early:.1f} s early" if landing.early > 0.05 else "")
    )
    margin = series["zmp_margin"][window]
    if cause == f"{support} foot" and np.nanmin(margin, initial=math.inf) > _ON_EDGE:
        return f"{swing} foot misplaced", sentence
    return cause, f"{sentence}: {how}"


def _when(series: Series, row: int) -> str:
    return f"at {series['time'][row]:.1f} s, in {series['phase'][row]}"


def explain_fall(robot: Robot, series: Series, failure: str) -> tuple[int, str, str]:
    """Return when the fall began, what gave way in a word or two, and a sentence that says when, where and how.

    Time and phase are those in which the world said so; if the robot was upright for the last time in an earlier
    phase, then that is told, too. What counts as the cause is what happened just before that moment: a servo at the
    limit of its torque, the fan at that of its thrust, a support foot that slid, and else a foot that tipped over
    its edge.

    Args:
        robot: The robot.
        series: The series by name.
        failure: What the world says of it.

    Returns:
        The row in which the robot was upright for the last time, the cause and the sentence.
    """
    time = series["time"]
    upright = np.flatnonzero(series["tilt"] < _UPRIGHT)
    onset = int(upright[-1]) if upright.size else 0
    window = (time >= time[onset] - _BEFORE) & (time <= time[onset] + _AFTER)
    support: Side = "right" if series["swing_is_left"][onset] else "left"
    swing = opposite(support)
    cause, how = _what_gave_way(robot, series, window, support, swing)
    when = _when(series, len(time) - 1)
    if upright.size and series["phase"][onset] != series["phase"][-1]:
        when += f", upright until {time[onset]:.1f} s, in {series['phase'][onset]}"
    return onset, cause, f"the robot fell {when}: {how} ({failure})"


def _what_gave_way(robot: Robot, series: Series, window: Array, support: Side, swing: Side) -> tuple[str, str]:
    torques = series["joint_torques"][window].max(axis=0) / robot.effort
    if torques.max() >= _AT_LIMIT:
        joint = robot.joint_names[int(torques.argmax())].replace("_", " ")
        return f"{joint} torque", f"the {joint} servo was at its limit of {robot.effort[torques.argmax()]:.1f} N m"
    fan = robot.fans[0 if swing == "left" else 1]
    if series["thrust_commanded"][window].max() >= _AT_LIMIT * fan.max_thrust:
        return "thrust limit", f"the {swing} fan was at its limit of {fan.max_thrust:.0f} N"
    slip = series["slip"][window]
    if np.ptp(slip) > _SLID:
        return f"{support} foot slip", f"the {support} foot slid by {1e3 * np.ptp(slip):.0f} mm"
    margin = np.where(np.isfinite(series["zmp_margin"][window]), series["zmp_margin"][window], math.inf)
    worst = int(np.flatnonzero(window)[int(margin.argmin())])
    sole = series["soles"][worst, 0 if support == "left" else 1]
    if not np.isfinite(series["zmp"][worst]).all():
        return f"{support} foot", f"the {support} foot lost the ground"
    edge = nearest_edge(series["zmp"][worst], robot, support, sole)
    return f"{support} foot", f"the {support} foot tipped over its {edge} edge"


def _landing_errors(plan: Plan, series: Series) -> dict[Side, float]:
    """Return how far each sole is from where it should be at the end [m], seen from above."""
    places = soles_after(plan.step)
    ended = series["soles"][-1]
    return {side: math.dist(ended[k, :2], np.asarray(places[side])[:2]) for k, side in enumerate(SIDES)}


def _count(steps: int) -> str:
    return "one step" if steps == 1 else f"{steps} steps"
