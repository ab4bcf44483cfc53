"""The page: one HTML file that needs nothing else."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from jet_gym.reproduction.model import Chapter, Settings

_TEMPLATE = "page.html.jinja"
_SETTING_NAMES = {
    "seed": "first seed",
    "plans": "plans of each planner and motion",
    "space_resolution": "grid of the balance space (mm)",
    "study_plans": "plans of each variant in the studies",
    "thrust_resolution": "grid of the least thrust (mm)",
    "trials": "trials of the experiment",
    "draws": "draws of the disturbances",
    "rounds": "rounds of the calculation times",
}


def render_page(chapters: Sequence[Chapter], settings: Settings, facts: dict[str, str]) -> str:
    """Return the page as HTML; its pictures are within it.

    Args:
        chapters: What was found.
        settings: With which settings.
        facts: On which machine and by which command.
    """
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    template = environment.from_string(Path(__file__).with_name(_TEMPLATE).read_text(encoding="utf-8"))
    claims = [(chapter, claim) for chapter in chapters for claim in chapter.claims]
    return template.render(
        chapters=chapters,
        claims=claims,
        counts={
            kind: sum(claim.verdict == kind for _, claim in claims) for kind in ("holds", "differs", "not tested")
        },
        settings={_SETTING_NAMES[name]: f"{value:g}" for name, value in asdict(settings).items()},
        facts=facts,
        embedded=lambda png: base64.b64encode(png).decode(),
    )
