"""What can be set on the page, and what it says."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING, Protocol

from jet_gym.leg import SIDES, opposite
from jet_gym.studio.inputs import FEET, MOTIONS, Inputs
from jet_gym.studio.page.controls import hint, on_change, on_click, on_update
from jet_gym.studio.page.planner_panel import PlannerController, PlannerPanel
from jet_gym.studio.planning import Verdict
from jet_gym.studio.scene.stage import LAYERS

if TYPE_CHECKING:
    from viser import GuiApi

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
BALANCE_SPACE = "balance space"
_TIME_DIGITS = 2  # of the slider's ends [s]
_KIND_COLORS = {
    "holds": ("#e8f5ee", "#0b6e4a"),
    "violated": ("#fff5e0", "#8a5a00"),
    "infeasible": ("#fdeaea", "#a01020"),
    "refused": ("#fdeaea", "#a01020"),
}


class Controller(PlannerController, Protocol):
    """What the panel asks of its page."""

    def seek(self, time: float) -> None:
        """Show a time [s]."""

    def play(self, playing: bool) -> None:
        """Let time pass, or not."""

    def set_speed(self, speed: float) -> None:
        """Let time pass at a multiple of the robot's own."""

    def show_layer(self, layer: str, visible: bool) -> None:
        """Draw a part of the scene, or not."""


class Panel:
    """The controls of one page.

    Args:
        gui: Where they are drawn.
        inputs: What they show at first.
        controller: What they act on.
    """

    def __init__(self, gui: GuiApi, inputs: Inputs, controller: Controller) -> None:
        self._controller = controller
        self.verdict = gui.add_html("")
        self._moment = gui.add_html("")
        self.play = gui.add_button("Play", icon="player-play")
        self.time = gui.add_slider("time [s]", 0.0, inputs.duration, 0.1, 0.0)
        self.speed = gui.add_dropdown("speed", [f"{s:g} ×" for s in SPEEDS], initial_value="1 ×")
        self._playing = False
        tabs = gui.add_tab_group()
        with tabs.add_tab("Step"):
            self._add_step(gui, inputs)
        with tabs.add_tab("Planner"):
            self.planning = PlannerPanel(gui, inputs, controller)
        with tabs.add_tab("Show"):
            self.layers = {layer: gui.add_checkbox(layer, True) for layer in LAYERS}
            self.layers[BALANCE_SPACE] = gui.add_checkbox(
                BALANCE_SPACE, False,
                hint="Where the swing foot can be while some posture balances: blue without thrust, "
                "violet with it. Computed in the background.",
            )  # fmt: skip
        self.outputs_tab = tabs.add_tab("Output")
        self.table = gui.add_html("")
        self._listen()

    def _add_step(self, gui: GuiApi, inputs: Inputs) -> None:
        gui.add_html(hint("Drag a block in the scene; with Shift it moves up and down."))
        self.motion = gui.add_button_group("paper's motion", MOTIONS)
        self.swing = gui.add_dropdown("swing leg", SIDES, initial_value=inputs.swing)
        self.feet = {
            foot: gui.add_vector3(f"{foot} [mm]", _millimetres(inputs.position(foot)), step=5.0) for foot in FEET
        }
        self.apex = gui.add_slider("apex [mm]", 10, 200, 5, round(1e3 * inputs.apex))
        self.points = gui.add_slider("swing points", 10, 180, 1, inputs.points)
        self.duration = gui.add_slider("duration [s]", 2.0, 30.0, 0.5, inputs.duration)

    def _listen(self) -> None:
        controller = self._controller
        on_change(
            controller, self.swing, lambda inputs, value: mirrored(inputs) if value != inputs.swing else inputs
        )
        for foot, handle in self.feet.items():
            on_update(handle, functools.partial(self._move, foot))
        on_change(controller, self.apex, lambda inputs, value: replace(inputs, apex=1e-3 * value))
        on_change(controller, self.points, lambda inputs, value: replace(inputs, points=int(value)))
        on_change(controller, self.duration, lambda inputs, value: replace(inputs, duration=float(value)))
        on_click(
            self.motion,
            lambda value: controller.change(lambda inputs: inputs.with_step(Inputs.of_motion(value).step)),
        )
        on_click(self.play, lambda _: controller.play(not self._playing))
        on_update(self.time, lambda value: controller.seek(float(value)))
        on_update(self.speed, lambda value: controller.set_speed(float(value.split()[0])))
        for layer, box in self.layers.items():
            on_update(box, functools.partial(controller.show_layer, layer))

    def _move(self, foot: str, millimetres: Sequence[float]) -> None:
        x, y, z = (1e-3 * value for value in millimetres)
        self._controller.change(lambda inputs: inputs.moved(foot, (x, y, z)), foot)

    def show_inputs(self, inputs: Inputs) -> None:
        """Let every control show what is asked for."""
        self.swing.value = inputs.swing
        for foot, handle in self.feet.items():
            handle.value = _millimetres(inputs.position(foot))
        self.apex.value = round(1e3 * inputs.apex)
        self.points.value = min(max(inputs.points, 10), 180)
        self.duration.value = min(max(inputs.duration, 2.0), 30.0)
        self.planning.show_inputs(inputs)

    def show_playing(self, playing: bool) -> None:
        """Let the button say what it will do."""
        self._playing = playing
        self.play.label = "Pause" if playing else "Play"
        self.play.icon = "player-pause" if playing else "player-play"

    def show_time(self, time: float) -> None:
        """Move the slider to a time [s]."""
        self.time.value = min(max(time, self.time.min), self.time.max)

    def show_range(self, start: float, end: float, step: float) -> None:
        """Let the slider reach from a time to another [s], both rounded, in steps [s]."""
        self.time.step = step
        self.time.min = round(start, _TIME_DIGITS)
        self.time.max = round(end, _TIME_DIGITS)

    def show_verdict(self, verdict: Verdict, note: str = "") -> None:
        """Say what became of the step, with a note below it."""
        background, ink = _KIND_COLORS[verdict.kind]
        small = f'<div style="margin-top:4px;color:#555">{escape(note)}</div>' if note else ""
        self.verdict.content = (
            f'<div data-verdict="{verdict.kind}" style="margin:6px 10px 2px;padding:8px 10px;border-radius:6px;'
            f'background:{background};color:{ink};font-size:13px;line-height:1.35">'
            f"{escape(verdict.sentence)}{small}</div>"
        )

    def show_moment(self, lines: list[str]) -> None:
        """Say what is the case at the moment that is shown."""
        text = "<br>".join(escape(line) for line in lines)
        self._moment.content = (
            '<div style="padding:4px 12px;font-size:12px;line-height:1.4;color:#333;'
            f'font-variant-numeric:tabular-nums">{text}</div>'
        )

    def show_table(self, html: str) -> None:
        """Show the comparison table."""
        self.table.content = f'<div style="padding:6px 10px 10px">{html}</div>'


def mirrored(inputs: Inputs) -> Inputs:
    """Return the step of the other leg: everything mirrored on the plane y = 0."""
    other = {foot: (p[0], -p[1], p[2]) for foot in FEET for p in [inputs.position(foot)]}
    return replace(
        inputs,
        swing=opposite(inputs.swing),
        start=other["start"],
        landing=other["landing"],
        support=other["support"],
    )


def _millimetres(position: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = (round(1e3 * value, 1) for value in position)
    return x, y, z
