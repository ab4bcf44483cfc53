"""The IMU measures in its own frame, late and with its errors; what calibration and filter make of it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from jet_gym.errors import SettingsError
from jet_gym.simulation.imu import ComplementaryFilter, Imu, ImuSample, ImuSettings, RestCalibration

GRAVITY = 9.81
PERFECT = ImuSettings(
    rate=200.0,
    delay=0.0,
    accelerometer_noise=0.0,
    gyroscope_noise=0.0,
    accelerometer_bias=0.0,
    gyroscope_bias=0.0,
)


def pitched(angle: float) -> np.ndarray:
    """Axes of a frame that is turned about y."""
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])


def watch(settings, motion, seconds, seed=0, rate=1000.0) -> list[ImuSample]:
    """Let an IMU look at a motion: axes, velocity and angular velocity as a function of time."""
    imu = Imu(settings, GRAVITY, np.random.default_rng(seed))
    samples = []
    for k in range(round(seconds * rate)):
        time = k / rate
        if imu.due(time):
            imu.measure(time, *motion(time))
        samples += [(time, sample) for sample in imu.arrived(time)]
    watch.arrivals = [time for time, _ in samples]
    return [sample for _, sample in samples]


def at_rest(_time):
    return np.eye(3), np.zeros(3), np.zeros(3)


class TestImu:
    def test_at_rest_it_feels_gravity_upwards_along_its_own_axes(self):
        (last, *_) = watch(PERFECT, lambda t: (pitched(0.3), np.zeros(3), np.zeros(3)), 0.1)[::-1]
        assert last.acceleration == pytest.approx(GRAVITY * np.array([-math.sin(0.3), 0.0, math.cos(0.3)]))
        assert last.angular_velocity == pytest.approx(np.zeros(3))

    def test_in_free_fall_it_feels_nothing(self):
        (last, *_) = watch(PERFECT, lambda t: (np.eye(3), np.array([0, 0, -GRAVITY * t]), np.zeros(3)), 0.1)[::-1]
        assert last.acceleration == pytest.approx(np.zeros(3), abs=1e-9)

    def test_it_measures_acceleration_and_turning_in_its_own_frame(self):
        axes = pitched(0.5)
        push, spin = np.array([1.0, 2.0, 0.5]), np.array([0.1, -0.2, 0.3])
        (last, *_) = watch(PERFECT, lambda t: (axes, push * t, spin), 0.1)[::-1]
        assert axes @ last.acceleration == pytest.approx([1.0, 2.0, 0.5 + GRAVITY])
        assert axes @ last.angular_velocity == pytest.approx(spin)

    def test_samples_come_at_its_rate_and_late_by_its_delay(self):
        settings = ImuSettings(rate=50.0, delay=0.03)
        samples = watch(settings, at_rest, 2.0)
        assert len(samples) == pytest.approx(2.0 * 50.0, abs=3)
        assert np.diff([sample.time for sample in samples]) == pytest.approx(1.0 / 50.0, abs=1e-9)
        late = np.array(watch.arrivals) - [sample.time for sample in samples]
        assert late == pytest.approx(0.03, abs=1.01e-3)

    def test_noise_and_bias_have_their_standard_deviations(self):
        settings = ImuSettings(
            accelerometer_noise=0.2, gyroscope_noise=0.03, accelerometer_bias=0.5, gyroscope_bias=0.1, delay=0.0
        )
        runs = [watch(settings, at_rest, 2.0, seed) for seed in range(60)]
        felt = np.array([[s.acceleration - [0.0, 0.0, GRAVITY] for s in run] for run in runs])
        turned = np.array([[s.angular_velocity for s in run] for run in runs])
        for values, noise, bias in ((felt, 0.2, 0.5), (turned, 0.03, 0.1)):
            assert values.std(axis=1).mean() == pytest.approx(noise, rel=0.05)
            assert values.mean(axis=1).std() == pytest.approx(bias, rel=0.2)

    @pytest.mark.parametrize("change", [{"rate": 0.0}, {"delay": -0.1}, {"gyroscope_noise": math.nan}])
    def test_settings_that_make_no_sense_are_refused(self, change):
        with pytest.raises(SettingsError, match=next(iter(change))):
            ImuSettings(**change)


class TestRestCalibration:
    @pytest.mark.parametrize("seed", range(5))
    def test_after_a_rest_the_errors_are_nearly_gone(self, seed):
        """What remains is the noise of half a second's mean."""
        settings = ImuSettings(accelerometer_bias=0.3, gyroscope_bias=0.05, delay=0.0)
        calibration, tilts, turns = RestCalibration(0.5), [], []
        for sample in watch(settings, at_rest, 3.0, seed):
            corrected = calibration.corrected(sample)
            if sample.time > 0.5:
                tilts.append(corrected.acceleration[:2] / GRAVITY)
                turns.append(corrected.angular_velocity)
            else:
                assert corrected.acceleration[:2] == pytest.approx([0.0, 0.0])
        assert np.abs(np.mean(tilts, axis=0)).max() < math.radians(0.15)
        assert np.abs(np.mean(turns, axis=0)).max() < 2e-3

    def test_a_turn_after_it_is_measured_in_full(self):
        calibration, spin = RestCalibration(0.2), np.array([0.1, -0.2, 0.3])
        samples = watch(PERFECT, lambda t: (np.eye(3), np.zeros(3), spin * (t > 0.2)), 0.4)
        last = [calibration.corrected(sample) for sample in samples][-1]
        assert last.angular_velocity == pytest.approx(spin)
        assert last.acceleration == pytest.approx([0.0, 0.0, GRAVITY])

    def test_without_a_rest_nothing_is_corrected(self):
        calibration = RestCalibration(0.0)
        for sample in watch(ImuSettings(), at_rest, 0.3, seed=1):
            assert calibration.corrected(sample) is sample


class TestComplementaryFilter:
    def test_it_follows_a_turn_at_once_though_the_accelerometer_lies(self):
        """A swing of 10 degrees in half a second, shaken by 3 m/s^2 all the while."""

        def motion(time):
            angle = math.radians(10.0) * min(time / 0.5, 1.0)
            shaking = np.array([3.0 / 60.0 * (1.0 - math.cos(60.0 * time)), 0.0, 0.0])
            speed = math.radians(20.0) if time < 0.5 else 0.0
            return pitched(angle), shaking, np.array([0.0, speed, 0.0])

        estimate = ComplementaryFilter(1.0)
        estimate.update(ImuSample(0.0, np.array([0.0, 0.0, GRAVITY]), np.zeros(3)))
        for sample in watch(PERFECT, motion, 0.7):
            up = estimate.update(sample)
        assert math.degrees(math.atan2(-up[0], up[2])) == pytest.approx(10.0, abs=0.7)

    def test_it_forgets_a_wrong_beginning(self):
        estimate = ComplementaryFilter(0.5)
        wrong = ImuSample(0.0, np.array([3.0, 0.0, 9.0]), np.zeros(3))
        first = estimate.update(wrong)
        assert first[0] > 0.3
        for k in range(1, 600):
            up = estimate.update(ImuSample(0.005 * k, np.array([0.0, 0.0, GRAVITY]), np.zeros(3)))
        assert up == pytest.approx([0.0, 0.0, 1.0], abs=2e-3)
        assert np.linalg.norm(up) == pytest.approx(1.0)

    def test_a_biased_gyroscope_costs_its_bias_times_the_time_constant(self):
        estimate = ComplementaryFilter(0.8)
        for k in range(2000):
            up = estimate.update(ImuSample(0.005 * k, np.array([0.0, 0.0, GRAVITY]), np.array([0.0, 0.01, 0.0])))
        assert math.atan2(-up[0], up[2]) == pytest.approx(0.8 * 0.01, rel=0.02)
