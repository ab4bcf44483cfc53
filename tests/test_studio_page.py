"""The studio in a real browser: what a person sees and does on the page."""

from __future__ import annotations

import gc
import json
import shutil
import threading
import time
import weakref
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlparse

import numpy as np
import pytest
from browsing import choose, drag, frames_of, open_tab, pixel_of, upload, verdict_on
from page_inputs import SIDE
from waiting import wait_for

from agents import Plan
from agents.policy import SHIPPED_POLICY
from jet_gym.cli import run
from jet_gym.studio.inputs import Inputs
from jet_gym.studio.recording import FILM_KINDS
from jet_gym.studio.server import Studio

pytest.importorskip("viser")

SHORT = replace(SIDE, points=10, duration=2.5)
SMALL = {"width": 900, "height": 360}  # a browser without a graphics card draws it in time


@pytest.fixture(scope="module")
def studio() -> Iterator[Studio]:
    with Studio(port=0, inputs=SIDE) as studio:
        yield studio


@pytest.fixture(scope="module")
def tab(studio: Studio, browser: Any) -> Iterator[tuple[Any, Any]]:
    """A page that is open during all tests, its session, and what it asked the network for."""
    page = browser.new_page(viewport=SMALL)
    page.set_default_timeout(180_000)
    page.requested = []
    page.on("request", lambda request: page.requested.append(request.url))
    page.goto(studio.url)
    session = wait_for(lambda: studio.sessions and studio.sessions[0])
    wait_for(lambda: session.plan)
    page.get_by_role("tab", name="Planner").wait_for(timeout=180_000)
    yield page, session
    page.close()


@pytest.fixture
def page(tab: tuple[Any, Any]) -> Any:
    return tab[0]


@pytest.fixture
def session(tab: tuple[Any, Any]) -> Any:
    """The page's session, back at the side step and planned."""
    session = tab[1]
    ask(session, SIDE)
    return session


def ask(session: Any, inputs: Inputs) -> None:
    """Ask for a step that can be made, and wait until a plan of it is shown."""
    asked = replace(inputs)  # told apart from whatever was asked for before, though it may be the same
    session.change(lambda _: asked)
    wait_for(lambda: session._plan_inputs is asked and session.verdict.kind == "holds")


def test_page_loads_from_this_machine_alone(page: Any, session: Any, studio: Studio) -> None:
    wait_for(lambda: page.locator("canvas").count() >= 1 + 5)  # the scene and five plots
    wait_for(lambda: "every constraint holds at all 30 swing points" in verdict_on(page))
    hosts = {urlparse(url).hostname for url in page.requested if not url.startswith(("blob:", "data:"))}
    assert hosts == {"127.0.0.1"}


def test_landing_typed_into_the_page_moves_and_changes_the_thrust(page: Any, session: Any) -> None:
    before = session.plan.thrust.max()
    open_tab(page, "Step")
    field = page.get_by_label("landing [mm]")
    wait_for(lambda: field.input_value() == "0")
    field.fill("180")
    field.press("Enter")
    wait_for(lambda: session.plan.step.landing == (0.18, 0.34, 0.0))
    assert abs(session.plan.thrust.max() - before) > 0.1
    wait_for(lambda: f"up to {session.plan.thrust.max():.1f} N" in verdict_on(page))


def test_landing_block_dragged_with_the_mouse_moves(page: Any, session: Any) -> None:
    def moves() -> bool:
        drag(page, *pixel_of(page, session, np.array([0.015, 0.34, -0.07])))
        return bool(session.inputs.landing != SIDE.landing)

    wait_for(moves)  # a browser that is short of time may not have seen the block at first
    wait_for(lambda: session.plan.step.landing != SIDE.landing)
    moved = np.subtract(session.plan.step.landing, SIDE.landing)
    assert 0.002 < np.hypot(*moved[:2]) < 0.3
    assert moved[2] == 0.0
    assert session.plan.step.start == SIDE.start


def test_planner_menu_plans_with_the_chosen_planner(page: Any, session: Any) -> None:
    open_tab(page, "Planner")
    choose(page, "planner", "gaex")
    wait_for(lambda: session.plan.planner == "gaex")
    assert session.inputs.planner == "gaex"
    wait_for(lambda: "GAEx:" in verdict_on(page))


def test_ghost_is_the_other_planner_and_joins_the_table(page: Any, session: Any) -> None:
    open_tab(page, "Planner")
    choose(page, "ghost of", "ga")
    wait_for(lambda: session.rival is not None and session.rival.planner == "ga")
    assert session.plan.planner == "gas"
    wait_for(lambda: page.locator("td", has_text="GA").count() >= 2)
    session.change(lambda inputs: SIDE)
    wait_for(lambda: session.rival is None)


def test_infeasible_landing_says_where_and_why_and_shows_a_red_block(page: Any, session: Any) -> None:
    session.change(lambda inputs: inputs.moved("landing", (0.0, 0.8, 0.0)), "landing")
    wait_for(lambda: session.verdict.kind == "infeasible")
    wait_for(lambda: page.locator('[data-verdict="infeasible"]').count() == 1)
    assert verdict_on(page).startswith("No posture makes swing point ")
    assert "thrust" in verdict_on(page)
    wait_for(lambda: session.stage.ground.bad_foot == "landing")
    session.change(lambda _: SIDE)
    wait_for(lambda: page.locator('[data-verdict="holds"]').count() == 1)
    wait_for(lambda: session.stage.ground.bad_foot is None)


def test_feet_that_overlap_say_so(page: Any, session: Any) -> None:
    session.change(lambda inputs: inputs.moved("landing", (0.0, -0.1, 0.0)), "landing")
    wait_for(lambda: page.locator('[data-verdict="refused"]').count() == 1)
    assert "feet overlap" in verdict_on(page)
    assert session.plan.step.landing == SIDE.landing  # the robot stays where it was


def test_plan_saved_in_the_page_loads_in_the_command_line(
    page: Any, session: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("pybullet")
    ask(session, SHORT)
    open_tab(page, "Output")
    with page.expect_download() as download:
        page.get_by_role("button", name="Save plan.json").click()
    file = tmp_path / "plan.json"
    download.value.save_as(file)
    assert download.value.suggested_filename == "plan.json"
    np.testing.assert_array_equal(Plan.load(file).pelvis, session.plan.pelvis)
    assert run(["simulate", str(file)]) == 0
    assert "fell" not in capsys.readouterr().err


def test_plan_file_uploaded_to_the_page_is_shown_as_it_is(page: Any, session: Any, tmp_path: Path) -> None:
    file, wrong = tmp_path / "own.json", tmp_path / "wrong.json"
    assert run(["plan", "side", "--points", "12", "--seed", "5", "--output", str(file)]) == 0
    wrong.write_text(json.dumps({"format": "another/1"}))
    open_tab(page, "Output")
    upload(page, "Load plan.json", file)
    wait_for(lambda: (session.plan.seed, session.plan.step.points) == (5, 12))
    np.testing.assert_array_equal(session.plan.pelvis, Plan.load(file).pelvis)
    wait_for(lambda: "all 12 swing points" in verdict_on(page))
    file.write_text(json.dumps(json.loads(file.read_text()) | {"planner": "mine.npz"}))  # unknown to the page
    upload(page, "Load plan.json", file)
    wait_for(lambda: "As loaded; planned by mine.npz." in verdict_on(page))
    assert "is planning" not in verdict_on(page)
    assert session.plan.planner == "mine.npz"
    upload(page, "Load plan.json", wrong)
    wait_for(lambda: page.get_by_text("wrong.json is not a plan: field 'format'").count() == 1)
    assert session.plan.step.points == 12


def test_own_policy_uploaded_to_the_page_plans_and_is_a_ghost_and_in_the_table(
    page: Any, session: Any, tmp_path: Path
) -> None:
    file, wrong = tmp_path / "mine.npz", tmp_path / "wrong.npz"
    shutil.copy(SHIPPED_POLICY, file)
    wrong.write_bytes(b"nothing")
    open_tab(page, "Planner")
    upload(page, "Load your policy", wrong)
    wait_for(lambda: page.get_by_text("wrong.npz is not a policy").count() == 1)
    assert session.inputs.planners == SIDE.planners
    upload(page, "Load your policy", file)
    wait_for(lambda: session.plan.planner == "mine.npz")
    wait_for(lambda: page.get_by_text("mine.npz is in the planner menu").count() == 1)
    wait_for(lambda: verdict_on(page).startswith("mine.npz"))
    choose(page, "planner", "gas")
    choose(page, "ghost of", "mine.npz")
    wait_for(lambda: session.plan.planner == "gas" and session.rival and session.rival.planner == "mine.npz")
    wait_for(lambda: page.locator("td", has_text="mine.npz").count() == 1)
    choose(page, "planner", "mine.npz+refine")
    wait_for(lambda: session.plan.planner == "mine.npz+refine")


def test_zip_is_loaded_only_where_the_user_trusts_it(page: Any, session: Any) -> None:
    pytest.importorskip("stable_baselines3")
    file = SHIPPED_POLICY.with_name("model.zip")
    open_tab(page, "Planner")
    upload(page, "Load your policy", file)
    wait_for(lambda: page.get_by_text("model.zip is not loaded").count() == 1)
    assert session.inputs.models == ()
    page.get_by_label("I trust .zip files").check()
    wait_for(lambda: session.panel.planning.trust.value)
    upload(page, "Load your policy", file)
    wait_for(lambda: session.plan.planner == "model.zip")


def test_plan_sent_to_physics_comes_back_and_is_replayed_with_measured_zmp_and_tilt(
    page: Any, session: Any
) -> None:
    pytest.importorskip("pybullet")
    ask(session, SHORT)
    open_tab(page, "Output")
    page.get_by_role("button", name="Send to physics").click()
    wait_for(lambda: session.outputs.simulated is not None)
    simulated = session.outputs.simulated
    assert simulated.success
    wait_for(lambda: page.get_by_text("simulated: tilt").count() == 1)
    assert "measured ZMP" in page.get_by_text("simulated: tilt").inner_text()
    session.seek(1.0)
    expected = f"tilt {np.degrees(simulated.tilt_at(1.0)):.2f}°", f"{1e3 * abs(simulated.margin_at(1.0)):.0f} mm"
    wait_for(lambda: all(part in page.get_by_text("simulated: tilt").inner_text() for part in expected))
    page.get_by_role("button", name="Play").click()
    wait_for(lambda: session.playback.time > 1.2)
    page.get_by_role("button", name="Pause").click()
    np.testing.assert_array_equal(
        session.playback.motion.at(0.5).pelvis, simulated.motion.at(0.5).pelvis
    )  # what is played is what was simulated
    choose(page, "motion shown", "planned")
    wait_for(lambda: page.get_by_text("simulated: tilt").count() == 0)
    assert session.playback.motion is not simulated.motion


@pytest.mark.parametrize("kind", FILM_KINDS)
def test_film_of_the_motion_is_downloaded(
    kind: str, page: Any, session: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("jet_gym.studio.outputs._FILM_SIZE", (90, 160))
    monkeypatch.setattr("jet_gym.studio.outputs._FILM_RATE", 2.0)
    ask(session, SHORT)
    open_tab(page, "Output")
    choose(page, "film", kind)
    with page.expect_download() as download:
        page.get_by_role("button", name="Record the motion").click()
    assert download.value.suggested_filename == f"jet-hr1.{kind}"
    file = tmp_path / f"film.{kind}"
    download.value.save_as(file)
    pictures = frames_of(file)
    assert len(pictures) == 6  # 2.5 s at 2 frames a second, both ends
    assert (np.abs(np.diff(pictures.astype(int), axis=0)) > 30).any(axis=(1, 2, 3)).all()  # the robot moves
    wait_for(lambda: page.get_by_text(f"recorded 6 frames as jet-hr1.{kind}").count() == 1)


def test_play_lets_time_pass_and_pause_stops_it(page: Any, session: Any) -> None:
    session.seek(0.0)
    page.get_by_role("button", name="Play").click()
    wait_for(lambda: session.panel.time.value > 0.2)
    page.get_by_role("button", name="Pause").click()
    wait_for(lambda: page.get_by_role("button", name="Play").count() == 1)
    stopped = session.panel.time.value
    time.sleep(0.3)
    assert session.panel.time.value == stopped


def test_second_tab_has_its_own_step_and_is_freed_when_it_closes(
    page: Any, session: Any, studio: Studio, browser: Any
) -> None:
    other = browser.new_page(viewport=SMALL)
    other.goto(studio.url)
    wait_for(lambda: len(studio.sessions) == 2)
    gone, threads = _plan_in_newest_tab(studio)
    assert session.plan.step.landing == SIDE.landing
    other.close()
    wait_for(lambda: len(studio.sessions) == 1)
    wait_for(lambda: not any(thread.name.startswith(threads) for thread in threading.enumerate()))
    wait_for(lambda: gc.collect() is not None and gone() is None)


def _plan_in_newest_tab(studio: Studio) -> tuple[weakref.ref[Any], str]:
    """Plan a step; return a reference that does not keep the session, and how the names of its threads begin.

    Nothing is asked of the browser here, because Playwright keeps the frames that call it.
    """
    session = studio.sessions[-1]
    session.change(lambda inputs: inputs.moved("landing", (0.1, 0.34, 0.0)))
    wait_for(lambda: session.plan is not None and session.plan.step.landing == (0.1, 0.34, 0.0))
    return weakref.ref(session), f"studio-{session._client.client_id}-"
