"""The robot's servos and fans, and the course of commands that they follow."""

from __future__ import annotations

import numpy as np

from jet_gym.robot import Side
from jet_gym.simulation.body import RobotBody
from jet_gym.simulation.motion import CommandBlend, FanLag
from jet_gym.simulation.settings import SimulationSettings
from jet_gym.urdf import Array

_NO_THRUST = 1e-9  # [N] not worth a call


class Actuators:
    """Drives servos and fans at every simulation step on the way to a commanded posture and thrust.

    Attributes:
        posture: The last posture that was commanded (12,) [rad].
        thrust: The last thrust that the blowing fan was told [N].

    Args:
        body: The robot.
        settings: Rate and blend time.
    """

    def __init__(self, body: RobotBody, settings: SimulationSettings) -> None:
        self._body = body
        self._settings = settings
        self._blend = CommandBlend(settings.steps(settings.blend_time))
        self.posture: Array = np.zeros(12)
        self.thrust = 0.0

    def reset(self, posture: Array, thrust: float, swing: Side) -> None:
        """Rest in a posture, with both fans still and one of them told to blow."""
        self.posture, self.thrust = posture, thrust
        self._blowing = swing
        self._target = posture
        self._blend.reset(posture)
        left, right = self._body.robot.fans
        self._fans: dict[Side, FanLag] = {
            "left": FanLag(left, self._settings.time_step),
            "right": FanLag(right, self._settings.time_step),
        }

    def swing(self, side: Side) -> None:
        """Let the other fan blow from now on."""
        if side != self._blowing:
            self._blowing, self.thrust = side, 0.0

    def set_course(self, posture: Array, thrust: float, steps: int) -> None:
        """Head for a posture (12,) [rad] and a thrust [N], both in straight lines over some simulation steps."""
        targets = self._blend.advance(posture, steps)
        velocities = np.diff(targets, axis=0, prepend=self._target[None]) * self._settings.rate
        self._course = zip(
            targets.tolist(),
            velocities.tolist(),
            np.linspace(self.thrust, thrust, steps + 1)[1:].tolist(),
            strict=True,
        )
        self.posture = posture

    def step(self) -> float:
        """Apply the commands of the next simulation step; return the thrust of the blowing fan [N]."""
        target, velocity, self.thrust = next(self._course)
        self._target = np.array(target)
        self._body.drive(target, velocity)
        for side, fan in self._fans.items():
            thrust = fan.step(self.thrust if side == self._blowing else 0.0)
            if thrust > _NO_THRUST:
                self._body.blow(side, thrust)
        return self._fans[self._blowing].thrust
