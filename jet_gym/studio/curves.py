"""The curves along a step that the page plots and tabulates."""

from __future__ import annotations

import numpy as np

from jet_gym.constraints import CONSTRAINT_NAMES, SEARCH_RANGE
from jet_gym.fitness import FitnessSettings, fitness_of_postures
from jet_gym.ground import rectangle_margin
from jet_gym.leg import opposite
from jet_gym.plan import Plan
from jet_gym.step import Step
from jet_gym.utils.arrays import Array


def zmp_margin(step: Step, zmp: Array) -> Array:
    """Return how far ZMPs (N, 2) are from the nearest edge of the support sole (N,) [m]; negative outside."""
    leg = step.robot.leg(opposite(step.swing))
    return rectangle_margin(leg, zmp - np.array(step.support[:2]))


def fitness_terms(plan: Plan, settings: FitnessSettings) -> Array:
    """Return f1 to f4 of eqs (16) to (22) at each swing point of a plan (N, 4)."""
    flags = {name: flag for flag, name in CONSTRAINT_NAMES.items() if flag != SEARCH_RANGE}
    violations = [sum(flags.get(name, 0) for name in names) for names in plan.violations]
    return fitness_of_postures(violations, plan.thrust, plan.pelvis, settings)
