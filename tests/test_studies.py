"""The sweep, the claims and the statistics behind them."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from agents import make_planner
from agents.studies.claims import ClaimKey, measure_claims
from agents.studies.sweep import sweep_smoothness
from agents.summary import summarize
from jet_gym.courses import PAPER
from jet_gym.fitness import FitnessSettings
from jet_gym.utils.statistics import bootstrap_mean


def test_bootstrap_interval_covers_the_mean_in_about_95_of_100_samples() -> None:
    generator = np.random.default_rng(0)
    covered = 0
    for trial in range(100):
        interval = bootstrap_mean(generator.normal(1.0, 2.0, 50).tolist(), seed=trial)
        covered += interval.low <= 1.0 <= interval.high
    assert 88 <= covered <= 99


def test_equal_values_have_a_point_for_an_interval_and_none_are_refused() -> None:
    interval = bootstrap_mean([2.0, 2.0])
    assert interval.low == interval.mean == interval.high == 2.0
    with pytest.raises(ValueError, match="at least one value"):
        bootstrap_mean([])


def test_a_summary_is_of_one_planner() -> None:
    step = replace(PAPER.side, points=4)
    plans = [make_planner(name).plan(step) for name in ("gas", "ga")]
    with pytest.raises(ValueError, match="one planner"):
        summarize(plans)
    assert summarize(plans[:1]).mean_thrust.mean == pytest.approx(plans[0].thrust.mean())


def test_weight_per_cm2_trades_where_per_m2_does_nothing_and_per_mm2_freezes() -> None:
    seen = []
    rows = sweep_smoothness(range(3), (50.0, 50e4, 50e6), progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (8, 8)
    for motion in ("side", "forward"):
        ga, per_m2, per_cm2, per_mm2 = (row.summary for row in rows if row.motion == motion)
        assert ga.planner == "ga"
        assert per_m2.pelvis_roughness.mean > 0.8 * ga.pelvis_roughness.mean
        assert per_cm2.pelvis_roughness.mean < 0.5 * ga.pelvis_roughness.mean
        assert ga.mean_thrust.mean < per_cm2.mean_thrust.mean < per_mm2.mean_thrust.mean


def test_the_default_weight_is_the_swept_one_per_cm2() -> None:
    assert FitnessSettings().smoothness_weight == 50.0 / 0.01**2


def test_claims_tell_no_violation_and_smoother_pelvis() -> None:
    report = measure_claims(range(3))
    assert {claim.motion for claim in report.claims} == {"side", "forward"}
    by_key = {(claim.motion, claim.key): claim.holds for claim in report.claims}
    for motion in ("side", "forward"):
        assert by_key[motion, "pelvis-smoothness"]
        assert by_key[motion, "gas-thrust"]
        assert all(summary.violations == frozenset() for summary in report.summaries[motion].values())


def test_a_claim_that_does_not_hold_is_told() -> None:
    from agents.studies.claims import _claims_of

    report = measure_claims(range(2))
    swapped = report.summaries["side"] | {
        "gas": report.summaries["side"]["ga"],
        "ga": report.summaries["side"]["gas"],
    }
    holding = {claim.key: claim.holds for claim in _claims_of("side", swapped)}
    assert not holding["gas-thrust"]
    assert not holding["pelvis-smoothness"]


def test_every_claim_is_measured_once_on_each_motion_and_a_missing_one_is_an_error() -> None:
    report = measure_claims(range(2))
    for key in get_args(ClaimKey):
        assert [claim.motion for claim in report.of(key)] == ["side", "forward"]
    assert len(report.claims) == 2 * len(get_args(ClaimKey))
    with pytest.raises(KeyError, match="gas-thrust"):
        replace(report, claims=[]).of("gas-thrust")
