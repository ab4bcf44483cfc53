"""What one page asks for: the step, who plans it, and by which settings."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

from agents.planner import PLANNERS
from jet_gym.balance import BalanceSettings, ThrustModel
from jet_gym.courses import PAPER
from jet_gym.fitness import FitnessSettings
from jet_gym.leg import Side, Vector
from jet_gym.robot import Robot, jet_hr1
from jet_gym.step import Step
from jet_gym.studio.own_models import OwnModel

FEET = ("start", "landing", "support")
"""What can be dragged: where the swing foot leaves, where it lands, where the other foot stands."""

MOTIONS = ("forward", "side")
"""The paper's motions that a page can begin with."""

MOTION_POINTS = {"forward": 60, "side": 30}
"""Swing points of a motion on the page: fewer than the paper's course has, so that a drag is followed at once."""


@dataclass(frozen=True)
class Inputs:
    """Everything that a plan depends on.

    Nothing is checked here, because a person who drags a block passes through steps that make no sense:
    :attr:`step` and :attr:`balance` refuse them.

    Attributes:
        swing: The leg that swings.
        start: Where the swing sole leaves (x, y, z) [m].
        landing: Where it lands [m].
        support: Where the other sole stands [m].
        apex: Height of the swing path above its chord [m].
        points: Number of swing points.
        duration: Time from the first to the last swing point [s].
        planner: Name of the planner.
        rival: Name of the planner that is drawn as a ghost, or ``None``.
        seed: Seed of both.
        thrust_model: ``"assigned"`` or ``"least"``.
        smoothness_weight: omega of eq. (18) [1/m^2].
        zmp_margin: Distance that planning keeps between ZMP and the sole's edge [m].
        max_thrust: Largest thrust [N]; the robot's own where ``None``.
        edge_tolerance: rho of eq. (10) [rad].
        robot: The robot.
        models: Policies of the user's own.
    """

    swing: Side
    start: Vector
    landing: Vector
    support: Vector
    apex: float = Step.apex
    points: int = Step.points
    duration: float = Step.duration
    planner: str = "gas"
    rival: str | None = None
    seed: int = 0
    thrust_model: ThrustModel = "assigned"
    smoothness_weight: float = FitnessSettings.smoothness_weight
    zmp_margin: float = BalanceSettings.zmp_margin
    max_thrust: float | None = None
    edge_tolerance: float = BalanceSettings.edge_tolerance
    robot: Robot | None = None
    models: tuple[OwnModel, ...] = ()

    @classmethod
    def of_motion(cls, name: str) -> Inputs:
        """Return one of the paper's motions, ``"forward"`` or ``"side"``, with every setting at its default."""
        return cls(**_fields_of(replace(PAPER[name], points=MOTION_POINTS[name])))

    def with_step(self, step: Step) -> Inputs:
        """Return the same settings for another step."""
        return replace(self, **_fields_of(step))

    def with_model(self, model: OwnModel) -> Inputs:
        """Return the same inputs with a policy more, planned by it; one of the same name is replaced."""
        others = tuple(known for known in self.models if known.name != model.name)
        return replace(self, models=(*others, model), planner=model.planners[0])

    @property
    def planners(self) -> tuple[str, ...]:
        """Names of the planners that can be asked for, the user's own at the end."""
        return (*PLANNERS, *(name for model in self.models for name in model.planners))

    def moved(self, foot: str, position: Vector) -> Inputs:
        """Return the same inputs with one foot elsewhere.

        Args:
            foot: One of :data:`FEET`.
            position: Where to (x, y, z) [m].
        """
        if foot not in FEET:
            raise ValueError(f"a foot is one of {', '.join(FEET)}, not {foot!r}")
        x, y, z = (float(value) for value in position)
        there: dict[str, Any] = {foot: (x, y, z)}
        return replace(self, **there)

    def position(self, foot: str) -> Vector:
        """Return where a foot of :data:`FEET` is [m]."""
        position: Vector = getattr(self, foot)
        return position

    @property
    def step(self) -> Step:
        """The step.

        Raises:
            StepError: If it makes no sense.
        """
        return Step(
            swing=self.swing,
            start=self.start,
            landing=self.landing,
            support=self.support,
            apex=self.apex,
            points=self.points,
            duration=self.duration,
            robot=self.robot or jet_hr1(),
        )

    @property
    def balance(self) -> BalanceSettings:
        """What counts as balanced.

        Raises:
            SettingsError: If a setting is outside of what is allowed.
        """
        return BalanceSettings(
            thrust_model=self.thrust_model,
            zmp_margin=self.zmp_margin,
            edge_tolerance=self.edge_tolerance,
            max_thrust=self.max_thrust,
        )

    @property
    def fitness(self) -> FitnessSettings:
        """Weights and penalties.

        Raises:
            SettingsError: If the weight is outside of what is allowed.
        """
        return FitnessSettings(smoothness_weight=self.smoothness_weight)


def _fields_of(step: Step) -> dict[str, Any]:
    return {field.name: getattr(step, field.name) for field in fields(step)}
