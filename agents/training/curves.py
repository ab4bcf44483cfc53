"""Draws the learning curves of training runs.

python -m agents.training.curves runs/*-seed* --plot docs/images/learning-curves.png
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from agents.training.run_folder import PROGRESS, read_progress
from jet_gym.errors import TOLD, sentence_of
from jet_gym.figures.learning_curves import plot_learning_curves
from jet_gym.figures.saving import check_figure_path, save_figure


def main() -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path, help="folders of training runs")
    parser.add_argument("--plot", type=Path, required=True, help="picture to write")
    arguments = parser.parse_args()
    try:
        path = check_figure_path(arguments.plot)
        for run in arguments.runs:
            if not (run / PROGRESS).exists():
                raise ValueError(f"{run} holds no run")
        runs = [read_progress(run) for run in arguments.runs]
        save_figure(plot_learning_curves(runs), path)
    except (*TOLD, KeyError) as error:
        print(f"error: {sentence_of(error)}", file=sys.stderr)
        return 2
    for folder, run in zip(arguments.runs, runs, strict=True):
        last, seconds = run["validations"][-1], sum(part[-1]["seconds"] for part in run.values() if part)
        print(
            f"{folder}: {last['steps']:,} steps of PPO, {seconds / 60:.1f} min in all, below GAS on "
            f"{last['wins']:.0%} of steps, {last['violated_points']:.2%} of points violated"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
