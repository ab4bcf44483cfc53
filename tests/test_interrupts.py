"""Ctrl-C in finalisers and in workers."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import joblib
import pytest

from jet_gym.utils.interrupts import call_in_worker, no_interrupt_lost, terminated_as_interrupted


class Finalised:
    """Gets Ctrl-C while it is finalised."""

    def __del__(self):
        signal.raise_signal(signal.SIGINT)


def _finalise_and_wait():
    Finalised()
    deadline = time.monotonic() + 20.0
    while time.monotonic() < deadline:
        time.sleep(0.01)


def test_ctrl_c_in_a_finaliser_is_raised_all_the_same(capsys):
    with pytest.raises(KeyboardInterrupt), no_interrupt_lost():
        _finalise_and_wait()
    assert capsys.readouterr().err == ""


def test_other_errors_in_finalisers_are_told_as_before(monkeypatch):
    class Broken:
        def __del__(self):
            raise ValueError("broken")

    told = []
    monkeypatch.setattr(sys, "unraisablehook", lambda lost: told.append(str(lost.exc_value)))
    with no_interrupt_lost():
        Broken()
    assert told == ["broken"]


def _signal_handler():
    return signal.getsignal(signal.SIGINT)


def test_workers_are_deaf_and_the_parent_is_not():
    before = signal.getsignal(signal.SIGINT)
    assert call_in_worker(os.getpid(), _signal_handler) is before
    call = joblib.delayed(call_in_worker)
    found = joblib.Parallel(n_jobs=2)(call(os.getpid(), _signal_handler) for _ in range(4))
    assert found == [signal.SIG_IGN] * 4
    assert signal.getsignal(signal.SIGINT) is before


def test_a_command_ends_by_ctrl_c_in_a_finaliser():
    program = """
import signal, time, click
import jet_gym.cli as cli

class Finalised:
    def __del__(self):
        signal.raise_signal(signal.SIGINT)

@cli.cli.command()
def finalise():
    Finalised()
    time.sleep(20.0)
    click.echo("went on")

raise SystemExit(cli.run(["finalise"]))
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 130
    assert done.stdout == ""
    assert done.stderr.strip() == "jet-gym: interrupted; what was written is whole"


def test_sigterm_ends_a_command_in_order_and_its_workers_with_it(tmp_path):
    program = """
import os, sys, time, click, joblib
import jet_gym.cli as cli
from jet_gym.utils.interrupts import call_in_worker

def wait(folder):
    open(os.path.join(folder, str(os.getpid())), "w").close()
    time.sleep(100.0)

@cli.cli.command()
@click.argument("folder")
def work(folder):
    call = joblib.delayed(call_in_worker)
    try:
        joblib.Parallel(n_jobs=2)(call(os.getpid(), wait, folder) for _ in range(2))
    finally:
        click.echo("tidied")

raise SystemExit(cli.run(["work", sys.argv[1]]))
"""
    command = subprocess.Popen(
        [sys.executable, "-c", program, str(tmp_path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    _wait_until(lambda: len(list(tmp_path.iterdir())) == 2)
    command.terminate()
    out, err = command.communicate(timeout=60.0)  # which end with the last process that holds them
    assert command.returncode == 130
    assert out == "tidied\n"
    assert err.strip() == "jet-gym: interrupted; what was written is whole"
    _wait_until(lambda: not any(_is_running(int(file.name)) for file in tmp_path.iterdir()))


def test_sigterm_of_others_is_left_to_them():
    taken = []
    before = signal.signal(signal.SIGTERM, lambda *_: taken.append("theirs"))
    try:
        with terminated_as_interrupted():
            signal.raise_signal(signal.SIGTERM)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert taken == ["theirs"]


def test_sigterm_is_as_before_afterwards():
    with pytest.raises(KeyboardInterrupt), terminated_as_interrupted():
        signal.raise_signal(signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def _wait_until(true):
    deadline = time.monotonic() + 100.0
    while not true():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def _is_running(process):
    try:
        status = Path(f"/proc/{process}/stat").read_text(encoding="ascii", errors="replace")
    except OSError:
        return False
    return status.rpartition(")")[2].split()[0] != "Z"
