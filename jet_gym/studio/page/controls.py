"""What every panel needs: quiet lines of text, and controls that act on what a person does."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any, Protocol

from jet_gym.studio.inputs import Inputs

Change = Callable[[Inputs], Inputs]


def hint(text: str) -> str:
    """Return a quiet line of HTML."""
    return f'<div style="padding:4px 12px 2px;font-size:12px;color:#666">{escape(text)}</div>'


def outcome(sentence: str, good: bool = True) -> str:
    """Return HTML that says what became of something; nothing if the sentence is empty."""
    ink = "#0b6e4a" if good else "#a01020"
    text = f'<div style="padding:4px 12px;font-size:13px;color:{ink}">{escape(sentence)}</div>'
    return text if sentence else ""


class Changeable(Protocol):
    """A page whose inputs can be changed."""

    def change(self, change: Change, foot: str | None = None) -> None:
        """Change what is asked for; ``foot`` is the one that was moved, if one was."""


def on_update(handle: Any, act: Callable[[Any], None]) -> None:
    """Act on what a person sets, and not on what the page itself does; coroutines keep the order of events."""

    async def updated(event: Any) -> None:
        if event.client is not None:
            act(event.target.value)

    handle.on_update(updated)


def on_change(controller: Changeable, handle: Any, change: Callable[[Inputs, Any], Inputs]) -> None:
    """Let what a person sets change what is asked for, from the inputs and the value to new inputs."""
    on_update(handle, lambda value: controller.change(lambda inputs: change(inputs, value)))


def on_click(handle: Any, act: Callable[[Any], None]) -> None:
    """Act on a click."""

    async def clicked(event: Any) -> None:
        act(event.target.value)

    handle.on_click(clicked)


def on_upload(handle: Any, act: Callable[[str, bytes], None]) -> None:
    """Act on a file, given its name and content."""

    async def uploaded(event: Any) -> None:
        act(event.target.value.name, event.target.value.content)

    handle.on_upload(uploaded)
