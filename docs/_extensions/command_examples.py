"""The examples in a command's help, set as a block of code on the page of the command line."""

from typing import Any

import click
from sphinx.application import Sphinx


def _set_examples(_app: Sphinx, _context: click.Context, lines: list[str]) -> None:
    set_lines: list[str] = []
    within = False
    for line in lines:
        example = line.removeprefix("| ").strip()
        is_example = line.startswith("| ") and ("jet-gym " in example or "python " in example)
        if is_example and not within:
            set_lines += [".. code-block:: sh", ""]
        set_lines.append(f"   {example}" if is_example else line)
        within = is_example
    lines[:] = set_lines


def setup(app: Sphinx) -> dict[str, Any]:
    """Change descriptions before they are set."""
    app.setup_extension("sphinx_click")
    app.connect("sphinx-click-process-description", _set_examples)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
