"""Executes plans in simulation: ``execute(plans, settings, seed) -> Execution``."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from jet_gym.errors import SettingsError
from jet_gym.leg import Side
from jet_gym.plan import Plan
from jet_gym.simulation.course import Course, CourseSettings, Phase, make_course
from jet_gym.simulation.diagnosis import Demands, Failure
from jet_gym.simulation.disturbances import Disturbance
from jet_gym.simulation.history import Execution, History
from jet_gym.simulation.imu import Imu, ImuSettings
from jet_gym.simulation.settings import SimulationSettings
from jet_gym.simulation.thrust_control import AttitudeFeedback, PidSettings
from jet_gym.simulation.world import World
from jet_gym.utils.progress import Progress
from jet_gym.utils.settings import require_seed, require_within

ThrustControl = Literal["feedforward", "pid"]
CONTROL_NAMES: dict[str, str] = {"feedforward": "feed-forward", "pid": "feed-forward and PID"}
"""What ways to control the thrust are called."""

_FAILED_LANDING = "the {side} foot never carried the robot"


@dataclass(frozen=True)
class ExecutionSettings:
    """How plans are executed.

    Attributes:
        thrust: ``"feedforward"``, the plan's thrust; or ``"pid"``, which adds a PID on the pelvis' attitude.
        course: How the plans are put into time.
        imu: What the IMU gets wrong.
        pid: Gains of the PID.
        simulation: The physics engine and the servos.
        fan_power: Share [1] of the commanded thrust that is passed to the fans; 0 switches them off.
        carrying_share: Share [1] of the weight that a landed foot must carry before it becomes the support foot.
        lift_off_share: Share [1] of the force on the ground that the support foot must carry before the other
            one lifts off.
        airborne_share: Share [1] of the weight; a swing foot that carries less is in the air, and the PID acts.
        patience: Time [s] that is waited for either.
        landing_tolerance: Largest distance [m] of a foot from its planned place, at touchdown and at the end, in an
            execution that succeeds. Cartons are 20 mm longer than the soles at toe and heel and 5 mm wider at each
            side: 15 mm let at most 10 mm of a sole hang over, half of the margin that plans keep the ZMP from its
            edge.
        slip_tolerance: Largest distance [m] that a support foot may slide in an execution that succeeds.
    """

    thrust: ThrustControl = "feedforward"
    course: CourseSettings = field(default_factory=CourseSettings)
    imu: ImuSettings = field(default_factory=ImuSettings)
    pid: PidSettings = field(default_factory=PidSettings)
    simulation: SimulationSettings = field(default_factory=SimulationSettings)
    fan_power: float = 1.0
    carrying_share: float = 0.3
    lift_off_share: float = 0.75
    airborne_share: float = 0.03
    patience: float = 1.0
    landing_tolerance: float = 0.015
    slip_tolerance: float = 0.01

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed.

        Raises:
            SettingsError: A ``ValueError`` that names the setting and what it may be.
        """
        if self.thrust not in get_args(ThrustControl):
            allowed = " or ".join(map(repr, get_args(ThrustControl)))
            raise SettingsError(f"thrust must be {allowed}, not {self.thrust!r}")
        for name in ("fan_power", "carrying_share", "lift_off_share", "airborne_share"):
            require_within(name, getattr(self, name), most=1.0)
        for name in ("patience", "landing_tolerance", "slip_tolerance"):
            require_within(name, getattr(self, name))


def execute(
    plans: Sequence[Plan],
    settings: ExecutionSettings | None = None,
    seed: int = 0,
    *,
    disturbance: Disturbance | None = None,
    gui: bool = False,
    progress: Progress | None = None,
) -> Execution:
    """Let the robot execute plans on cartons, and say what happened.

    The robot stands between its feet, shifts its weight, makes the first plan's step, moves its pelvis over to the
    other foot, makes the next one's, and stands. The same plans, settings and seed give the same result to the last
    bit on one machine::

        from agents import make_planner
        from jet_gym.courses import PAPER
        from jet_gym.simulation import ExecutionSettings, execute

        plans = [make_planner("gas").plan(step) for step in PAPER]
        result = execute(plans, ExecutionSettings(thrust="pid"), seed=0)
        print(result.summary.outcome)
        plot(result.time, result.joint_positions, result.thrust_delivered)

    What it returns holds time series, one row every ``sample_every`` simulation steps, 60 a second by default: see
    :class:`~jet_gym.simulation.history.Execution`; :func:`jet_gym.simulation.pictures.film.film` shows them.

    Args:
        plans: One plan or several, each beginning where the one before it ended.
        settings: How; the defaults where omitted.
        seed: Of the IMU's bias and noise.
        disturbance: What differs from the model; nothing where omitted.
        gui: Whether to show PyBullet's window, in real time.
        progress: Called with how many hundredths of a second are done and how many there are.

    Raises:
        ValueError: If there is no plan, they do not belong together, or the seed is not a whole number
            of 0 or more.
        BulletMissingError: If PyBullet is not installed.
        DisplayMissingError: If there is no display for the window.
    """
    settings = settings or ExecutionSettings()
    require_seed(seed)
    course = make_course(plans, settings.course)
    with World(plans[0].step.robot, settings.simulation, gui=gui) as world:
        world.disturb(disturbance or Disturbance())
        run = _Run(world, course, _disturbed(settings, disturbance), int(seed), progress)
        run.run()
        weight = plans[0].step.robot.mass * settings.simulation.gravity
        demands = Demands(settings.landing_tolerance, settings.slip_tolerance, settings.airborne_share * weight)
        return run.history.execution(course, settings.thrust, int(seed), run.failure, demands)


def _disturbed(settings: ExecutionSettings, disturbance: Disturbance | None) -> ExecutionSettings:
    """Return settings whose IMU is that of a disturbance."""
    if disturbance is None:
        return settings
    imu = settings.imu
    noisy = {
        name: disturbance.imu_noise * getattr(imu, name)
        for name in ("accelerometer_noise", "gyroscope_noise", "accelerometer_bias", "gyroscope_bias")
    }
    delay = imu.delay if disturbance.imu_delay is None else disturbance.imu_delay
    return dataclasses.replace(settings, imu=dataclasses.replace(imu, delay=delay, **noisy))


class _Run:
    """One execution in the making."""

    def __init__(
        self,
        world: World,
        course: Course,
        settings: ExecutionSettings,
        seed: int,
        progress: Progress | None,
    ) -> None:
        self._world, self._course, self._settings = world, course, settings
        self._progress = progress
        self._frame = settings.simulation.sample_every * settings.simulation.time_step
        self._weight = world.robot.mass * settings.simulation.gravity
        imu = Imu(settings.imu, settings.simulation.gravity, np.random.default_rng(seed))
        self._feedback = AttitudeFeedback(
            world.body, imu, settings.pid, settings.simulation.time_step, settings.course.stand_time
        )
        self._swing: Side = course.plans[0].step.swing
        self._plan = 0
        self.history = History(world)
        self.failure: Failure | None = None

    def run(self) -> None:
        """Go through the phases until the end or a fall."""
        world, course = self._world, self._course
        step = course.plans[0].step
        world.actuators.feedback = self._thrust
        self._feedback.swing(step.swing)
        world.reset(step, course.phases[0].joint_positions[0], course.pelvis, course.pelvis_yaw)
        self.history.begin()
        for phase in course.phases:
            self._wait_for_weight(phase)
            self._go_through(phase)
            if self.failure:
                break

    def _thrust(self, thrust: float) -> float:
        """Return what the fan is told: what was commanded, with the PID's correction where there is one."""
        chosen = self._feedback(thrust) if self._settings.thrust == "pid" else thrust
        return self._settings.fan_power * chosen

    def _go_through(self, phase: Phase) -> None:
        frames = max(math.ceil(phase.duration / self._frame - 1e-9), 1)
        for frame in range(1, frames + 1):
            time = frame * self._frame
            if not self._advance(phase, time):
                return
            if phase.kind == "transition" and self._plan == phase.plan and time >= 0.5 * phase.duration:
                self._change_support_if_carried()
        patience = round(self._settings.patience / self._frame)
        while phase.kind == "transition" and self._plan == phase.plan:
            if patience == 0:
                self.failure = Failure(_FAILED_LANDING.format(side=self._swing), False, self._swing)
                return
            patience -= 1
            if not self._advance(phase, phase.duration):
                return
            self._change_support_if_carried()

    def _wait_for_weight(self, phase: Phase) -> None:
        """Before lift-off, wait until the support foot carries the robot."""
        if phase.kind != "motion":
            return
        for _ in range(round(self._settings.patience / self._frame)):
            left, right = self.history.forces
            support = right if self._swing == "left" else left
            if support >= self._settings.lift_off_share * (left + right) or not self._advance(phase, 0.0):
                return

    def _change_support_if_carried(self) -> None:
        left, right = self.history.forces
        landed = left if self._swing == "left" else right
        if landed >= self._settings.carrying_share * self._weight:
            self._plan += 1
            step = self._course.plans[self._plan].step
            self._world.next_step(step)
            self._swing = step.swing
            self._feedback.swing(step.swing)

    def _advance(self, phase: Phase, time: float) -> bool:
        """Let a frame pass; return whether the robot stands."""
        joints, thrust, next_thrust = phase.at(time)
        left, right = self.history.forces
        carried = left if self._swing == "left" else right
        in_the_air = carried < self._settings.airborne_share * self._weight
        self._feedback.active = in_the_air and phase.kind in ("motion", "transition", "finish")
        command = thrust if self._plan == phase.plan else next_thrust
        measured = self._world.advance(joints, command, self._frame)
        up = self._feedback.up if self._settings.thrust == "pid" else None
        self.history.add(measured, phase.name, self._plan, self._swing, command, up)
        if self._progress is not None:
            hundredths = round(100.0 * self._course.duration)
            self._progress(min(round(100.0 * measured.time), hundredths), hundredths)
        if measured.fallen:
            self.failure = Failure(measured.reason, True, self._swing)
        return not measured.fallen
