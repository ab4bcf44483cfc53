"""What the live plots along the step show: which curves, of what, in which colours."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from jet_gym.figures.style import ACHIEVED_COLOR, LIMIT_COLOR, THRUST_COLOR, planner_style
from jet_gym.studio.curves import fitness_terms, zmp_margin
from jet_gym.studio.page.plot import Curve, Plot, Samples

if TYPE_CHECKING:
    from viser import GuiApi, GuiTabHandle

    from jet_gym.plan import Plan
    from jet_gym.studio.inputs import Inputs
    from jet_gym.studio.simulated import Simulated

_AXIS_COLORS = ("#D55E00", "#009E73", "#0072B2")  # x, y, z


class Plots:
    """Thrust, pelvis, edge angle, ZMP margin and fitness terms along the step.

    Args:
        gui: Where they are drawn.
        tab: The tab that they are drawn in.
    """

    def __init__(self, gui: GuiApi, tab: GuiTabHandle) -> None:
        titles = (
            ("Thrust", "N"),
            ("Pelvis from its first place", "mm"),
            ("Edge angle", "deg"),
            ("ZMP inside the sole by", "mm"),
            ("Fitness terms", ""),
        )
        self._plots = [Plot(gui, tab, 2.0 * number, *title) for number, title in enumerate(titles)]

    def show(
        self, inputs: Inputs, plan: Plan, rival: Plan | None, simulated: Simulated | None, time: float
    ) -> None:
        """Draw the curves of a plan, of a rival's and a simulated motion where there are; the cursor at a time."""
        chosen = [
            _thrust(inputs, plan, rival, simulated),
            _pelvis(plan, rival, simulated),
            _edge_angle(inputs, plan, rival),
            _margin(plan, rival, simulated),
            _fitness(inputs, plan, rival),
        ]
        for plot, samples in zip(self._plots, chosen, strict=True):
            plot.show(samples, time)

    def point_at(self, time: float) -> None:
        """Move the cursor's line to a time [s]."""
        for plot in self._plots:
            plot.point_at(time)


def _of_planner(plan: Plan, rival: bool = False) -> Curve:
    look = planner_style(plan.planner)
    return Curve(look.label, look.color, dashed=rival)


def _level(plan: Plan, value: float, label: str = "") -> Samples:
    ends = plan.time[[0, -1]]
    return Samples(Curve(label, LIMIT_COLOR, dashed=True, width=1.0), ends, np.full(2, value))


def _thrust(inputs: Inputs, plan: Plan, rival: Plan | None, simulated: Simulated | None) -> list[Samples]:
    limit = inputs.balance.parameters(plan.step.robot).max_thrust
    samples = [Samples(_of_planner(plan), plan.time, plan.thrust), _level(plan, limit, "F max")]
    if rival is not None:
        samples.append(Samples(_of_planner(rival, rival=True), rival.time, rival.thrust))
    if simulated is not None:
        samples.append(Samples(Curve("measured", THRUST_COLOR, width=1.2), simulated.time, simulated.thrust))
    return samples


def _pelvis(plan: Plan, rival: Plan | None, simulated: Simulated | None) -> list[Samples]:
    samples = []
    for axis, color in enumerate(_AXIS_COLORS):
        name = "xyz"[axis]
        moved = 1e3 * (plan.pelvis[:, axis] - plan.pelvis[0, axis])
        samples.append(Samples(Curve(name, color), plan.time, moved))
        if rival is not None:
            moved = 1e3 * (rival.pelvis[:, axis] - plan.pelvis[0, axis])
            samples.append(Samples(Curve("", color, dashed=True, width=1.2), rival.time, moved))
        if simulated is not None:
            moved = 1e3 * (simulated.pelvis[:, axis] - plan.pelvis[0, axis])
            samples.append(Samples(Curve("", color, width=0.8), simulated.time, moved))
    return samples


def _edge_angle(inputs: Inputs, plan: Plan, rival: Plan | None) -> list[Samples]:
    limit = float(np.degrees(inputs.edge_tolerance))
    samples = [Samples(_of_planner(plan), plan.time, np.degrees(plan.edge_angle))]
    if rival is not None:
        samples.append(Samples(_of_planner(rival, rival=True), rival.time, np.degrees(rival.edge_angle)))
    return [*samples, _level(plan, limit, "± rho"), _level(plan, -limit)]


def _margin(plan: Plan, rival: Plan | None, simulated: Simulated | None) -> list[Samples]:
    samples = [Samples(_of_planner(plan), plan.time, 1e3 * zmp_margin(plan.step, plan.zmp))]
    if rival is not None:
        margin = 1e3 * zmp_margin(rival.step, rival.zmp)
        samples.append(Samples(_of_planner(rival, rival=True), rival.time, margin))
    if simulated is not None:
        samples.append(
            Samples(Curve("measured", ACHIEVED_COLOR, width=1.2), simulated.time, 1e3 * simulated.zmp_margin)
        )
    return [*samples, _level(plan, 0.0, "edge")]


def _fitness(inputs: Inputs, plan: Plan, rival: Plan | None) -> list[Samples]:
    terms = fitness_terms(plan, inputs.fitness)
    penalties = terms[:, 0] + terms[:, 1]
    samples = [
        Samples(Curve("f4 thrust", THRUST_COLOR), plan.time, terms[:, 3]),
        Samples(Curve("f3 smoothness", "#0072B2"), plan.time, terms[:, 2]),
    ]
    if penalties.any():
        samples.append(Samples(Curve("f1 + f2", LIMIT_COLOR), plan.time, penalties))
    if rival is not None:
        look = planner_style(rival.planner)
        samples.append(Samples(Curve(f"{look.label}, sum", look.color, dashed=True), rival.time, rival.fitness))
    return samples
