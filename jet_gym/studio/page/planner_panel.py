"""The controls for who plans, by which settings, and for a model of the user's own."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

from jet_gym.robot import jet_hr1
from jet_gym.studio.inputs import Inputs
from jet_gym.studio.page.controls import Changeable, hint, on_change, on_click, on_upload, outcome

if TYPE_CHECKING:
    from viser import GuiApi

PER_SQUARE_CENTIMETRE = 1e4  # [1/m^2]
_NOBODY = "nobody"


class PlannerController(Changeable, Protocol):
    """What the panel asks of its page."""

    def compare_all(self) -> None:
        """Put every planner into the table."""

    def load_model(self, name: str, content: bytes, trust: bool) -> None:
        """Add a policy of the user's own to the planners."""


class PlannerPanel:
    """The controls that say who plans.

    Args:
        gui: Where they are drawn, in the container that is open.
        inputs: What they show at first.
        controller: What they act on.
    """

    def __init__(self, gui: GuiApi, inputs: Inputs, controller: PlannerController) -> None:
        names = inputs.planners
        self.planner = gui.add_dropdown("planner", names, initial_value=inputs.planner)
        self.rival = gui.add_dropdown("ghost of", (_NOBODY, *names), initial_value=inputs.rival or _NOBODY)
        self.thrust_model = gui.add_dropdown(
            "thrust model", ("assigned", "least"), initial_value=inputs.thrust_model,
            hint="Thrust that puts the ZMP at the assigned point, or the least that balances.",
        )  # fmt: skip
        self.smoothness = gui.add_slider(
            "omega [1/cm²]", 0, 500, 5, round(inputs.smoothness_weight / PER_SQUARE_CENTIMETRE),
            hint="Smoothness weight of eq. (18); the paper's is 50.",
        )  # fmt: skip
        self.margin = gui.add_slider(
            "ZMP margin [mm]", 0, 45, 1, round(1e3 * inputs.zmp_margin),
            hint="Distance that planning keeps between the ZMP and the sole's edge.",
        )  # fmt: skip
        limit = round(jet_hr1().max_thrust if inputs.max_thrust is None else inputs.max_thrust)
        self.max_thrust = gui.add_slider("F max [N]", 0, 40, 1, limit, hint="Largest thrust of a fan, eq. (9).")
        self.edge = gui.add_slider(
            "rho [deg]", 0.5, 30.0, 0.5, math.degrees(inputs.edge_tolerance),
            hint="Half angle of the edge polygon, eq. (10).",
        )  # fmt: skip
        self.seed = gui.add_number("seed", inputs.seed, min=0, max=2**31, step=1)
        self.compare = gui.add_button("Compare all planners", icon="table", color="gray")
        gui.add_divider()
        gui.add_html(hint("A policy of your own, as train.py writes it: policy.npz, or model.zip."))
        self.trust = gui.add_checkbox(
            "I trust .zip files", False,
            hint="Loading a .zip can run any code that is in it: tick this only if you know where it comes from.",
        )  # fmt: skip
        self.model = gui.add_upload_button("Load your policy", icon="upload", color="gray", mime_type=".npz,.zip")
        self._outcome = gui.add_html("")
        self._listen(controller)

    def _listen(self, controller: PlannerController) -> None:
        on_change(controller, self.planner, lambda inputs, value: replace(inputs, planner=value))
        on_change(
            controller, self.rival, lambda inputs, value: replace(inputs, rival=None if value == _NOBODY else value)
        )
        on_change(controller, self.thrust_model, lambda inputs, value: replace(inputs, thrust_model=value))
        on_change(
            controller,
            self.smoothness,
            lambda inputs, value: replace(inputs, smoothness_weight=PER_SQUARE_CENTIMETRE * value),
        )
        on_change(controller, self.margin, lambda inputs, value: replace(inputs, zmp_margin=1e-3 * value))
        on_change(controller, self.max_thrust, lambda inputs, value: replace(inputs, max_thrust=float(value)))
        on_change(controller, self.edge, lambda inputs, value: replace(inputs, edge_tolerance=math.radians(value)))
        on_change(controller, self.seed, lambda inputs, value: replace(inputs, seed=int(value)))
        on_click(self.compare, lambda _: controller.compare_all())
        on_upload(self.model, lambda name, content: controller.load_model(name, content, self.trust.value))

    def show_inputs(self, inputs: Inputs) -> None:
        """Let every control show what is asked for."""
        names = inputs.planners
        if names != self.planner.options:
            self.planner.options, self.rival.options = names, (_NOBODY, *names)
        self.planner.value = inputs.planner
        self.rival.value = inputs.rival or _NOBODY
        self.thrust_model.value = inputs.thrust_model
        self.smoothness.value = round(inputs.smoothness_weight / PER_SQUARE_CENTIMETRE)
        self.margin.value = round(1e3 * inputs.zmp_margin)
        if inputs.max_thrust is not None:
            self.max_thrust.value = round(inputs.max_thrust)
        self.edge.value = math.degrees(inputs.edge_tolerance)
        self.seed.value = inputs.seed

    def show_outcome(self, sentence: str, good: bool = True) -> None:
        """Say what became of a model that was to be loaded."""
        self._outcome.content = outcome(sentence, good)
