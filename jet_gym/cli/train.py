"""``jet-gym train``: the same as ``python train.py``."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import click

from jet_gym.errors import JetGymError

_PACKAGE = Path(__file__).resolve().parents[1]
_PLACES = (_PACKAGE.parent / "train.py", _PACKAGE / "data" / "train.py")  # in the source, in a wheel


@click.command(
    "train",
    short_help="Train a posture policy with PPO.",
    context_settings={"ignore_unknown_options": True, "help_option_names": []},
)
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED)
def train_command(arguments: tuple[str, ...]) -> int:
    """Train a posture policy; the same as python train.py, whose --help has the options."""
    try:
        script = _load(next(place for place in _PLACES if place.exists()))
    except ImportError as error:
        raise JetGymError(
            f"training needs {error.name}: pip install torch==2.13.0, and then 'jet-gym[train]'"
        ) from error
    code: int = script.main(list(arguments), "jet-gym train")
    return code


def _load(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("train", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["train"] = module  # where its annotations are looked up
    spec.loader.exec_module(module)
    return module
