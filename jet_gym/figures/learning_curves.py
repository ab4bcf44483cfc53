"""How policies get better as they train, seed by seed: while they imitate, then by PPO."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from jet_gym.figures import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from jet_gym.utils.arrays import Array

Progress = Mapping[str, Sequence[Mapping[str, float]]]
"""The validations of a run, in their order: ``imitation``, with ``states``, and ``validations``, with ``steps``.

Each has the fields of a score too.
"""

_QUANTITIES = (
    ("wins", "steps with less fitness than GAS [%]", 100.0),
    ("median_ratio", "median fitness over that of GAS", 1.0),
    ("violated_points", "swing points that violate a constraint [%]", 100.0),
)
_COLOR = "#0072B2"
_LEAST_SHOWN = 0.01  # [%] below which the axis of violations is linear


def plot_learning_curves(runs: Sequence[Progress]) -> Figure:
    """Draw what validation says of runs with different seeds: each run thin, the median over them thick.

    Args:
        runs: The progress of each run.

    Raises:
        ValueError: If there is no run, or one without a validation of PPO.
    """
    if not runs or not all(run["validations"] for run in runs):
        raise ValueError("learning curves need at least one run with a validation")
    figure = style.new_figure(12.0, 4.6)
    panels: list[Axes] = list(np.atleast_1d(figure.subplots(1, 3, sharex=True)))
    imitated = min(_imitated(run) for run in runs)
    for panel, (name, label, scale) in zip(panels, _QUANTITIES, strict=True):
        for run in runs:
            seen, values = _curve(run, name)
            panel.plot(seen / 1e6, scale * values, color=style.tint(_COLOR, 0.45), linewidth=1.0)
        seen, middle = _median(runs, name)
        panel.plot(seen / 1e6, scale * middle, color=_COLOR, linewidth=2.4)
        if imitated > 0.0:
            panel.axvspan(0.0, imitated / 1e6, color=style.tint(_COLOR, 0.08), linewidth=0.0, zorder=0)
        style.label_axes(panel, x_label="states seen [10⁶]", y_label=label)
    panels[0].set_ylim(0.0, 101.0)
    panels[1].set_ylim(bottom=0.0)
    panels[1].axhline(1.0, color=style.INK, linewidth=0.8, linestyle=":")
    panels[2].set_yscale("symlog", linthresh=_LEAST_SHOWN)
    panels[2].yaxis.set_major_formatter("{x:g}")
    panels[2].set_ylim(bottom=0.0)
    runs_said = f"{len(runs)} seeds, their median thick" if len(runs) > 1 else "one seed"
    phases = "imitation shaded, then PPO; " if imitated > 0.0 else ""
    said = f"{phases}on validation steps that training never draws; {runs_said}"
    style.add_heading(figure, "Learning curves", said)
    return figure


def _imitated(run: Progress) -> float:
    """Return how many states a run saw in imitation."""
    return run["imitation"][-1]["states"] if run["imitation"] else 0.0


def _curve(run: Progress, name: str) -> tuple[Array, Array]:
    """Return the states seen at each validation of a run, and a quantity there."""
    before = _imitated(run)
    seen = [row["states"] for row in run["imitation"]] + [before + row["steps"] for row in run["validations"]]
    values = [row[name] for row in (*run["imitation"], *run["validations"])]
    return np.array(seen, dtype=np.float64), np.array(values, dtype=np.float64)


def _median(runs: Sequence[Progress], name: str) -> tuple[Array, Array]:
    """Return the states at which the shortest run was validated, and the median over the runs there."""
    curves = [_curve(run, name) for run in runs]
    seen = min((states for states, _ in curves), key=lambda states: float(states[-1]))
    return seen, np.median([np.interp(seen, *curve) for curve in curves], axis=0)
