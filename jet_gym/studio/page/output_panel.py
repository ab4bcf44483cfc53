"""What can be done with a plan: simulate it, save it, load another, record a film."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, get_args

from jet_gym.simulation.execution import ThrustControl
from jet_gym.studio.page.controls import hint, on_click, on_update, on_upload, outcome
from jet_gym.studio.recording import FILM_KINDS, FilmKind

if TYPE_CHECKING:
    from viser import GuiApi

PLANNED, SIMULATED = "planned", "simulated"


class OutputController(Protocol):
    """What the panel asks of its page."""

    def simulate(self, thrust: ThrustControl) -> None:
        """Send the plan to the physics engine."""

    def show_simulated(self, simulated: bool) -> None:
        """Show the simulated motion, or the planned one."""

    def save(self) -> None:
        """Let the browser save the plan."""

    def load(self, name: str, content: bytes) -> None:
        """Show a plan file."""

    def record(self, kind: FilmKind) -> None:
        """Record a film of the motion."""


class OutputPanel:
    """The controls for a plan that is there.

    Args:
        gui: Where they are drawn, in the container that is open.
        controller: What they act on.
    """

    def __init__(self, gui: GuiApi, controller: OutputController) -> None:
        gui.add_html(hint("The plan goes to PyBullet in the background; the motion comes back into this scene."))
        self.thrust = gui.add_dropdown(
            "thrust control", get_args(ThrustControl), initial_value=get_args(ThrustControl)[0],
            hint="The plan's thrust alone, or with a PID on the pelvis' attitude.",
        )  # fmt: skip
        self.send = gui.add_button("Send to physics", icon="atom")
        self.progress = gui.add_progress_bar(0.0, visible=False)
        self.outcome = gui.add_html("")
        self.shown = gui.add_dropdown("motion shown", (PLANNED, SIMULATED), initial_value=PLANNED, visible=False)
        gui.add_divider()
        self.save = gui.add_button("Save plan.json", icon="download", color="gray")
        self.load = gui.add_upload_button(
            "Load plan.json", icon="upload", color="gray", mime_type="application/json"
        )
        gui.add_divider()
        self.kind = gui.add_dropdown("film", FILM_KINDS, initial_value=FILM_KINDS[0])
        self.record = gui.add_button(
            "Record the motion", icon="video", color="gray", hint="As this tab shows it, at its speed."
        )
        on_click(self.send, lambda _: controller.simulate(self.thrust.value))
        on_update(self.shown, lambda value: controller.show_simulated(value == SIMULATED))
        on_click(self.save, lambda _: controller.save())
        on_upload(self.load, controller.load)
        on_click(self.record, lambda _: controller.record(self.kind.value))

    def show_progress(self, share: float | None) -> None:
        """Show how much of a simulation or a film is done, from 0 to 1; nothing where there is none."""
        self.progress.visible = share is not None
        self.progress.value = 100.0 * (share or 0.0)

    def show_outcome(self, sentence: str, good: bool = True) -> None:
        """Say what became of a simulation, a file or a film; nothing if the sentence is empty."""
        self.outcome.content = outcome(sentence, good)

    def show_choice(self, there: bool, simulated: bool = False) -> None:
        """Let the motion be chosen if a simulated one is there."""
        self.shown.visible = there
        self.shown.value = SIMULATED if simulated else PLANNED
