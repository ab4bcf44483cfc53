"""Films of executions, drawn from their time series after the fact."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jet_gym.errors import SettingsError
from jet_gym.leg import SIDES
from jet_gym.simulation.body import Pose
from jet_gym.simulation.history import Execution
from jet_gym.simulation.pictures.camera import CameraSettings
from jet_gym.simulation.pictures.encoding import require_encoder, write_mp4
from jet_gym.simulation.pictures.overlay import Overlay
from jet_gym.simulation.pictures.renderer import Renderer
from jet_gym.simulation.world import World
from jet_gym.utils.files import check_writable, write_whole_with
from jet_gym.utils.progress import Progress
from jet_gym.utils.settings import require_within

SUFFIX = ".mp4"
_VISIBLE_TILT = 1.0  # [degrees]


@dataclass(frozen=True)
class FilmSettings:
    """What a film is like. A frame of the default size takes about a quarter of a second to draw.

    Attributes:
        width: Width [px], even.
        height: Height [px], even.
        frames_per_second: Frames per second of the film.
        speed: Simulated seconds per second of the film.
        supersampling: By how much larger the bodies are drawn before they are made smaller.
    """

    width: int = 640
    height: int = 480
    frames_per_second: float = 12.0
    speed: float = 1.0
    supersampling: int = 2

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed.

        Raises:
            SettingsError: A ``ValueError`` that names the setting and what it may be.
        """
        for name in ("width", "height"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or not 64 <= value <= 4096 or value % 2:
                raise SettingsError(f"{name} must be an even whole number from 64 to 4096, not {value!r}")
        for name, most in (("frames_per_second", 120.0), ("speed", 100.0)):
            require_within(name, getattr(self, name), 0.01, most)


def film(
    execution: Execution,
    path: str | Path,
    settings: FilmSettings | None = None,
    progress: Progress | None = None,
) -> None:
    """Write a film (H.264 in MP4) of an execution, whole or not at all.

    Args:
        execution: What to show.
        path: The file, ``.mp4``.
        settings: Its size and speed; the defaults where omitted.
        progress: Called with how many frames are done and how many there are.

    Raises:
        SettingsError: If the file's name does not end in ``.mp4``.
        EncoderMissingError: If imageio-ffmpeg is not installed.
        OSError: If the file cannot be written.
    """
    settings = settings or FilmSettings()
    path = check_film_path(path)
    rows = film_rows(execution, settings)

    def pictures() -> Iterator[NDArray[np.uint8]]:
        for number, picture in enumerate(frames(execution, rows, settings), start=1):
            yield picture
            if progress is not None:
                progress(number, len(rows))

    size, rate = (settings.width, settings.height), settings.frames_per_second
    write_whole_with(path, lambda temporary: write_mp4(temporary, pictures(), size, rate))


def check_film_path(path: str | Path) -> Path:
    """Return the path of a film if one can be written there.

    Raises:
        SettingsError: If its name does not end in ``.mp4``.
        EncoderMissingError: If imageio-ffmpeg is not installed.
        OSError: If it cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() != SUFFIX:
        raise SettingsError(f"a film's file name must end in {SUFFIX}, not {path.name!r}")
    require_encoder()
    check_writable(path)
    return path


def film_rows(execution: Execution, settings: FilmSettings) -> list[int]:
    """Return the rows of an execution that a film shows."""
    step = settings.speed / settings.frames_per_second
    times = np.arange(execution.time[0], execution.time[-1] + 1e-9, step)
    return [int(row) for row in np.searchsorted(execution.time, times - 1e-9)]


def frames(
    execution: Execution, rows: list[int], settings: FilmSettings, camera: CameraSettings | None = None
) -> Iterator[NDArray[np.uint8]]:
    """Draw rows of an execution: pictures (height, width, 3), red, green, blue.

    Args:
        execution: What to show.
        rows: Its rows, in order.
        settings: Size of the pictures.
        camera: From where it is seen and how the camera follows; as in a film where omitted.
    """
    robot = execution.plans[0].step.robot
    size = settings.width, settings.height
    with (
        World(robot) as world,
        Renderer(robot, *size, supersampling=settings.supersampling, camera=camera) as renderer,
    ):
        shown = -1
        for row in rows:
            shown = _place(world, execution, row, shown)
            yield renderer.render(world, _overlay(world, execution, row))


def _place(world: World, execution: Execution, row: int, shown: int) -> int:
    """Put the robot and its cartons where they were; return the index of the plan whose cartons there are."""
    while shown < execution.plan[row]:
        shown += 1
        step = execution.plans[shown].step
        if shown == 0:
            world.place_cartons(step)
        else:
            world.cartons.continue_with(step)
            world.step = step
    x, y, z, w = execution.pelvis_orientation[row].tolist()
    world.show(execution.joint_positions[row], Pose(execution.pelvis[row], (x, y, z, w)))
    return shown


def _overlay(world: World, execution: Execution, row: int) -> Overlay:
    swing = 0 if execution.swing_is_left[row] else 1
    fan = world.body.fan_pose(SIDES[swing])
    tilt = math.degrees(execution.tilt[row])
    caption = f"{execution.time[row]:5.1f} s   {execution.phase[row]}"
    return Overlay.of_step(
        execution.plans[execution.plan[row]].step,
        center_of_mass=execution.center_of_mass[row],
        zmp=execution.zmp[row],
        fan=fan.position,
        thrust=float(execution.thrust_delivered[row, swing]),
        fan_axis=fan.axes[:, 2],
        caption=caption + (f"   tilt {tilt:.1f}°" if tilt > _VISIBLE_TILT else ""),
    )
