"""The picture of the layers and of the direction of imports: the real ones, and the layers of pyproject.toml."""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import grimp
import tomllib
from sphinx.application import Sphinx

TITLES = {  # of a layer, by its first module
    "jet_gym.cli": "command line",
    "jet_gym.reproduction": "reproduction and studio",
    "agents.training": "training",
    "jet_gym.figures": "figures",
    "agents.studies": "studies",
    "jet_gym.envs": "environments",
    "jet_gym.simulation": "simulation",
    "agents.planner": "planners",
    "agents.paths": "paths over a step",
    "jet_gym.task": "the task",
    "jet_gym.plan": "plans and balance space",
    "jet_gym.posture": "posture and fitness",
    "jet_gym.balance": "balance",
    "jet_gym.kinematics": "kinematics",
    "jet_gym.courses": "steps",
    "jet_gym.robot": "robot",
    "jet_gym.errors": "tools",
}
WIDTH, LEFT, RIGHT, GAP, LINE = 900, 16, 640, 10, 15  # [px]; boxes from LEFT to RIGHT, arrows beside them
HUES = {"jet_gym": "#0072b2", "agents": "#d55e00"}


def read_layers(pyproject: Path) -> list[list[str]]:
    """Return the modules of each layer, from top to bottom."""
    contracts = tomllib.loads(pyproject.read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]
    lines = next(contract["layers"] for contract in contracts if contract["id"] == "layers")
    return [line.replace(":", "|").replace(" ", "").split("|") for line in lines]


def count_imports(layers: list[list[str]]) -> Counter[tuple[int, int]]:
    """Return how many modules of one layer are imported by how many of another, by the layers' numbers."""
    graph = grimp.build_graph("jet_gym", "agents", cache_dir=None)
    number = {module: k for k, modules in enumerate(layers) for module in modules}

    def layer_of(module: str) -> int | None:
        while module and module not in number:
            module = module.rpartition(".")[0]
        return number.get(module)

    counts: Counter[tuple[int, int]] = Counter()
    for importer in graph.modules:
        for imported in graph.find_modules_directly_imported_by(importer):
            pair = layer_of(importer), layer_of(imported)
            if None not in pair and pair[0] != pair[1]:
                counts[pair] += 1  # type: ignore[index]
    return counts


def draw(layers: list[list[str]], counts: Counter[tuple[int, int]]) -> str:
    """Return the picture as SVG."""
    rows, middles, y = [], [], 40
    for modules in layers:
        names = ", ".join(module.partition(".")[2] for module in modules)
        lines = textwrap.wrap(names, 62)
        height = 2 * 9 + LINE * max(1, len(lines))
        hue = HUES[modules[0].partition(".")[0]]
        rows.append(
            f'<rect x="{LEFT}" y="{y}" width="{RIGHT - LEFT}" height="{height}" rx="5" fill="{hue}" '
            f'fill-opacity="0.09" stroke="{hue}" stroke-opacity="0.55"/>'
        )
        middle = y + height / 2
        rows.append(f'<text x="{LEFT + 12}" y="{middle + 4.5:g}" class="title">{escape(TITLES[modules[0]])}</text>')
        first = middle + 4 - LINE * (len(lines) - 1) / 2
        rows += [
            f'<text x="{LEFT + 214}" y="{first + LINE * k:g}" class="names">{escape(line)}</text>'
            for k, line in enumerate(lines)
        ]
        middles.append(middle)
        y += height + GAP
    arrows = [_arrow(middles, pair, count) for pair, count in sorted(counts.items())]
    key = (
        f'<text x="{LEFT}" y="24" class="names">'
        f'<tspan fill="{HUES["jet_gym"]}" font-weight="600">jet_gym/</tspan> and '
        f'<tspan fill="{HUES["agents"]}" font-weight="600">agents/</tspan>'
        f": an arrow leads from a layer to one that it imports from; the thicker, the more imports</text>"
    )
    style = (
        "text{font-family:system-ui,'Segoe UI',Roboto,'DejaVu Sans',sans-serif;fill:#222}"
        ".title{font-size:14px;font-weight:600}.names{font-size:12px}"
        ".arrow{fill:none;stroke-opacity:.4}"
    )
    head = (
        '<marker id="down" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" '
        'markerUnits="userSpaceOnUse" orient="auto"><path d="M0 0 8 4 0 8z" fill="#555"/></marker>'
        '<marker id="up" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="9" markerHeight="9" '
        'markerUnits="userSpaceOnUse" orient="auto"><path d="M0 0 8 4 0 8z" fill="#c00"/></marker>'
    )
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {y + 6}" width="{WIDTH}" role="img" '
            'aria-label="Layers of the package and the direction of imports">',
            f"<style>{style}</style><defs>{head}</defs>",
            f'<rect width="{WIDTH}" height="{y + 6}" fill="#fff"/>',
            key,
            *rows,
            *arrows,
            "</svg>\n",
        ]
    )


def _arrow(middles: list[float], pair: tuple[int, int], count: int) -> str:
    """Return an arc from one layer to another, the wider the farther they are; red where it leads upward."""
    above, below = pair
    start, end = middles[above] + 4, middles[below] - 4
    reach = 14 + 230 * abs(below - above) / len(middles)
    color, head = ("#555", "down") if below > above else ("#c00", "up")
    width, far = 0.6 + 0.5 * math.log2(count), RIGHT + 1.33 * reach
    return (
        f'<path class="arrow" stroke="{color}" stroke-width="{width:.1f}" marker-end="url(#{head})" '
        f'd="M{RIGHT} {start:g}C{far:.0f} {start:g} {far:.0f} {end:g} {RIGHT} {end:g}"/>'
    )


def picture() -> str:
    """Return the picture of this repository."""
    layers = read_layers(Path(__file__).parents[2] / "pyproject.toml")
    return draw(layers, count_imports(layers))


def _write_picture(app: Sphinx) -> None:
    folder = Path(app.srcdir) / "_generated"
    folder.mkdir(exist_ok=True)
    (folder / "layers.svg").write_text(picture(), encoding="utf-8")


def setup(app: Sphinx) -> dict[str, Any]:
    """Draw the picture before pages are read."""
    app.connect("builder-inited", _write_picture)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
