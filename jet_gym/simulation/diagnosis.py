"""What an execution comes to: extremes, whether the robot stands, and if not, when and why it fell."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jet_gym.leg import SIDES, Side
from jet_gym.plan import Plan
from jet_gym.robot import Robot
from jet_gym.simulation.double_support import soles_after
from jet_gym.simulation.support import nearest_edge
from jet_gym.urdf import Array

OFF_ITS_CARTON = 0.03  # [m] a sole that is this far from its place has slid off its carton
_UPRIGHT = math.radians(3.0)  # a robot that falls was last upright when it tilted by less
_BEFORE, _AFTER = 0.5, 0.1  # [s] around that moment the cause is looked for
_AT_LIMIT = 0.99
_SLID = 0.01  # [m]

Series = Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class Summary:
    """What an execution comes to.

    Attributes:
        success: Whether the robot made all steps and stands on its cartons.
        outcome: One sentence that says so, or when it fell and which foot or limit gave way.
        cause: In a word or two what gave way, such as ``"left foot"`` or ``"thrust limit"``; empty on success.
        duration: Simulated time [s].
        peak_thrust: Largest thrust that a fan delivered [N].
        mean_thrust: Mean of the thrust that both fans delivered together while a foot was in the air [N].
        worst_tilt: Largest tilt of the pelvis [rad].
        least_zmp_margin: Least distance of the ZMP from the edge of the soles that carry the robot [m].
        low_zmp_margin: The distance that it falls below for 1 % of the time [m].
        worst_slip: How far a support sole slid at most [m].
        landing_error: Largest distance of a sole from where it should be at the end [m].
        peak_torques: Largest magnitude of each servo's torque (12,) [N m].
        torque_limits: What each may be (12,) [N m].
    """

    success: bool
    outcome: str
    cause: str
    duration: float
    peak_thrust: float
    mean_thrust: float
    worst_tilt: float
    least_zmp_margin: float
    low_zmp_margin: float
    worst_slip: float
    landing_error: float
    peak_torques: Array
    torque_limits: Array


def summarize(plans: Sequence[Plan], series: Series, failure: str) -> Summary:
    """Summarize an execution.

    Args:
        plans: What was executed.
        series: The series of :class:`~jet_gym.simulation.history.Execution` by name.
        failure: Why it ended early; empty if it did not.
    """
    robot = plans[0].step.robot
    errors = _landing_errors(plans[-1], series)
    cause, sentence = "", ""
    if failure:
        cause, sentence = explain_fall(robot, series, failure)
    else:
        for side, error in errors.items():
            if not error <= OFF_ITS_CARTON:
                cause = f"{side} foot"
                sentence = f"the {side} foot slid off its carton: it ended {1e3 * error:.0f} mm from its place"
    time = series["time"]
    thrust, margin = series["thrust_delivered"], series["zmp_margin"]
    airborne = np.isin(series["phase"], [name for name in np.unique(series["phase"]) if name.startswith("motion")])
    known = margin[np.isfinite(margin)]
    return Summary(
        success=not cause,
        outcome=sentence or f"the robot made {_count(len(plans))} in {time[-1]:.1f} s and stands",
        cause=cause,
        duration=float(time[-1]),
        peak_thrust=float(thrust.max()),
        mean_thrust=float(thrust[airborne].sum(axis=1).mean()) if airborne.any() else 0.0,
        worst_tilt=float(np.nanmax(series["tilt"])),
        least_zmp_margin=float(known.min()) if known.size else math.nan,
        low_zmp_margin=float(np.percentile(known, 1.0)) if known.size else math.nan,
        worst_slip=float(np.nanmax(series["slip"])),
        landing_error=max(errors.values()),
        peak_torques=series["joint_torques"].max(axis=0),
        torque_limits=robot.effort,
    )


def explain_fall(robot: Robot, series: Series, failure: str) -> tuple[str, str]:
    """Return what gave way in a word or two, and a sentence that says when, where and how.

    What counts is what happened just before the robot was upright for the last time: a servo at the limit of its
    torque, the fan at that of its thrust, a support foot that slid, and else a foot that tipped over its edge.

    Args:
        robot: The robot.
        series: The series by name.
        failure: What the world says of it.
    """
    time = series["time"]
    upright = np.flatnonzero(series["tilt"] < _UPRIGHT)
    onset = int(upright[-1]) if upright.size else 0
    window = (time >= time[onset] - _BEFORE) & (time <= time[onset] + _AFTER)
    support: Side = "right" if series["swing_is_left"][onset] else "left"
    swing: Side = "left" if support == "right" else "right"
    cause, how = _what_gave_way(robot, series, window, support, swing)
    when = f"at {time[-1]:.1f} s, in {series['phase'][onset]}"
    return cause, f"the robot fell {when}: {how} ({failure})"


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
