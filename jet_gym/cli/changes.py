"""The option ``--set NAME=VALUE``, to change settings of an execution, and ``--settings``, to list them."""

from __future__ import annotations

import dataclasses
import difflib
import inspect
import re
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from jet_gym.simulation.execution import ExecutionSettings

Command = TypeVar("Command", bound=Callable[..., Any])
Settings = TypeVar("Settings")

_HAVE_OPTIONS = {"thrust"}  # of their own


def changes_option(command: Command) -> Command:
    """Add ``--set``, whose values are the argument ``changes``, and ``--settings``."""
    listing = click.option(
        "--settings", is_flag=True, expose_value=False, is_eager=True, callback=_list_settings,
        help="List what --set can change, with units and defaults, and exit.",
    )  # fmt: skip
    change = click.option(
        "--set", "changes", multiple=True, metavar="NAME=VALUE",
        help="Change a setting of timing, servos, IMU, PID or simulation, such as pid.proportional=60 "
        "course.time_scale=0.6 fan_power=0; may be given many times.",
    )  # fmt: skip
    return change(listing(command))


def with_changes(settings: Settings, changes: Sequence[str]) -> Settings:
    """Return settings with changes such as ``"pid.proportional=60"``.

    Raises:
        click.UsageError: If there is no such setting, or its value is no number.
        SettingsError: If the value is outside of what is allowed.
    """
    known = dict(setting_values(settings))
    for change in changes:
        name, equals, text = (part.strip() for part in change.partition("="))
        if not equals:
            raise click.UsageError(f"--set needs NAME=VALUE, not {change!r}")
        if name not in known:
            near = difflib.get_close_matches(name, known, n=3, cutoff=0.4)
            hint = f"near it: {', '.join(near)}" if near else "--settings lists them"
            raise click.UsageError(f"there is no setting {name!r}; {hint}")
        try:
            value = type(known[name])(text)
        except ValueError:
            kind = "whole number" if isinstance(known[name], int) else "number"
            raise click.UsageError(f"{name} must be a {kind}, not {text!r}") from None
        settings = _changed(settings, name.split("."), value)
    return settings


def setting_values(settings: Any, prefix: str = "") -> Iterator[tuple[str, int | float]]:
    """Yield the names and values of all settings that are numbers, those within others with a dot."""
    for field in dataclasses.fields(settings):
        value = getattr(settings, field.name)
        if dataclasses.is_dataclass(value):
            yield from setting_values(value, f"{prefix}{field.name}.")
        elif field.name not in _HAVE_OPTIONS:
            yield prefix + field.name, value


def _changed(settings: Settings, path: Sequence[str], value: int | float) -> Settings:
    first, *rest = path
    inner = _changed(getattr(settings, first), rest, value) if rest else value
    return dataclasses.replace(settings, **{first: inner})  # type: ignore[type-var]


def _list_settings(context: click.Context, _: click.Parameter, asked: bool) -> None:
    if not asked or context.resilient_parsing:
        return
    from jet_gym.cli.console import console, plain_table
    from jet_gym.simulation.execution import ExecutionSettings

    settings: ExecutionSettings = ExecutionSettings()
    table = plain_table("settings of an execution")
    for heading in ("name", "default", "what it is"):
        table.add_column(heading, justify="right" if heading == "default" else "left")
    for name, value in setting_values(settings):
        owner: Any = settings
        *parents, last = name.split(".")
        for parent in parents:
            owner = getattr(owner, parent)
        table.add_row(name, f"{value:g}", _description(type(owner), last))
    console.print(table, markup=False)
    context.exit(0)


def _description(owner: type, name: str) -> str:
    """Return what a class' docstring says of an attribute."""
    lines = inspect.getdoc(owner) or ""
    found = re.search(rf"^    {name}: (.*(?:\n        .*)*)", lines, re.MULTILINE)
    return " ".join(found[1].split()).replace("``", "") if found else ""
