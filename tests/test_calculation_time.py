"""The race of planners and other libraries' optimisers, and what it is told when one is missing."""

from __future__ import annotations

from itertools import count

import pytest

from agents.studies import calculation_time
from agents.studies.calculation_time import measure_calculation_time
from agents.studies.off_the_shelf import EVALUATIONS, OPTIMISERS, missing_note
from agents.studies.race import Contestant, race
from agents.studies.swing_point import later_swing_point
from jet_gym.utils.machine import machine


def test_ratios_are_to_the_first_and_units_share_the_time() -> None:
    calls = count()

    def work() -> int:
        next(calls)
        return sum(range(20_000))

    one, two, tenth = race([Contestant("one", work), Contestant("two", work), Contestant("ten", work, 10)], 3, 1e-3)
    assert (one.name, one.ratio, one.lowest, one.highest) == ("one", 1.0, 1.0, 1.0)
    assert two.lowest <= two.ratio <= two.highest or two.seconds > 0.0
    assert tenth.seconds < 0.5 * one.seconds
    assert next(calls) > 9


@pytest.mark.parametrize(("name", "module", "make"), OPTIMISERS, ids=[name for name, _, _ in OPTIMISERS])
def test_everybody_has_the_same_budget_and_comes_near_the_best(name: str, module: str, make: object) -> None:
    pytest.importorskip(module)
    point = later_swing_point()
    evaluated: list[int] = []
    evaluate = type(point).fitness

    def counted(self: object, candidates: object) -> object:
        evaluated.append(candidates.shape[1])  # type: ignore[attr-defined]
        return evaluate(self, candidates)  # type: ignore[arg-type]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(point), "fitness", counted)
        reached = make(point)(0)  # type: ignore[operator]
    assert 0.9 * EVALUATIONS < sum(evaluated) <= EVALUATIONS, name
    assert 0.0 < reached < point.fitness_of_one(*point.previous.tolist())


def test_a_missing_library_is_told_in_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    assert missing_note("numpy") is None
    sentence = "is not installed and left out; pip install jet-gym[bench] adds it."
    assert missing_note("no_such_library") == f"no_such_library {sentence}"
    monkeypatch.setattr(calculation_time, "missing_note", lambda module: f"{module} {sentence}")
    rows, notes = measure_calculation_time(1, 1)
    assert [row.name for row in rows] == ["gas", "ga", "gaex"]
    assert rows[0].ratio == 1.0
    assert notes == [f"{module} {sentence}" for module in ("cmaes", "deap", "pymoo")]


def test_the_machine_is_told_without_its_name() -> None:
    import platform

    facts = machine("one of them used")
    assert facts["cores"].endswith("one of them used")
    assert platform.node() not in " ".join(facts.values()).split()
    assert "numpy" in facts["packages"]
