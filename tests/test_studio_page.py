"""The studio in a real browser: what a person sees and does on the page."""

from __future__ import annotations

import gc
import json
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlparse

import numpy as np
import pytest

from agents import Plan
from jet_gym.cli import run
from jet_gym.studio.inputs import Inputs
from jet_gym.studio.server import Studio

pytest.importorskip("viser")

SIDE = Inputs.of_motion("side")
SMALL = {"width": 900, "height": 360}  # a browser without a graphics card draws it in time


def wait_for(condition: Callable[[], Any], timeout: float = 180.0) -> Any:
    """Wait until a condition holds, and return what it returned."""
    deadline = time.monotonic() + timeout
    while not (result := condition()):
        assert time.monotonic() < deadline, "it did not come about"
        time.sleep(0.05)
    return result


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
    session.change(lambda _: SIDE)
    wait_for(lambda: session.plan.step.landing == SIDE.landing and session.verdict.kind == "holds")
    return session


def open_tab(page: Any, name: str) -> None:
    page.get_by_role("tab", name=name, exact=True).click()


def verdict_on(page: Any) -> str:
    return str(page.locator("[data-verdict]").inner_text())


def test_page_loads_from_this_machine_alone(page: Any, session: Any, studio: Studio) -> None:
    wait_for(lambda: page.locator("canvas").count() >= 1 + 5)  # the scene and five plots
    wait_for(lambda: "every constraint holds at all 30 swing points" in verdict_on(page))
    hosts = {urlparse(url).hostname for url in page.requested if not url.startswith(("blob:", "data:"))}
    assert hosts == {"127.0.0.1"}


def test_landing_typed_into_the_page_moves_and_changes_the_thrust(page: Any, session: Any) -> None:
    before = session.plan.thrust.max()
    open_tab(page, "Step")
    field = page.get_by_label("landing [mm]")
    assert field.input_value() == "0"
    field.fill("180")
    field.press("Enter")
    wait_for(lambda: session.plan.step.landing == (0.18, 0.34, 0.0))
    assert abs(session.plan.thrust.max() - before) > 0.1
    wait_for(lambda: f"up to {session.plan.thrust.max():.1f} N" in verdict_on(page))


def test_landing_block_dragged_with_the_mouse_moves(page: Any, session: Any) -> None:
    drag(page, *pixel_of(page, session, np.array([0.015, 0.34, -0.07])))
    if session.inputs.landing == SIDE.landing:  # a browser that is short of time may not have seen the block yet
        drag(page, *pixel_of(page, session, np.array([0.015, 0.34, -0.07])))
    wait_for(lambda: session.plan.step.landing != SIDE.landing)
    moved = np.subtract(session.plan.step.landing, SIDE.landing)
    assert 0.002 < np.hypot(*moved[:2]) < 0.3
    assert moved[2] == 0.0
    assert session.plan.step.start == SIDE.start


def drag(page: Any, x: float, y: float) -> None:
    """Move the mouse onto a pixel, press, move a little, and let go, as slowly as a person."""
    page.mouse.move(x - 2, y)
    page.mouse.move(x, y)
    time.sleep(1.0)
    page.mouse.down()
    for k in range(1, 5):
        page.mouse.move(x + 3 * k, y)
        time.sleep(0.3)
    page.mouse.up()
    time.sleep(1.0)


def pixel_of(page: Any, session: Any, point: np.ndarray) -> tuple[float, float]:
    """Return where a point of the world is on the page."""
    from viser.transforms import SO3

    camera = session._client.camera
    x, y, z = SO3(camera.wxyz).inverse().apply(point - camera.position)
    box = page.locator("canvas").first.bounding_box()
    focal = 0.5 * box["height"] / np.tan(0.5 * camera.fov)
    return box["x"] + 0.5 * box["width"] + focal * x / z, box["y"] + 0.5 * box["height"] + focal * y / z


def test_planner_menu_plans_with_the_chosen_planner(page: Any, session: Any) -> None:
    open_tab(page, "Planner")
    page.get_by_label("planner", exact=True).click()
    page.get_by_role("option", name="gaex", exact=True).click()
    wait_for(lambda: session.plan.planner == "gaex")
    assert session.inputs.planner == "gaex"
    wait_for(lambda: "GAEx:" in verdict_on(page))


def test_ghost_is_the_other_planner_and_joins_the_table(page: Any, session: Any) -> None:
    open_tab(page, "Planner")
    page.get_by_label("ghost of").click()
    page.get_by_role("option", name="ga", exact=True).last.click()
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
    assert session.stage.ground.bad_foot == "landing"
    session.change(lambda _: SIDE)
    wait_for(lambda: page.locator('[data-verdict="holds"]').count() == 1)
    assert session.stage.ground.bad_foot is None


def test_feet_that_overlap_say_so(page: Any, session: Any) -> None:
    session.change(lambda inputs: inputs.moved("landing", (0.0, -0.1, 0.0)), "landing")
    wait_for(lambda: page.locator('[data-verdict="refused"]').count() == 1)
    assert "feet overlap" in verdict_on(page)
    assert session.plan.step.landing == SIDE.landing  # the robot stays where it was


def test_plan_saved_in_the_page_loads_in_the_command_line(
    page: Any, session: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    open_tab(page, "Output")
    with page.expect_download() as download:
        page.get_by_role("button", name="Save plan.json").click()
    file = tmp_path / "plan.json"
    download.value.save_as(file)
    assert download.value.suggested_filename == "plan.json"
    np.testing.assert_array_equal(Plan.load(file).pelvis, session.plan.pelvis)
    assert run(["simulate", str(file), "--help"]) == 0
    capsys.readouterr()


def test_plan_file_loaded_into_the_page_is_shown_as_it_is(page: Any, session: Any, tmp_path: Path) -> None:
    assert run(["plan", "side", "--points", "12", "--seed", "5", "--output", str(tmp_path / "own.json")]) == 0
    open_tab(page, "Output")
    session.outputs.load("own.json", (tmp_path / "own.json").read_bytes())
    plan = Plan.load(tmp_path / "own.json")
    assert (session.plan.seed, session.plan.step.points) == (5, 12)
    np.testing.assert_array_equal(session.plan.pelvis, plan.pelvis)
    wait_for(lambda: "all 12 swing points" in verdict_on(page))
    session.outputs.load("own.json", json.dumps({"format": "another/1"}).encode())
    wait_for(lambda: page.get_by_text("own.json is not a plan: field 'format'").count() == 1)


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
