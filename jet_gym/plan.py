"""A plan: the posture, thrust and fitness at every swing point of a step, and its file."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from jet_gym.arrays import Array, finite_array
from jet_gym.balance import BalanceSettings
from jet_gym.constraints import CONSTRAINT_NAMES, SEARCH_RANGE, violation_names
from jet_gym.errors import JetGymError, PlanFileError
from jet_gym.files import write_whole
from jet_gym.fitness import FitnessSettings, fitness_of_postures
from jet_gym.leg import SIDES
from jet_gym.posture import evaluate_postures
from jet_gym.robot import Robot, jet_hr1
from jet_gym.step import Step

FORMAT = "jet-gym-plan/1"
_PATH_TOLERANCE = 1e-9  # [m] rounding of a path that another machine computed
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
        search_range: float = 0.025,
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
        search_range: float = 0.025,
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
        """
        plans: list[Plan | None] = [None] * len(steps)
        for side in SIDES:
            chosen = [number for number, step in enumerate(steps) if step.swing == side]
            if not chosen:
                continue
            pelvises = [_checked_path(steps[number], paths[number]) for number in chosen]
            soles = [steps[number].swing_sole for number in chosen]
            counts = [len(path) for path in pelvises]
            supports = np.repeat([steps[number].support for number in chosen], counts, axis=0)
            pelvis, robot = np.concatenate(pelvises), steps[chosen[0]].robot
            postures = evaluate_postures(robot, side, np.concatenate(soles), supports, pelvis, balance)
            starts = np.cumsum([0, *counts[:-1]])
            flags = postures.violations.copy()
            far = np.abs(np.diff(pelvis, axis=0, prepend=pelvis[:1])).max(axis=1) > search_range + _RANGE_TOLERANCE
            far[starts] = False
            flags[far] |= SEARCH_RANGE
            terms = fitness_of_postures(postures.violations, postures.thrust, pelvis, fitness, starts)
            totals = terms.sum(axis=1)
            for number, start, count, sole in zip(chosen, starts.tolist(), counts, soles, strict=True):
                rows = slice(start, start + count)
                plans[number] = cls(
                    planner=planner,
                    seed=seed,
                    step=steps[number],
                    time=steps[number].time,
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
        return [plan for plan in plans if plan is not None]

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
            **{name: getattr(self, name).tolist() for name in _array_widths()},
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
        try:
            text = Path(path).read_text(encoding="utf-8")
        except (OSError, ValueError) as error:  # a path with a null character is a ValueError
            if isinstance(error, UnicodeDecodeError):
                raise PlanFileError(f"{path} is not a plan: it is not a text file") from error
            raise PlanFileError(f"cannot read the plan {path!s}: {getattr(error, 'strerror', error)}") from error
        try:
            data = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise PlanFileError(f"{path} is not a plan: it is not JSON ({error})") from error
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
        robot = robot or jet_hr1()
        if not isinstance(data, dict) or data.get("format") != FORMAT:
            found = data.get("format") if isinstance(data, dict) else type(data).__name__
            raise PlanFileError(f"field 'format' must be {FORMAT!r}, not {found!r}")
        if data.get("robot") != robot.name:
            raise PlanFileError(f"field 'robot' is {data.get('robot')!r}, but the robot at hand is {robot.name!r}")
        if data.get("joint_names") != list(robot.joint_names):
            raise PlanFileError(f"field 'joint_names' must be the joints of {robot.name} in its own order")
        planner, seed = data.get("planner"), data.get("seed")
        if not isinstance(planner, str):
            raise PlanFileError(f"field 'planner' must be a name, not {planner!r}")
        if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
            raise PlanFileError(f"field 'seed' must be a whole number of 0 or more, not {seed!r}")
        step = _read_step(data.get("step"), robot)
        if data.get("support_sole") != list(step.support):
            raise PlanFileError("field 'support_sole' must be the support of field 'step'")
        arrays = {name: _read_array(data, name, step.points, width) for name, width in _array_widths().items()}
        if np.any(np.diff(arrays["time"]) <= 0.0):
            raise PlanFileError("field 'time' must increase from swing point to swing point")
        if np.abs(arrays["swing_sole"] - step.swing_sole).max() > _PATH_TOLERANCE:
            raise PlanFileError("field 'swing_sole' must be the path of field 'step'")
        if (arrays["evaluations"] < 0.0).any():
            raise PlanFileError("field 'evaluations' must be 0 or more")
        return cls(
            planner=planner,
            seed=seed,
            step=step,
            violations=_read_violations(data.get("violations"), step.points),
            **arrays,
        )


def roughness(trajectory: ArrayLike) -> float:
    """Return the root mean square length of a trajectory's second differences; 0 below three points.

    Args:
        trajectory: Values (N,) or (N, D) at equally spaced points.
    """
    second = np.diff(np.asarray(trajectory, dtype=np.float64), n=2, axis=0).reshape(-1)
    points = max(len(np.asarray(trajectory)) - 2, 1)
    return math.sqrt(float(second @ second) / points)


def _array_widths() -> dict[str, int | None]:
    """Return the arrays of a plan and the length of their rows; ``None`` for a plain list."""
    return {
        "time": None,
        "swing_sole": 3,
        "pelvis": 3,
        "pelvis_yaw": None,
        "joint_positions": 12,
        "com": 3,
        "zmp": 2,
        "assigned_zmp": 2,
        "fan": 3,
        "thrust": None,
        "fitness": None,
        "edge_angle": None,
        "solve_time": None,
        "evaluations": None,
    }


def _read_array(data: dict[str, Any], name: str, points: int, width: int | None) -> Array:
    shape = (points,) if width is None else (points, width)
    if name not in data:
        raise PlanFileError(f"field {name!r} is missing")
    if not isinstance(data[name], list) or len(data[name]) != points:
        raise PlanFileError(f"field {name!r} must be a list of {points}, one for each swing point")
    rows = [[row] for row in data[name]] if width is None else data[name]
    if not all(isinstance(row, list) and all(type(value) in (int, float) for value in row) for row in rows):
        raise PlanFileError(f"field {name!r} must be numbers of shape {shape}")
    try:
        array = np.array(data[name], dtype=np.float64)
    except (ValueError, OverflowError):
        raise PlanFileError(f"field {name!r} must be finite numbers of shape {shape}") from None
    if array.shape != shape:
        raise PlanFileError(f"field {name!r} must have shape {shape}, not {array.shape}")
    if not np.isfinite(array).all():
        raise PlanFileError(f"field {name!r} must be finite")
    return array


def _read_step(data: Any, robot: Robot) -> Step:
    if not isinstance(data, dict):
        raise PlanFileError(f"field 'step' must be a table, not {type(data).__name__}")
    names = {"swing", "start", "landing", "support", "apex", "points", "duration"}
    unknown, missing = sorted(set(data) - names), sorted(names - set(data))
    if unknown or missing:
        raise PlanFileError(f"field 'step' has unknown entries {unknown} or lacks {missing}")
    try:
        return Step(robot=robot, **data)
    except JetGymError as error:
        raise PlanFileError(f"field 'step': {error}") from error


def _checked_path(step: Step, pelvis: ArrayLike) -> Array:
    path = finite_array(pelvis, "pelvis", 3)
    if path.shape != (step.points, 3):
        raise ValueError(f"pelvis must have shape ({step.points}, 3), one row a swing point, not {path.shape}")
    return path


def _read_violations(data: Any, points: int) -> tuple[tuple[str, ...], ...]:
    known = sorted(CONSTRAINT_NAMES.values())
    if not isinstance(data, list) or len(data) != points:
        raise PlanFileError(f"field 'violations' must be a list of {points} lists of names")
    for names in data:
        if not isinstance(names, list) or not all(name in known for name in names):
            raise PlanFileError(f"field 'violations' may only name {known}, not {names!r}")
    return tuple(tuple(names) for names in data)
