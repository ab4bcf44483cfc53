"""Samples of a moving robot, gathered into a measurement; and when it counts as fallen."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from jet_gym.ground import rectangle_margin
from jet_gym.kinematics import forward_kinematics
from jet_gym.leg import Side
from jet_gym.simulation.body import RobotBody
from jet_gym.simulation.measurement import Measurement
from jet_gym.simulation.rotation import roll_pitch_tilt
from jet_gym.simulation.settings import SimulationSettings
from jet_gym.simulation.support import support_margin, zmp_of_feet
from jet_gym.step import Step
from jet_gym.utils.arrays import Array


@dataclass(frozen=True, eq=False)
class Footing:
    """Which foot supports, and where it stood when the step began.

    Attributes:
        step: The step.
        support: The support leg.
        sole: Where the support sole stood (3,) [m].
        ground: Height of the carton that it stands on [m].
    """

    step: Step
    support: Side
    sole: Array
    ground: float


class Recorder:
    """Gathers what is measured over one interval.

    Attributes:
        reason: Why the robot counts as fallen; empty while it stands.

    Args:
        body: The robot.
        settings: When the robot counts as fallen.
        footing: Which foot supports.
    """

    def __init__(self, body: RobotBody, settings: SimulationSettings, footing: Footing) -> None:
        self._body = body
        self._settings = settings
        self._footing = footing
        self._support_link = body.foot(footing.support)
        self._swing_links = body.foot(footing.step.swing), body.fan(footing.step.swing)
        self._thrusts: list[float] = []
        self._torques: list[list[float]] = []
        self._support_forces: list[float] = []
        self._swing_forces: list[float] = []
        self._sole_margins: list[float] = []
        self._zmp_margins: list[float] = []
        self._tilts: list[float] = []
        self.reason = ""

    def step(self, thrust: float) -> None:
        """Take note of a simulation step and of the thrust [N] during it."""
        self._thrusts.append(thrust)
        self._torques.append(self._body.torques())

    def sample(self) -> None:
        """Look at pelvis, soles and contacts."""
        body, footing = self._body, self._footing
        self.pelvis = body.pelvis()
        self.swing_sole, self.support_sole = body.sole(footing.step.swing), body.sole(footing.support)
        self.support, self.swing = body.contact(self._support_link), body.contact(*self._swing_links)
        self._support_forces.append(self.support.force)
        self._swing_forces.append(self.swing.force)
        if self.support.touching:
            self._sole_margins.append(self._support_sole_margin())
        if self.support.touching or self.swing.touching:
            self._zmp_margins.append(self._zmp_margin())
        self.roll, self.pitch, tilt = roll_pitch_tilt(self.pelvis.pose.axes)
        self._tilts.append(tilt)
        self.reason = self._why_fallen(tilt)

    def measurement(self, time: float) -> Measurement:
        """Return what was measured, after the last sample.

        Args:
            time: Simulated time [s].
        """
        positions, velocities, torques = self._body.joints()
        pose = self.pelvis.pose
        exploded = not np.isfinite([*positions, *pose.position]).all()
        com = np.full(3, math.nan) if exploded else self._center_of_mass(positions)
        slip = self.support_sole.position[:2] - self._footing.sole[:2]
        return Measurement(
            time=time,
            thrust=self._thrusts[-1],
            mean_thrust=float(np.mean(self._thrusts)),
            zmp=self.support.center,
            support_sole_margin=min(self._sole_margins, default=math.nan),
            zmp_margin=min(self._zmp_margins, default=math.nan),
            support_contact=self.support.touching,
            swing_contact=self.swing.touching,
            support_force=float(np.mean(self._support_forces)),
            swing_force=float(np.mean(self._swing_forces)),
            support_slip=math.hypot(*slip),
            support_lift=float(self.support_sole.position[2]) - self._footing.ground,
            tilt=self._tilts[-1],
            peak_tilt=max(self._tilts),
            roll=self.roll,
            pitch=self.pitch,
            pelvis=pose.position,
            pelvis_orientation=np.array(pose.quaternion),
            pelvis_velocity=self.pelvis.velocity,
            pelvis_angular_velocity=self.pelvis.angular_velocity,
            joint_positions=np.array(positions),
            joint_velocities=np.array(velocities),
            joint_torques=np.array(torques),
            peak_joint_torques=np.abs(self._torques).max(axis=0),
            center_of_mass=com,
            reason=self.reason,
        )

    def _support_sole_margin(self) -> float:
        """Return the distance [m] from the support foot's ZMP to the edge of its sole, negative outside."""
        point = (self.support.center - self.support_sole.position[:2]) @ self.support_sole.axes[:2, :2]
        return float(rectangle_margin(self._body.robot.leg(self._footing.support), point))

    def _zmp_margin(self) -> float:
        """Return the distance [m] from the robot's ZMP to the edge of what carries it; see :class:`Measurement`."""
        if not self.swing.touching:
            return self._sole_margins[-1]
        footing, robot = self._footing, self._body.robot
        feet = [
            (contact, (robot.leg(side), sole))
            for contact, side, sole in (
                (self.support, footing.support, self.support_sole),
                (self.swing, footing.step.swing, self.swing_sole),
            )
            if contact.touching
        ]
        forces = np.array([contact.force for contact, _ in feet])
        zmp = zmp_of_feet(forces, np.array([contact.center for contact, _ in feet]))
        return support_margin(zmp, [sole for _, sole in feet])

    def _center_of_mass(self, joint_positions: list[float]) -> Array:
        return self.pelvis.pose.point(forward_kinematics(self._body.robot, joint_positions).center_of_mass)

    def _why_fallen(self, tilt: float) -> str:
        settings = self._settings
        speed = math.hypot(*self.pelvis.velocity)
        if not speed <= settings.max_speed:  # NaN too
            return f"exploded: the pelvis moves at {speed:.3g} m/s"
        if tilt > settings.max_tilt:
            return f"the pelvis tilts by {math.degrees(tilt):.1f} degrees"
        height = self.pelvis.pose.position[2] - self.support_sole.position[2]
        if height < settings.least_height * self._body.robot.leg_length:
            return f"the pelvis is only {1e3 * height:.0f} mm above the support sole"
        lift = self.support_sole.position[2] - self._footing.ground
        if abs(lift) > settings.max_lift:
            return f"the support foot is lost: its sole is {1e3 * lift:.0f} mm off its carton"
        return ""
