"""The robot on its cartons in PyBullet: reset it, move it, measure it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter, sleep
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from jet_gym.kinematics import forward_kinematics
from jet_gym.leg import opposite
from jet_gym.robot import Robot, jet_hr1
from jet_gym.simulation.actuators import Actuators
from jet_gym.simulation.body import Pose, RobotBody
from jet_gym.simulation.bullet import configure, connect
from jet_gym.simulation.cartons import Cartons
from jet_gym.simulation.disturbances import Disturbance
from jet_gym.simulation.disturber import Disturber
from jet_gym.simulation.errors import WorldStateError
from jet_gym.simulation.measurement import Measurement
from jet_gym.simulation.recorder import Footing, Recorder
from jet_gym.simulation.rotation import from_yaw
from jet_gym.simulation.settings import SimulationSettings
from jet_gym.step import Step
from jet_gym.utils.arrays import Array, finite_array
from jet_gym.utils.self_closing import SelfClosing


class World(SelfClosing):
    """A robot on three cartons in a physics server of its own.

    After :meth:`reset`, the same commands give the same states to the last bit, whatever happened before and
    in whichever world.

    Attributes:
        robot: The robot.
        settings: The settings.
        client: The physics server's client.
        body: The robot in it.
        cartons: The cartons in it.
        actuators: Servos and fans.
        step: The step that the cartons are placed for; ``None`` at first.

    Args:
        robot: The robot; Jet-HR1 where omitted.
        settings: The settings; the defaults where omitted.
        gui: Whether to show PyBullet's window and to keep pace with the clock.

    Raises:
        BulletMissingError: If PyBullet is not installed.
        DisplayMissingError: If there is no display for the window.
    """

    def __init__(
        self, robot: Robot | None = None, settings: SimulationSettings | None = None, *, gui: bool = False
    ) -> None:
        self.robot = robot or jet_hr1()
        self.settings = settings or SimulationSettings()
        self.client: Any = connect(gui)
        self.step: Step | None = None
        self._gui, self._open = gui, True
        configure(self.client, self.settings)
        with self._unseen():
            self.cartons = Cartons(self.client, self.settings.restitution, visible=gui)
            self.body = RobotBody(self.client, self.robot, visible=gui)
            self.body.set_up(self.settings)
            self._pristine: int = self.client.saveState()
        self.actuators = Actuators(self.body, self.settings)
        self._disturber = Disturber(self.client, self.body, self.settings)
        self._footing: Footing | None = None  # none: the robot stands nowhere
        self._steps_done, self._time_asked = 0, 0.0
        self._step_number = 0  # of the course

    def close(self) -> None:
        """Shut down this world's physics server; a second time does nothing."""
        if self._open:
            self._open, self._footing = False, None
            self.client.disconnect()

    @property
    def time(self) -> float:
        """Simulated time since the robot settled [s]."""
        return self._steps_done * self.settings.time_step

    def reset(
        self, step: Step, joint_positions: ArrayLike, pelvis: ArrayLike, pelvis_yaw: float, thrust: float = 0.0
    ) -> Measurement:
        """Begin a step: the robot stands at rest on the cartons of start and support, and settles.

        Args:
            step: The step; the cartons go under its start, support and landing.
            joint_positions: First posture (12,) [rad]; the servos hold it.
            pelvis: Where the pelvis is (3,) [m]. It is moved so that the support sole is exactly on its carton.
            pelvis_yaw: Yaw of the level pelvis [rad].
            thrust: Thrust [N] that the swing foot's fan is told meanwhile.

        Returns:
            What was measured while it settled; its time ends at 0.

        Raises:
            ValueError: If a shape is wrong, a number is not finite or the step is another robot's.
            WorldStateError: If the world is closed.
        """
        self._refuse_if_closed()
        step.require_robot(self.robot)
        command, thrust = self._command(joint_positions), _finite(thrust, "thrust")
        pose = _level_pose(pelvis, pelvis_yaw)
        support = opposite(step.swing)
        sole = forward_kinematics(self.robot, command).soles[0 if support == "left" else 1]
        settle_steps = max(self.settings.steps(self.settings.settle_time), 1)
        with self._unseen():
            self.client.restoreState(self._pristine)
            self._disturber.begin()
            self.place_cartons(step)
            self.body.place(command, pose._replace(position=pose.position + step.support - pose.point(sole)))
            self.actuators.reset(command, thrust, step.swing, self._disturber.acting)
            self._footing = self._stand(step, np.array(step.support))
            self._steps_done, self._time_asked = -settle_steps, 0.0
            settled = self._simulate(command, thrust, settle_steps, stop_on_fall=True)
        self._steps_done = 0
        self._footing = self._stand(step, self.body.sole(support).position)
        return settled

    def disturb(self, disturbance: Disturbance) -> None:
        """Let a disturbance act from the next reset on; ``Disturbance()`` is none."""
        self._refuse_if_closed()
        self._disturber.disturbance = disturbance

    def advance(
        self,
        joint_positions: ArrayLike,
        thrust: float,
        duration: float,
        *,
        rest: float = 0.0,
        stop_on_fall: bool = True,
    ) -> Measurement:
        """Move to the next posture and thrust.

        Both commands go there in straight lines over the duration, less the rest; the joints' corners are rounded
        (:class:`~jet_gym.simulation.motion.CommandBlend`) and the fan lags behind.

        Args:
            joint_positions: Posture at the end (12,) [rad], clipped to the joint limits.
            thrust: Thrust of the swing foot's fan at the end [N], clipped to what the fan can do.
            duration: How long it takes [s]. Whole simulation steps pass; what is rounded off is made up for
                the next time, what a fall cuts off is not.
            rest: For how much of it, at its end, both commands stay where they then are [s]; less than all of it.
            stop_on_fall: Whether to stop when the robot has fallen.

        Raises:
            ValueError: If a shape is wrong, a number is not finite or the duration is not positive.
            WorldStateError: If the world is closed or was not reset.
        """
        self._standing()
        command, thrust = self._command(joint_positions), _finite(thrust, "thrust")
        duration = _finite(duration, "duration")
        if duration <= 0.0:
            raise ValueError(f"duration must be more than 0 s, not {duration}")
        if not 0.0 <= rest < duration:
            raise ValueError(f"rest must be at least 0 s and less than the duration of {duration} s, not {rest}")
        self._time_asked += duration
        steps = max(self.settings.steps(self._time_asked) - self._steps_done, 1)
        resting = min(self.settings.steps(rest), steps - 1)
        end = self._steps_done + steps
        measured = self._simulate(command, thrust, steps, stop_on_fall, resting)
        if self._steps_done < end:
            self._time_asked = self.time
        return measured

    def hold(self, duration: float, *, stop_on_fall: bool = True) -> Measurement:
        """Keep the last commands for a time [s]; see :meth:`advance`."""
        self._standing()
        return self.advance(self.actuators.posture, self.actuators.thrust, duration, stop_on_fall=stop_on_fall)

    def next_step(self, step: Step) -> None:
        """Go on with another step from where the robot stands; the free carton moves under the new landing.

        Where the other foot swings, its fan is the one that is commanded from now on, and the last one stops.

        Raises:
            StepError: If the step begins elsewhere than the last one ended.
            ValueError: If it is another robot's.
            WorldStateError: If the world is closed or was not reset.
        """
        self._standing()
        step.require_robot(self.robot)
        self._step_number += 1
        self.cartons.continue_with(step, self._disturber.acting.block_height(self._step_number))
        self.step = step
        self.actuators.swing(step.swing)
        self._footing = self._stand(step, self.body.sole(opposite(step.swing)).position)

    def clear_start(self) -> None:
        """Take the start's carton away.

        Where it is in the landing's way, :meth:`advance`, :meth:`pose` and :meth:`show` do so by themselves as soon
        as the swing foot is nearer to its landing than to its start.
        """
        self._refuse_if_closed()
        self.cartons.clear_start()
        self._set_collisions()

    def place_cartons(self, step: Step) -> None:
        """Place cartons and floor for a step, without the robot; :meth:`reset` does it by itself.

        Raises:
            ValueError: If the step is another robot's.
            WorldStateError: If the world is closed.
        """
        self._refuse_if_closed()
        step.require_robot(self.robot)
        self.step, self._footing, self._step_number = step, None, 0
        self.cartons.place(step, self._disturber.acting.block_height(0))

    def pose(self, joint_positions: ArrayLike, pelvis: ArrayLike, pelvis_yaw: float) -> None:
        """Put the robot somewhere without any dynamics, to look at it; to simulate again, reset.

        Args:
            joint_positions: Joint positions (12,) [rad].
            pelvis: Position of the pelvis origin (3,) [m].
            pelvis_yaw: Yaw of the level pelvis [rad].

        Raises:
            ValueError: If a shape is wrong or a number is not finite.
            WorldStateError: If the world is closed.
        """
        self.show(joint_positions, _level_pose(pelvis, pelvis_yaw))

    def show(self, joint_positions: ArrayLike, pelvis: Pose) -> None:
        """Put the robot somewhere like :meth:`pose`, but with a pelvis that may tilt.

        Args:
            joint_positions: Joint positions (12,) [rad].
            pelvis: Pose of the pelvis.

        Raises:
            ValueError: If the joint positions have a wrong shape or are not finite.
            WorldStateError: If the world is closed.
        """
        self._refuse_if_closed()
        joints = _vector(joint_positions, "joint_positions", 12)
        self._footing = None
        self.body.place(joints, pelvis)
        if self.step is not None:
            self._clear_start_when_left(self.step, self.body.sole(self.step.swing).position)

    def _simulate(
        self, command: Array, thrust: float, steps: int, stop_on_fall: bool, resting: int = 0
    ) -> Measurement:
        footing = self._standing()
        recorder = Recorder(self.body, self.settings, footing)
        self.actuators.set_course(command, thrust, steps, resting)
        for k in range(1, steps + 1):
            delivered = self.actuators.step()
            self._disturber.step(self.time)
            self.client.stepSimulation()
            self._steps_done += 1
            recorder.step(delivered)
            if k % self.settings.sample_every == 0 or k == steps:
                recorder.sample()
                self._clear_start_when_left(footing.step, recorder.swing_sole.position)
                if self._gui:
                    self._keep_pace()
                if recorder.reason and stop_on_fall:
                    break
        return recorder.measurement(self.time)

    def _stand(self, step: Step, sole: Array) -> Footing:
        """Let the feet touch their cartons, and remember where the support sole is."""
        self._set_collisions()
        self._clock = perf_counter() - self.time
        return Footing(step, opposite(step.swing), sole, self.cartons.soles["support"][2])

    def _set_collisions(self) -> None:
        if self.step is not None:
            swing, support = self.body.leg(self.step.swing), self.body.leg(opposite(self.step.swing))
            self.cartons.set_collisions(self.body.id, swing, support)

    def _clear_start_when_left(self, step: Step, swing_sole: Array) -> None:
        landing_is_nearer = math.dist(swing_sole, step.landing) < math.dist(swing_sole, step.start)
        if landing_is_nearer and self.cartons.conflict("start", "landing"):
            self.clear_start()

    @contextmanager
    def _unseen(self) -> Iterator[None]:
        """Let the window, if there is one, draw nothing for a while: every call would wait for its pictures."""
        if self._gui:
            self.client.configureDebugVisualizer(self.client.COV_ENABLE_RENDERING, 0)
        yield
        if self._gui:
            self.client.configureDebugVisualizer(self.client.COV_ENABLE_RENDERING, 1)

    def _keep_pace(self) -> None:
        sleep(max(self._clock + self.time - perf_counter(), 0.0))

    def _command(self, joint_positions: ArrayLike) -> Array:
        return np.clip(_vector(joint_positions, "joint_positions", 12), self.robot.lower, self.robot.upper)

    def _standing(self) -> Footing:
        self._refuse_if_closed()
        if self._footing is None:
            raise WorldStateError("reset the world before you move the robot")
        return self._footing

    def _refuse_if_closed(self) -> None:
        if not self._open:
            raise WorldStateError("the world is closed; make a new one")


def _level_pose(pelvis: ArrayLike, pelvis_yaw: float) -> Pose:
    return Pose(_vector(pelvis, "pelvis", 3), from_yaw(_finite(pelvis_yaw, "pelvis_yaw")))


def _vector(values: ArrayLike, name: str, length: int) -> Array:
    vector = finite_array(values, name, length)
    if vector.shape != (length,):
        raise ValueError(f"{name} must have shape ({length},), not {vector.shape}")
    return vector


def _finite(value: float, name: str) -> float:
    if not math.isfinite(value):
        raise ValueError(f"{name} must be finite, not {value}")
    return float(value)
