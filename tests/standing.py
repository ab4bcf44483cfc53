"""A robot on one foot with the other one's fan blowing: numbers, feet and oracles that tests of balance share."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from jet_gym.balance import (
    Rectangle,
    Stance,
    stance_of,
)
from jet_gym.leg import Side
from jet_gym.robot import Robot
from jet_gym.single_support import swing_and_support
from jet_gym.utils.arrays import Array

WEIGHT = 6.8 * 9.81  # [N]
MAX_THRUST = 23.0  # [N]
MARGIN = 0.02  # [m]
SOLE = (-0.07, 0.10, -0.05, 0.05)  # [m]
coordinates = st.floats(-0.4, 0.4)
points = st.tuples(coordinates, coordinates)


def shrunk(rectangle: Rectangle, margin: float = MARGIN) -> tuple[Array, Array]:
    """Return the low and the high corner of a rectangle shrunk by a margin."""
    x_min, x_max, y_min, y_max = rectangle
    return np.array([x_min + margin, y_min + margin]), np.array([x_max - margin, y_max - margin])


def zmp_by_moments(com: Array, fan: Array, thrust: Array) -> Array:
    """Return where the ground must push for weight, thrust and ground to turn nothing about the origin."""
    thrust = np.asarray(thrust)[..., None]
    return (WEIGHT * com - thrust * fan) / (WEIGHT - thrust)


def random_feet(rng: np.random.Generator, swing: Side) -> tuple[Array, Array]:
    """Return a swing and a support sole in an ordinary step."""
    outward = 1.0 if swing == "left" else -1.0
    support = rng.uniform([-1.0, -1.0, -0.1], [1.0, 1.0, 0.1])
    swing_sole = support + rng.uniform([-0.6, 0.15, 0.0], [0.6, 0.4, 0.1]) * [1.0, outward, 1.0]
    return swing_sole, support


def random_steps(rng: np.random.Generator, swing: Side) -> tuple[Array, Array, Array]:
    """Return swing soles, support soles and pelvis positions (200, 3) that the legs can mostly reach."""
    feet = np.array([random_feet(rng, swing) for _ in range(200)])
    pelvis = feet[:, 1] + 0.3 * (feet[:, 0] - feet[:, 1]) + rng.normal(0.0, 0.03, (200, 3))
    return feet[:, 0], feet[:, 1], pelvis + np.array([0.0, 0.0, 0.4])


def stance(robot: Robot, swing: Side, swing_sole: Array, support: Array, margin: float = MARGIN) -> Stance:
    swing_leg, support_leg, side = swing_and_support(robot, swing)
    return stance_of(swing_leg, support_leg, side, margin, tuple(swing_sole.tolist()), tuple(support.tolist()))
