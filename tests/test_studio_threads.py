"""The studio's threads: the newest job alone is done, and what plays can be paused."""

from __future__ import annotations

import threading
import time
from typing import Any

from jet_gym.studio.player import Player
from jet_gym.studio.worker import LatestWorker


def test_worker_does_the_newest_job_and_skips_what_came_in_between() -> None:
    started, go_on, done = threading.Event(), threading.Event(), []

    def work(job: int, stale: Any) -> None:
        started.set()
        go_on.wait(10.0)
        done.append((job, stale()))

    worker = LatestWorker(work, "test")
    worker.submit(1)
    assert started.wait(10.0)
    for job in (2, 3, 4):
        worker.submit(job)
    go_on.set()
    assert worker.wait_until_idle(10.0)
    assert done == [(1, True), (4, False)]
    worker.close()


def test_worker_drops_what_waits_and_makes_stale_what_it_does() -> None:
    seen, go_on = [], threading.Event()

    def work(_job: int, stale: Any) -> None:
        go_on.wait(10.0)
        seen.append(stale())

    worker = LatestWorker(work, "test")
    worker.submit(1)
    time.sleep(0.05)
    worker.drop()
    go_on.set()
    assert worker.wait_until_idle(10.0)
    assert seen in ([], [True])
    worker.close()


def test_patient_worker_waits_until_no_newer_job_comes() -> None:
    done: list[int] = []
    begun: list[float] = []
    patience = 0.3
    worker = LatestWorker(lambda job, _: (done.append(job), begun.append(time.monotonic())), "test", patience)
    before, after = [], []  # each job's submission
    for job in range(5):
        before.append(time.monotonic())
        worker.submit(job)
        after.append(time.monotonic())
    assert worker.wait_until_idle(60.0)
    assert done[-1] == 4
    assert begun[-1] >= before[-1] + patience
    overtaken = {job for job in range(4) if after[job + 1] - before[job] < patience}
    assert not overtaken & set(done)
    worker.close()


def test_closed_worker_ends_its_thread_and_takes_no_job() -> None:
    done: list[int] = []
    worker = LatestWorker(lambda job, _: done.append(job), "test-closed")
    assert any(thread.name == "test-closed" for thread in threading.enumerate())
    worker.close()
    worker.close()
    worker.submit(1)
    deadline = time.monotonic() + 10.0
    while any(thread.name == "test-closed" for thread in threading.enumerate()):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert done == []


def test_player_passes_the_time_of_the_clock_and_stops() -> None:
    passed: list[float] = []
    player = Player(passed.append, "test")
    player.speed = 2.0
    started = time.monotonic()
    player.playing = True
    deadline = started + 60.0
    while len(passed) < 3:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    player.playing = False
    count = len(passed)
    assert 0.0 < sum(passed) <= 2.0 * (time.monotonic() - started)
    time.sleep(0.1)
    assert len(passed) == count
    player.close()


def test_player_is_paused_only_when_nothing_is_on_its_way_any_more() -> None:
    advancing, go_on, paused = threading.Event(), threading.Event(), threading.Event()
    player = Player(lambda _: (advancing.set(), go_on.wait(60.0)), "test")
    player.playing = True
    assert advancing.wait(60.0)

    def pause() -> None:
        player.playing = False
        paused.set()

    threading.Thread(target=pause, daemon=True).start()
    assert not paused.wait(0.2)
    go_on.set()
    assert paused.wait(60.0)
    player.close()


def test_player_can_be_paused_by_what_it_calls() -> None:
    calls: list[float] = []
    paused = threading.Event()

    def advance(elapsed: float) -> None:
        calls.append(elapsed)
        player.playing = False
        paused.set()

    player = Player(advance, "test")
    player.playing = True
    assert paused.wait(60.0)
    player.playing = False  # from outside: waits until that call has returned
    assert len(calls) == 1
    player.close()
