"""A simulated six-axis IMU, and the attitude that a complementary filter makes of what it says."""

from __future__ import annotations

import dataclasses
import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from jet_gym.simulation.rotation import cross
from jet_gym.utils.arrays import Array
from jet_gym.utils.settings import require_within


@dataclass(frozen=True)
class ImuSettings:
    """What the IMU gets wrong. The paper names the unit, INS550, but no number; ours are estimates.

    Attributes:
        rate: Samples per second [Hz]; no more than the simulation's own rate come through.
        delay: Time [s] from a sample to its use.
        accelerometer_noise: Standard deviation of a sample, per axis [m/s^2].
        gyroscope_noise: Standard deviation of a sample, per axis [rad/s].
        accelerometer_bias: Standard deviation of the constant bias, per axis [m/s^2], drawn anew for each run.
        gyroscope_bias: Likewise of the gyroscope [rad/s], after its calibration at rest.
    """

    rate: float = 120.0
    delay: float = 0.01
    accelerometer_noise: float = 0.05
    gyroscope_noise: float = 0.005
    accelerometer_bias: float = 0.03
    gyroscope_bias: float = 0.002

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed.

        Raises:
            SettingsError: A ``ValueError`` that names the setting and what it may be.
        """
        for field in dataclasses.fields(self):
            require_within(field.name, getattr(self, field.name), 1.0 if field.name == "rate" else 0.0)


@dataclass(frozen=True, eq=False)
class ImuSample:
    """What the IMU says, in its own frame.

    Attributes:
        time: When it was measured [s].
        acceleration: Specific force (3,) [m/s^2]: at rest, gravity upwards.
        angular_velocity: Angular velocity (3,) [rad/s].
    """

    time: float
    acceleration: Array
    angular_velocity: Array


class Imu:
    """Turns the motion of the IMU's frame into samples with noise, bias, rate and delay.

    Args:
        settings: What it gets wrong.
        gravity: Acceleration of gravity [m/s^2].
        generator: Draws bias and noise.
    """

    def __init__(self, settings: ImuSettings, gravity: float, generator: np.random.Generator) -> None:
        self._settings = settings
        self._generator = generator
        self._gravity = np.array([0.0, 0.0, gravity])
        self._bias = generator.normal(size=(2, 3)) * [
            [settings.accelerometer_bias],
            [settings.gyroscope_bias],
        ]
        self._noise = np.array([[settings.accelerometer_noise], [settings.gyroscope_noise]])
        self._last: tuple[float, Array] | None = None
        self._due = -math.inf
        self._on_its_way: deque[ImuSample] = deque()

    def due(self, time: float) -> bool:
        """Tell whether a sample is to be measured now [s]."""
        return time >= self._due - 1e-9

    def measure(self, time: float, axes: Array, velocity: Array, angular_velocity: Array) -> None:
        """Take a sample of the motion of the frame; the first time there is no acceleration yet, and no sample.

        Args:
            time: Now [s]; it increases from call to call.
            axes: The frame's axes as columns (3, 3), world.
            velocity: Velocity of the frame's origin (3,) [m/s], world.
            angular_velocity: Angular velocity (3,) [rad/s], world.
        """
        if self._last is not None:
            before, velocity_before = self._last
            acceleration = (velocity - velocity_before) / (time - before)  # the unit's own mean over a sample
            self._on_its_way.append(self._sample(time, axes, acceleration, angular_velocity))
        self._last = time, np.array(velocity)
        period = 1.0 / self._settings.rate
        self._due = time + period if self._due < time - period else self._due + period

    def arrived(self, time: float) -> list[ImuSample]:
        """Return the samples that have arrived until now [s] and were not returned before, mostly one or none."""
        arrived = []
        while self._on_its_way and self._on_its_way[0].time + self._settings.delay <= time + 1e-9:
            arrived.append(self._on_its_way.popleft())
        return arrived

    def _sample(self, time: float, axes: Array, acceleration: Array, angular_velocity: Array) -> ImuSample:
        true = np.array([(acceleration + self._gravity) @ axes, angular_velocity @ axes])
        measured = true + self._bias + self._noise * self._generator.normal(size=(2, 3))
        return ImuSample(time, measured[0], measured[1])


class RestCalibration:
    """Takes for an error of the IMU what it says on average while the robot stands still, its pelvis level.

    Args:
        duration: How long that is, from time 0 [s]; with 0 nothing is corrected.
    """

    def __init__(self, duration: float) -> None:
        self._duration = duration
        self._sum: Array = np.zeros((2, 3))
        self._count = 0

    def corrected(self, sample: ImuSample) -> ImuSample:
        """Return a sample without the error; while the robot rests, one that says so."""
        if sample.time <= self._duration:
            self._sum += (sample.acceleration, sample.angular_velocity)
            self._count += 1
            return ImuSample(sample.time, np.array([0.0, 0.0, np.linalg.norm(sample.acceleration)]), np.zeros(3))
        if self._count == 0:
            return sample
        acceleration, turning = self._sum / self._count
        tilted = acceleration - [0.0, 0.0, np.linalg.norm(acceleration)]
        return ImuSample(sample.time, sample.acceleration - tilted, sample.angular_velocity - turning)


class ComplementaryFilter:
    """Estimates which way is up: the gyroscope over short times, the accelerometer over long ones.

    The estimate is turned by the measured angular velocity and drawn towards the measured specific force with a
    time constant (Mahony, Hamel and Pflimlin, "Nonlinear complementary filters on the special orthogonal group",
    2008, without its estimate of the bias). Yaw is not observable, and not needed.

    Attributes:
        up: Estimate of the vertical (3,), in the IMU's frame.

    Args:
        time_constant: Of the way from gyroscope to accelerometer [s].
    """

    def __init__(self, time_constant: float) -> None:
        self.up: Array = np.array([0.0, 0.0, 1.0])
        self._time_constant = time_constant
        self._time: float | None = None

    def update(self, sample: ImuSample) -> Array:
        """Take note of a sample; return the estimate (3,)."""
        measured = sample.acceleration / max(float(np.linalg.norm(sample.acceleration)), 1e-9)
        if self._time is None:
            self.up = measured
        else:
            step = sample.time - self._time
            turning = np.array(cross(sample.angular_velocity.tolist(), self.up.tolist()))
            turned = self.up - turning * step
            drawn = turned + (measured - turned) * (step / (self._time_constant + step))
            self.up = drawn / np.linalg.norm(drawn)
        self._time = sample.time
        return self.up
