"""How many postures a second, beside PyBullet's inverse kinematics and a numerical one with Pinocchio.

All work on the same pelvis positions of one swing point, as GAS draws them. The iterative solvers get only
those within reach, as on the others they would run to their last iteration, and start from the posture that
GAS chose there, some centimetres away at most. They find joint positions and centre of mass; jet_gym also thrust,
ZMP and violated constraints. That all of them found the same is checked and printed.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from agents.studies.race import Contestant, race
from agents.studies.swing_point import SwingPoint, later_swing_point
from benchmarks.peers import TOLERANCE, BulletSolver, PinSolver, Solver
from benchmarks.report import Report, command_line
from jet_gym.fitness import FitnessSettings, fitness_of_postures
from jet_gym.posture import Postures, evaluate_postures
from jet_gym.utils.arrays import Array

_BATCH = 4000
_ITERATIVE = 50  # postures a call of an iterative solver
_CHECKED = 500


def measure(rounds: int) -> Report:
    """Run the race."""
    report = Report("Postures, on one core")
    point = later_swing_point()
    pelvises = point.random_pelvises(_BATCH)
    candidates = np.ascontiguousarray(pelvises.T)
    postures = _evaluate(point, pelvises)
    reachable = np.flatnonzero(postures.out_of_reach == 0.0)
    report.notes.append(
        f"Of {_BATCH:,} pelvis positions {len(reachable):,} are within reach and "
        f"{np.count_nonzero(postures.violations == 0):,} meet every constraint."
    )
    solvers = _solvers(point, report)
    contestants = [
        Contestant("evaluate_postures", lambda: _evaluate(point, pelvises), _BATCH),
        Contestant("fitness_of_candidates", lambda: point.fitness(candidates), _BATCH),
    ]
    spaced = reachable[:: max(1, len(reachable) // _ITERATIVE)][:_ITERATIVE]
    chosen = [(pelvises[i], float(postures.pelvis_yaw[i])) for i in spaced]
    for name, solver in solvers.items():
        contestants.append(Contestant(name, _solve_all(solver, chosen), len(chosen)))
    ours, inner, *others = race(contestants, rounds)

    report.add("evaluate_postures", 1.0 / ours.seconds, "/s", goal=1e6, at_least=True)
    report.add("fitness_of_candidates", 1.0 / inner.seconds, "/s")
    goals = {"PyBullet": 300.0, "Pinocchio": 30.0}
    for other in others:
        report.add(other.name, 1.0 / other.seconds, "/s")
        report.add(
            f"evaluate_postures over {other.name}",
            other.ratio, "x", lowest=other.lowest, highest=other.highest,
            goal=goals[other.name], at_least=True,
        )  # fmt: skip
        report.add(f"fitness_of_candidates over {other.name}", other.seconds / inner.seconds, "x")
    _check_fitness(report, point, pelvises, postures)
    _check_solvers(report, point, postures, reachable[:_CHECKED], solvers)
    return report


def _evaluate(point: SwingPoint, pelvises: Array) -> Postures:
    step = point.step
    return evaluate_postures(step.robot, step.swing, point.swing_sole, step.support, pelvises)


def _soles(point: SwingPoint) -> Array:
    """Return where the left and the right sole should be (2, 3) [m]."""
    soles = (point.swing_sole, np.array(point.step.support))
    return np.array(soles if point.step.swing == "left" else soles[::-1])


def _solvers(point: SwingPoint, report: Report) -> dict[str, Solver]:
    guess = _evaluate(point, point.planned).joint_positions
    makers: tuple[tuple[str, str, type[BulletSolver | PinSolver]], ...] = (
        ("PyBullet", "pybullet", BulletSolver),
        ("Pinocchio", "pinocchio", PinSolver),
    )
    robot, soles = point.step.robot, _soles(point)
    return {name: make(robot, soles, guess) for name, module, make in makers if report.has(module)}


def _solve_all(solver: Solver, tasks: list[tuple[Array, float]]) -> Callable[[], None]:
    def run() -> None:
        for pelvis, yaw in tasks:
            solver.solve(pelvis, yaw)

    return run


def _check_fitness(report: Report, point: SwingPoint, pelvises: Array, postures: Postures) -> None:
    """Compare the inner loop with the fitness of the evaluated postures."""
    settings = FitnessSettings()
    terms = fitness_of_postures(postures.violations, postures.thrust, pelvises, settings)
    moved_squared = ((pelvises - point.previous) ** 2).sum(axis=1)
    expected = terms[:, 0] + terms[:, 1] + settings.smoothness_weight * moved_squared + terms[:, 3]
    fitness = point.fitness(np.ascontiguousarray(pelvises.T))
    report.add("relative difference of their fitness", np.abs(fitness / expected - 1.0).max())


def _check_solvers(
    report: Report, point: SwingPoint, postures: Postures, indices: NDArray[np.int64], solvers: dict[str, Solver]
) -> None:
    """Place every solution by Pinocchio, and compare soles with their targets and centres of mass with ours."""
    judge = solvers.get("Pinocchio")
    if not isinstance(judge, PinSolver):
        return
    soles = _soles(point)
    sole_errors: dict[str, list[float]] = {name: [] for name in ("evaluate_postures", *solvers)}
    com_errors: dict[str, list[float]] = {name: [] for name in sole_errors}
    for i in indices:
        pelvis, yaw, com = postures.pelvis[i], float(postures.pelvis_yaw[i]), postures.center_of_mass[i]
        joints = postures.joint_positions[i]
        found = {"evaluate_postures": (joints, judge.place(pelvis, yaw, joints)[1])}
        found.update((name, solver.solve(pelvis, yaw)) for name, solver in solvers.items())
        for name, (joints, found_com) in found.items():
            misplaced = judge.place(pelvis, yaw, joints)[0] - soles
            sole_errors[name].append(float(np.linalg.norm(misplaced, axis=1).max()))
            com_errors[name].append(math.dist(found_com, com))
    report.notes.append(
        f"Errors are the largest of {len(indices)} postures, each placed by Pinocchio; "
        f"the iterative solvers stop at {1e6 * TOLERANCE:g} µm."
    )
    for name, errors in sole_errors.items():
        report.add(f"sole error, {name}", max(errors), "m", goal=2.0 * TOLERANCE)
    for name, errors in com_errors.items():
        report.add(f"centre of mass off ours, {name}", max(errors), "m", goal=10.0 * TOLERANCE)


if __name__ == "__main__":
    command_line(__doc__, measure)
