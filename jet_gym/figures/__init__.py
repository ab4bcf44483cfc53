"""Figures of plans and studies; matplotlib is loaded when the first one is drawn.

Every figure is a ``matplotlib.figure.Figure`` of its own: no window, no pyplot, nothing global.
"""

from jet_gym.figures.balance_space import plot_balance_section, plot_balance_space
from jet_gym.figures.locomotion import plot_locomotion
from jet_gym.figures.style import check_figure_path, save_figure
from jet_gym.figures.sweep import SweepRow, plot_smoothness_sweep
from jet_gym.figures.trajectories import plot_trajectories

__all__ = [
    "SweepRow",
    "check_figure_path",
    "plot_balance_section",
    "plot_balance_space",
    "plot_locomotion",
    "plot_smoothness_sweep",
    "plot_trajectories",
    "save_figure",
]
