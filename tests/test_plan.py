"""A plan and its file: whole, exact, and refused with the field's name where it is damaged."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents import Plan, make_planner
from jet_gym.courses import PAPER
from jet_gym.errors import PlanFileError, SettingsError
from jet_gym.plan import roughness
from jet_gym.task.drawing import draw_random_steps

STEP = replace(PAPER.side, points=8)


@pytest.fixture(scope="module")
def plan() -> Plan:
    return make_planner("gas").plan(STEP, seed=2)


def test_file_holds_the_fields_of_the_format(plan: Plan, tmp_path: Path) -> None:
    plan.save(tmp_path / "plan.json")
    data = json.loads((tmp_path / "plan.json").read_text())
    assert data["format"] == "jet-gym-plan/1"
    assert set(data) == {
        "format", "robot", "planner", "seed", "step", "joint_names", "time", "swing_sole", "support_sole", "pelvis",
        "pelvis_yaw", "joint_positions", "com", "zmp", "assigned_zmp", "fan", "thrust", "fitness", "edge_angle",
        "violations", "solve_time", "evaluations",
    }  # fmt: skip
    assert len(data["joint_names"]) == 12
    assert all(len(data[name]) == 8 for name in ("time", "pelvis", "thrust", "violations", "solve_time"))


def test_a_loaded_plan_is_the_saved_one_to_the_last_bit(plan: Plan, tmp_path: Path) -> None:
    plan.save(tmp_path / "plan.json")
    loaded = Plan.load(tmp_path / "plan.json")
    assert loaded.step == plan.step
    assert (loaded.planner, loaded.seed, loaded.violations) == ("gas", 2, plan.violations)
    for name in ("pelvis", "joint_positions", "com", "zmp", "thrust", "fitness", "time", "evaluations"):
        assert np.array_equal(getattr(loaded, name), getattr(plan, name))


def test_zmp_of_a_plan_balances_weight_and_thrust(plan: Plan) -> None:
    weight = plan.step.robot.mass * 9.81
    moment = weight * plan.com[:, :2] - plan.thrust[:, None] * plan.fan[:, :2]
    assert np.allclose(plan.zmp, moment / (weight - plan.thrust)[:, None])


def test_a_pelvis_that_leaves_the_search_range_is_told(plan: Plan) -> None:
    path = plan.pelvis.copy()
    path[4:] += [0.0, 0.0, -0.03]
    jumped = Plan.from_pelvis_path(STEP, path, planner="mine")
    assert "search_range" in jumped.violations[4]
    assert all("search_range" not in names for k, names in enumerate(jumped.violations) if k != 4)


def test_pelvis_of_the_wrong_length_is_refused(plan: Plan) -> None:
    with pytest.raises(ValueError, match=r"pelvis must have shape \(8, 3\)"):
        Plan.from_pelvis_path(STEP, plan.pelvis[:-1], planner="mine")


def _set(name: str, value: Any) -> Callable[[dict[str, Any]], None]:
    return lambda data: data.__setitem__(name, value)


@pytest.mark.parametrize(
    ("damage", "field"),
    [
        (_set("format", "jet-gym-plan/2"), "format"),
        (_set("robot", "atlas"), "robot"),
        (_set("planner", 3), "planner"),
        (_set("seed", "zero"), "seed"),
        (_set("joint_names", ["knee"]), "joint_names"),
        (_set("step", [1, 2]), "step"),
        (lambda data: data["step"].pop("swing"), "step"),
        (lambda data: data["step"].update(jump=1), "step"),
        (lambda data: data["step"].update(points=1), "step"),
        (lambda data: data["step"].update(landing=[float("nan"), 0, 0]), "step"),
        (lambda data: data.pop("thrust"), "thrust"),
        (lambda data: data["thrust"].pop(), "thrust"),
        (lambda data: data["thrust"].__setitem__(0, None), "thrust"),
        (lambda data: data["thrust"].__setitem__(0, "much"), "thrust"),
        (lambda data: data["thrust"].__setitem__(0, 10**400), "thrust"),
        (lambda data: data["pelvis"].__setitem__(0, [0.0, 0.0]), "pelvis"),
        (lambda data: data["zmp"][3].__setitem__(0, float("inf")), "zmp"),
        (lambda data: data["joint_positions"][3].__setitem__(0, float("nan")), "joint_positions"),
        (lambda data: data["thrust"].__setitem__(0, "1.0"), "thrust"),
        (lambda data: data["thrust"].__setitem__(0, True), "thrust"),
        (lambda data: data.update(pelvis="high"), "pelvis"),
        (lambda data: data["evaluations"].__setitem__(0, -3), "evaluations"),
        (lambda data: data["swing_sole"][0].__setitem__(0, 5.0), "swing_sole"),
        (lambda data: data["step"].update(start="123"), "step"),
        (lambda data: data["step"].update(apex=10**400), "step"),
        (lambda data: data["step"].update(points=10**9), "step"),
        (_set("seed", -1), "seed"),
        (lambda data: data["time"].reverse(), "time"),
        (_set("support_sole", [9.0, 9.0, 9.0]), "support_sole"),
        (_set("violations", []), "violations"),
        (lambda data: data["violations"].__setitem__(0, ["gravity"]), "violations"),
        (lambda data: data["violations"].__setitem__(0, "reach"), "violations"),
        (lambda data: data["violations"].__setitem__(0, [["reach"]]), "violations"),
    ],
)  # fmt: skip
def test_a_damaged_file_is_refused_naming_the_field(
    plan: Plan, tmp_path: Path, damage: Callable[[dict[str, Any]], None], field: str
) -> None:
    data = json.loads(json.dumps(plan.to_dict()))
    damage(data)
    path = tmp_path / "plan.json"
    path.write_text(json.dumps(data))
    with pytest.raises(PlanFileError, match=f"field '{field}'"):
        Plan.load(path)


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe\x00", b"[" * 100_000, b"null", b"[]", b"7"])
def test_a_file_that_is_no_plan_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "plan.json"
    path.write_bytes(content)
    with pytest.raises(PlanFileError):
        Plan.load(path)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PlanFileError, match="No such file"):
        Plan.load(tmp_path / "none.json")


def test_roughness_is_the_root_mean_square_second_difference() -> None:
    assert roughness([0.0, 1.0, 2.0, 3.0]) == 0.0
    assert roughness([0.0, 0.0, 1.0, 0.0]) == pytest.approx(np.sqrt((1.0 + 4.0) / 2.0))
    assert roughness([[0.0, 0.0], [1.0, 1.0], [0.0, 0.0]]) == pytest.approx(np.sqrt(8.0))
    assert roughness([1.0, 2.0]) == 0.0


@pytest.mark.parametrize("paths", [0, 1, 3])
def test_there_is_one_path_a_step(plan: Plan, paths: int) -> None:
    with pytest.raises(SettingsError, match=f"one path a step, 2 in all, not {paths}"):
        Plan.from_pelvis_paths([STEP, STEP], [plan.pelvis] * paths, planner="mine")


def test_steps_of_two_robots_are_not_planned_at_once(plan: Plan) -> None:
    """Whichever their swing legs: the postures of each side are found for one robot."""
    other = replace(STEP, robot=replace(STEP.robot, name="other"))
    for step in (other, replace(PAPER.forward, points=8, robot=other.robot)):
        with pytest.raises(SettingsError, match="one is of jet_hr1 and one of other"):
            Plan.from_pelvis_paths([STEP, step], [plan.pelvis] * 2, planner="mine")
    (alone,) = Plan.from_pelvis_paths([other], [plan.pelvis], planner="mine")
    assert alone.step is other


def test_no_step_makes_no_plan() -> None:
    assert Plan.from_pelvis_paths([], [], planner="mine") == []


def test_plans_made_at_once_are_those_made_one_by_one() -> None:
    steps = draw_random_steps(6, seed=2)
    assert {step.swing for step in steps} == {"left", "right"}
    random = np.random.default_rng(0)
    paths = [step.nominal_pelvis + random.normal(0.0, 0.02, (step.points, 3)) for step in steps]
    for step, path, plan in zip(steps, paths, Plan.from_pelvis_paths(steps, paths, planner="mine"), strict=True):
        alone = Plan.from_pelvis_path(step, path, planner="mine")
        assert plan.step is step
        assert plan.violations == alone.violations
        for name in ("pelvis", "thrust", "fitness", "joint_positions", "zmp", "swing_sole"):
            assert np.array_equal(getattr(plan, name), getattr(alone, name))
