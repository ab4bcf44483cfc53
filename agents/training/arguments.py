"""A training script's arguments: read by tyro, refused in one sentence as those of every other command."""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Sequence
from typing import TypeVar

import tyro

from jet_gym.errors import SettingsError

Settings = TypeVar("Settings")


def parse_arguments(
    settings: type[Settings], arguments: Sequence[str], description: str | None, program: str
) -> Settings:
    """Return the settings that arguments ask for.

    Args:
        settings: A dataclass; its fields are the options.
        arguments: The arguments.
        description: What ``--help`` begins with.
        program: What ``--help`` calls the program.

    Raises:
        SettingsError: If an argument is wrong; a sentence.
        SystemExit: After ``--help``.
    """
    told = io.StringIO()
    try:
        with contextlib.redirect_stderr(told):
            return tyro.cli(settings, args=arguments, description=description, prog=program)
    except SystemExit as end:
        if not end.code:
            raise
        raise SettingsError(sentence_in(told.getvalue())) from end


def sentence_in(box: str) -> str:
    """Return in one line what a box of tyro says: what is wrong, and what was perhaps meant.

    A box has a title, what is wrong, and, each below a line across, options that are like the one given and where
    to find help; its lines are drawn in Unicode or in ASCII, as the terminal can.
    """
    title, *lines = (line.strip("│ ") for line in re.sub(r"\x1b\[[0-9;]*m", "", box).splitlines())
    parts = re.split(r"^[─╰╯-]{3,}$", "\n".join(lines), flags=re.MULTILINE)
    wrong, *others = [" ".join(part.split()) for part in parts if part.strip()] or [title]
    sentence = re.sub(r"^Error parsing (?!-)\w+: ", "", wrong)
    meant = re.search(r"meant: (--[\w.-]+)", "\n".join(others))
    return f"{sentence}. Did you mean {meant[1]}?" if meant else sentence
