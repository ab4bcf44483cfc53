"""What can be set on the page, and what it says."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING, Any, Protocol

from agents.planner import PLANNERS
from jet_gym.robot import jet_hr1
from jet_gym.studio.inputs import FEET, MOTIONS, Inputs
from jet_gym.studio.planning import Verdict
from jet_gym.studio.stage import LAYERS

if TYPE_CHECKING:
    from viser import GuiApi

PER_SQUARE_CENTIMETRE = 1e4  # [1/m^2]
SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
BALANCE_SPACE = "balance space"
_NOBODY = "nobody"
_KIND_COLORS = {
    "holds": ("#e8f5ee", "#0b6e4a"),
    "violated": ("#fff5e0", "#8a5a00"),
    "infeasible": ("#fdeaea", "#a01020"),
    "refused": ("#fdeaea", "#a01020"),
}

Change = Callable[[Inputs], Inputs]


class Controller(Protocol):
    """What the panel asks of its page."""

    def change(self, change: Change, foot: str | None = None) -> None:
        """Change what is asked for; ``foot`` is the one that was moved, if one was."""

    def seek(self, time: float) -> None:
        """Show a time [s]."""

    def play(self, playing: bool) -> None:
        """Let time pass, or not."""

    def set_speed(self, speed: float) -> None:
        """Let time pass at a multiple of the robot's own."""

    def show_layer(self, layer: str, visible: bool) -> None:
        """Draw a part of the scene, or not."""

    def compare_all(self) -> None:
        """Put every planner into the table."""


class Panel:
    """The controls of one page.

    Args:
        gui: Where they are drawn.
        inputs: What they show at first.
        controller: What they act on.
    """

    def __init__(self, gui: GuiApi, inputs: Inputs, controller: Controller) -> None:
        self._gui = gui
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
            self._add_planner(gui, inputs)
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
        self.swing = gui.add_dropdown("swing leg", ("left", "right"), initial_value=inputs.swing)
        self.feet = {
            foot: gui.add_vector3(f"{foot} [mm]", _millimetres(inputs.position(foot)), step=5.0) for foot in FEET
        }
        self.apex = gui.add_slider("apex [mm]", 10, 200, 5, round(1e3 * inputs.apex))
        self.points = gui.add_slider("swing points", 10, 180, 1, inputs.points)
        self.duration = gui.add_slider("duration [s]", 2.0, 30.0, 0.5, inputs.duration)

    def _add_planner(self, gui: GuiApi, inputs: Inputs) -> None:
        names = tuple(PLANNERS)
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

    def _listen(self) -> None:
        controller = self._controller

        def changes(handle: Any, change: Callable[[Inputs, Any], Inputs]) -> None:
            on_update(handle, lambda value: controller.change(lambda inputs: change(inputs, value)))

        changes(self.swing, lambda inputs, value: mirrored(inputs) if value != inputs.swing else inputs)
        for foot, handle in self.feet.items():
            on_update(handle, functools.partial(self._move, foot))
        changes(self.apex, lambda inputs, value: replace(inputs, apex=1e-3 * value))
        changes(self.points, lambda inputs, value: replace(inputs, points=int(value)))
        changes(self.duration, lambda inputs, value: replace(inputs, duration=float(value)))
        changes(self.planner, lambda inputs, value: replace(inputs, planner=value))
        changes(self.rival, lambda inputs, value: replace(inputs, rival=None if value == _NOBODY else value))
        changes(self.thrust_model, lambda inputs, value: replace(inputs, thrust_model=value))
        changes(
            self.smoothness,
            lambda inputs, value: replace(inputs, smoothness_weight=PER_SQUARE_CENTIMETRE * value),
        )
        changes(self.margin, lambda inputs, value: replace(inputs, zmp_margin=1e-3 * value))
        changes(self.max_thrust, lambda inputs, value: replace(inputs, max_thrust=float(value)))
        changes(self.edge, lambda inputs, value: replace(inputs, edge_tolerance=math.radians(value)))
        changes(self.seed, lambda inputs, value: replace(inputs, seed=int(value)))
        on_click(
            self.motion,
            lambda value: controller.change(lambda inputs: inputs.with_step(Inputs.of_motion(value).step)),
        )
        on_click(self.compare, lambda _: controller.compare_all())
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
        self.planner.value = inputs.planner
        self.rival.value = inputs.rival or _NOBODY
        self.thrust_model.value = inputs.thrust_model
        self.smoothness.value = round(inputs.smoothness_weight / PER_SQUARE_CENTIMETRE)
        self.margin.value = round(1e3 * inputs.zmp_margin)
        if inputs.max_thrust is not None:
            self.max_thrust.value = round(inputs.max_thrust)
        self.edge.value = math.degrees(inputs.edge_tolerance)
        self.seed.value = inputs.seed

    def show_playing(self, playing: bool) -> None:
        """Let the button say what it will do."""
        self._playing = playing
        self.play.label = "Pause" if playing else "Play"
        self.play.icon = "player-pause" if playing else "player-play"

    def show_time(self, time: float) -> None:
        """Move the slider to a time [s]."""
        self.time.value = min(max(time, self.time.min), self.time.max)

    def show_range(self, start: float, end: float, step: float) -> None:
        """Let the slider reach from a time to another [s] in steps [s]."""
        self.time.step = step
        self.time.min = start
        self.time.max = end

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
        swing="right" if inputs.swing == "left" else "left",
        start=other["start"],
        landing=other["landing"],
        support=other["support"],
    )


def hint(text: str) -> str:
    """Return a quiet line of HTML."""
    return f'<div style="padding:4px 12px 2px;font-size:12px;color:#666">{escape(text)}</div>'


def _millimetres(position: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = (round(1e3 * value, 1) for value in position)
    return x, y, z


def on_update(handle: Any, act: Callable[[Any], None]) -> None:
    """Act on what a person sets, and not on what the page itself does; coroutines keep the order of events."""

    async def updated(event: Any) -> None:
        if event.client is not None:
            act(event.target.value)

    handle.on_update(updated)


def on_click(handle: Any, act: Callable[[Any], None]) -> None:
    """Act on a click."""

    async def clicked(event: Any) -> None:
        act(event.target.value)

    handle.on_click(clicked)


def on_upload(handle: Any, act: Callable[[str, bytes], None]) -> None:
    """Act on a file, given its name and content."""

    async def uploaded(event: Any) -> None:
        act(event.target.value.name, event.target.value.content)

    handle.on_upload(uploaded)
