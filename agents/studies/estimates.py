"""What the estimates do: peak thrust and the greatest ditch with another mass split, fan offset, foot or margin.

The paper does not state how the robot's mass is split, how far outward the fan sits, how long the foot is, or how
far from the sole's edge its ZMP stays. Each of them varies here about the estimate, the others as they are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from agents.planner import make_planner
from agents.summary import PlanSummary, summarize
from jet_gym.balance import BalanceSettings
from jet_gym.courses import CARTON_LENGTH, PAPER
from jet_gym.leg import Leg
from jet_gym.robot import Robot, Trunk
from jet_gym.utils.progress import Progress

PELVIS_MASSES = (2.0, 2.4, 2.8, 3.2, 3.6)  # [kg] of 6.8 kg
FAN_OFFSETS = (0.0, 0.03, 0.06, 0.09, 0.12)  # [m] outward of the ankle
FOOT_LENGTHS = (0.13, 0.15, 0.17, 0.19, 0.21)  # [m]
ZMP_MARGINS = (0.005, 0.01, 0.02, 0.03, 0.04)  # [m]
_WIDEST = 0.8  # [m] ditch, much beyond two stretched legs
_PRECISION = 0.002  # [m] of the greatest ditch
_DITCH_PLANS = 3  # plans by which a ditch is judged


@dataclass(frozen=True)
class EstimateRow:
    """The robot with one number changed.

    Attributes:
        quantity: What varies.
        value: Its value, in the unit.
        unit: ``"kg"`` or ``"mm"``.
        is_estimate: Whether it is the value that this package takes.
        side: GAS on the step to the side, over the seeds.
        forward: GAS on the step across the ditch, over the seeds.
        side_ga: GA, which looks at thrust alone, on the step to the side.
        forward_ga: GA on the step across the ditch.
        greatest_ditch: The widest ditch [m] that GAS plans to cross.
    """

    quantity: str
    value: float
    unit: str
    is_estimate: bool
    side: PlanSummary
    forward: PlanSummary
    side_ga: PlanSummary
    forward_ga: PlanSummary
    greatest_ditch: float


@dataclass(frozen=True)
class _Variant:
    quantity: str
    value: float
    unit: str
    is_estimate: bool
    robot: Robot
    settings: BalanceSettings


def study_estimates(seeds: Sequence[int], progress: Progress | None = None) -> list[EstimateRow]:
    """Vary each estimate about its value and see what that does.

    Args:
        seeds: Seeds of the plans.
        progress: Called with how many of how many variants are done.
    """
    variants = list(_variants(PAPER.side.robot))
    rows = []
    for done, variant in enumerate(variants, start=1):
        side, forward, side_ga, forward_ga = (
            summarize([planner.plan(replace(step, robot=variant.robot), seed=seed) for seed in seeds])
            for planner in (make_planner(name, balance=variant.settings) for name in ("gas", "ga"))
            for step in PAPER
        )
        ditch = greatest_ditch(variant.robot, variant.settings, seeds[:_DITCH_PLANS])
        rows.append(
            EstimateRow(
                variant.quantity, variant.value, variant.unit, variant.is_estimate,
                side, forward, side_ga, forward_ga, ditch,
            )
        )  # fmt: skip
        if progress is not None:
            progress(done, len(variants))
    return rows


def greatest_ditch(
    robot: Robot, settings: BalanceSettings | None = None, seeds: Sequence[int] = (0, 1, 2)
) -> float:
    """Return the width of the widest ditch [m] that GAS plans to cross by the paper's step, its landing moved.

    By bisection, to 2 mm. A ditch is crossed if one of the plans violates no constraint at any swing point.

    Args:
        robot: The robot.
        settings: What counts as balanced; the defaults where omitted.
        seeds: Seeds of the plans, one after the other until one succeeds.

    Returns:
        The width; NaN if not even cartons that touch can be crossed.
    """
    planner = make_planner("gas", balance=settings)

    def crossed(width: float) -> bool:
        landing = (width + CARTON_LENGTH, *PAPER.forward.landing[1:])
        step = replace(PAPER.forward, landing=landing, robot=robot)
        return any(not planner.plan(step, seed=seed).violated_points for seed in seeds)

    low, high = 0.0, _WIDEST
    if not crossed(low):
        return math.nan
    while high - low > _PRECISION:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if crossed(middle) else (low, middle)
    return low


def with_pelvis_mass(robot: Robot, mass: float) -> Robot:
    """Return a robot of the same total mass whose pelvis has another; its legs are scaled to what is left."""
    pelvis = robot.mass - math.fsum((*robot.left.masses, *robot.right.masses))
    of_pelvis, of_legs = mass / pelvis, (robot.mass - mass) / (robot.mass - pelvis)
    x, y, z = (of_pelvis * moment for moment in robot.trunk.mass_moment)
    return replace(
        robot,
        left=_scaled_mass(robot.left, of_legs),
        right=_scaled_mass(robot.right, of_legs),
        trunk=Trunk((x, y, z), robot.mass),
    )


def with_fan_offset(robot: Robot, offset: float) -> Robot:
    """Return a robot whose fans blow farther outward of the ankle; where their mass is stays."""
    left, right = (
        leg._replace(fan=(leg.fan[0], math.copysign(offset, leg.fan[1]), leg.fan[2]))
        for leg in (robot.left, robot.right)
    )
    return replace(robot, left=left, right=right)


def with_foot_length(robot: Robot, length: float) -> Robot:
    """Return a robot with longer soles, toe and heel in proportion; their mass stays."""
    left, right = (_scaled_sole(leg, length) for leg in (robot.left, robot.right))
    return replace(robot, left=left, right=right)


def _variants(robot: Robot) -> Iterator[_Variant]:
    usual = BalanceSettings()
    pelvis = robot.mass - math.fsum((*robot.left.masses, *robot.right.masses))
    foot = robot.left.sole_rectangle[1] - robot.left.sole_rectangle[0]
    for mass in PELVIS_MASSES:
        yield _Variant("pelvis mass", mass, "kg", _same(mass, pelvis), with_pelvis_mass(robot, mass), usual)
    for offset in FAN_OFFSETS:
        is_estimate = _same(offset, abs(robot.left.fan[1]))
        yield _Variant("fan offset", 1e3 * offset, "mm", is_estimate, with_fan_offset(robot, offset), usual)
    for length in FOOT_LENGTHS:
        yield _Variant(
            "foot length", 1e3 * length, "mm", _same(length, foot), with_foot_length(robot, length), usual
        )
    for margin in ZMP_MARGINS:
        settings = replace(usual, zmp_margin=margin)
        yield _Variant("ZMP margin", 1e3 * margin, "mm", _same(margin, usual.zmp_margin), robot, settings)


def _same(a: float, b: float) -> bool:
    return math.isclose(a, b, abs_tol=1e-9)


def _scaled_mass(leg: Leg, factor: float) -> Leg:
    a, b, c, d, e, f = (factor * mass for mass in leg.masses)
    u, v, w, x, y, z = ((factor * moment[0], factor * moment[1], factor * moment[2]) for moment in leg.mass_moments)
    return leg._replace(masses=(a, b, c, d, e, f), mass_moments=(u, v, w, x, y, z))


def _scaled_sole(leg: Leg, length: float) -> Leg:
    x_min, x_max, y_min, y_max = leg.sole_rectangle
    factor = length / (x_max - x_min)
    return leg._replace(sole_rectangle=(factor * x_min, factor * x_max, y_min, y_max))
