"""The folder of a training run: what was asked, by which versions, and what came out."""

from __future__ import annotations

import dataclasses
import json
import platform
import subprocess
from collections.abc import Sequence
from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from jet_gym.errors import SettingsError, sentence_of
from jet_gym.utils.files import read_whole, write_whole

RUN, PROGRESS = "run.json", "progress.json"
_PACKAGES = ("jet-gym", "gymnasium", "stable-baselines3", "torch", "numpy", "numba", "pybullet")


def describe_run(settings: Any, command: Sequence[str]) -> dict[str, Any]:
    """Return settings (a dataclass), versions, command and git revision of this run as plain data."""
    return {
        "settings": {name: _plain(value) for name, value in dataclasses.asdict(settings).items()},
        "command": list(command),
        "started": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        "python": platform.python_version(),
        "versions": {name: found for name in _PACKAGES if (found := _version(name)) is not None},
        "git_revision": git_revision(),
    }


def read_run(folder: Path) -> dict[str, Any]:
    """Return what :func:`describe_run` said of the run in a folder.

    Raises:
        SettingsError: If it holds none, or a damaged one.
    """
    try:
        about: dict[str, Any] = json.loads(read_whole(folder / RUN))
        if not (isinstance(about, dict) and {"settings", "command"} <= set(about)):
            raise ValueError("its settings and its command are missing")
    except (OSError, ValueError) as error:
        raise SettingsError(f"{folder} holds no run: {sentence_of(error)}") from error
    return about


def git_revision() -> str | None:
    """Return the revision of the source, with a ``+`` where it was changed since; ``None`` outside git."""
    folder = Path(__file__).resolve().parent
    try:
        revision = _git(folder, "rev-parse", "HEAD")
        return revision + ("+" if _git(folder, "status", "--porcelain", "--untracked-files=no") else "")
    except (OSError, subprocess.SubprocessError):
        return None


def read_progress(folder: Path) -> dict[str, list[dict[str, float]]]:
    """Return what the validations of a run scored so far: ``imitation`` and ``validations``, the latter of PPO."""
    path = folder / PROGRESS
    noted: dict[str, list[dict[str, float]]] = json.loads(path.read_text()) if path.exists() else {}
    return {"imitation": noted.get("imitation", []), "validations": noted.get("validations", [])}


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write a JSON file, whole or not at all."""
    write_whole(path, (json.dumps(content, indent=1) + "\n").encode())


def _git(folder: Path, *arguments: str) -> str:
    done = subprocess.run(["git", *arguments], cwd=folder, check=True, capture_output=True, text=True, timeout=10)
    return done.stdout.strip()


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _plain(value: Any) -> Any:
    return str(value) if isinstance(value, Path) else value
