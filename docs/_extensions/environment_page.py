"""The environment's page is its class docstring, in Markdown as Gymnasium's are; the API links to it."""

import inspect
import re
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

from jet_gym.envs.jet_hr1_step import JetHR1StepEnv


def _write_page(app: Sphinx) -> None:
    folder = Path(app.srcdir) / "_generated"
    folder.mkdir(exist_ok=True)
    text = inspect.cleandoc(JetHR1StepEnv.__doc__ or "")
    (folder / "jet_hr1_step.md").write_text(_as_markdown(text) + "\n", encoding="utf-8")


def _as_markdown(text: str) -> str:
    """Return a docstring without roles of reStructuredText, each row of a table on one line."""
    text = re.sub(r":\w+:`([^`]+)`", r"`\1`", text)
    return re.sub(r" \|\n\|(?: \|)+ (?=\S)", " ", text)


def _link_to_page(_app: Sphinx, _what: str, name: str, _object: Any, _options: Any, lines: list[str]) -> None:
    if name.endswith(f".{JetHR1StepEnv.__name__}"):
        lines[:] = ["See :doc:`its page </environment>`."]


def setup(app: Sphinx) -> dict[str, Any]:
    """Write the page before pages are read."""
    app.setup_extension("sphinx.ext.autodoc")
    app.connect("builder-inited", _write_page)
    app.connect("autodoc-process-docstring", _link_to_page)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
