"""The thrust: what the plan says, and what a PID on the pelvis' attitude adds.

The fan of the swing foot pushes up at its end of a lever about the support foot. If the pelvis tilts towards the
swing foot, more thrust rights it, and less if it tilts the other way; across that line the fan can do nothing. So
the PID acts on the tilt along the line from the support foot to the fan, and gives a moment, which the length of
the lever turns into thrust.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from jet_gym.errors import SettingsError, require_number
from jet_gym.kinematics import forward_kinematics
from jet_gym.robot import Side
from jet_gym.simulation.body import RobotBody
from jet_gym.simulation.imu import ComplementaryFilter, Imu, ImuSample
from jet_gym.urdf import Array

_LEAST_LEVER = 0.1  # [m]
_LEVER_EVERY = 0.05  # [s] it changes slowly


@dataclass(frozen=True)
class PidSettings:
    """Gains of the PID on the attitude, of its filter and its limits. The paper gives none.

    A robot that rocks about its support foot topples with a moment of about 15 N m/rad and a time constant of
    0.16 s, while its fans lag by 0.15 s: the proportional gain must exceed the first, and derivative over
    proportional gain the last.

    Attributes:
        proportional: Moment over tilt [N m/rad].
        integral: Moment over tilt and time [N m/(rad s)].
        derivative: Moment over angular velocity [N m s/rad].
        integral_limit: Largest moment of the integral part [N m].
        dead_band: Tilt [rad] that is left alone: servos and soles yield by so much anyway.
        filter_time: Time constant of the complementary filter [s].
    """

    proportional: float = 60.0
    integral: float = 20.0
    derivative: float = 15.0
    integral_limit: float = 1.5
    dead_band: float = math.radians(0.3)
    filter_time: float = 1.0

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed.

        Raises:
            SettingsError: A ``ValueError`` that names the setting and what it may be.
        """
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            require_number(field.name, value)
            if not 0.0 <= value < math.inf:
                raise SettingsError(f"{field.name} must be finite and 0 or more, not {value}")


class Pid:
    """Turns tilt and angular velocity into a moment.

    Args:
        settings: Gains and limits.
    """

    def __init__(self, settings: PidSettings) -> None:
        self._settings = settings
        self._integral = 0.0

    def reset(self) -> None:
        """Forget the past."""
        self._integral = 0.0

    def moment(self, tilt: float, speed: float, time_step: float) -> float:
        """Return the moment [N m] that rights a tilt [rad] that grows with a speed [rad/s]."""
        s = self._settings
        error = math.copysign(max(abs(tilt) - s.dead_band, 0.0), tilt)
        integral = self._integral + s.integral * error * time_step
        self._integral = min(max(integral, -s.integral_limit), s.integral_limit)
        return s.proportional * error + self._integral + s.derivative * speed


class AttitudeFeedback:
    """Adds the PID's thrust to the plan's, at every simulation step.

    Attributes:
        active: Whether the PID adds anything; it only makes sense while one foot carries the robot.
        up: The estimated vertical in the pelvis' frame (3,).
        correction: What the PID adds [N].

    Args:
        body: The robot.
        imu: Its IMU.
        settings: Of the PID.
        time_step: Simulation step [s].
    """

    def __init__(self, body: RobotBody, imu: Imu, settings: PidSettings, time_step: float) -> None:
        self._body = body
        self._imu = imu
        self._filter = ComplementaryFilter(settings.filter_time)
        self._pid = Pid(settings)
        self._time_step = time_step
        self._time, self._last_sample = 0.0, 0.0
        self._swing: Side = "left"
        self._lever: tuple[Array, float] = np.zeros(2), _LEAST_LEVER
        self._lever_due = -math.inf
        self.active = False
        self.up = self._filter.up
        self.correction = 0.0

    def swing(self, side: Side) -> None:
        """Say which foot's fan blows."""
        self._swing = side
        self._pid.reset()
        self._lever_due = -math.inf

    def __call__(self, thrust: float) -> float:
        """Return the thrust [N] to command in place of the planned one."""
        self._time += self._time_step
        if self._imu.due(self._time):
            self._imu.measure(self._time, *self._body.imu_motion())
        for sample in self._imu.arrived(self._time):
            self.up = self._filter.update(sample)
            elapsed, self._last_sample = sample.time - self._last_sample, sample.time
            if self.active:
                self.correction = self._correction(sample, elapsed)
        if not self.active:
            self._pid.reset()
            self.correction = 0.0
        return thrust + self.correction

    def _correction(self, sample: ImuSample, elapsed: float) -> float:
        if sample.time >= self._lever_due:
            self._lever, self._lever_due = self._measure_lever(), sample.time + _LEVER_EVERY
        direction, lever = self._lever
        angular_velocity = sample.angular_velocity
        tilt = -math.asin(min(max(float(self.up[:2] @ direction), -1.0), 1.0))
        speed = float(angular_velocity[1] * direction[0] - angular_velocity[0] * direction[1])
        return self._pid.moment(tilt, speed, elapsed) / max(lever, _LEAST_LEVER)

    def _measure_lever(self) -> tuple[Array, float]:
        """Return direction (2,) and length [m] of the way from support sole to fan, in the pelvis' frame."""
        points = forward_kinematics(self._body.robot, self._body.joints()[0])
        swing, support = (0, 1) if self._swing == "left" else (1, 0)
        way = points.fans[swing, :2] - points.soles[support, :2]
        length = float(np.hypot(*way))
        return way / max(length, 1e-9), length
