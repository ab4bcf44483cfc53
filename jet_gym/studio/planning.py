"""From what a page asks for to a plan, and to the sentence that says what became of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from agents.planner import Planner, make_planner
from jet_gym.errors import JetGymError
from jet_gym.feasibility import Infeasibility, diagnose, infeasibility_sentence
from jet_gym.figures.style import planner_style
from jet_gym.plan import Plan
from jet_gym.studio.inputs import Inputs
from jet_gym.studio.worker import Stale, StaleError, give_up_if

Kind = Literal["holds", "violated", "infeasible", "refused"]


@dataclass(frozen=True)
class Verdict:
    """What a person is told about a step.

    Attributes:
        kind: ``"holds"`` if the plan meets every constraint; ``"violated"`` if it does not, though for all that
            is known a posture exists; ``"infeasible"`` if no posture exists; ``"refused"`` if the step or
            a setting makes no sense.
        sentence: It in one sentence; with the swing point and the constraint, where one fails.
        point: The swing point that fails, if one does.
    """

    kind: Kind
    sentence: str
    point: int | None = None


def plan_with(planner: str, inputs: Inputs, stale: Stale) -> Plan | None:
    """Plan a step; give up, returning ``None``, as soon as it is stale.

    Args:
        planner: Name of the planner.
        inputs: What is asked for.
        stale: Whether it still is.

    Raises:
        JetGymError: If the step or a setting makes no sense, or the planner cannot be loaded.
    """
    agent = _planner(planner, inputs)
    try:
        plan = agent.plan(inputs.step, seed=inputs.seed, progress=give_up_if(stale))
    except StaleError:
        return None
    return replace(plan, planner=planner)


def _planner(name: str, inputs: Inputs) -> Planner:
    """Return a planner of the package, or one that a model of the user's own makes."""
    for model in inputs.models:
        for planner, kind in zip(model.planners, ("policy", "policy+refine"), strict=True):
            if planner == name:
                return make_planner(kind, balance=inputs.balance, fitness=inputs.fitness, model=model.network)
    return make_planner(name, balance=inputs.balance, fitness=inputs.fitness)


def judge(plan: Plan, inputs: Inputs) -> Verdict:
    """Say whether a plan meets every constraint, and where and which it violates otherwise."""
    failing = len(plan.violated_points)
    if failing:
        return _violated(plan, f"; {failing} points violate a constraint" if failing > 1 else "")
    limit = inputs.balance.parameters(plan.step.robot).max_thrust
    return Verdict(
        "holds",
        f"{planner_label(plan.planner)}: every constraint holds at all {plan.step.points} swing points; "
        f"thrust up to {plan.thrust.max():.1f} N of {limit:.3g} N.",
    )


def explain(plan: Plan, inputs: Inputs, stale: Stale) -> Verdict | None:
    """Say why a plan that violates constraints does: because no posture exists, or because it missed one.

    One swing point is always looked at, which takes some 50 ms, so that a person who keeps dragging is told, too.

    Args:
        plan: The plan.
        inputs: What it was made from.
        stale: Whether a newer job has arrived; then the other points are left out.

    Returns:
        The verdict; ``None`` if a newer job came before anything was found.
    """
    findings: list[Infeasibility] = []
    for point in _suspects(plan):
        findings += diagnose(plan.step, inputs.balance, [point])
        if stale():
            break
    else:
        if not findings:
            return missed(plan)
    return infeasible(plan, findings) if findings else None


def infeasible(plan: Plan, findings: Sequence[Infeasibility]) -> Verdict:
    """Say that no posture makes some swing points of a plan's step."""
    sentence, worst = infeasibility_sentence(plan.step, findings)
    return Verdict("infeasible", sentence[0].upper() + sentence[1:] + ".", worst.point)


def missed(plan: Plan) -> Verdict:
    """Say that a planner violates constraints where every swing point has a posture that meets them."""
    return _violated(plan, ", though a posture exists there: more swing points or another planner may find it")


def _violated(plan: Plan, addition: str) -> Verdict:
    worst = _suspects(plan)[0]
    names = ", ".join(name.replace("_", " ") for name in plan.violations[worst])
    where = f"swing point {worst} (of 0 to {plan.step.points - 1})"
    return Verdict("violated", f"{planner_label(plan.planner)} violates {names} at {where}{addition}.", worst)


def planner_label(name: str) -> str:
    """Return a planner's name as figures have it."""
    return planner_style(name).label


def refused(error: JetGymError | ValueError) -> Verdict:
    """Say why a step or a setting makes no sense."""
    sentence = str(error)
    return Verdict("refused", sentence[:1].upper() + sentence[1:] + ".")


def _suspects(plan: Plan) -> list[int]:
    """Return the swing points that a plan violates, the ones most likely impossible first.

    Those are where a sole is out of reach, and of the others the ones nearest to the landing.
    """
    return sorted(plan.violated_points, key=lambda k: ("reach" not in plan.violations[k], -k))
