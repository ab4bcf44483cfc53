"""A PyBullet physics server of one's own; the only place that imports PyBullet."""

from __future__ import annotations

import importlib
import importlib.util
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from jet_gym.simulation.errors import BulletMissingError, DisplayMissingError
from jet_gym.simulation.settings import SimulationSettings


def connect(gui: bool = False) -> Any:
    """Start a physics server and return its client, a ``pybullet_utils.bullet_client.BulletClient``.

    Every call of the client goes to its own server, so that worlds do not disturb each other; a bare
    ``pybullet`` call would go to the first server of the process, whoever owns it.

    Args:
        gui: Whether to open PyBullet's window.

    Raises:
        BulletMissingError: If PyBullet is not installed.
        DisplayMissingError: If a window is asked for and there is no display, where PyBullet itself would end
            the whole process; or if PyBullet cannot start.
    """
    require_bullet()
    with _silent():
        pybullet: Any = importlib.import_module("pybullet")
    bullet_client: Any = importlib.import_module("pybullet_utils.bullet_client").BulletClient
    if gui and sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        raise DisplayMissingError(
            "there is no display for PyBullet's window (DISPLAY is not set); render to images instead"
        )
    # The client's constructor passes options to connect(), which makes PyBullet print a line to stdout.
    client = bullet_client.__new__(bullet_client)
    client._shapes, client._pid = {}, os.getpid()
    client._client = pybullet.connect(pybullet.GUI if gui else pybullet.DIRECT)
    if client._client < 0:
        raise DisplayMissingError(f"PyBullet could not {'open its window' if gui else 'start a server'}")
    return client


def require_bullet(instead: str = "") -> None:
    """Refuse to go on where PyBullet is not installed, without importing it.

    Args:
        instead: What works without it, for the error's sentence.

    Raises:
        BulletMissingError: If PyBullet is not installed; it says what to install.
    """
    if importlib.util.find_spec("pybullet") is not None:
        return
    compiler = ", which needs a C++ compiler on this Python" if sys.version_info >= (3, 12) else ""
    raise BulletMissingError(
        "the simulation needs PyBullet, which is not installed: pip install 'jet-gym[bullet]'"
        + compiler
        + (f"; or {instead}" if instead else "")
    )


@contextmanager
def _silent() -> Iterator[None]:
    """Keep what compiled code prints from the terminal: PyBullet tells its build time when it is imported."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = [(stream, os.dup(stream)) for stream in (1, 2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for stream, _ in kept:
            os.dup2(nowhere, stream)
        yield
    finally:
        for stream, copy in kept:
            os.dup2(copy, stream)
            os.close(copy)
        os.close(nowhere)


def configure(client: Any, settings: SimulationSettings) -> None:
    """Tell an engine how to compute, and set up the view of its window, if it has one."""
    client.setPhysicsEngineParameter(
        fixedTimeStep=settings.time_step,
        numSolverIterations=settings.solver_iterations,
        deterministicOverlappingPairs=1,  # contacts in an order that the past does not decide
    )
    client.setGravity(0.0, 0.0, -settings.gravity)
    client.configureDebugVisualizer(client.COV_ENABLE_GUI, 0)
    client.resetDebugVisualizerCamera(1.4, 50.0, -18.0, (0.2, 0.1, 0.15))
