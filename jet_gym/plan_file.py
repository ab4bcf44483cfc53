"""The file of a plan, ``plan.json``: its fields, each read with an error that names it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from jet_gym.constraints import CONSTRAINT_NAMES
from jet_gym.errors import JetGymError, PlanFileError
from jet_gym.robot import Robot
from jet_gym.step import Step
from jet_gym.utils.arrays import Array
from jet_gym.utils.files import read_whole

FORMAT = "jet-gym-plan/1"
ARRAY_WIDTHS: dict[str, int | None] = {
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
"""The arrays of a plan and the length of their rows; ``None`` for a plain list."""

_PATH_TOLERANCE = 1e-9  # [m] rounding of a path that another machine computed


def read_json(path: str | Path) -> Any:
    """Return what a JSON file holds.

    Raises:
        PlanFileError: If it cannot be read, is no text or no JSON.
    """
    try:
        text = read_whole(path).decode()
    except (OSError, ValueError) as error:  # a path with a null character is a ValueError
        if isinstance(error, UnicodeDecodeError):
            raise PlanFileError(f"{path} is not a plan: it is not a text file") from error
        raise PlanFileError(f"cannot read the plan {path!s}: {getattr(error, 'strerror', error)}") from error
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise PlanFileError(f"{path} is not a plan: it is not JSON ({error})") from error


def read_fields(data: Any, robot: Robot) -> dict[str, Any]:
    """Return what a plan for a robot is made of, from plain data of which every field is checked.

    Raises:
        PlanFileError: If a field is missing, of the wrong shape or not finite.
    """
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
    arrays = {name: _read_array(data, name, step.points, width) for name, width in ARRAY_WIDTHS.items()}
    if np.any(np.diff(arrays["time"]) <= 0.0):
        raise PlanFileError("field 'time' must increase from swing point to swing point")
    if np.abs(arrays["swing_sole"] - step.swing_sole).max() > _PATH_TOLERANCE:
        raise PlanFileError("field 'swing_sole' must be the path of field 'step'")
    if (arrays["evaluations"] < 0.0).any():
        raise PlanFileError("field 'evaluations' must be 0 or more")
    return {
        "planner": planner,
        "seed": seed,
        "step": step,
        "violations": _read_violations(data.get("violations"), step.points),
        **arrays,
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


def _read_violations(data: Any, points: int) -> tuple[tuple[str, ...], ...]:
    known = sorted(CONSTRAINT_NAMES.values())
    if not isinstance(data, list) or len(data) != points:
        raise PlanFileError(f"field 'violations' must be a list of {points} lists of names")
    for names in data:
        if not isinstance(names, list) or not all(name in known for name in names):
            raise PlanFileError(f"field 'violations' may only name {known}, not {names!r}")
    return tuple(tuple(names) for names in data)
