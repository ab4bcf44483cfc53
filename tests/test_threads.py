"""Work divided among threads."""

from __future__ import annotations

import threading
import time

import pytest

from jet_gym.utils.threads import available_cores, for_each, one_core


def test_each_share_is_done_once_and_counted() -> None:
    done: list[int] = []
    seen: list[tuple[int, int]] = []
    for_each(done.append, range(50), threads=3, progress=lambda number, total: seen.append((number, total)))
    assert sorted(done) == list(range(50))
    assert seen == [(number, 50) for number in range(1, 51)]
    assert available_cores() >= 1


def test_the_first_share_is_done_by_the_caller_before_any_other_begins() -> None:
    """What it compiles for a minute, Ctrl-C ends at once; a thread would have to be waited for."""
    by: list[str] = []

    def work(share: int) -> None:
        by.append(threading.current_thread().name)
        if share == 0:
            time.sleep(0.05)
            assert len(by) == 1

    for_each(work, range(20), threads=3)
    assert by[0] == threading.main_thread().name
    assert all(name.startswith("jet_gym") for name in by[1:])


def test_nothing_to_do_is_done() -> None:
    for_each(pytest.fail, [])


def test_an_error_ends_the_work() -> None:
    done: list[int] = []

    def work(share: int) -> None:
        if share == 0:
            raise ValueError("share 0")
        time.sleep(1e-3)
        done.append(share)

    with pytest.raises(ValueError, match="share 0"):
        for_each(work, range(5_000), threads=2)
    assert len(done) < 4_999


def test_ctrl_c_ends_the_work() -> None:
    done: list[int] = []

    def work(share: int) -> None:
        time.sleep(1e-3)
        done.append(share)

    def interrupt(number: int, _total: int) -> None:
        if number == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        for_each(work, range(5_000), threads=2, progress=interrupt)
    assert len(done) < 4_000


def test_one_core_is_kept_to_and_all_are_given_back() -> None:
    before = available_cores()
    with one_core():
        assert available_cores() == 1
    assert available_cores() == before
