"""The race of planners and other libraries' optimisers, and what it is told when one is missing."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import count

import pytest

from agents.studies import calculation_time
from agents.studies import race as race_module
from agents.studies.calculation_time import measure_calculation_time
from agents.studies.off_the_shelf import EVALUATIONS, OPTIMISERS, contestant, missing_note
from agents.studies.race import Contestant, Timing, race
from agents.studies.swing_point import later_swing_point
from jet_gym.utils.machine import machine


class MadeUpClock:
    """A clock that stands still but for work, which takes as long as it is told."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._now = 0.0
        monkeypatch.setattr(race_module, "_clock", lambda: self._now)

    def work(self, durations: Iterable[float]) -> Callable[[], None]:
        """Return work that takes each of the durations in turn [s]."""
        left = iter(durations)

        def run() -> None:
            self._now += next(left)

        return run


def test_ratios_are_to_the_first_and_units_share_the_time(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = MadeUpClock(monkeypatch)
    before = (9.0, 7.0)  # compiling, and finding out how often to call: neither counts
    timings = race(
        [
            Contestant("one", clock.work([*before, 2.0, 4.0, 1.0])),
            Contestant("two", clock.work([*before, 6.0, 2.0, 5.0])),
            Contestant("three", clock.work([*before, 10.0, 30.0, 20.0]), units=10),
        ],
        3,
        least_duration=1.0,
    )
    assert timings == [
        Timing("one", seconds=2.0, ratio=1.0, lowest=1.0, highest=1.0),
        Timing("two", seconds=5.0, ratio=2.5, lowest=0.5, highest=5.0),
        Timing("three", seconds=2.0, ratio=1.0, lowest=0.5, highest=2.0),
    ]


def test_a_turn_repeats_its_call_until_it_lasts(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, calls = MadeUpClock(monkeypatch), count()
    short = clock.work(0.25 for _ in calls)
    (timing,) = race([Contestant("short", short)], 3, least_duration=1.0)
    assert timing.seconds == 0.25
    assert next(calls) == 1 + 1 + 4 + 3 * 4  # to compile, once and four times to find out, four in each round


def test_a_contestant_searches_with_another_seed_each_time() -> None:
    one, other = contestant("one", float), contestant("other", float)
    assert (one.name, one.units) == ("one", 1)
    assert [one.run(), one.run(), other.run(), one.run()] == [0.0, 1.0, 0.0, 2.0]


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
