"""The window of ``render_mode="human"``, on a virtual display; skipped where there is none."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pybullet")

_WATCH = """
import sys
import time
import gymnasium as gym
import jet_gym

env = gym.make("JetHR1Step-v0", render_mode="human", physics=sys.argv[1], time_per_point=0.2)
env.reset(seed=0)
inner = env.unwrapped
bullet = sys.argv[1] == "bullet"
simulated, started = 0.0, time.perf_counter()
for point in range(1 if bullet else 5):
    env.step(inner.action_to(inner.current_step.nominal_pelvis))
    simulated += 1.4 if bullet else 0.2
passed = time.perf_counter() - started
print(simulated, passed, flush=True)
sys.stdin.readline()
env.close()
"""


@dataclass(frozen=True)
class Display:
    """A display that nobody looks at."""

    name: str
    screen: Path

    def colors(self) -> int:
        """Return how many colours there are on it."""
        content = self.screen.read_bytes()
        header, colors = (int.from_bytes(content[place : place + 4], "big") for place in (0, 76))
        pixels = np.frombuffer(content[header + 12 * colors :], dtype=np.uint32)
        return len(np.unique(pixels))


@pytest.fixture
def display(tmp_path: Path) -> Iterator[Display]:
    if (server := shutil.which("Xvfb")) is None:
        pytest.skip("Xvfb is not installed")
    reading, writing = os.pipe()
    screen = ["-screen", "0", "1100x800x24", "-fbdir", str(tmp_path)]
    command = [server, "-displayfd", str(writing), *screen, "-nolisten", "tcp", "+extension", "GLX"]
    process = subprocess.Popen(command, pass_fds=(writing,), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(writing)
    with os.fdopen(reading) as answer:
        number = answer.readline().strip()
    assert number, "Xvfb did not start"
    yield Display(f":{number}", tmp_path / "Xvfb_screen0")
    process.terminate()
    process.wait(60)


@pytest.mark.parametrize("physics", ["bullet", "quasistatic"])
def test_the_window_shows_the_robot_and_keeps_real_time(display: Display, physics: str) -> None:
    assert display.colors() == 1
    process = subprocess.Popen(
        [sys.executable, "-c", _WATCH, physics],
        env={**os.environ, "DISPLAY": display.name},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    killer = threading.Timer(600.0, process.kill)  # a window that hangs fails the test
    killer.start()
    assert process.stdout is not None
    lines = []
    for line in process.stdout:  # PyBullet says a few words of its own
        lines.append(line)
        if line.replace(".", "").replace(" ", "").strip().isdigit():
            break
    colors = display.colors()
    _, errors = process.communicate("\n")
    killer.cancel()
    assert process.returncode == 0, errors
    assert "Traceback" not in errors
    simulated, passed = map(float, lines[-1].split())
    assert passed > simulated - 0.1
    assert colors > 100
