"""The two threads that plan for a page: one keeps up with a drag, the other runs what takes longer."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Protocol

from jet_gym.plan import Plan
from jet_gym.studio import planning
from jet_gym.studio.inputs import Inputs
from jet_gym.studio.planning import Verdict
from jet_gym.studio.worker import LatestWorker, Stale

QUICK = 0.1  # [s] a planner that needs longer for a step does not follow a drag: GAS stands in until it is done
STAND_IN = "gas"
_SETTLED = 0.15  # [s] without a change after which a slow planner is started


class Audience(Protocol):
    """Who is told what was planned; called from the threads."""

    def show_plans(self, inputs: Inputs, plan: Plan | None, rival: Plan | None) -> None:
        """Show a plan, a rival's plan, or both."""

    def explain(self, plan: Plan, verdict: Verdict) -> None:
        """Say why a plan violates constraints."""

    def fail(self, inputs: Inputs, planner: str, reason: str) -> None:
        """Say that a planner could not plan."""


class PlannerThreads:
    """Plans the newest inputs.

    Quick planners finish what they began, so that a drag is followed however fast it is; slow ones wait until the
    inputs have settled and give up when they change. Until its speed is known, a planner counts as slow.

    Args:
        audience: Who is told.
        name: Begins the names of the threads.
    """

    def __init__(self, audience: Audience, name: str) -> None:
        self._audience = audience
        self._pace: dict[str, float] = {STAND_IN: 0.0}  # [s] a swing point takes
        self._closed = False
        self.live = LatestWorker(self._plan_live, f"{name}-live")
        self.thorough = LatestWorker(self._plan_thorough, f"{name}-thorough", patience=_SETTLED)

    def submit(self, inputs: Inputs) -> None:
        """Plan these inputs in place of those before."""
        self.live.submit(inputs)
        self.thorough.submit(inputs)

    def drop(self) -> None:
        """Give up what is being planned."""
        self.live.drop()
        self.thorough.drop()

    def close(self) -> None:
        """End the threads; may be called twice."""
        self._closed = True
        self.live.close()
        self.thorough.close()

    def plan_all(self, inputs: Inputs, show: Callable[[Plan], bool]) -> threading.Thread:
        """Plan with every planner in a thread of its own, while ``show``, called with each plan, returns true."""
        thread = threading.Thread(target=self._plan_all, args=(inputs, show), name="studio-compare", daemon=True)
        thread.start()
        return thread

    def is_quick(self, planner: str, points: int) -> bool:
        """Tell whether a planner is known to follow a drag."""
        return self._pace.get(planner, QUICK) * points < QUICK

    def _plan_live(self, inputs: Inputs, stale: Stale) -> None:
        quick = self.is_quick(inputs.planner, inputs.points)
        plan = self._plan(inputs.planner if quick else STAND_IN, inputs)
        if plan is None:
            return
        rival = None
        if inputs.rival is not None and self.is_quick(inputs.rival, inputs.points):
            rival = self._plan(inputs.rival, inputs)
        self._audience.show_plans(inputs, plan, rival)
        self._explain(plan, inputs, stale)

    def _plan_thorough(self, inputs: Inputs, stale: Stale) -> None:
        for planner in dict.fromkeys(filter(None, (inputs.planner, inputs.rival))):
            if self.is_quick(planner, inputs.points):
                continue
            plan = self._plan(planner, inputs, stale)
            if plan is None or stale():
                return
            main = plan if planner == inputs.planner else None
            self._audience.show_plans(inputs, main, plan if planner == inputs.rival else None)
            if main is not None:
                self._explain(main, inputs, stale)

    def _plan_all(self, inputs: Inputs, show: Callable[[Plan], bool]) -> None:
        for planner in inputs.planners:
            plan = self._plan(planner, inputs, lambda: self._closed)
            if self._closed or (plan is not None and not show(plan)):
                return

    def _plan(self, planner: str, inputs: Inputs, stale: Stale = lambda: False) -> Plan | None:
        """Plan, note how long a swing point takes, and say so where it fails."""
        try:
            plan = planning.plan_with(planner, inputs, stale)
        except Exception as error:  # a planner may be anybody's, and the page must go on
            self._audience.fail(inputs, planner, str(error))
            return None
        if plan is not None and planner != STAND_IN:
            self._pace[planner] = float(plan.solve_time.sum()) / plan.step.points
        return plan

    def _explain(self, plan: Plan, inputs: Inputs, stale: Stale) -> None:
        verdict = planning.explain(plan, inputs, stale) if plan.violated_points else None
        if verdict is not None:
            self._audience.explain(plan, verdict)
