"""Steps on which policies are judged, and what GAS and the optimum make of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from agents.network import PolicyNetwork
from agents.optimal import OptimalPlanner
from agents.planner import make_planner
from agents.policy import PolicyPlanner
from jet_gym.plan import Plan
from jet_gym.step import Step
from jet_gym.utils.arrays import Array
from jet_gym.utils.progress import Progress

VALIDATION_SEED, TEST_SEED = 1_000_000_000, 2_000_000_000
"""First seeds of the steps that choose the best model, and of those that judge it; training's are below 10^9."""


def drawn_steps(count: int, first_seed: int, difficulty: float = 1.0) -> list[Step]:
    """Return the steps that ``JetHR1Step-v0`` draws for consecutive seeds."""
    from jet_gym.envs.jet_hr1_step import JetHR1StepEnv

    env, steps = JetHR1StepEnv(physics="quasistatic", difficulty=difficulty), []
    for seed in range(first_seed, first_seed + count):
        env.reset(seed=seed)
        steps.append(env.current_step)
    return steps


@dataclass(frozen=True)
class Score:
    """How a policy does on a set of steps.

    Attributes:
        wins: Share of the steps on which its total fitness is below that of GAS.
        median_ratio: Median of its total fitness over that of GAS.
        median_gap: Median of its total fitness over the optimal one, less 1.
        violated_points: Share of swing points at which a constraint is violated.
        violated_steps: Share of the steps with such a point.
        total_fitness: Mean total fitness.
        mean_thrust: Mean thrust over all swing points [N].
    """

    wins: float
    median_ratio: float
    median_gap: float
    violated_points: float
    violated_steps: float
    total_fitness: float
    mean_thrust: float

    @property
    def cost(self) -> float:
        """What the best model has least of: its median ratio to GAS, and a lot for each violated point."""
        return self.median_ratio + 100.0 * self.violated_points

    def __str__(self) -> str:
        """Say it in one line."""
        return (
            f"below GAS on {self.wins:.0%} of steps, {self.median_ratio:.2f} of its fitness, "
            f"{self.median_gap:.0%} above the optimum, {self.violated_points:.2%} of points violated"
        )


@dataclass(frozen=True, eq=False)
class StepSet:
    """Steps with what GAS and the optimal planner make of them.

    Attributes:
        steps: The steps.
        gas: Total fitness of GAS (N,).
        optimal: Total fitness of the optimal planner (N,).
    """

    steps: Sequence[Step]
    gas: Array = field(repr=False)
    optimal: Array = field(repr=False)

    @classmethod
    def drawn(cls, count: int, first_seed: int, progress: Progress | None = None) -> StepSet:
        """Draw steps and plan them with GAS and to the optimum, which takes some tenths of a second each."""
        steps = drawn_steps(count, first_seed)
        gas = [make_planner("gas").plan(step).total_fitness for step in steps]
        optimal = OptimalPlanner().plan_many(steps, progress=progress)
        return cls(steps, np.array(gas), np.array([plan.total_fitness for plan in optimal]))

    def score(self, network: PolicyNetwork, refine: int = 0) -> Score:
        """Judge a policy."""
        return self.score_plans(PolicyPlanner(model=network, refine=refine).plan_many(self.steps))

    def score_plans(self, plans: Sequence[Plan]) -> Score:
        """Judge plans of the steps, in their order."""
        totals = np.array([plan.total_fitness for plan in plans])
        violated = np.array([len(plan.violated_points) for plan in plans])
        points = sum(step.points for step in self.steps)
        return Score(
            wins=float((totals < self.gas).mean()),
            median_ratio=float(np.median(totals / self.gas)),
            median_gap=float(np.median(totals / self.optimal) - 1.0),
            violated_points=float(violated.sum() / points),
            violated_steps=float((violated > 0).mean()),
            total_fitness=float(totals.mean()),
            mean_thrust=float(np.concatenate([plan.thrust for plan in plans]).mean()),
        )
