"""``train.py`` as tests run it: every size so small that it takes seconds."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parents[1]
TINY = [
    "--steps",
    "700",
    "--lanes",
    "4",
    "--rollout",
    "64",
    "--batch-size",
    "64",
    "--epochs",
    "2",
    "--imitation.rounds",
    "2",
    "--imitation.first-steps",
    "8",
    "--imitation.steps-per-round",
    "2",
    "--imitation.episodes",
    "8",
    "--critic-steps",
    "256",
    "--validate-every",
    "256",
    "--validation-steps",
    "4",
    "--test-steps",
    "3",
    "--hidden",
    "16",
    "16",
    "--threads",
    "1",
]


def script() -> ModuleType:
    """Return ``train.py`` as a module."""
    sys.path.insert(0, str(ROOT))
    try:
        import train as module
    finally:
        sys.path.pop(0)
    return module


def train(*arguments: str) -> int:
    try:
        return int(script().main(list(arguments)))
    except SystemExit as stopped:  # bad arguments
        return int(stopped.code or 0)
