"""What one page asks for and is shown, without a browser: viser's server stands in for the tab."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from waiting import PATIENCE, wait_for

from agents.policy import SHIPPED_POLICY
from jet_gym.plan import Plan
from jet_gym.studio import planner_threads
from jet_gym.studio.inputs import Inputs
from jet_gym.studio.page.panel import BALANCE_SPACE
from jet_gym.studio.scene.stage import LAYERS
from jet_gym.studio.session import Session

viser = pytest.importorskip("viser")

SHORT = replace(Inputs.of_motion("side"), points=10, duration=2.5)


class Tab:
    """A tab that nobody looks at, and whose pictures are noise.

    Attributes:
        downloads: The files that the browser was given.
        closed: Whether it draws no more.
    """

    client_id = 7

    def __init__(self, server: Any) -> None:
        self.gui, self.scene, self.atomic = server.gui, server.scene, server.atomic
        self.camera = SimpleNamespace(position=(1.0, -2.0, 1.5))
        self.downloads: dict[str, bytes] = {}
        self.closed = False

    def send_file_download(self, name: str, content: bytes, save_immediately: bool) -> None:
        self.downloads[name] = content

    def get_render(self, height: int, width: int, timeout: float) -> np.ndarray:
        if self.closed:
            raise TimeoutError("nobody draws")
        return np.random.default_rng(0).integers(0, 256, (height, width, 3)).astype(np.uint8)


@pytest.fixture(scope="module")
def server() -> Iterator[Any]:
    server = viser.ViserServer(port=0, verbose=False)
    yield server
    server.stop()


@pytest.fixture
def tab(server: Any) -> Tab:
    server.gui.reset()
    server.scene.reset()
    return Tab(server)


@pytest.fixture
def session(tab: Tab, monkeypatch: pytest.MonkeyPatch) -> Iterator[Session]:
    monkeypatch.setattr(planner_threads, "_SETTLED", 0.0)
    session = Session(tab, SHORT)  # type: ignore[arg-type]
    wait_for(lambda: session.plan)
    yield session
    session.close()
    wait_for(lambda: not any(thread.name.startswith("studio-7") for thread in threading.enumerate()))


def settle(session: Session) -> None:
    """Wait until all is planned that was asked for."""
    assert session.planners.live.wait_until_idle(PATIENCE)
    assert session.planners.thorough.wait_until_idle(PATIENCE)


def test_a_page_begins_with_a_plan_of_its_step(session: Session) -> None:
    settle(session)
    assert session.verdict is not None
    assert session.verdict.kind == "holds"
    assert 'data-verdict="holds"' in session.panel.verdict.content
    assert (session.panel.time.min, session.panel.time.max) == (0.0, 2.5)
    assert session.panel.time.value == pytest.approx(0.72 * 2.5)
    assert ">GAS<" in session.panel.table.content


def test_a_moved_foot_is_planned_anew_and_shown_in_its_control(session: Session) -> None:
    session.change(lambda inputs: inputs.moved("landing", (0.1, 0.3, 0.0)), "landing")
    settle(session)
    assert session.plan is not None
    assert session.plan.step.landing == (0.1, 0.3, 0.0)
    assert tuple(session.panel.feet["landing"].value) == (100.0, 300.0, 0.0)
    assert session.replans >= 2


def test_a_step_without_a_posture_is_told_and_its_block_marked(session: Session) -> None:
    session.change(lambda inputs: inputs.moved("landing", (0.0, 0.8, 0.0)), "landing")
    wait_for(lambda: session.verdict is not None and session.verdict.kind == "infeasible")
    wait_for(lambda: session.stage.ground.bad_foot == "landing")
    session.change(lambda _: SHORT)
    wait_for(lambda: session.verdict is not None and session.verdict.kind == "holds")
    wait_for(lambda: session.stage.ground.bad_foot is None)


def test_a_step_that_makes_no_sense_leaves_the_robot_where_it_was(session: Session) -> None:
    settle(session)
    before = session.plan
    session.change(lambda inputs: inputs.moved("start", (0.0, -0.1, 0.0)), "start")
    settle(session)
    assert session.verdict is not None
    assert session.verdict.kind == "refused"
    assert "feet overlap" in session.verdict.sentence
    assert session.stage.ground.bad_foot == "start"
    assert session.plan is before


def test_a_ghost_joins_the_table_and_leaves_it(session: Session) -> None:
    session.change(lambda inputs: replace(inputs, rival="ga"))
    wait_for(lambda: session.rival is not None and session.rival.planner == "ga")
    settle(session)
    assert ">GA<" in session.panel.table.content
    session.show_layer("paths", False)
    session.change(lambda inputs: replace(inputs, rival="gaex"))
    wait_for(lambda: session.rival is not None and session.rival.planner == "gaex")
    session.change(lambda inputs: replace(inputs, rival=None))
    wait_for(lambda: session.rival is None)
    settle(session)
    assert ">GAEx<" not in session.panel.table.content


def test_all_planners_are_put_into_the_table(session: Session) -> None:
    settle(session)
    session.compare_all()
    wait_for(lambda: session.panel.table.content.count("<tr") == 1 + len(session.inputs.planners))


def test_a_planner_that_fails_is_told(session: Session) -> None:
    settle(session)
    session.fail(session.inputs, "policy", "it knows no such robot")
    assert session.verdict is not None
    assert session.verdict.sentence.endswith("cannot plan this step: it knows no such robot")
    session.fail(replace(SHORT), "policy", "of inputs that are asked for no more")
    assert session.verdict.sentence.endswith("it knows no such robot")


def test_a_saved_plan_is_loaded_as_it_is(session: Session, tab: Tab) -> None:
    settle(session)
    assert session.plan is not None
    saved = session.plan
    session.outputs.save()
    content = tab.downloads["plan.json"]
    assert Plan.from_dict(json.loads(content)).pelvis.tobytes() == saved.pelvis.tobytes()
    session.change(lambda inputs: inputs.moved("landing", (0.05, 0.3, 0.0)))
    settle(session)
    assert session.plan.step.landing != saved.step.landing
    session.outputs.load("mine.json", content)
    assert session.plan.pelvis.tobytes() == saved.pelvis.tobytes()
    assert session.inputs.landing == saved.step.landing
    assert "showing mine.json" in session.outputs.panel.outcome.content
    session.outputs.load("wrong.json", b"[")
    assert "wrong.json is not a plan" in session.outputs.panel.outcome.content
    assert session.plan.pelvis.tobytes() == saved.pelvis.tobytes()


def test_an_own_policy_plans_and_what_is_none_is_told(session: Session) -> None:
    settle(session)
    session.load_model("wrong.npz", b"nothing", trust=False)
    wait_for(lambda: "wrong.npz is not a policy" in session.panel.planning._outcome.content)
    assert session.inputs.models == ()
    session.load_model("mine.npz", SHIPPED_POLICY.read_bytes(), trust=False)
    wait_for(lambda: session.plan is not None and session.plan.planner == "mine.npz")
    assert session.panel.planning.planner.value == "mine.npz"
    wait_for(lambda: "mine.npz is in the planner menu" in session.panel.planning._outcome.content)


def test_the_plan_is_simulated_and_its_motion_shown(session: Session) -> None:
    pytest.importorskip("pybullet")
    settle(session)
    session.outputs.simulate("feedforward")
    simulated = wait_for(lambda: session.outputs.simulated)
    wait_for(lambda: session.playback.motion is simulated.motion)
    wait_for(lambda: "simulated: tilt" in session.panel._moment.content)
    session.outputs.show_simulated(False)
    assert session.playback.motion is not simulated.motion
    assert "simulated: tilt" not in session.panel._moment.content
    session.change(lambda inputs: inputs.moved("landing", (0.05, 0.3, 0.0)))
    assert session.outputs.simulated is None


def test_a_film_is_given_to_the_browser(session: Session, tab: Tab, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("jet_gym.studio.outputs._FILM_SIZE", (90, 160))
    monkeypatch.setattr("jet_gym.studio.outputs._FILM_RATE", 2.0)
    settle(session)
    session.outputs.record("gif")
    wait_for(lambda: "recorded 6 frames as jet-hr1.gif" in session.outputs.panel.outcome.content)
    assert tab.downloads["jet-hr1.gif"].startswith(b"GIF")
    wait_for(lambda: not session.outputs.panel.progress.visible)
    tab.closed = True
    session.outputs.record("gif")
    wait_for(lambda: "the film failed: nobody draws" in session.outputs.panel.outcome.content)


def test_time_passes_while_it_is_played(session: Session) -> None:
    settle(session)
    session.seek(0.0)
    session.set_speed(4.0)
    session.play(True)
    wait_for(lambda: session.panel.time.value > 0.2)
    session.play(False)
    stopped = session.playback.time
    assert session.panel.play.label == "Play"
    time.sleep(0.1)
    assert session.playback.time == stopped


@pytest.mark.parametrize("layer", LAYERS)
def test_a_layer_is_left_out_and_drawn_again(session: Session, layer: str) -> None:
    settle(session)
    handles = session._client.scene._handle_from_node_name
    before = {name for name, handle in handles.items() if handle.visible}
    session.show_layer(layer, False)
    left = {name for name, handle in handles.items() if handle.visible}
    assert left < before
    session.show_layer(layer, True)
    assert {name for name, handle in handles.items() if handle.visible} == before


def test_the_balance_space_is_computed_when_it_is_looked_at(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("jet_gym.studio.scene.balance_cloud.RESOLUTION", 0.1)
    settle(session)
    assert not session.cloud.ready
    session.show_layer(BALANCE_SPACE, True)
    wait_for(lambda: session.cloud.ready)
    assert session.cloud.visible


def test_a_closed_page_plans_no_more_and_its_threads_end(tab: Tab) -> None:
    session = Session(tab, SHORT)  # type: ignore[arg-type]
    wait_for(lambda: session.plan)
    session.close()
    session.close()
    wait_for(lambda: not any(thread.name.startswith("studio-7") for thread in threading.enumerate()))
    shown = session.replans
    session.show_plans(session.inputs, session.plan, None)
    assert session.replans == shown
