"""The studio's planner threads: who stands in for whom, and what becomes of planners that fail."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
from waiting import PATIENCE

from agents import PLANNERS
from agents.genetic import GasPlanner
from jet_gym.errors import SettingsError
from jet_gym.plan import Plan
from jet_gym.studio import planning
from jet_gym.studio.inputs import Inputs
from jet_gym.studio.planner_threads import PlannerThreads
from jet_gym.studio.planning import Verdict

SHORT = replace(Inputs.of_motion("side"), points=4)


class Listener:
    """Remembers what it is told."""

    def __init__(self) -> None:
        self.shown: list[tuple[str | None, str | None]] = []
        self.explained: list[Verdict] = []
        self.failed: list[tuple[str, str]] = []

    def show_plans(self, inputs: Inputs, plan: Plan | None, rival: Plan | None) -> None:
        self.shown.append((plan and plan.planner, rival and rival.planner))

    def explain(self, plan: Plan, verdict: Verdict) -> None:
        self.explained.append(verdict)

    def fail(self, inputs: Inputs, planner: str, reason: str) -> None:
        self.failed.append((planner, reason))


@pytest.fixture
def listener() -> Listener:
    return Listener()


@pytest.fixture
def threads(listener: Listener) -> Iterator[PlannerThreads]:
    threads = PlannerThreads(listener, "test")
    yield threads
    threads.close()


@pytest.fixture
def planned_by_gas(monkeypatch: pytest.MonkeyPatch) -> dict[str, float]:
    """Let GAS plan in the place of all, each taking as long a swing point as it says here [s]."""
    seconds = dict.fromkeys(PLANNERS, 1e-4)
    plan = GasPlanner().plan(SHORT.step)

    def plan_with(planner: str, inputs: Inputs, stale: Any) -> Plan | None:
        return (
            None if stale() else replace(plan, planner=planner, solve_time=0.0 * plan.solve_time + seconds[planner])
        )

    monkeypatch.setattr(planning, "plan_with", plan_with)
    return seconds


def plan_to_the_end(threads: PlannerThreads, inputs: Inputs) -> None:
    threads.submit(inputs)
    assert threads.live.wait_until_idle(PATIENCE)
    assert threads.thorough.wait_until_idle(PATIENCE)


def test_gas_stands_in_until_a_planner_is_known_to_be_quick(
    threads: PlannerThreads, listener: Listener, planned_by_gas: dict[str, float]
) -> None:
    inputs = replace(SHORT, planner="policy")
    plan_to_the_end(threads, inputs)
    assert listener.shown == [("gas", None), ("policy", None)]
    listener.shown.clear()
    plan_to_the_end(threads, inputs)
    assert listener.shown == [("policy", None)]


def test_a_slow_planner_never_follows_a_drag(
    threads: PlannerThreads, listener: Listener, planned_by_gas: dict[str, float]
) -> None:
    planned_by_gas["optimal"] = 1.0
    for _ in range(2):
        listener.shown.clear()
        plan_to_the_end(threads, replace(SHORT, planner="optimal"))
        assert listener.shown == [("gas", None), ("optimal", None)]
    assert not threads.is_quick("optimal", SHORT.points)


def test_a_rival_is_planned_beside_the_planner(
    threads: PlannerThreads, listener: Listener, planned_by_gas: dict[str, float]
) -> None:
    inputs = replace(SHORT, rival="ga")
    plan_to_the_end(threads, inputs)
    assert listener.shown == [("gas", None), (None, "ga")]
    listener.shown.clear()
    plan_to_the_end(threads, inputs)
    assert listener.shown == [("gas", "ga")]


def test_a_planner_that_fails_is_told_and_the_thread_goes_on(
    threads: PlannerThreads, listener: Listener, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as broken:

        def refuse(*_: Any) -> None:
            raise SettingsError("no such robot")

        broken.setattr(planning, "plan_with", refuse)
        plan_to_the_end(threads, SHORT)
    assert listener.failed == [("gas", "no such robot")]
    assert listener.shown == []
    plan_to_the_end(threads, SHORT)
    assert listener.shown == [("gas", None)]


def test_where_no_posture_exists_the_reason_is_told(threads: PlannerThreads, listener: Listener) -> None:
    plan_to_the_end(threads, SHORT.moved("landing", (0.0, 2.0, 0.0)))
    assert [verdict.kind for verdict in listener.explained] == ["infeasible"]


def test_what_is_dropped_is_not_shown(
    threads: PlannerThreads, listener: Listener, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, go_on = threading.Event(), threading.Event()

    def plan_with(planner: str, inputs: Inputs, stale: Any) -> Plan | None:
        if planner == "optimal":
            begun.set()
            assert go_on.wait(PATIENCE)
            assert stale()
            return None
        return GasPlanner().plan(inputs.step)

    monkeypatch.setattr(planning, "plan_with", plan_with)
    threads.submit(replace(SHORT, planner="optimal"))
    assert begun.wait(PATIENCE)
    threads.drop()
    go_on.set()
    assert threads.thorough.wait_until_idle(PATIENCE)
    assert threads.live.wait_until_idle(PATIENCE)
    assert ("optimal", None) not in listener.shown


def test_all_planners_are_planned_with_until_nobody_wants_more(
    threads: PlannerThreads, planned_by_gas: dict[str, float]
) -> None:
    shown: list[str] = []

    def show(plan: Plan) -> bool:
        shown.append(plan.planner)
        return len(shown) < 3 or len(shown) >= 3 + len(PLANNERS)

    threads.plan_all(SHORT, show).join(PATIENCE)
    assert shown == list(PLANNERS)[:3]
    threads.close()
    threads.plan_all(SHORT, show).join(PATIENCE)
    assert len(shown) == 3, "planned for a page that is closed"
