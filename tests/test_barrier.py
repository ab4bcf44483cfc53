"""The interior-point method and its parts, held against linear algebra, the constraints and small bumps."""

from __future__ import annotations

import numpy as np
import pytest

from agents import Plan, make_planner
from agents.paths.barrier import polish, shares_of_mu
from agents.paths.bring_inside import bring_inside
from agents.paths.cost import cost_of_path, search_of_step, stance_at
from agents.paths.linear_algebra import make_positive, solve_banded
from agents.paths.slacks import FILLED, REACH_SLACKS, SLACKS, ZMP_SLACKS, fill_slacks
from jet_gym.balance import BalanceSettings, ThrustModel
from jet_gym.fitness import FitnessSettings
from jet_gym.posture import evaluate_postures
from jet_gym.step import Step

STEP = Step(swing="left", start=(0, 0.1125, 0), landing=(0.2, 0.3, 0.02), support=(0, -0.1125, 0), points=8)


def test_banded_systems_are_solved_as_numpy_solves_them() -> None:
    generator = np.random.default_rng(0)
    for size, width in ((1, 4), (3, 4), (24, 4)):
        lower = np.tril(generator.normal(size=(size, size)))
        lower[np.subtract.outer(np.arange(size), np.arange(size)) > width] = 0.0
        matrix, gradient = lower @ lower.T + np.eye(size), generator.normal(size=size)
        band = np.zeros((size, width + 1))
        for row in range(size):
            for away in range(min(row, width) + 1):
                band[row, away] = matrix[row, row - away]
        step = np.empty(size)
        decrement = solve_banded(band, gradient, step)
        np.testing.assert_allclose(step, np.linalg.solve(matrix, gradient), rtol=1e-6, atol=1e-7)
        assert decrement == pytest.approx(gradient @ step)


def test_negative_curvature_is_cut_off_and_positive_curvature_kept() -> None:
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    matrix = turn @ np.diag([2.0, -3.0, 0.5]) @ turn.T
    make_positive(matrix)
    np.testing.assert_allclose(matrix, turn @ np.diag([2.0, 0.0, 0.5]) @ turn.T, atol=1e-12)


@pytest.mark.parametrize("thrust_model", ["assigned", "least"])
def test_slacks_are_positive_where_the_constraints_hold_and_there_alone(thrust_model: ThrustModel) -> None:
    balance = BalanceSettings(thrust_model=thrust_model)
    model, points = search_of_step(STEP, balance, FitnessSettings())
    planned = make_planner("gas", balance=balance).plan(STEP).pelvis
    generator, seen = np.random.default_rng(2), set()
    margin = balance.zmp_margin if thrust_model == "least" else 0.0
    x_min, x_max, y_min, y_max = STEP.robot.right.sole_rectangle
    for point in range(STEP.points):
        stance = stance_at(model, points, point)
        clouds = [planned[point] + generator.normal(scale=scale, size=(60, 3)) for scale in (5e-4, 5e-3, 5e-2)]
        pelvis = np.concatenate(clouds)
        found = evaluate_postures(STEP.robot, "left", STEP.swing_sole[point], STEP.support, pelvis, balance)
        for place, flags, thrust, zmp in zip(pelvis, found.violations, found.thrust, found.zmp, strict=True):
            slacks = np.empty(FILLED)
            asked, violations = fill_slacks(model, stance, np.array([*place, thrust + 1e-9]), slacks)
            assert (violations, asked) == (flags, pytest.approx(thrust, abs=1e-12))
            if thrust + 1e-9 > 1e-8:  # where it is idle, the bound itself is on its limit
                assert (slacks[:SLACKS] > -1e-12).all() == (flags == 0)
            x, y = zmp - STEP.support[:2]
            room = np.array([x - x_min, x_max - x, y - y_min, y_max - y]) - margin
            np.testing.assert_allclose(slacks[ZMP_SLACKS:REACH_SLACKS], room, atol=1e-7)
            seen.add(int(flags))
    assert len(seen) > 3
    assert 0 in seen


@pytest.mark.parametrize("thrust_model", ["assigned", "least"])
def test_a_path_beside_the_edge_polygon_is_brought_inside(thrust_model: ThrustModel) -> None:
    balance = BalanceSettings(thrust_model=thrust_model)
    model, points = search_of_step(STEP, balance, FitnessSettings())
    path = make_planner("gas", balance=balance).plan(STEP).pelvis.copy()
    path[3:6, 0] += 14e-3
    before = Plan.from_pelvis_path(STEP, path, planner="test", balance=balance)
    assert {"edge_polygon"} <= {name for names in before.violations[3:6] for name in names}
    assert bring_inside(model, points, path) >= 3
    after = Plan.from_pelvis_path(STEP, path, planner="test", balance=balance)
    assert not any(after.violations[3:6])
    assert bring_inside(model, points, path) == 0


def test_polishing_ends_where_no_small_bump_of_the_path_is_cheaper() -> None:
    model, points = search_of_step(STEP, BalanceSettings(), FitnessSettings())
    path = make_planner("gas").plan(STEP).pelvis.copy()
    first = cost_of_path(model, points, path)
    assert polish(model, points, 10.0, 1e-5, shares_of_mu(), path) > 10
    polished = cost_of_path(model, points, path)
    assert polished < first
    generator = np.random.default_rng(3)
    for size in (1e-6, 1e-5, 1e-4):
        for _ in range(50):
            bumped = path + generator.normal(scale=size, size=path.shape)
            assert cost_of_path(model, points, bumped) > polished - 0.05
