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

from jet_gym.fans_and_servos import Fan
from jet_gym.kinematics import forward_kinematics
from jet_gym.leg import SIDES, Side
from jet_gym.simulation.body import RobotBody
from jet_gym.simulation.imu import ComplementaryFilter, Imu, ImuSample, RestCalibration
from jet_gym.utils.arrays import Array
from jet_gym.utils.settings import require_within

_LEAST_LEVER = 0.1  # [m]
_LEVER_EVERY = 0.05  # [s] it changes slowly


@dataclass(frozen=True)
class PidSettings:
    """Gains of the PID on the attitude, of its filter and its limits. The paper gives none.

    A robot that rocks on the edge of its support foot topples with a moment of about 14 N m/rad, which the
    proportional gain must exceed, and within 0.2 s, while its fans lag by 0.15 s. So the correction leads: the fan
    is told more than is wanted, by as much as its lag takes away. These gains right a rocking robot whose fans lag
    by 0.05 to 0.3 s, with an IMU that is late by up to 0.03 s.

    Attributes:
        proportional: Moment over tilt [N m/rad].
        integral: Moment over tilt and time [N m/(rad s)].
        derivative: Moment over angular velocity [N m s/rad].
        integral_limit: Largest moment of the integral part [N m].
        dead_band: Tilt [rad] that is left alone: servos and soles yield by so much anyway.
        filter_time: Time constant of the complementary filter [s].
        zeroing_time: Time [s] in which the robot stands at first, and in which the IMU's errors are measured; no
            longer than the robot does stand. With 0 they stay.
        fan_time: Time constant [s] with which a fan of the robot's own lag follows the correction thanks to the
            lead; not below a hundredth of that lag.
    """

    proportional: float = 45.0
    integral: float = 40.0
    derivative: float = 10.0
    integral_limit: float = 3.0
    dead_band: float = math.radians(0.1)
    filter_time: float = 1.0
    zeroing_time: float = 0.5
    fan_time: float = 0.04

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed.

        Raises:
            SettingsError: A ``ValueError`` that names the setting and what it may be.
        """
        for field in dataclasses.fields(self):
            require_within(field.name, getattr(self, field.name))


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


class FanLead:
    """Tells a fan more than is wanted, so that it follows faster than it would by itself.

    It reckons what the fan delivers of what it was told, and asks for what closes the gap within the wanted time.

    Args:
        fan: The fan, as far as the controller knows it.
        fan_time: Time constant that is wanted [s].
    """

    def __init__(self, fan: Fan, fan_time: float) -> None:
        self._fan = fan
        self._gain = max(fan.time_constant / max(fan_time, 0.01 * fan.time_constant, 1e-9), 1.0)
        self._delivered = 0.0

    def reset(self) -> None:
        """Forget the past: no correction is delivered."""
        self._delivered = 0.0

    def told(self, wanted: float, planned: float, time_step: float) -> float:
        """Return the correction [N] to tell the fan.

        Args:
            wanted: The correction that is wanted [N].
            planned: The thrust that it corrects [N]; together they are within what the fan can do.
            time_step: Time since the last call [s].
        """
        told = self._delivered + self._gain * (wanted - self._delivered)
        told = min(max(told, -planned), self._fan.max_thrust - planned)
        kept = math.exp(-time_step / self._fan.time_constant) if self._fan.time_constant > 0.0 else 0.0
        self._delivered = told + (self._delivered - told) * kept
        return told


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
        standing: How long the robot stands at first [s].
    """

    def __init__(
        self, body: RobotBody, imu: Imu, settings: PidSettings, time_step: float, standing: float = 0.0
    ) -> None:
        self._body = body
        self._imu = imu
        self._calibration = RestCalibration(min(settings.zeroing_time, standing))
        self._filter = ComplementaryFilter(settings.filter_time)
        self._pid = Pid(settings)
        self._leads = {
            side: FanLead(fan, settings.fan_time) for side, fan in zip(SIDES, body.robot.fans, strict=True)
        }
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
        self._leads[side].reset()
        self._lever_due = -math.inf

    def __call__(self, thrust: float) -> float:
        """Return the thrust [N] to command in place of the planned one."""
        self._time += self._time_step
        if self._imu.due(self._time):
            self._imu.measure(self._time, *self._body.imu_motion())
        for sample in map(self._calibration.corrected, self._imu.arrived(self._time)):
            self.up = self._filter.update(sample)
            elapsed, self._last_sample = sample.time - self._last_sample, sample.time
            if self.active:
                wanted = self._wanted(sample, elapsed)
                self.correction = self._leads[self._swing].told(wanted, thrust, elapsed)
        if not self.active:
            self._pid.reset()
            self._leads[self._swing].reset()
            self.correction = 0.0
        return thrust + self.correction

    def _wanted(self, sample: ImuSample, elapsed: float) -> float:
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
