"""Dataclasses of numbers and text from the plain data that JSON gives back, each field checked against its type."""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from typing import Any, TypeVar

Kind = TypeVar("Kind")


def from_plain(kind: type[Kind], data: Any) -> Kind:
    """Make a dataclass from a table of its fields.

    Args:
        kind: The dataclass; its fields are numbers, text, truth values, ``None``, literals, and tuples, named
            tuples and dataclasses of such.
        data: What ``json.loads`` made of what ``dataclasses.asdict`` gave.

    Raises:
        ValueError: If a field is missing, unknown, of another type or not finite; it names the field.
    """
    made: Kind = _made(kind, data, kind.__name__)
    return made


def _made(hint: Any, value: Any, name: str) -> Any:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (types.UnionType, typing.Union):  # with None
        other = next(kind for kind in arguments if kind is not type(None))
        return None if value is None else _made(other, value, name)
    if origin is tuple:
        kinds = arguments[:1] * _length(value) if arguments[1:] == (...,) else arguments
        return tuple(_parts(kinds, value, name))
    if dataclasses.is_dataclass(hint):
        return _from_fields(hint, value, name)
    if isinstance(hint, type) and issubclass(hint, tuple):  # a named one
        return hint(*_parts(tuple(typing.get_type_hints(hint).values()), value, name))
    if hint is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if not (value in arguments if origin is typing.Literal else type(value) is hint):
        raise ValueError(f"{name} cannot be {str(value)[:40]!r}")
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{name} must be finite, not {value}")
    return value


def _length(value: Any) -> int:
    return len(value) if isinstance(value, list) else 0


def _parts(kinds: tuple[Any, ...], value: Any, name: str) -> list[Any]:
    if not isinstance(value, list) or len(value) != len(kinds):
        raise ValueError(f"{name} must be a list of {len(kinds)}")
    return [_made(kind, part, name) for kind, part in zip(kinds, value, strict=True)]


def _from_fields(kind: Any, value: Any, name: str) -> Any:
    hints = typing.get_type_hints(kind)
    if not isinstance(value, dict) or set(value) != set(hints):
        raise ValueError(f"{name} must have the fields {', '.join(hints)}")
    return kind(**{field: _made(hint, value[field], field) for field, hint in hints.items()})
