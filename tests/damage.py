"""How the fuzz tests damage files, and what they ask of an error."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

NUMBERS = st.one_of(
    st.floats(),
    st.integers(),
    st.sampled_from([0, -1, 2, 10**9, 10**30, 10**400, -0.0, 1e308, math.nan, math.inf, True, "1", "nan"]),
)

JSON = st.recursive(
    st.one_of(st.none(), st.booleans(), NUMBERS, st.text(max_size=8)),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=5), inner, max_size=3)),
    max_leaves=8,
)


class Bomb:
    """Writes a file when it is unpickled."""

    def __init__(self, target: Path) -> None:
        self.target = target

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.target,)


def check_sentence(error: BaseException) -> None:
    """An error's message is one line that says something."""
    assert len(str(error)) > 10
    assert "\n" not in str(error)


@st.composite
def damaged_bytes(draw: st.DrawFn, content: bytes) -> bytes:
    """Flip, cut out, repeat or put in some bytes."""
    damaged = bytearray(content)
    for _ in range(draw(st.integers(1, 4))):
        place = draw(st.integers(0, max(len(damaged) - 1, 0)))
        length = draw(st.integers(1, 40))
        kind = draw(st.sampled_from(["flip", "cut", "end", "repeat", "insert"]))
        if kind == "flip" and damaged:
            damaged[place] ^= 1 << draw(st.integers(0, 7))
        elif kind == "cut":
            del damaged[place : place + length]
        elif kind == "end":
            del damaged[place:]
        elif kind == "repeat":
            damaged[place:place] = damaged[place : place + length]
        else:
            damaged[place:place] = draw(st.binary(max_size=8))
    return bytes(damaged)


@st.composite
def damaged_json(draw: st.DrawFn, content: str) -> str:
    """Replace, delete or add values somewhere in a document."""
    data = json.loads(content)
    for _ in range(draw(st.integers(1, 3))):
        node = data
        while isinstance(node, dict | list) and node:
            keys = list(node) if isinstance(node, dict) else list(range(len(node)))
            key = draw(st.sampled_from(keys))
            child = node[key]
            if isinstance(child, dict | list) and child and draw(st.integers(0, 3)):
                node = child
                continue
            kind = draw(st.sampled_from(["replace", "replace", "number", "delete", "add"]))
            if kind == "replace":
                node[key] = draw(JSON)
            elif kind == "number":
                node[key] = draw(NUMBERS)
            elif kind == "delete":
                del node[key]
            elif isinstance(node, dict):
                node[draw(st.text(max_size=5))] = draw(JSON)
            else:
                node.append(draw(JSON))
            break
    return json.dumps(data)


DTYPES = st.sampled_from(["f4", "f8", "f2", "i8", "u1", "c16", "?", "U3", "S3", "M8[s]"])

SHAPES = st.lists(st.integers(0, 4), max_size=3).map(tuple)
