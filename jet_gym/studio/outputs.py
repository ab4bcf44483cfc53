"""What one page does with its plan: simulates it, saves and loads it, films it."""

from __future__ import annotations

import json
from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from jet_gym.errors import JetGymError
from jet_gym.plan import Plan
from jet_gym.studio.motion import Motion
from jet_gym.studio.page.output_panel import OutputPanel
from jet_gym.studio.physics import Physics
from jet_gym.studio.recording import FilmKind, Picture, encode_film, film_times, shoot
from jet_gym.studio.simulated import Simulated
from jet_gym.studio.worker import LatestWorker, Stale, StaleError

if TYPE_CHECKING:
    from viser import ClientHandle

    from jet_gym.simulation.execution import ThrustControl
    from jet_gym.studio.session import Session

_FILM_RATE = 20.0  # [1/s] frames of a film
_FILM_SIZE = (540, 960)  # [px] height and width of a film
_PATIENCE = 60.0  # [s] for a picture from the browser


class Outputs:
    """Does with a page's plan what its output panel asks for.

    Attributes:
        simulated: What the physics engine made of the plan, if it was sent there.

    Args:
        session: The page's session.
        client: The tab.
    """

    def __init__(self, session: Session, client: ClientHandle) -> None:
        self.simulated: Simulated | None = None
        self._session = session
        self._client = client
        self.panel = OutputPanel(client.gui, self)
        self._physics = Physics(self.panel.show_progress, self._show_result)
        self._films = LatestWorker(self._record, f"studio-{client.client_id}-film")

    def close(self) -> None:
        """Give up what is under way."""
        self._physics.drop()
        self._films.close()

    def forget(self) -> None:
        """Give up and forget what belongs to a plan that is there no more."""
        self._physics.drop()
        self._films.drop()
        if self.simulated is not None:
            self.panel.show_outcome("")
        self.simulated = None
        self.panel.show_progress(None)
        self.panel.show_choice(False)

    def simulate(self, thrust: ThrustControl) -> None:
        """Send the plan to the physics engine; its motion is shown when it is done."""
        plan = self._session.plan
        if plan is not None:
            self.panel.show_outcome("")
            self.panel.show_progress(0.0)
            self._physics.send(plan, thrust)

    def show_simulated(self, simulated: bool) -> None:
        """Show the simulated motion, or the planned one."""
        session = self._session
        with session.lock:
            if session.plan is not None:
                there = self.simulated if simulated else None
                session.show_motion(Motion.of_plan(session.plan) if there is None else there.motion)

    def save(self) -> None:
        """Let the browser save the plan as ``plan.json``."""
        plan = self._session.plan
        if plan is not None:
            content = json.dumps(plan.to_dict(), allow_nan=False).encode()
            self._client.send_file_download("plan.json", content, save_immediately=True)

    def load(self, name: str, content: bytes) -> None:
        """Show a plan file as it is."""
        try:
            plan = Plan.from_dict(json.loads(content))
        except (JetGymError, ValueError, RecursionError) as error:
            self.panel.show_outcome(f"{name} is not a plan: {error}", good=False)
            return
        self._session.show_loaded(plan)
        self.panel.show_outcome(f"showing {name}")

    def record(self, kind: FilmKind) -> None:
        """Record a film of the motion that is shown, in place of one under way, and let the browser save it."""
        self._films.submit(kind)

    def _show_result(self, plan: Plan, result: Simulated | str) -> None:
        session = self._session
        with session.lock, self._client.atomic():
            if session.closed or session.plan is not plan:
                return
            self.panel.show_progress(None)
            if isinstance(result, str):
                self.panel.show_outcome(result, good=False)
                return
            self.simulated = result
            self.panel.show_outcome(f"{result.outcome[:1].upper()}{result.outcome[1:]}.", result.success)
            self.panel.show_choice(True, simulated=True)
            self.show_simulated(True)

    def _record(self, kind: FilmKind, stale: Stale) -> None:
        """Record a film until it is stale or another motion is shown, of which nothing is left then."""
        session = self._session
        motion = session.playback.motion
        if motion is None:
            return
        times = film_times(motion.start, motion.end, session.playback.player.speed, _FILM_RATE)
        height, width = _FILM_SIZE
        done = 0

        def show(time: float) -> None:
            nonlocal done
            with session.lock:
                if stale():
                    raise StaleError
                if session.playback.motion is not motion:
                    raise RuntimeError("another motion is shown")
                self.panel.show_progress(done / len(times))
                done += 1
                session.seek(time)

        def take() -> Picture:
            return np.asarray(self._client.get_render(height, width, timeout=_PATIENCE), dtype=np.uint8)

        try:
            session.play(False)
            film = encode_film(shoot(times, show, take), kind, _FILM_RATE)
        except StaleError:
            return
        except (JetGymError, RuntimeError, TimeoutError, OSError) as error:  # such as a browser that does not draw
            film, outcome = None, f"the film failed: {error}"
        else:
            outcome = f"recorded {len(times)} frames as jet-hr1.{kind}"
        with session.lock, suppress(RuntimeError):  # the tab may have been closed in between
            if not stale():
                self.panel.show_progress(None)
                self.panel.show_outcome(outcome, good=film is not None)
                if film is not None:
                    self._client.send_file_download(f"jet-hr1.{kind}", film, save_immediately=True)
