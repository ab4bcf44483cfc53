"""How policies get better as they train, seed by seed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from jet_gym.figures import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Validations = Sequence[Mapping[str, float]]
"""The validations of a run: ``steps``, ``seconds`` and the fields of a score, in the order of their steps."""

_QUANTITIES = (
    ("wins", "steps with less fitness than GAS [%]", 100.0),
    ("median_ratio", "median fitness over that of GAS", 1.0),
    ("violated_points", "swing points that violate a constraint [%]", 100.0),
)
_COLOR = "#0072B2"


def plot_learning_curves(runs: Sequence[Validations]) -> Figure:
    """Draw what validation says of runs with different seeds: each run thin, the median over them thick.

    Args:
        runs: The validations of each run.

    Raises:
        ValueError: If there is no run, or one without a validation.
    """
    if not runs or not all(runs):
        raise ValueError("learning curves need at least one run with a validation")
    figure = style.new_figure(12.0, 4.6)
    panels: list[Axes] = list(np.atleast_1d(figure.subplots(1, 3, sharex=True)))
    for panel, (name, label, scale) in zip(panels, _QUANTITIES, strict=True):
        for run in runs:
            steps = [row["steps"] / 1e6 for row in run]
            values = [scale * row[name] for row in run]
            panel.plot(steps, values, color=style.tint(_COLOR, 0.45), linewidth=1.0)
        at, middle = _median(runs, name)
        panel.plot(at / 1e6, scale * middle, color=_COLOR, linewidth=2.4)
        panel.set_ylim(bottom=0.0, top=100.0 if name == "wins" else None)
        style.label_axes(panel, x_label="steps of PPO [10⁶]", y_label=label)
    panels[1].axhline(1.0, color=style.INK, linewidth=0.8, linestyle=":")
    runs_said = f"{len(runs)} seeds, their median thick" if len(runs) > 1 else "one seed"
    style.add_heading(figure, "Learning curves", f"on validation steps that training never draws; {runs_said}")
    return figure


def _median(runs: Sequence[Validations], name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the steps at which the shortest run was validated, and the median over the runs there."""
    steps = np.array([row["steps"] for row in min(runs, key=lambda run: run[-1]["steps"])], dtype=np.float64)
    curves = [np.interp(steps, [row["steps"] for row in run], [row[name] for row in run]) for run in runs]
    return steps, np.median(curves, axis=0)
