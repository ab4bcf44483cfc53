"""Whether a step can be made at all, and if not, where and why."""

from __future__ import annotations

from dataclasses import replace

import pytest

from agents import make_planner
from jet_gym import Step, jet_hr1
from jet_gym.balance import BalanceSettings
from jet_gym.courses import PAPER
from jet_gym.errors import InfeasibleStepError
from jet_gym.feasibility import diagnose, require_feasible


def _sideways(landing_y: float, **options: float) -> Step:
    return Step("left", (0.0, 0.1125, 0.0), (0.0, landing_y, 0.0), (0.0, -0.1125, 0.0), points=10, **options)


@pytest.mark.parametrize("motion", ["side", "forward"])
def test_every_point_of_the_paper_motions_can_be_made(motion: str) -> None:
    assert diagnose(replace(PAPER[motion], points=6)) == []


def test_a_landing_beyond_both_legs_is_out_of_reach_by_what_is_missing() -> None:
    finding = diagnose(_sideways(2.0), points=[9])[0]
    straight_legs_apart = 2.0 * 0.1125 + 2.0 * 0.4
    assert (finding.point, finding.constraint, finding.unit) == (9, "reach", "mm")
    each_leg_short = 0.5 * (2.1125 - straight_legs_apart)
    assert finding.shortfall == pytest.approx(1e3 * each_leg_short, abs=1.0)


def test_a_wide_landing_takes_more_thrust_than_the_fan_has() -> None:
    finding = diagnose(_sideways(0.8), points=[9])[0]
    assert (finding.constraint, finding.unit) == ("thrust", "N")
    stronger = BalanceSettings(max_thrust=jet_hr1().max_thrust + finding.shortfall + 0.5)
    assert diagnose(_sideways(0.8), stronger, points=[9]) == []


def test_without_a_fan_the_same_side_step_ends_sooner() -> None:
    none = BalanceSettings(thrust_model="least", max_thrust=0.0)
    assert diagnose(_sideways(0.34), points=[9]) == []
    assert diagnose(_sideways(0.34), none, points=[9])[0].constraint in {"thrust", "zmp"}


def test_a_point_that_a_planner_manages_is_never_called_infeasible() -> None:
    step = _sideways(0.55)
    plan = make_planner("gas").plan(step)
    managed = set(range(step.points)) - set(plan.violated_points)
    assert not managed & {finding.point for finding in diagnose(step)}


def test_the_refusal_names_point_constraint_and_amount() -> None:
    with pytest.raises(InfeasibleStepError, match=r"swing point 9 \(of 0 to 9\): it takes a thrust of .* N"):
        require_feasible(_sideways(0.8))
    require_feasible(_sideways(0.3))
