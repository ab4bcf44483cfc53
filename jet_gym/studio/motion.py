"""What the page plays: the robot over time, be it planned or simulated."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from jet_gym.plan import Plan
from jet_gym.utils.arrays import Array


@dataclass(frozen=True, eq=False)
class Pose:
    """The robot at one moment. World frame.

    Attributes:
        pelvis: Pelvis origin (3,) [m].
        orientation: Quaternion w, x, y, z of the pelvis (4,).
        joint_positions: Joint positions (12,) [rad].
        swing_sole: Swing sole (3,) [m].
        com: Centre of mass (3,) [m].
        zmp: Zero-moment point (2,) [m]; NaN where nothing supports the robot.
        assigned_zmp: Assigned ZMP (2,) [m].
        fan: Where the thrust acts (3,) [m].
        thrust: Thrust (1,) [N].
    """

    pelvis: Array
    orientation: Array
    joint_positions: Array
    swing_sole: Array
    com: Array
    zmp: Array
    assigned_zmp: Array
    fan: Array
    thrust: Array


@dataclass(frozen=True, eq=False)
class Motion:
    """The robot over time, as poses stacked along a first axis of N moments.

    Attributes:
        time: Moments (N,), increasing [s].
        poses: Every array of :class:`Pose` with a leading axis of N.
    """

    time: Array
    poses: Pose

    @classmethod
    def of_plan(cls, plan: Plan) -> Motion:
        """Return the motion that a plan asks for."""
        half, zero = 0.5 * plan.pelvis_yaw, np.zeros_like(plan.pelvis_yaw)
        return cls(
            plan.time,
            Pose(
                pelvis=plan.pelvis,
                orientation=np.column_stack([np.cos(half), zero, zero, np.sin(half)]),
                joint_positions=plan.joint_positions,
                swing_sole=plan.swing_sole,
                com=plan.com,
                zmp=plan.zmp,
                assigned_zmp=plan.assigned_zmp,
                fan=plan.fan,
                thrust=plan.thrust[:, None],
            ),
        )

    @property
    def start(self) -> float:
        """Time of the first moment [s]."""
        return float(self.time[0])

    @property
    def end(self) -> float:
        """Time of the last moment [s]."""
        return float(self.time[-1])

    def at(self, time: float) -> Pose:
        """Return the pose at a time [s], between two moments on the straight line between them.

        Orientations close to each other are mixed and normalised, which for neighbouring moments is a rotation
        at a speed that is constant within a thousandth.
        """
        moment = min(max(float(time), self.start), self.end)
        after = min(max(int(np.searchsorted(self.time, moment, side="right")), 1), len(self.time) - 1)
        share = (moment - self.time[after - 1]) / (self.time[after] - self.time[after - 1])
        mixed = {}
        for field in fields(Pose):
            values: Array = getattr(self.poses, field.name)
            a, b = values[after - 1], values[after]
            if field.name == "orientation" and float(a @ b) < 0.0:
                b = -b  # the same rotation on the near side
            mixed[field.name] = (1.0 - share) * a + share * b if 0.0 < share < 1.0 else (b if share >= 1.0 else a)
        mixed["orientation"] = mixed["orientation"] / np.linalg.norm(mixed["orientation"])
        return Pose(**mixed)
