"""Whether any posture at all satisfies the constraints at a swing point, and if none does, which one fails.

By exhaustion over the pelvis: every position of a grid about the hip heights and widths that the legs allow.
A step that is feasible at each of its points can still have no smooth path; that is for planners to find out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from jet_gym.balance import BalanceSettings
from jet_gym.errors import InfeasibleStepError
from jet_gym.leg import opposite
from jet_gym.posture import Postures, evaluate_postures
from jet_gym.robot import Robot
from jet_gym.step import Step
from jet_gym.utils.arrays import Array

RESOLUTION = 0.015  # [m] of the pelvis grid
_REFINEMENTS = 3  # finer grids about the best position before a swing point is given up
_ORDER = ("reach", "joint_limits", "edge_polygon", "thrust", "zmp")


@dataclass(frozen=True)
class Infeasibility:
    """A swing point that no posture on the grid can make.

    Attributes:
        point: Index of the swing point.
        constraint: Name of the constraint that no posture meets among those that meet the ones before it, in
            the order reach, joint limits, edge polygon, thrust, ZMP.
        shortfall: By how much the best posture misses it, in the unit.
        unit: ``"mm"``, ``"deg"`` or ``"N"``.
        detail: The whole finding in one clause.
    """

    point: int
    constraint: str
    shortfall: float
    unit: str
    detail: str


def diagnose(
    step: Step, settings: BalanceSettings | None = None, points: Iterable[int] | None = None
) -> list[Infeasibility]:
    """Find the swing points of a step at which no posture satisfies the constraints (8) to (11).

    Args:
        step: The step.
        settings: What counts as balanced; the defaults where omitted.
        points: Swing points to look at; all of them where omitted.

    Returns:
        One finding a swing point that cannot be made, in order; empty if every point can be made.
    """
    settings, soles = settings or BalanceSettings(), step.swing_sole
    chosen = range(step.points) if points is None else sorted(points)
    findings = (_diagnose_point(step, point, soles[point], settings) for point in chosen)
    return [finding for finding in findings if finding is not None]


def require_feasible(
    step: Step, settings: BalanceSettings | None = None, points: Iterable[int] | None = None
) -> None:
    """Refuse a step that has a swing point which no posture can make.

    Args:
        step: The step.
        settings: What counts as balanced; the defaults where omitted.
        points: Swing points to look at; all of them where omitted.

    Raises:
        InfeasibleStepError: Naming the worst such point, the constraint, and by how much it is missed.
    """
    findings = diagnose(step, settings, points)
    if findings:
        raise InfeasibleStepError(infeasibility_sentence(step, findings)[0])


def infeasibility_sentence(step: Step, findings: Sequence[Infeasibility]) -> tuple[str, Infeasibility]:
    """Tell in one sentence what makes a step infeasible.

    Args:
        step: The step.
        findings: What :func:`diagnose` found, one at least.

    Returns:
        The sentence, which names the worst swing point, the constraint, and by how much it is missed; and the
        finding at that point.
    """
    worst = min(findings, key=lambda finding: (_ORDER.index(finding.constraint), -finding.shortfall))
    others = f"; {len(findings)} swing points cannot be made" if len(findings) > 1 else ""
    where = f"swing point {worst.point} (of 0 to {step.points - 1})"
    return f"no posture makes {where}: {worst.detail}{others}", worst


def _diagnose_point(step: Step, point: int, sole: Array, settings: BalanceSettings) -> Infeasibility | None:
    """Look at one swing point on a grid, and on finer ones about the best position if that finds nothing."""
    support = np.array(step.support)
    reach = _reach(step.robot)
    low, high = np.maximum(sole, support) - reach, np.minimum(sole, support) + reach
    low[2] = max(sole[2], support[2])
    center, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), 2.0 * RESOLUTION)
    spacing = RESOLUTION
    finding: Infeasibility | None = None
    for _ in range(1 + _REFINEMENTS):
        grid = _grid(center, half, spacing)
        postures = evaluate_postures(step.robot, step.swing, sole, support, grid, settings)
        if (postures.violations == 0).any():
            return None
        finding, best = _first_unmet(point, postures, step, settings)
        center, half, spacing = grid[best], np.full(3, 2.0 * spacing), 0.25 * spacing
    return finding


def _reach(robot: Robot) -> float:
    """Return a bound on the distance from a sole to the pelvis along any axis [m]."""
    return max(
        math.hypot(*leg.thigh) + math.hypot(*leg.shank) + math.hypot(*leg.hip) + math.hypot(*leg.sole)
        for leg in (robot.left, robot.right)
    )


def _grid(center: Array, half: Array, spacing: float) -> Array:
    counts = np.ceil(half / spacing).astype(int)
    lines = [c + spacing * np.arange(-n, n + 1) for c, n in zip(center, counts, strict=True)]
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)


def _first_unmet(
    point: int, postures: Postures, step: Step, settings: BalanceSettings
) -> tuple[Infeasibility, int]:
    """Drop the postures that miss one constraint after the other; report the one that leaves none."""
    left = np.arange(len(postures.thrust))
    for stage in _stages(postures, step, settings):
        met = left[stage.excess[left] <= stage.tolerance]
        if len(met) == 0:
            best = int(left[np.argmin(stage.excess[left])])
            shortfall = float(stage.excess[best])
            detail = stage.describe(best, f"{shortfall:.3g} {stage.unit}")
            return Infeasibility(point, stage.constraint, shortfall, stage.unit, detail), best
        left = met
    raise AssertionError("a posture that meets every stage has no violation")


@dataclass(frozen=True, eq=False)
class _Stage:
    """One constraint: by how much each posture misses it, and how to say so."""

    constraint: str
    excess: Array
    unit: str
    describe: Callable[[int, str], str]
    tolerance: float = 0.0


def _stages(postures: Postures, step: Step, settings: BalanceSettings) -> tuple[_Stage, ...]:
    robot = step.robot
    max_thrust = settings.parameters(robot).max_thrust
    joints = postures.joint_positions
    joint_excess = np.degrees(np.maximum(robot.lower - joints, joints - robot.upper))
    edge_excess = np.degrees(np.abs(postures.edge_angle) - settings.edge_tolerance)
    thrust_excess = np.maximum(postures.thrust - max_thrust, -postures.thrust)
    x_min, x_max, y_min, y_max = robot.leg(opposite(step.swing)).sole_rectangle
    zmp = postures.zmp - np.array(step.support[:2])
    zmp_excess = 1e3 * np.max([x_min - zmp[:, 0], zmp[:, 0] - x_max, y_min - zmp[:, 1], zmp[:, 1] - y_max], axis=0)
    return (
        _Stage(
            "reach",
            1e3 * postures.out_of_reach,
            "mm",
            lambda _, missing: f"a sole is out of the legs' reach by {missing} at least",
        ),
        _Stage(
            "joint_limits",
            joint_excess.max(axis=-1),
            "deg",
            lambda best, missing: (
                f"joint {robot.joint_names[int(joint_excess[best].argmax())]} has to pass its limit "
                f"by {missing} at least, eq. (8)"
            ),
            tolerance=1e-6,
        ),
        _Stage(
            "edge_polygon",
            edge_excess,
            "deg",
            lambda _, missing: (
                f"the centre of mass leaves the edge polygon of {math.degrees(settings.edge_tolerance):.3g} deg "
                f"by {missing} at least, eq. (10)"
            ),
            tolerance=1e-9,
        ),
        _Stage(
            "thrust",
            thrust_excess,
            "N",
            lambda best, missing: (
                f"it takes a thrust of {postures.thrust[best]:.3g} N, "
                f"{missing} outside of 0 to {max_thrust:.3g} N, eq. (9)"
            ),
        ),
        _Stage(
            "zmp",
            zmp_excess,
            "mm",
            lambda _, missing: f"the ZMP leaves the support foot by {missing} at least, eq. (11)",
        ),
    )
