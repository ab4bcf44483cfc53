"""The comparison table for the one step of the page."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from agents.summary import summarize
from jet_gym.figures.style import planner_styles
from jet_gym.plan import Plan

_HEADINGS = (
    ("planner", ""),
    ("mean<br>thrust", "N"),
    ("peak<br>thrust", "N"),
    ("pelvis<br>rough.", "mm"),
    ("thrust<br>rough.", "N"),
    ("total<br>fitness", ""),
    ("viol.<br>points", ""),
    ("a<br>point", "ms"),
)


def comparison_table(plans: Sequence[Plan]) -> str:
    """Return the figures by which plans of one step are compared, as HTML."""
    styles = planner_styles(plan.planner for plan in plans)
    heads = "".join(
        f'<th style="text-align:right;padding:2px 3px;vertical-align:bottom;font-weight:600">{name}'
        f'<br><span style="color:#888;font-weight:400">{unit}</span></th>'
        for name, unit in _HEADINGS
    )
    rows = []
    for plan in plans:
        s = summarize([plan])
        look = styles[plan.planner]
        cells = (
            f"{s.mean_thrust.mean:.2f}",
            f"{s.peak_thrust.mean:.2f}",
            f"{1e3 * s.pelvis_roughness.mean:.2f}",
            f"{s.thrust_roughness.mean:.2f}",
            _short(s.total_fitness.mean),
            f"{s.violated_points.mean:.0f}",
            f"{s.milliseconds_per_point.mean:.2f}",
        )
        name = f'<td style="padding:2px 3px;color:{look.color};font-weight:600">{_breakable(look.label)}</td>'
        rows.append(
            f"<tr>{name}"
            + "".join(f'<td style="text-align:right;padding:2px 3px">{c}</td>' for c in cells)
            + "</tr>"
        )
    return (
        '<table style="width:100%;border-collapse:collapse;font-size:11px;line-height:1.2;'
        f'font-variant-numeric:tabular-nums"><tr style="border-bottom:1px solid #ddd">{heads}</tr>{"".join(rows)}'
        "</table>"
    )


def _breakable(name: str) -> str:
    """Return a name as HTML that may go on in the next line where it has a plus sign."""
    return escape(name).replace("+", "+<wbr>")


def _short(value: float) -> str:
    """Write a number so that it fits into a narrow column."""
    return f"{value:,.0f}" if value < 1e5 else f"{1e-3 * value:,.0f}k"
