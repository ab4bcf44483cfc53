"""Figures of plans and studies; matplotlib is loaded when the first one is drawn.

Every figure is a ``matplotlib.figure.Figure`` of its own: no window, no pyplot, nothing global.
"""

from jet_gym.figures.balance_space import plot_balance_section, plot_balance_space
from jet_gym.figures.calculation_time import plot_calculation_time
from jet_gym.figures.comparison import plot_comparison, plot_examples
from jet_gym.figures.estimates import plot_estimates
from jet_gym.figures.experiment import plot_execution, plot_pictures
from jet_gym.figures.locomotion import plot_locomotion
from jet_gym.figures.robustness import plot_robustness
from jet_gym.figures.saving import check_figure_path, png_bytes, save_figure
from jet_gym.figures.sweep import plot_smoothness_sweep
from jet_gym.figures.trajectories import plot_trajectories

__all__ = [
    "check_figure_path",
    "plot_balance_section",
    "plot_balance_space",
    "plot_calculation_time",
    "plot_comparison",
    "plot_estimates",
    "plot_examples",
    "plot_execution",
    "plot_locomotion",
    "plot_pictures",
    "plot_robustness",
    "plot_smoothness_sweep",
    "plot_trajectories",
    "png_bytes",
    "save_figure",
]
