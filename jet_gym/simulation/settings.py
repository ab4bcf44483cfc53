"""Settings of the simulation, each with its unit."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

from jet_gym.balance import GRAVITY
from jet_gym.utils.settings import require_whole, require_within

_MAY_BE_ZERO = {
    "sole_friction",
    "spinning_friction",
    "rolling_friction",
    "restitution",
    "velocity_gain",
    "blend_time",
    "settle_time",
}
_AT_MOST_ONE = {"position_gain", "velocity_gain", "restitution"}
_WHOLE = {"solver_iterations", "sample_every"}


@dataclass(frozen=True)
class SimulationSettings:
    """What the physics engine and the robot's low-level controller are told.

    The paper gives none of them; all but gravity are estimates, chosen so that results do not hang on them: with
    half or twice the solver iterations, the position gain or the friction, or at twice the rate, the paper's two
    motions end the same way.

    Attributes:
        rate: Simulation steps per second [Hz].
        gravity: Acceleration of gravity [m/s^2].
        sole_friction: Coulomb friction between sole and carton [1]; rubber on cardboard.
        spinning_friction: Torsional friction of a single contact point [m]; a sole rests on four, whose sliding
            friction already resists turning.
        rolling_friction: Rolling friction of a single contact point [m].
        contact_stiffness: Stiffness of a single contact point [N/m]: a sole of hard rubber yields by less than
            0.1 mm. Without any give, the solver chatters now and then.
        contact_damping: Damping of a single contact point [N s/m].
        restitution: Share of its speed that a landing foot keeps [1].
        position_gain: Share of the position error that a servo removes in one simulation step [1].
        velocity_gain: Share of the velocity error that it removes in one simulation step [1].
        blend_time: Time [s] over which the corners of the commanded joint path are rounded. It delays the joints
            by half of itself: 0.3 s is twice the time constant of Jet-HR1's fans, so that posture and thrust
            arrive together.
        settle_time: Time [s] that the robot holds its first posture before an episode begins.
        solver_iterations: Iterations of the constraint solver in one simulation step.
        sample_every: Simulation steps from one sample of contacts and pelvis to the next.
        max_tilt: Tilt of the pelvis [rad] above which the robot counts as fallen.
        least_height: Height of the pelvis over the support sole, as a share of the leg length [1], below which
            the robot counts as fallen.
        max_lift: Height of the support sole over its carton [m] above which the robot counts as fallen.
        max_speed: Speed of the pelvis [m/s] above which the simulation counts as exploded.
    """

    rate: float = 240.0
    gravity: float = GRAVITY
    sole_friction: float = 0.8
    spinning_friction: float = 0.0
    rolling_friction: float = 0.0
    contact_stiffness: float = 3e5
    contact_damping: float = 1e3
    restitution: float = 0.0
    position_gain: float = 0.4
    velocity_gain: float = 1.0
    blend_time: float = 0.3
    settle_time: float = 0.5
    solver_iterations: int = 50
    sample_every: int = 4
    max_tilt: float = math.radians(20.0)
    least_height: float = 0.3
    max_lift: float = 0.02
    max_speed: float = 5.0

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed.

        Raises:
            SettingsError: A ``ValueError`` that names the setting and what it may be.
        """
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if field.name in _WHOLE:
                require_whole(field.name, value, 1)
                continue
            most = 1.0 if field.name in _AT_MOST_ONE else math.inf
            require_within(field.name, value, 0.0, most, above=field.name not in _MAY_BE_ZERO)

    @property
    def time_step(self) -> float:
        """Length of one simulation step [s]."""
        return 1.0 / self.rate

    def steps(self, duration: float) -> int:
        """Return the number of simulation steps nearest to a duration [s]."""
        return round(duration * self.rate)
