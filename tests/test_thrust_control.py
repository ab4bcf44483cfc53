"""The PID and the lead of the fan right a robot that rocks, within what the fan can do."""

from __future__ import annotations

import math

import numpy as np
import pytest

from agents.planner import make_planner
from jet_gym.courses import PAPER
from jet_gym.errors import SettingsError
from jet_gym.robot import Robot
from jet_gym.simulation import ExecutionSettings, PidSettings, SimulationSettings, execute
from jet_gym.simulation.disturbances import Disturbance, Push
from jet_gym.simulation.motion import FanLag
from jet_gym.simulation.thrust_control import FanLead, Pid

TOPPLING = 14.0  # [N m/rad] moment over tilt of a robot that rocks on its sole's edge
INERTIA = 0.55  # [kg m^2] about that edge


class TestPid:
    def test_tilt_and_speed_ask_for_moments_that_right_them(self):
        pid = Pid(PidSettings(proportional=10.0, integral=0.0, derivative=2.0, dead_band=0.0))
        assert pid.moment(0.1, 0.5, 0.01) == pytest.approx(2.0)
        assert pid.moment(-0.1, -0.5, 0.01) == pytest.approx(-2.0)

    def test_a_tilt_within_the_dead_band_is_left_alone(self):
        pid = Pid(PidSettings(dead_band=0.02, derivative=0.0))
        assert pid.moment(0.019, 0.0, 0.01) == 0.0
        assert pid.moment(-0.03, 0.0, 0.01) < 0.0

    def test_the_integral_grows_to_its_limit_and_is_forgotten(self):
        pid = Pid(PidSettings(proportional=0.0, integral=5.0, derivative=0.0, dead_band=0.0, integral_limit=0.4))
        moments = [pid.moment(0.1, 0.0, 0.01) for _ in range(200)]
        assert moments[9] == pytest.approx(5.0 * 0.1 * 0.1)
        assert moments[-1] == pytest.approx(0.4)
        pid.reset()
        assert pid.moment(0.1, 0.0, 0.01) < 0.01

    @pytest.mark.parametrize("change", [{"proportional": -1.0}, {"filter_time": math.nan}, {"fan_time": "fast"}])
    def test_settings_that_make_no_sense_are_refused(self, change):
        with pytest.raises(SettingsError, match=next(iter(change))):
            PidSettings(**change)


class TestFanLead:
    def test_a_fan_follows_as_fast_as_is_wanted(self, robot):
        fan, lead, step = FanLag(robot.fans[0], 1e-3), FanLead(robot.fans[0], 0.05), 1e-3
        thrusts = [fan.step(5.0 + lead.told(0.5, 5.0, step)) for _ in range(2000)]
        alone = FanLag(robot.fans[0], 1e-3)
        added = np.array(thrusts) - [alone.step(5.0) for _ in range(2000)]
        assert added[49] == pytest.approx(0.5 * (1.0 - math.exp(-1.0)), rel=0.02)
        assert added[-1] == pytest.approx(0.5, rel=1e-3)

    def test_it_never_asks_for_what_the_fan_cannot_give(self, robot):
        lead = FanLead(robot.fans[0], 0.01)
        told = [lead.told(wanted, 20.0, 0.01) for wanted in (50.0, -50.0) * 20]
        assert -20.0 <= min(told) < max(told) <= robot.max_thrust - 20.0


@pytest.mark.parametrize("lag", [0.05, 0.15, 0.3])
@pytest.mark.parametrize("delay", [0.0, 0.03])
def test_a_rocking_robot_is_righted_over_the_stated_lags_and_delays(robot: Robot, lag: float, delay: float):
    """An inverted pendulum on the sole's edge, pushed: without feedback it falls, with it it comes to rest."""
    settings, step, lever = PidSettings(), 1.0 / 240.0, 0.6
    tilts = {}
    for feedback in (False, True):
        pid, lead, delivered = Pid(settings), FanLead(robot.fans[0], settings.fan_time), 0.0
        tilt, speed, past = 0.01, 0.05, [(0.0, 0.0)] * round(delay / step)
        tilts[feedback] = []
        for _ in range(960):
            past.append((tilt, speed))
            moment = pid.moment(*past.pop(0), step) if feedback else 0.0
            told = lead.told(moment / lever, 12.0, step)
            delivered += (told - delivered) * (1.0 - math.exp(-step / lag))
            speed += (TOPPLING * tilt - lever * delivered) / INERTIA * step
            tilt += speed * step
            tilts[feedback].append(tilt)
            if abs(tilt) > 0.5:
                break
    assert max(tilts[False]) > 0.5
    assert np.abs(tilts[True]).max() < 0.06
    assert np.abs(tilts[True][-240:]).max() < 0.006


def test_pid_rights_the_pelvis_after_a_push_that_feed_forward_falls_to():
    """2 N s towards the fan while the right foot swings across the ditch."""
    pytest.importorskip("pybullet")
    plan = make_planner("gas").plan(PAPER.forward, seed=0)
    towards_fan = plan.fan[120, :2] - plan.step.support[:2]
    x, y = 10.0 * towards_fan / np.hypot(*towards_fan)
    push = Disturbance(pushes=(Push(6.0, 0.2, (float(x), float(y), 0.0)),))
    coarse = SimulationSettings(sample_every=8)
    feedforward, pid = (
        execute([plan], ExecutionSettings(thrust=control, simulation=coarse), disturbance=push)
        for control in ("feedforward", "pid")
    )
    assert "tipped over its inner edge" in feedforward.summary.outcome
    assert 6.0 < feedforward.time[-1] < 8.0
    assert pid.summary.success
    assert pid.summary.worst_tilt < math.radians(4.0)
    rocking = (pid.time > 6.0) & (pid.time < 8.0)
    assert (pid.thrust_commanded - pid.thrust_planned)[rocking].max() > 1.0
    estimated = np.hypot(pid.estimated_roll, pid.estimated_pitch)[rocking].max()
    assert estimated == pytest.approx(pid.tilt[rocking].max(), abs=math.radians(1.0))
