"""What a person does on the studio's page: choose, upload, drag, read."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest


def choose(page: Any, menu: str, option: str) -> None:
    """Choose from a menu of the page."""
    page.get_by_label(menu, exact=True).click()
    page.get_by_role("option", name=option, exact=True).locator("visible=true").click()


def upload(page: Any, button: str, file: Path) -> None:
    """Give a file to one of the page's upload buttons."""
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name=button).click()
    chooser.value.set_files(file)


def open_tab(page: Any, name: str) -> None:
    page.get_by_role("tab", name=name, exact=True).click()


def verdict_on(page: Any) -> str:
    return str(page.locator("[data-verdict]").inner_text())


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


def frames_of(file: Path) -> np.ndarray:
    """Return the pictures (N, 90, 160, 3) of a film."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    command = [ffmpeg, "-v", "error", "-i", str(file), "-fps_mode", "passthrough", "-f", "rawvideo"]
    pixels = subprocess.run([*command, "-pix_fmt", "rgb24", "-"], check=True, capture_output=True).stdout
    return np.frombuffer(pixels, dtype=np.uint8).reshape(-1, 90, 160, 3)
