"""What is different from the model on the day: masses, friction, fans, IMU, cartons, and somebody who pushes.

:class:`DisturbanceRanges` says within what, :meth:`DisturbanceRanges.draw` draws one :class:`Disturbance`, and
:meth:`jet_gym.simulation.World.disturb` lets it act. Neither the planner nor the controller knows of it.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from jet_gym.errors import SettingsError
from jet_gym.leg import Vector
from jet_gym.robot import jet_hr1
from jet_gym.simulation.settings import SimulationSettings
from jet_gym.utils.settings import require_number, require_whole, require_within

LINKS = 13  # pelvis, then the six links of the left and of the right leg, from hip yaw to foot
Range = tuple[float, float]


class Push(NamedTuple):
    """A horizontal force on the pelvis' origin for a short time."""

    time: float  # [s] when it begins
    duration: float  # [s]
    force: Vector  # [N] world


@dataclass(frozen=True)
class Disturbance:
    """One draw of everything that may differ; the defaults differ in nothing.

    Attributes:
        mass_factors: Mass over the model's [1], of the pelvis and of each leg's links from the hip down, the left
            leg first; inertia goes with it.
        pelvis_com: By how much the pelvis' centre of mass is off (3,) [m], in its own frame. Its weight acts
            there; the inertia of the shift is neglected.
        friction: Friction between soles and cartons [1]; ``None`` is that of the simulation's settings.
        contact_stiffness: Stiffness of a contact point of a sole [N/m]; ``None`` likewise.
        imu_noise: Noise and bias of the IMU over those of its settings [1].
        imu_delay: Delay of the IMU [s]; ``None`` is that of its settings.
        fan_lag: Time constant of the fans [s]; ``None`` is that of the robot.
        thrust_gain: Thrust over what the fan was told [1]. A weak fan's largest thrust is less by as much, a
            strong one gives no more than the robot's fan can.
        block_heights: By how much the landing's carton of each step is higher than planned [m]; further ones are
            as planned.
        pushes: Pushes, in order of time.
    """

    mass_factors: tuple[float, ...] = (1.0,) * LINKS
    pelvis_com: Vector = (0.0, 0.0, 0.0)
    friction: float | None = None
    contact_stiffness: float | None = None
    imu_noise: float = 1.0
    imu_delay: float | None = None
    fan_lag: float | None = None
    thrust_gain: float = 1.0
    block_heights: tuple[float, ...] = ()
    pushes: tuple[Push, ...] = ()

    def block_height(self, step: int) -> float:
        """Return by how much the carton of a step's landing is higher than planned [m]."""
        return self.block_heights[step] if step < len(self.block_heights) else 0.0


@dataclass(frozen=True)
class DisturbanceRanges:
    """Ranges of the disturbances, each drawn uniformly and independently of the others.

    Attributes:
        mass: Half range of each link's mass factor about 1 [1].
        pelvis_com: Half range of the pelvis' centre of mass about the model's, per axis [m].
        friction: Friction between soles and cartons [1].
        contact_stiffness: Stiffness of a contact point of a sole [N/m], drawn uniformly in its logarithm; at the
            lower end a sole yields by 0.8 mm under the robot's weight.
        imu_noise: Noise and bias of the IMU over those of its settings [1].
        imu_delay: Delay of the IMU [s].
        fan_lag: Time constant of the fans [s].
        thrust_gain: Half range of the thrust gain about 1 [1].
        block_height: Half range of the landing cartons' heights about the plan's [m].
        push_impulse: Impulse of a push [N s]; 0.5 N s changes the robot's speed by 74 mm/s.
        push_duration: Duration of a push [s].
        pushes: Number of pushes, one in each of as many equal parts of the time, in any horizontal direction.
    """

    mass: float = 0.05
    pelvis_com: float = 0.01
    friction: Range = (0.4, 1.0)
    contact_stiffness: Range = (2e4, 1e6)
    imu_noise: Range = (0.5, 2.0)
    imu_delay: Range = (0.0, 0.03)
    fan_lag: Range = (0.05, 0.3)
    thrust_gain: float = 0.1
    block_height: float = 0.005
    push_impulse: Range = (0.0, 0.5)
    push_duration: float = 0.2
    pushes: int = 2

    def __post_init__(self) -> None:
        """Refuse ranges outside of what is allowed.

        Raises:
            SettingsError: A ``ValueError`` that names the range and what it may be.
        """
        require_whole("pushes", self.pushes, 0, 100)
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if field.name in ("friction", "contact_stiffness", "imu_noise", "imu_delay", "fan_lag", "push_impulse"):
                self._refuse_bad_range(field.name, value)
            elif field.name != "pushes":
                most = 0.5 if field.name in ("mass", "thrust_gain") else 1.0
                require_within(field.name, value, 0.0, most, above=field.name == "push_duration")

    def scaled(self, factor: float) -> DisturbanceRanges:
        """Return ranges that reach further from the model by a factor.

        Half ranges, and the distances of ranges' ends from the model's values, grow in proportion; but the lower
        end of a positive quantity is divided by no more than the factor. The sole's compliance grows in proportion.
        The model's friction is that of the simulation's default settings, its fans are Jet-HR1's.

        Raises:
            SettingsError: If what comes of it is outside of what is allowed.
        """
        require_within("factor", factor, 0.0, 100.0)
        model = {
            "friction": SimulationSettings.sole_friction,
            "imu_noise": 1.0,
            "fan_lag": jet_hr1().fans[0].time_constant,
        }
        changed: dict[str, Any] = {}
        for name in ("mass", "pelvis_com", "thrust_gain", "block_height"):
            changed[name] = factor * getattr(self, name)
        for name in ("imu_delay", "push_impulse"):
            low, high = getattr(self, name)
            changed[name] = (factor * low, factor * high)
        for name, middle in model.items():
            low, high = getattr(self, name)
            lowest = low / max(factor, 1.0)
            changed[name] = (max(middle - factor * (middle - low), lowest), middle + factor * (high - middle))
        soft, hard = self.contact_stiffness
        changed["contact_stiffness"] = (min(soft / max(factor, 1e-3), hard), hard)
        return dataclasses.replace(self, **changed)

    def draw(self, generator: np.random.Generator, duration: float, steps: int = 1) -> Disturbance:
        """Draw a disturbance.

        Args:
            generator: Where the random numbers come from.
            duration: Time over which the pushes are spread [s].
            steps: Number of steps, each with a carton to land on.
        """

        def uniform(span: Range) -> float:
            return float(generator.uniform(*span))

        def about(middle: float, half: float, count: int) -> tuple[float, ...]:
            return tuple((middle + half * generator.uniform(-1.0, 1.0, count)).tolist())

        masses = about(1.0, self.mass, LINKS)
        x, y, z = about(0.0, self.pelvis_com, 3)
        low, high = (math.log(value) for value in self.contact_stiffness)
        return Disturbance(
            mass_factors=masses,
            pelvis_com=(x, y, z),
            friction=uniform(self.friction),
            contact_stiffness=math.exp(uniform((low, high))),
            imu_noise=uniform(self.imu_noise),
            imu_delay=uniform(self.imu_delay),
            fan_lag=uniform(self.fan_lag),
            thrust_gain=about(1.0, self.thrust_gain, 1)[0],
            block_heights=about(0.0, self.block_height, steps),
            pushes=tuple(self._draw_push(generator, duration, k) for k in range(self.pushes)),
        )

    def _draw_push(self, generator: np.random.Generator, duration: float, part: int) -> Push:
        time = duration * (part + float(generator.uniform())) / self.pushes
        force = float(generator.uniform(*self.push_impulse)) / self.push_duration
        direction = float(generator.uniform(0.0, math.tau))
        return Push(time, self.push_duration, (force * math.cos(direction), force * math.sin(direction), 0.0))

    def _refuse_bad_range(self, name: str, value: object) -> None:
        if not isinstance(value, tuple) or len(value) != 2:
            raise SettingsError(f"{name} must be a pair (low, high), not {value!r}")
        low, high = value
        require_number(name, low)
        require_number(name, high)
        least = 1e-3 if name in ("contact_stiffness", "friction", "fan_lag") else 0.0
        if not least <= low <= high < math.inf:
            raise SettingsError(f"{name} must rise from {least:g} or more to a finite number, not {value}")
