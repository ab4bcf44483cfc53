"""What physics adds to the task: the simulated robot behind the environment, and what it changes of the reward."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from jet_gym.constraints import JOINT_LIMITS, REACH
from jet_gym.posture import Postures, evaluate_postures
from jet_gym.step import Step
from jet_gym.task.model import TaskModel
from jet_gym.task.transition import Transition
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from jet_gym.simulation.disturbances import Disturbance, DisturbanceRanges
    from jet_gym.simulation.measurement import Measurement
    from jet_gym.simulation.world import World

FIRST_POINT_TIME = 1.4  # [s] of the first swing point, to which the pelvis may move 150 mm
FIRST_POINT_REST = 0.4  # [s] of it, at its end, in which joints and fan, which lag, arrive
LIFT_OFF_TIME = 0.6  # [s] that the second swing point takes at least: the swing foot hands over what it carries
_ZMP_EDGE = 0.005  # [m] a measured ZMP nearer to the edge of what carries the robot costs
_FREE_TILT = math.radians(3.0)
_TILT_SCALE = math.radians(10.0)
_LOWERING = 0.01  # [m] by which the first pelvis is lowered until both legs reach


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the simulated robot did at one swing point.

    Attributes:
        attitude: Roll and pitch of the pelvis at the end (2,) [rad].
        reward_terms: The reward's terms by name, with what was measured in place of the model.
        info: What is added to the environment's info.
        fallen: Whether the robot fell.
    """

    attitude: Array
    reward_terms: dict[str, float]
    info: dict[str, Any]
    fallen: bool


def standing_posture(step: Step, model: TaskModel) -> Postures:
    """Return the posture before a step: both soles at their places, the pelvis nominal or lower, within limits.

    It is what the robot is reset to; a wide stance needs a lower pelvis than the nominal one.
    """
    pelvis = step.nominal_pelvis
    lowered = pelvis - _LOWERING * np.arange(30)[:, None] * [0.0, 0.0, 1.0]
    postures = evaluate_postures(step.robot, step.swing, step.start, step.support, lowered, model.balance)
    stands = (postures.violations & (REACH | JOINT_LIMITS)) == 0
    chosen = int(np.argmax(stands)) if stands.any() else 0
    return evaluate_postures(step.robot, step.swing, step.start, step.support, lowered[chosen], model.balance)


class BulletPhysics:
    """The simulated robot of one environment.

    The simulation is built at the first reset.

    Args:
        model: The task.
        time_per_point: Simulated time of a swing point after the second [s].
        window: Whether to show PyBullet's window and to keep real time.
        disturbances: From what a disturbance is drawn at each reset; ``None`` for none.
    """

    def __init__(
        self,
        model: TaskModel,
        time_per_point: float,
        *,
        window: bool,
        disturbances: DisturbanceRanges | None = None,
    ) -> None:
        self._model = model
        self._time_per_point = time_per_point
        self._window = window
        self._disturbances = disturbances
        self._world: World | None = None
        self._last_zmp = np.zeros(2)

    @property
    def world(self) -> World:
        """The simulation; made when it is first asked for."""
        if self._world is None:
            from jet_gym.simulation.world import World

            self._world = World(self._model.robot, gui=self._window)
        return self._world

    def time_of(self, point: int) -> float:
        """Return the simulated time that a swing point takes [s]."""
        if point == 0:
            return FIRST_POINT_TIME
        return max(self._time_per_point, LIFT_OFF_TIME) if point == 1 else self._time_per_point

    def reset(self, step: Step, generator: np.random.Generator) -> tuple[Array, Disturbance | None]:
        """Let the robot stand before a step.

        Args:
            step: The step.
            generator: Draws the disturbance, if there is to be one.

        Returns:
            Roll and pitch of its pelvis (2,) [rad], and the disturbance.
        """
        disturbance = None
        if self._disturbances is not None:
            duration = sum(self.time_of(point) for point in range(step.points))
            disturbance = self._disturbances.draw(generator, duration)
            self.world.disturb(disturbance)
        posture = standing_posture(step, self._model)
        self._last_zmp = np.array(step.support[:2])
        measured = self.world.reset(step, posture.joint_positions, posture.pelvis, float(posture.pelvis_yaw))
        return np.array([measured.roll, measured.pitch]), disturbance

    def advance(self, result: Transition, point: int, points_left: int, terms: dict[str, float]) -> Outcome:
        """Command the posture of a transition and let the time of a swing point pass.

        Args:
            result: The model's transition, of one lane.
            point: The swing point.
            points_left: Swing points that come after it.
            terms: The model's reward terms by name.
        """
        duration = self.time_of(point)
        thrust = float(np.clip(result.thrust[0], 0.0, self._model.max_thrust))
        rest = FIRST_POINT_REST if point == 0 else 0.0
        measured = self.world.advance(result.joint_positions[0], thrust, duration, rest=rest)
        if np.isfinite(measured.zmp).all():
            self._last_zmp = np.array(measured.zmp)
        info = {
            "tilt": float(measured.tilt),
            "measured_zmp": self._last_zmp.copy(),
            "measured_thrust": float(measured.mean_thrust),
            "joint_torques": np.array(measured.joint_torques),
            "fall": measured.reason,
        }
        attitude = np.array([measured.roll, measured.pitch])
        reward_terms = self._measured_terms(measured, terms, points_left, first=point == 0)
        return Outcome(np.nan_to_num(attitude), reward_terms, info, measured.fallen)

    def close(self) -> None:
        """End the simulation."""
        if self._world is not None:
            self._world.close()
            self._world = None

    def _measured_terms(
        self, measured: Measurement, terms: dict[str, float], points_left: int, *, first: bool
    ) -> dict[str, float]:
        """Put what was measured in place of what the model says."""
        delivered = measured.mean_thrust / self._model.max_thrust
        nearness = 0.0 if first else _nearness_to_edge(measured.zmp_margin)
        zmp_cost = self._model.settings.violation_cost * nearness
        tilt_cost = max(measured.peak_tilt - _FREE_TILT, 0.0) / _TILT_SCALE
        tilt_cost = min(tilt_cost, self._model.settings.largest_cost) if math.isfinite(tilt_cost) else 0.0
        thrust_term = "thrust" if self._model.reward == "graded" else "f4"
        if thrust_term == "f4" and terms["f4"] <= -self._model.thrust_penalty:
            delivered = -terms["f4"]  # the fan was asked for what it cannot give: the penalty stays
        changed = {
            thrust_term: -delivered,
            "zmp": min(terms.get("zmp", 0.0), 0.0 - zmp_cost),
            "tilt": 0.0 - tilt_cost,
            "fall": self._model.worst_reward * (points_left + 1) if measured.fallen else 0.0,
        }
        return terms | changed


def _nearness_to_edge(margin: float) -> float:
    """Return 0 for a ZMP that keeps 5 mm from the sole's edge, 1 at the edge or without contact."""
    return min(max(1.0 - margin / _ZMP_EDGE, 0.0), 1.0) if math.isfinite(margin) else 1.0
