"""A plan: the posture, thrust and fitness at every swing point of a step, and its file."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from jet_gym.balance import BalanceSettings
from jet_gym.constraints import LATER_RANGE, SEARCH_RANGE, violation_names
from jet_gym.errors import PlanFileError, SettingsError
from jet_gym.fitness import FitnessSettings, fitness_of_postures
from jet_gym.leg import SIDES
from jet_gym.plan_file import ARRAY_WIDTHS, FORMAT, read_fields, read_json
from jet_gym.posture import evaluate_postures
from jet_gym.robot import Robot, jet_hr1
from jet_gym.step import Step
from jet_gym.utils.arrays import Array, finite_array
from jet_gym.utils.files import write_whole

_RANGE_TOLERANCE = 1e-9  # [m] rounding of a pelvis that moved by the whole search range


@dataclass(frozen=True, eq=False)
class Plan:
    """What a planner found for a step. World frame; N is the number of swing points.

    Attributes:
        planner: Name of the planner.
        seed: Seed that it was given.
        step: The step.
        time: Time of each swing point (N,) [s].
        swing_sole: Swing sole (N, 3) [m].
        pelvis: Pelvis origin (N, 3) [m].
        pelvis_yaw: Yaw of the pelvis (N,) [rad].
        joint_positions: Joint positions (N, 12) [rad].
        com: Centre of mass (N, 3) [m].
        zmp: Zero-moment point under the thrust (N, 2) [m].
        assigned_zmp: Assigned ZMP (N, 2) [m].
        fan: Where the thrust acts (N, 3) [m].
        thrust: Thrust (N,) [N].
        fitness: Fitness of eq. (15) (N,), the smoothness term included from the second point on.
        edge_angle: Angle of eq. (10) (N,) [rad].
        violations: Names of the violated constraints, one tuple a swing point.
        solve_time: Time that the planner took (N,) [s].
        evaluations: Postures that it evaluated (N,).
    """

    planner: str
    seed: int
    step: Step
    time: Array
    swing_sole: Array
    pelvis: Array
    pelvis_yaw: Array
    joint_positions: Array
    com: Array
    zmp: Array
    assigned_zmp: Array
    fan: Array
    thrust: Array
    fitness: Array
    edge_angle: Array
    violations: tuple[tuple[str, ...], ...]
    solve_time: Array = field(repr=False)
    evaluations: Array = field(repr=False)

    @classmethod
    def from_pelvis_path(
        cls,
        step: Step,
        pelvis: ArrayLike,
        *,
        planner: str,
        seed: int = 0,
        balance: BalanceSettings | None = None,
        fitness: FitnessSettings | None = None,
        search_range: float = LATER_RANGE,
        solve_time: ArrayLike | None = None,
        evaluations: ArrayLike | None = None,
    ) -> Plan:
        """Evaluate a pelvis path on a step, whoever made it.

        Args:
            step: The step.
            pelvis: Pelvis at each swing point (N, 3) [m].
            planner: Who made it.
            seed: With which seed.
            balance: What counts as balanced.
            fitness: Weights and penalties by which the path is judged.
            search_range: Largest move of the pelvis between two swing points, per axis [m], eq. (13).
            solve_time: Time taken at each swing point (N,) [s].
            evaluations: Postures evaluated at each swing point (N,).

        Raises:
            ValueError: If the path is not of the step's shape, or not finite.
        """
        (plan,) = cls.from_pelvis_paths(
            [step],
            [pelvis],
            planner=planner,
            seed=seed,
            balance=balance,
            fitness=fitness,
            search_range=search_range,
        )
        return replace(
            plan,
            solve_time=plan.solve_time if solve_time is None else np.asarray(solve_time, dtype=np.float64),
            evaluations=plan.evaluations if evaluations is None else np.asarray(evaluations, dtype=np.float64),
        )

    @classmethod
    def from_pelvis_paths(
        cls,
        steps: Sequence[Step],
        paths: Sequence[ArrayLike],
        *,
        planner: str,
        seed: int = 0,
        balance: BalanceSettings | None = None,
        fitness: FitnessSettings | None = None,
        search_range: float = LATER_RANGE,
        solve_time: float = 0.0,
        evaluations: float = 1.0,
    ) -> list[Plan]:
        """Evaluate pelvis paths on as many steps at once, which takes a fraction of the time.

        Args:
            steps: The steps, all of one robot.
            paths: Pelvis at the swing points of each (N, 3) [m].
            planner: Who made them.
            seed: With which seed.
            balance: What counts as balanced.
            fitness: Weights and penalties by which the paths are judged.
            search_range: Largest move of the pelvis between two swing points, per axis [m], eq. (13).
            solve_time: Time taken at each swing point [s].
            evaluations: Postures evaluated at each swing point.

        Raises:
            SettingsError: A ``ValueError``, if there is not one path a step, or the steps are of several robots.
            ValueError: If a path is not of its step's shape, or not finite.
        """
        _require_paths_of_one_robot(steps, paths)
        plans: dict[int, Plan] = {}
        for side in SIDES:
            chosen = [number for number, step in enumerate(steps) if step.swing == side]
            if not chosen:
                continue
            made = cls._plans_of_side(
                [steps[number] for number in chosen],
                [_checked_path(steps[number], paths[number]) for number in chosen],
                planner=planner,
                seed=seed,
                balance=balance,
                fitness=fitness,
                search_range=search_range,
                solve_time=solve_time,
                evaluations=evaluations,
            )
            plans.update(zip(chosen, made, strict=True))
        return [plans[number] for number in range(len(steps))]

    @classmethod
    def _plans_of_side(
        cls,
        steps: Sequence[Step],
        paths: Sequence[Array],
        *,
        planner: str,
        seed: int,
        balance: BalanceSettings | None,
        fitness: FitnessSettings | None,
        search_range: float,
        solve_time: float,
        evaluations: float,
    ) -> Iterator[Plan]:
        """Evaluate paths, each checked, on steps of one robot and one swing leg, one of them at least."""
        soles, counts = [step.swing_sole for step in steps], [len(path) for path in paths]
        supports = np.repeat([step.support for step in steps], counts, axis=0)
        pelvis, starts = np.concatenate(paths), np.cumsum([0, *counts[:-1]])
        robot, side = steps[0].robot, steps[0].swing
        postures = evaluate_postures(robot, side, np.concatenate(soles), supports, pelvis, balance)
        flags = postures.violations.copy()
        far = np.abs(np.diff(pelvis, axis=0, prepend=pelvis[:1])).max(axis=1) > search_range + _RANGE_TOLERANCE
        far[starts] = False
        flags[far] |= SEARCH_RANGE
        totals = fitness_of_postures(postures.violations, postures.thrust, pelvis, fitness, starts).sum(axis=1)
        for step, sole, start, count in zip(steps, soles, starts.tolist(), counts, strict=True):
            rows = slice(start, start + count)
            yield cls(
                planner=planner,
                seed=seed,
                step=step,
                time=step.time,
                swing_sole=sole,
                pelvis=postures.pelvis[rows],
                pelvis_yaw=postures.pelvis_yaw[rows],
                joint_positions=postures.joint_positions[rows],
                com=postures.center_of_mass[rows],
                zmp=postures.zmp[rows],
                assigned_zmp=postures.assigned_zmp[rows],
                fan=postures.fan[rows],
                thrust=postures.thrust[rows],
                fitness=totals[rows],
                edge_angle=postures.edge_angle[rows],
                violations=tuple(map(violation_names, flags[rows].tolist())),
                solve_time=np.full(count, solve_time),
                evaluations=np.full(count, evaluations),
            )

    @property
    def total_fitness(self) -> float:
        """Sum of the fitness over the step."""
        return float(self.fitness.sum())

    @property
    def violated_points(self) -> tuple[int, ...]:
        """Swing points at which a constraint is violated."""
        return tuple(k for k, names in enumerate(self.violations) if names)

    @property
    def pelvis_roughness(self) -> float:
        """Root mean square second difference of the pelvis path [m]."""
        return roughness(self.pelvis)

    @property
    def thrust_roughness(self) -> float:
        """Root mean square second difference of the thrust [N]."""
        return roughness(self.thrust)

    def save(self, path: str | Path) -> None:
        """Write the plan to a JSON file, whole or not at all.

        Raises:
            OSError: If the file cannot be written.
        """
        write_whole(path, json.dumps(self.to_dict(), indent=1).encode())

    def to_dict(self) -> dict[str, Any]:
        """Return the plan as plain data, format ``jet-gym-plan/1``."""
        return {
            "format": FORMAT,
            "robot": self.step.robot.name,
            "planner": self.planner,
            "seed": self.seed,
            "step": self.step.to_dict(),
            "joint_names": list(self.step.robot.joint_names),
            "support_sole": list(self.step.support),
            **{name: getattr(self, name).tolist() for name in ARRAY_WIDTHS},
            "evaluations": [int(count) for count in self.evaluations],
            "violations": [list(names) for names in self.violations],
        }

    @classmethod
    def load(cls, path: str | Path, robot: Robot | None = None) -> Plan:
        """Read a plan from a JSON file.

        Args:
            path: The file.
            robot: The robot that the plan is for; Jet-HR1 where omitted.

        Raises:
            PlanFileError: If the file cannot be read, is damaged, of another format or not finite; the
                message names the field.
        """
        data = read_json(path)
        try:
            return cls.from_dict(data, robot)
        except PlanFileError as error:
            raise PlanFileError(f"{path}: {error}") from error

    @classmethod
    def from_dict(cls, data: Any, robot: Robot | None = None) -> Plan:
        """Build a plan from plain data, checking every field.

        Raises:
            PlanFileError: If a field is missing, of the wrong shape or not finite.
        """
        return cls(**read_fields(data, robot or jet_hr1()))


def roughness(trajectory: ArrayLike) -> float:
    """Return the root mean square length of a trajectory's second differences; 0 below three points.

    Args:
        trajectory: Values (N,) or (N, D) at equally spaced points.
    """
    second = np.diff(np.asarray(trajectory, dtype=np.float64), n=2, axis=0).reshape(-1)
    points = max(len(np.asarray(trajectory)) - 2, 1)
    return math.sqrt(float(second @ second) / points)


def _require_paths_of_one_robot(steps: Sequence[Step], paths: Sequence[ArrayLike]) -> None:
    if len(paths) != len(steps):
        raise SettingsError(f"there must be one path a step, {len(steps)} in all, not {len(paths)}")
    for step in steps:
        if step.robot is not steps[0].robot:
            raise SettingsError(
                f"all steps must be of one robot, but one is of {steps[0].robot.name} and one of {step.robot.name}"
            )


def _checked_path(step: Step, pelvis: ArrayLike) -> Array:
    path = finite_array(pelvis, "pelvis", 3)
    if path.shape != (step.points, 3):
        raise ValueError(f"pelvis must have shape ({step.points}, 3), one row a swing point, not {path.shape}")
    return path
