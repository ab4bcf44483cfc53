"""What is the case at the moment that is shown, in words."""

from __future__ import annotations

import numpy as np

from jet_gym.step import Step
from jet_gym.studio.curves import zmp_margin
from jet_gym.studio.joint_room import joints_near_limits
from jet_gym.studio.motion import Pose
from jet_gym.studio.simulated import Simulated


def describe_moment(step: Step, time: float, pose: Pose, simulated: Simulated | None) -> list[str]:
    """Return what is the case at a moment, in lines.

    Args:
        step: The step.
        time: The moment [s].
        pose: The robot then.
        simulated: The simulated motion, if that is what is shown.
    """
    point = min(max(round(time / step.duration * (step.points - 1)), 0), step.points - 1)
    margin = float(zmp_margin(step, pose.zmp[None])[0]) if simulated is None else simulated.margin_at(time)
    lines = [
        f"swing point {point} of 0 to {step.points - 1}, {time:.2f} s",
        f"thrust {pose.thrust[0]:.1f} N, {'' if simulated is None else 'measured '}ZMP {_inside(margin)}",
    ]
    if simulated is not None:
        lines.append(f"simulated: tilt {np.degrees(simulated.tilt_at(time)):.2f}°")
    near = joints_near_limits(step.robot, pose.joint_positions)
    if near:
        names = ", ".join(f"{name.replace('_', ' ')} {np.degrees(room):.0f}°" for name, room in near[:3])
        lines.append(f"near the end of their range: {names}")
    return lines


def _inside(margin: float) -> str:
    if not np.isfinite(margin):
        return "nowhere: no foot is in contact"
    return f"{1e3 * abs(margin):.0f} mm {'inside' if margin >= 0.0 else 'outside'} the sole"
