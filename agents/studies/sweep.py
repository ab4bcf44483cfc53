"""What the smoothness weight omega does: the study from which its unit and its default were chosen.

The paper prints omega = 50 and no unit. In m it does nothing, in mm it freezes the pelvis.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from agents.planner import make_planner
from agents.summary import PlanSummary, summarize
from jet_gym.courses import PAPER
from jet_gym.fitness import FitnessSettings
from jet_gym.plan import Plan
from jet_gym.utils.progress import Progress

WEIGHTS = (50.0, 5e3, 2e4, 5e4, 1e5, 2e5, 5e5, 1e6, 2e6, 5e6, 5e7)  # [1/m^2]
UNITS = {50.0: "50 per m²", 5e3: "50 per dm²", 5e5: "50 per cm²", 5e7: "50 per mm²"}
"""Weights that are the paper's 50 in a round unit."""


@dataclass(frozen=True)
class SweepRow:
    """GAS with one smoothness weight on one motion.

    Attributes:
        motion: ``"side"`` or ``"forward"``.
        smoothness_weight: omega [1/m^2]; zero is GA.
        summary: Figures over the seeds.
    """

    motion: str
    smoothness_weight: float
    summary: PlanSummary


def sweep_smoothness(
    seeds: Sequence[int],
    weights: Sequence[float] = WEIGHTS,
    progress: Progress | None = None,
) -> list[SweepRow]:
    """Plan the paper's two motions with GA and with GAS at several smoothness weights.

    Args:
        seeds: Seeds of the plans.
        weights: Smoothness weights [1/m^2].
        progress: Called with how many of how many rows are done.
    """
    jobs = [(motion, weight) for motion in ("side", "forward") for weight in (0.0, *weights)]
    rows = []
    for done, (motion, weight) in enumerate(jobs, start=1):
        rows.append(SweepRow(motion, weight, summarize(list(_plans(motion, weight, seeds)))))
        if progress is not None:
            progress(done, len(jobs))
    return rows


def _plans(motion: str, weight: float, seeds: Sequence[int]) -> Iterator[Plan]:
    fitness = replace(FitnessSettings(), smoothness_weight=weight)
    planner = make_planner("gas" if weight > 0.0 else "ga", fitness=fitness)
    return (planner.plan(PAPER[motion], seed=seed) for seed in seeds)
