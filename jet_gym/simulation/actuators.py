"""The robot's servos and fans, and the course of commands that they follow."""

from __future__ import annotations

import dataclasses
from typing import Protocol

import numpy as np

from jet_gym.leg import SIDES, Side
from jet_gym.simulation.body import RobotBody
from jet_gym.simulation.disturbances import Disturbance
from jet_gym.simulation.motion import CommandBlend, FanLag
from jet_gym.simulation.settings import SimulationSettings
from jet_gym.utils.arrays import Array

_NO_THRUST = 1e-9  # [N] not worth a call


class ThrustFeedback(Protocol):
    """Changes the thrust on the way to the fan."""

    def __call__(self, thrust: float) -> float:
        """Return the thrust [N] to tell the fan in place of the one commanded; called at every simulation step."""


class Actuators:
    """Drives servos and fans at every simulation step on the way to a commanded posture and thrust.

    Attributes:
        posture: The last posture that was commanded (12,) [rad].
        target: What the servos were last told (12,) [rad]: the rounded path to it.
        thrust: The last thrust that was commanded [N].
        told: The last thrust that the blowing fan was told [N], after any feedback.
        feedback: Changes the thrust on the way to the fan; ``None`` leaves it.

    Args:
        body: The robot.
        settings: Rate and blend time.
    """

    def __init__(self, body: RobotBody, settings: SimulationSettings) -> None:
        self._body = body
        self._settings = settings
        self._blend = CommandBlend(settings.steps(settings.blend_time))
        self.posture: Array = np.zeros(12)
        self.target: Array = np.zeros(12)
        self.thrust = self.told = 0.0
        self.feedback: ThrustFeedback | None = None

    def reset(self, posture: Array, thrust: float, swing: Side, disturbance: Disturbance) -> None:
        """Rest in a posture, with both fans still and one of them told to blow."""
        self.posture, self.target = posture, posture
        self.thrust = self.told = thrust
        self._blowing = swing
        self._blend.reset(posture)
        lag, gain = disturbance.fan_lag, disturbance.thrust_gain
        self._fans: dict[Side, FanLag] = {
            side: FanLag(
                fan if lag is None else dataclasses.replace(fan, time_constant=lag), self._settings.time_step, gain
            )
            for side, fan in zip(SIDES, self._body.robot.fans, strict=True)
        }

    def swing(self, side: Side) -> None:
        """Let the other fan blow from now on."""
        if side != self._blowing:
            self._blowing, self.thrust, self.told = side, 0.0, 0.0

    def set_course(self, posture: Array, thrust: float, steps: int, rest: int = 0) -> None:
        """Head for a posture (12,) [rad] and a thrust [N], both in straight lines over some simulation steps.

        For as many of them as ``rest`` says, the commands then stay there.
        """
        targets = self._blend.advance(posture, steps - rest)
        thrusts = np.linspace(self.thrust, thrust, steps - rest + 1)[1:]
        if rest:
            targets = np.concatenate([targets, self._blend.advance(posture, rest)])
            thrusts = np.concatenate([thrusts, np.full(rest, thrust)])
        velocities = np.diff(targets, axis=0, prepend=self.target[None]) * self._settings.rate
        self._course = zip(targets.tolist(), velocities.tolist(), thrusts.tolist(), strict=True)
        self.posture = posture

    def step(self) -> float:
        """Apply the commands of the next simulation step; return the thrust of the blowing fan [N]."""
        target, velocity, self.thrust = next(self._course)
        self.target = np.array(target)
        self._body.drive(target, velocity)
        fan_limit = self._fans[self._blowing].max_thrust
        told = self.thrust if self.feedback is None else self.feedback(self.thrust)
        self.told = min(max(told, 0.0), fan_limit)
        for side, fan in self._fans.items():
            thrust = fan.step(self.told if side == self._blowing else 0.0)
            if thrust > _NO_THRUST:
                self._body.blow(side, thrust)
        return self._fans[self._blowing].thrust

    def delivered(self, side: Side) -> float:
        """Return the thrust that a fan delivers [N]."""
        return self._fans[side].thrust
