"""How far a disturbance can be raised before it breaks the course."""

from __future__ import annotations

import dataclasses

import pytest
from made_up_trials import without_simulation

from jet_gym.simulation import Disturbance, DisturbanceRanges
from jet_gym.simulation.limits import (
    FACTORS,
    End,
    _find_limit,
    ends_by_limit,
    find_limits,
    in_order_of_breaking,
    load_limits,
    range_ends,
    save_limits,
)
from jet_gym.simulation.results_file import ResultsFileError

pytest.importorskip("pybullet")


class TestLimits:
    def test_ends_disturb_one_quantity_at_a_time(self):
        ranges = DisturbanceRanges()
        found = range_ends(ranges, 20.0, 2)
        assert len({(end.quantity, end.end) for end in found}) == len(found) == 2 * 13 + 4
        for end in found:
            changed = [
                field.name
                for field in dataclasses.fields(Disturbance)
                if getattr(end.disturbance, field.name) != field.default
            ]
            assert len(changed) == 1, (end.quantity, changed)
        gains = [end.disturbance.thrust_gain for end in found if end.quantity == "thrust gain"]
        assert gains == pytest.approx([0.9, 1.1])
        assert [end.value for end in found if end.quantity == "thrust gain"] == ["-10 %", "+10 %"]

    def test_the_first_factor_that_is_too_much_is_found(self, experiment, monkeypatch):
        plain = dataclasses.replace(experiment, ranges=DisturbanceRanges(), controls=("pid",))
        for least_gain in (0.91, 0.9, 0.8, 0.72, 0.7, 0.55, 0.5, 0.4):
            ran: list[Disturbance] = []
            without_simulation(monkeypatch, lambda drawn, least=least_gain: drawn.thrust_gain > least + 1e-9, ran)
            limits = {(limit.quantity, limit.end): limit for limit in find_limits(plain, jobs=1)}
            expected = next((f for f in FACTORS if 1.0 - 0.1 * f <= least_gain + 1e-9), None)
            assert limits["thrust gain", "low"].factor == expected
            assert sum(drawn.thrust_gain < 1.0 for drawn in ran) <= 5
            reached = 5.0 if expected is None else expected
            assert limits["thrust gain", "low"].value == f"{-10.0 * reached:+.3g} %"
            others = [limit for key, limit in limits.items() if key != ("thrust gain", "low")]
            assert {limit.factor for limit in others} == {None}
            broken = in_order_of_breaking(list(limits.values()), "pid")
            assert [limit.factor for limit in broken] == [expected] * (expected is not None)

    def test_the_first_to_break_comes_first(self, experiment, monkeypatch):
        plain = dataclasses.replace(experiment, ranges=DisturbanceRanges())
        without_simulation(
            monkeypatch, lambda d: (d.friction or 1.0) > 0.2 and (d.fan_lag or 0.0) < 0.7 and not d.pushes, []
        )
        limits = find_limits(plain, jobs=1)
        first = in_order_of_breaking(limits, "feedforward")
        assert [(limit.quantity, limit.factor) for limit in first] == [
            *[("push", 1.0)] * 4, ("friction", 2.0), ("fan lag", 4.0),
        ]  # fmt: skip
        assert [quantity for quantity, _ in ends_by_limit(limits)][:6] == [*["push"] * 4, "friction", "fan lag"]

    def test_what_was_interrupted_is_taken_up_again(self, experiment, monkeypatch, tmp_path):
        path, ran = tmp_path / "limits.json", []
        without_simulation(monkeypatch, lambda drawn: drawn.thrust_gain > 0.75, ran)
        plain = dataclasses.replace(experiment, ranges=DisturbanceRanges())

        def interrupt(done: int, _: int) -> None:
            if done == 7:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            find_limits(plain, 1, progress=interrupt, save=lambda kept: save_limits(path, plain, kept))
        kept = load_limits(path, plain)
        assert len(kept) == 7
        ran.clear()
        resumed = find_limits(plain, 1, kept)
        assert resumed == find_limits(plain, 1)
        with pytest.raises(ResultsFileError, match="limits of another experiment: ranges differ"):
            load_limits(path, experiment)
        path.write_text(path.read_text().replace("jet-gym-limits/2", "jet-gym-limits/1"))
        with pytest.raises(ResultsFileError, match="must be 'jet-gym-limits/2'"):
            load_limits(path, plain)

    def test_a_real_limit(self, experiment):
        """Without nearly all of its friction the robot cannot stand."""
        frictions = {f: End("friction", "low", f"{0.4 / f:g}", Disturbance(friction=1e-3)) for f in FACTORS}
        limit = _find_limit(experiment, frictions, "pid")
        assert limit.factor == 1.0
        assert limit.cause
