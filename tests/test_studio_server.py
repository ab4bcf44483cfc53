"""The studio's server: for this machine alone, one sentence for bad input, ended by Ctrl-C."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from jet_gym.cli import run
from jet_gym.studio.errors import PortInUseError
from jet_gym.studio.server import Studio

pytest.importorskip("viser")


def test_page_is_served_to_this_machine_alone() -> None:
    with Studio(port=0) as studio:
        assert studio.url.startswith("http://127.0.0.1:")
        with urllib.request.urlopen(studio.url, timeout=30) as page:
            assert b"viser" in page.read().lower()
        sockets = [line for line in listening() if line.endswith(f":{studio.port:04X}")]
        assert sockets == [f"0100007F:{studio.port:04X}"]
    with pytest.raises(OSError, match=r"refused|reset"):
        urllib.request.urlopen(studio.url, timeout=5)


def listening() -> list[str]:
    """Return the addresses at which this machine listens, as Linux writes them."""
    found = []
    for table in (Path("/proc/net/tcp"), Path("/proc/net/tcp6")):
        lines = table.read_text().splitlines()[1:] if table.exists() else []
        found += [fields[1] for fields in map(str.split, lines) if fields[3] == "0A"]
    return found


def test_port_in_use_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(PortInUseError, match=f"port {port} of 127.0.0.1 is in use"):
            Studio(port=port)
        assert run(["studio", "--port", str(port)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith(f"jet-gym: port {port} of 127.0.0.1 is in use")
    assert captured.err.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--port", "70000"], "70000"),
        (["--host", "no such host"], "cannot listen at no such host"),
        (["--motion", "up"], "up"),
    ],
)
def test_bad_input_is_one_sentence(arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["studio", *arguments]) == 2
    captured = capsys.readouterr()
    assert words in captured.err
    assert captured.err.count("\n") == 1


def test_ctrl_c_ends_it_at_once() -> None:
    command = [sys.executable, "-m", "jet_gym.cli", "studio", "--port", "0"]
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # noqa: PLW1509
    )
    assert process.stdout is not None
    line = process.stdout.readline()
    assert "http://127.0.0.1:" in line
    os.kill(process.pid, signal.SIGINT)
    out, error = process.communicate(timeout=60)
    assert process.returncode == 130
    assert out == ""
    assert "Traceback" not in error
    assert error.strip().count("\n") == 0
