"""Lets a disturbance act on a robot in a physics server."""

from __future__ import annotations

from typing import Any

import numpy as np

from jet_gym.leg import SIDES
from jet_gym.simulation.body import RobotBody
from jet_gym.simulation.disturbances import Disturbance
from jet_gym.simulation.settings import SimulationSettings
from jet_gym.utils.arrays import Array

_PELVIS = -1  # PyBullet's index of the base


class Disturber:
    """Changes a robot's masses and contacts at a reset, and pushes it afterwards.

    Attributes:
        disturbance: What acts from the next reset on.
        acting: What acts since the last one.

    Args:
        client: The physics server.
        body: The robot.
        settings: The settings that the disturbance departs from.
    """

    def __init__(self, client: Any, body: RobotBody, settings: SimulationSettings) -> None:
        self._client, self._body, self._settings = client, body, settings
        self._parts = [[_PELVIS], *(part for side in SIDES for part in body.leg_parts(side))]
        self._model = {link: self._inertia(link) for part in self._parts for link in part}
        self.acting = Disturbance()
        self._pelvis_weight = 0.0
        self.disturbance = Disturbance()

    def begin(self) -> None:
        """Let masses and contacts be those of the disturbance."""
        if self.disturbance == self.acting:
            return
        chosen = self.acting = self.disturbance
        for factor, part in zip(chosen.mass_factors, self._parts, strict=True):
            for link in part:
                mass, inertia = self._model[link]
                self._client.changeDynamics(
                    self._body.id, link, mass=factor * mass, localInertiaDiagonal=(factor * inertia).tolist()
                )
        self._body.set_contacts(
            self._settings,
            self._settings.sole_friction if chosen.friction is None else chosen.friction,
            self._settings.contact_stiffness if chosen.contact_stiffness is None else chosen.contact_stiffness,
        )
        self._pelvis_weight = chosen.mass_factors[0] * self._model[_PELVIS][0] * self._settings.gravity

    def step(self, time: float) -> None:
        """Push during the next simulation step, at a time since the robot settled [s]."""
        chosen = self.acting
        if any(chosen.pelvis_com):
            self._shift_weight(np.array(chosen.pelvis_com))
        for push in chosen.pushes:
            if push.time <= time < push.time + push.duration:
                self._push(push.force, self._body.pelvis().pose.position)

    def _shift_weight(self, shift: Array) -> None:
        """Let the pelvis' weight act beside its centre of mass: PyBullet cannot move that."""
        position, orientation = self._client.getBasePositionAndOrientation(self._body.id)
        axes = np.array(self._client.getMatrixFromQuaternion(orientation)).reshape(3, 3)
        center = np.array(position)
        self._push((0.0, 0.0, -self._pelvis_weight), center + axes @ shift)
        self._push((0.0, 0.0, self._pelvis_weight), center)

    def _push(self, force: tuple[float, float, float], place: Array) -> None:
        self._client.applyExternalForce(self._body.id, _PELVIS, force, place.tolist(), self._client.WORLD_FRAME)

    def _inertia(self, link: int) -> tuple[float, Array]:
        info = self._client.getDynamicsInfo(self._body.id, link)
        return info[0], np.array(info[2])
