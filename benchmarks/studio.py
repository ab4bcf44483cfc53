"""How fast the studio's page follows a block that is dragged.

A tab without a browser connects to the server and takes everything that it is sent; a landing block is then dragged
on a circle. What counts is the way from the pointer's event to the new plan's messages: planning, plots, table,
scene. The browser's own drawing is left out.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib.util import find_spec
from statistics import median
from time import perf_counter, process_time, sleep
from typing import Any

from benchmarks.report import Report, command_line

_POINTS = 30
_POINTER_RATE = 20.0  # [1/s] pointer events that viser sends during a drag
_EVENTS = 40  # of one drag
_PATIENCE = 300.0  # [s] the first plan may have to be compiled


def measure(rounds: int) -> Report:
    """Drag a landing block and time each planner."""
    report = Report(f"Studio, a step of {_POINTS} points")
    if find_spec("viser") is None:
        report.notes.append("viser is not installed and the studio left out; pip install jet-gym[studio] adds it.")
        return report
    from agents.planner import PLANNERS
    from jet_gym.studio.inputs import Inputs
    from jet_gym.studio.server import Studio

    inputs = replace(Inputs.of_motion("side"), points=_POINTS)
    with Studio(port=0, inputs=inputs) as studio, _tab(studio.port):
        _wait(lambda: studio.sessions and studio.sessions[0].plan is not None)
        session = studio.sessions[0]
        _add_drag(report, session, inputs, rounds)
        _add_flood(report, session, inputs)
        for planner in PLANNERS:
            _add_planner(report, planner, inputs)
    return report


def _add_drag(report: Report, session: Any, inputs: Any, rounds: int) -> None:
    """Drag at the pace of a pointer: how late a plan is, and what it costs."""
    latencies, costs = [], []
    for turn in range(min(rounds, 5)):
        for place in _circle(inputs.landing, turn):
            started, used = perf_counter(), process_time()
            session._dragged("landing", place)
            _wait(
                lambda place=place: (
                    session.plan.step.landing == place and session.planners.live.wait_until_idle(0.0)
                )
            )
            latencies.append(perf_counter() - started)
            costs.append(process_time() - used)
            sleep(max(1.0 / _POINTER_RATE - latencies[-1], 0.0))
    report.add(
        "pointer event to new plan on the page", median(latencies), "s",
        lowest=min(latencies), highest=max(latencies), goal=0.1,
    )  # fmt: skip
    report.add("replans a second that a core of its own can do", 1.0 / median(costs), goal=10.0, at_least=True)


def _add_flood(report: Report, session: Any, inputs: Any) -> None:
    """Drag far faster than a pointer: older positions must be skipped, and the last one must be shown soon."""
    places = [place for turn in range(8) for place in _circle(inputs.landing, turn)]
    before, started = session.replans, perf_counter()
    for place in places:
        session._dragged("landing", place)
    sent = perf_counter()
    _wait(lambda: session.plan.step.landing == places[-1])
    ended = perf_counter()
    report.add("flood: replans a second", (session.replans - before) / (ended - started), goal=10.0, at_least=True)
    report.add("flood: events for each plan shown", len(places) / (session.replans - before))
    report.add("flood: last event to its plan", ended - sent, "s", goal=0.1)


def _add_planner(report: Report, planner: str, inputs: Any) -> None:
    from jet_gym.errors import JetGymError
    from jet_gym.studio.planning import plan_with

    try:
        plan_with(planner, inputs, lambda: False)  # loads and compiles
        times = []
        for _ in range(5):
            started = process_time()
            plan_with(planner, inputs, lambda: False)
            times.append(process_time() - started)
    except (JetGymError, ImportError) as error:
        report.notes.append(f"{planner} is left out: {error}")
        return
    report.add(f"plan by {planner}", median(times), "s", lowest=min(times), highest=max(times))


def _circle(center: tuple[float, float, float], turn: int) -> Iterator[tuple[float, float, float]]:
    """Yield places around a landing, each turn at a radius of its own so that no place comes twice."""
    radius = 0.02 + 0.001 * turn
    for k in range(_EVENTS):
        angle = 2.0 * math.pi * k / _EVENTS
        yield center[0] + radius * math.cos(angle), center[1] + radius * math.sin(angle), center[2]


def _wait(condition: Any) -> None:
    deadline = perf_counter() + _PATIENCE
    while not condition():
        if perf_counter() > deadline:
            raise TimeoutError("the studio does not answer")
        sleep(0.0005)


@contextmanager
def _tab(port: int) -> Iterator[None]:
    """Open a tab that says where its camera is and takes whatever comes."""
    import msgspec
    import viser
    from viser._messages import ViewerCameraMessage
    from websockets.exceptions import ConnectionClosed
    from websockets.sync.client import connect
    from websockets.typing import Subprotocol

    camera = ViewerCameraMessage(
        wxyz=(1.0, 0.0, 0.0, 0.0), position=(2.0, 0.0, 1.0), fov=1.0, near=0.01, far=100.0,
        image_height=600, image_width=800, look_at=(0.0, 0.0, 0.0), up_direction=(0.0, 0.0, 1.0),
    )  # fmt: skip
    protocol = Subprotocol(f"viser-v{viser.__version__}")
    with connect(f"ws://127.0.0.1:{port}", subprotocols=[protocol], compression=None, max_size=None) as connection:
        connection.send(msgspec.msgpack.encode(camera.as_serializable_dict()))

        def take() -> None:
            try:
                while True:
                    connection.recv()
            except ConnectionClosed:
                pass

        taker = threading.Thread(target=take, daemon=True)
        taker.start()
        yield
    taker.join(5.0)


if __name__ == "__main__":
    command_line(__doc__, measure)
