"""A plan executed by the physics engine, on the plan's own clock so that both can be seen at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from jet_gym.kinematics import forward_kinematics
from jet_gym.leg import SIDES
from jet_gym.plan import Plan
from jet_gym.simulation.history import Execution
from jet_gym.studio.motion import Motion, Pose
from jet_gym.utils.arrays import Array

_MOTION = "motion 1"  # the phase in which the plan's own step is made


@dataclass(frozen=True, eq=False)
class Simulated:
    """What the physics engine made of a plan. M moments.

    The engine lets the robot stand and shift its weight first, and makes the step in a time of its own. Here time
    is counted on the plan's clock: zero where the swing foot lifts off, the plan's duration where it lands, and in
    proportion before and after.

    Attributes:
        motion: The robot over time.
        thrust: Thrust that the swing foot's fan delivered (M,) [N].
        pelvis: Pelvis origin (M, 3) [m].
        zmp_margin: Distance of the measured ZMP from the edge of the soles that carry the robot (M,) [m]; NaN
            without contact.
        tilt: Tilt of the pelvis (M,) [rad].
        outcome: What happened, in one sentence.
        success: Whether the robot got where it was to go and stands.
    """

    motion: Motion
    thrust: Array
    pelvis: Array
    zmp_margin: Array
    tilt: Array
    outcome: str
    success: bool

    @property
    def time(self) -> Array:
        """Moments (M,) [s], on the plan's clock."""
        return self.motion.time

    @classmethod
    def of_execution(cls, execution: Execution) -> Simulated:
        """Return what is to be shown of the execution of one plan."""
        plan = execution.plans[0]
        time = _plan_clock(execution, plan)
        swing = SIDES.index(plan.step.swing)
        body = forward_kinematics(plan.step.robot, execution.joint_positions)
        fan = execution.pelvis + Rotation.from_quat(execution.pelvis_orientation).apply(body.fans[:, swing])
        assigned = np.column_stack([np.interp(time, plan.time, plan.assigned_zmp[:, k]) for k in range(2)])
        thrust = execution.thrust_delivered[:, swing]
        poses = Pose(
            pelvis=execution.pelvis,
            orientation=execution.pelvis_orientation[:, [3, 0, 1, 2]],
            joint_positions=execution.joint_positions,
            swing_sole=execution.soles[:, swing],
            com=execution.center_of_mass,
            zmp=execution.zmp,
            assigned_zmp=assigned,
            fan=fan,
            thrust=thrust[:, None],
        )
        return cls(
            motion=Motion(time, poses),
            thrust=thrust,
            pelvis=execution.pelvis,
            zmp_margin=execution.zmp_margin,
            tilt=execution.tilt,
            outcome=execution.summary.outcome,
            success=execution.summary.success,
        )

    def tilt_at(self, time: float) -> float:
        """Return the tilt [rad] at a time [s]."""
        return float(np.interp(time, self.time, self.tilt))

    def margin_at(self, time: float) -> float:
        """Return the ZMP margin [m] at a time [s]; NaN without contact."""
        return float(np.interp(time, self.time, self.zmp_margin))


def _plan_clock(execution: Execution, plan: Plan) -> Array:
    """Return the moments of an execution on the clock of its plan (M,) [s]."""
    moving = np.flatnonzero(execution.phase == _MOTION)
    if len(moving) == 0:  # it fell before it lifted a foot
        return execution.time - float(execution.time[-1])
    first = int(moving[0])
    started = float(execution.time[first - 1]) if first else 0.0
    ended = float(execution.time[moving[-1]])
    complete = moving[-1] + 1 < len(execution.time)
    pace = plan.step.duration / (ended - started) if complete and ended > started else 1.0
    return pace * (execution.time - started)
