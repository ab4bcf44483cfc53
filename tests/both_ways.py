"""What ``test_uncompiled.py`` computes twice: with machine code, and in a process of its own as plain Python.

Every case returns named numbers and takes a fraction of a second in plain Python. Run as a script, with
``NUMBA_DISABLE_JIT=1`` and a file's name, it writes those of all cases there.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from candidates import candidates_around

from agents.exhaustive import GaexPlanner
from agents.genetic import GaPlanner, GasPlanner, GeneticSettings
from agents.paths.barrier import polish, shares_of_mu
from agents.paths.bring_inside import bring_inside
from agents.paths.cost import cost_of_path, search_of_step
from agents.paths.lattice import accumulate, make_lattices, trace_back
from agents.paths.refinement import RefinementSettings, refine_path, violates
from agents.paths.relaxation import reach_boxes
from agents.policy import PolicyPlanner
from agents.studies.swing_point import SwingPoint
from jet_gym import Step, jet_hr1
from jet_gym.balance import BalanceSettings, ThrustModel
from jet_gym.balance_space import compute_balance_space, least_thrust_of_step
from jet_gym.fitness import FitnessSettings, fitness_of_postures
from jet_gym.joint_torques import static_torques
from jet_gym.kinematics import forward_kinematics, inverse_kinematics
from jet_gym.leg import SIDES
from jet_gym.posture import Postures, evaluate_postures
from jet_gym.simulation.pictures.camera import Camera, CameraSettings
from jet_gym.simulation.pictures.shading import FAR_AWAY, floor_of, shade
from jet_gym.task.drawing import draw_random_steps
from jet_gym.task.lanes import Lanes
from jet_gym.task.model import TaskModel
from jet_gym.task.transition import Transition
from jet_gym.utils.arrays import Array

Numbers = dict[str, Any]

ASIDE = Step("left", (0.0, 0.1125, 0.0), (0.1, 0.3, 0.02), (0.0, -0.1125, 0.0), points=4)
AHEAD = Step("right", (0.0, -0.1125, 0.0), (0.5, -0.12, 0.0), (0.0, 0.34, 0.0), points=3)
SIDEWARD = Step("left", (0.0, 0.1125, 0.0), (0.0, 0.34, 0.0), (0.0, -0.1125, 0.0), points=3)
BACK = Step("right", (0.0, -0.1125, 0.0), (-0.05, -0.2, 0.01), (0.0, 0.1125, 0.0), points=3)
THRUST_MODELS: tuple[ThrustModel, ...] = ("assigned", "least")


def legs() -> Numbers:
    """Legs placed by their soles, some out of reach and one lying, and by their joints."""
    robot, generator, numbers = jet_hr1(), np.random.default_rng(1), {}
    flat = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # the hip rolls by 90 degrees
    turns = np.stack([np.linalg.qr(generator.normal(size=(3, 3)))[0] for _ in range(20)] + [flat])
    turns *= np.sign(np.linalg.det(turns))[:, None, None]
    places = generator.uniform((-0.2, -0.2, -0.5), (0.2, 0.2, -0.1), (21, 3))
    for side in SIDES:
        numbers[f"{side} joints"], numbers[f"{side} out of reach"] = inverse_kinematics(robot, side, places, turns)
        numbers[f"{side} level joints"], _ = inverse_kinematics(robot, side, places)
    numbers |= vars(forward_kinematics(robot, generator.uniform(-1.0, 1.0, (20, 12))))
    return numbers


def _some_postures(step: Step, thrust_model: ThrustModel) -> Postures:
    """Return postures around the nominal one, most of which violate something and some of which nothing."""
    away = np.random.default_rng(2).normal(scale=(0.05, 0.05, 0.03), size=(120, 3))
    pelvis, soles = step.nominal_pelvis + away, np.repeat(step.swing_sole, 120 // step.points, axis=0)
    settings = BalanceSettings(thrust_model=thrust_model)
    return evaluate_postures(step.robot, step.swing, soles, step.support, pelvis, settings)


def postures() -> Numbers:
    """Postures, their fitness and the torques that hold them."""
    numbers: Numbers = {}
    for step, thrust_model in itertools.product((ASIDE, AHEAD), THRUST_MODELS):
        found, of = _some_postures(step, thrust_model), f"{step.swing} {thrust_model}"
        numbers |= {f"{of} {name}": values for name, values in vars(found).items()}
        numbers[f"{of} fitness"] = fitness_of_postures(found.violations, found.thrust, found.pelvis)
        numbers[f"{of} torques"] = static_torques(step.robot, step.swing, found)
    return numbers


def random_steps() -> Numbers:
    """Steps drawn at random, easy ones and hard ones."""
    steps = [*draw_random_steps(12, seed=3), *draw_random_steps(2, seed=3, difficulty=0.1)]
    return {
        f"{number} {step.swing}": [*step.start, *step.landing, *step.support, step.apex, step.points]
        for number, step in enumerate(steps)
    }


class Walk:
    """Random steps in the quasi-static task, a few swing points long."""

    def __init__(self, thrust_model: ThrustModel) -> None:
        self.task = TaskModel(thrust_model=thrust_model)
        steps = draw_random_steps(18, seed=4)  # more than a block of postures
        self.all = np.arange(len(steps))
        self.lanes, self.transition = Lanes(len(steps)), Transition(len(steps))
        for lane, step in enumerate(steps):
            self.lanes.begin(np.array([lane]), step)
        self.numbers: Numbers = {}

    def observe(self) -> Array:
        seen = self.task.empty_observations(len(self.all))
        self.task.observe(self.lanes, self.all, seen)
        self._note("observations", seen)
        return seen

    def advance(self, actions: Array) -> None:
        self.task.advance(
            self.lanes, self.task.check_actions(actions, (len(self.all), 3)), self.all, self.transition
        )
        self._note("actions", actions)
        self._note("transition", self.transition.array)

    def _note(self, what: str, values: Array) -> None:
        self.numbers[f"{what} {len(self.numbers)}"] = np.array(values)


def actions() -> Numbers:
    """Random actions in the task: what is observed, and what the actions lead to."""
    numbers, generator = {}, np.random.default_rng(5)
    for thrust_model in THRUST_MODELS:
        walk = Walk(thrust_model)
        for scale in (0.1, 0.3, 1.5):
            walk.observe()
            walk.advance(generator.normal(scale=scale, size=(len(walk.all), 3)))
        numbers |= {f"{thrust_model} {name}": values for name, values in walk.numbers.items()}
    return numbers


def choices() -> Numbers:
    """Thrusts, places across and heights that are chosen, and choices that are read off actions."""
    walk, generator = Walk("assigned"), np.random.default_rng(6)
    for point in range(4):
        seen = walk.observe()
        chosen = generator.uniform(-1.0, 1.0, (len(walk.all), 3)).astype(np.float32)
        walk.advance(walk.task.actions_of_choices(seen, chosen))
        moves = generator.normal(scale=0.2, size=(len(walk.all), 3))
        walk.numbers[f"choices {point}"] = walk.task.choices_of_actions(seen, moves)
    return walk.numbers


def genetic_planners() -> Numbers:
    """GAS, GA and GAEx with small populations, and with mutation everywhere and nowhere."""
    numbers = {}
    for mutation in (0.0, 0.05, 1.0):
        first = GeneticSettings(population=40, generations=6, half_range=0.15, mutation=mutation)
        later = replace(first, population=20, half_range=0.025)
        for planner in (
            GasPlanner(initial=first, intermediate=later),
            GaPlanner(initial=first, intermediate=later),
            GaexPlanner(initial=first, interval=0.002),
        ):
            numbers[f"{planner.name} {mutation}"] = planner.plan(ASIDE, seed=7).pelvis
    return numbers


def swing_point() -> Numbers:
    """The swing point that studies look at, here in the middle of a short step."""
    point = SwingPoint(ASIDE, ASIDE.swing_sole[2], ASIDE.nominal_pelvis, ASIDE.nominal_pelvis)
    candidates = np.ascontiguousarray(point.random_pelvises(40).T)
    return {"fitness": point.fitness(candidates), "one": point.fitness_of_one(*ASIDE.nominal_pelvis.tolist())}


def shipped_policy() -> Numbers:
    """The policy that ships, on a step of fewer swing points than it was trained on."""
    return {"pelvis": PolicyPlanner().plan(ASIDE).pelvis}


def lattices() -> Numbers:
    """Least total costs over coarse lattices, with exact and with relaxed constraints."""
    numbers: Numbers = {}
    for step, thrust_model, relaxation in itertools.product((ASIDE, AHEAD), THRUST_MODELS, (0.0, 0.012)):
        model, points = search_of_step(step, BalanceSettings(thrust_model=thrust_model), FitnessSettings())
        line = np.array([-0.03, -0.01, 0.0, 0.01])
        nodes = make_lattices([[center + line for center in step.nominal_pelvis] for _ in range(step.points)])
        values, path = np.empty(nodes.offsets[-1]), np.empty((step.points, 3))
        accumulate(model, points, nodes, relaxation, 0, step.points, values)
        of = f"{step.swing} {thrust_model} {relaxation}"
        numbers[f"{of} total"], numbers[f"{of} values"] = trace_back(model, nodes, values, path), values
        numbers[f"{of} path"], numbers[f"{of} cost"] = path, cost_of_path(model, points, path)
        numbers[f"{of} boxes"] = np.empty((step.points, 2, 3))
        reach_boxes(model, points, relaxation, numbers[f"{of} boxes"])
        path[-1] += 0.03
        numbers[f"{of} beyond the search range"] = cost_of_path(model, points, path)
    return numbers


def refinements() -> Numbers:
    """Paths refined by candidates around them, and by the interior-point method."""
    numbers: Numbers = {}
    for step, thrust_model in itertools.product((SIDEWARD, BACK), THRUST_MODELS):
        model, points = search_of_step(step, BalanceSettings(thrust_model=thrust_model), FitnessSettings())
        path, of = np.tile(step.nominal_pelvis, (step.points, 1)), f"{step.swing} {thrust_model}"
        numbers[f"{of} steps from outside"] = polish(model, points, 1.0, 1e-2, shares_of_mu(), path.copy())
        clouds = RefinementSettings(candidates=12, sweeps=10, widest=12e-3, narrowest=7e-4).clouds
        numbers[f"{of} violates at first"] = violates(model, points, path)
        numbers[f"{of} candidates"] = candidates_around(model, points, clouds[0], path)
        numbers[f"{of} moved inside"], numbers[f"{of} inside"] = bring_inside(model, points, path), path.copy()
        numbers[f"{of} cost"], numbers[f"{of} refined"] = refine_path(model, points, clouds, path), path.copy()
        numbers[f"{of} violates"] = violates(model, points, path)
        numbers[f"{of} steps"] = polish(model, points, 1.0, 1e-2, shares_of_mu(), path)
        numbers[f"{of} polished"] = path
    return numbers


def balance_space() -> Numbers:
    """The balance space on a coarse grid, and the least thrust at the swing points of a step."""
    space = compute_balance_space(0.2, threads=1)
    names = ("thrust", "thrust_within_torque", "torque_share")
    of_step = least_thrust_of_step(SIDEWARD, resolution=0.04, threads=1)
    return {"of a step": of_step} | {name: getattr(space, name) for name in names}


def shading() -> Numbers:
    """Floor, ditch and shadows around bodies that are noise, lit from almost above."""
    generator, numbers = np.random.default_rng(8), {}
    side, above = CameraSettings(near=1.0, far=30.0), CameraSettings(elevation=1.4, near=1.0, far=30.0)
    camera, light = Camera(48, 36, side), Camera(40, 40, above)
    for step in (ASIDE, AHEAD, Step("left", (0.0, 0.12, 0.0), (0.0, 0.5, 0.0), (0.0, -0.12, 0.0))):
        points = np.array(list(itertools.product((-0.4, 0.4), (-0.4, 0.4), (0.0, 0.3)))) + np.array(step.support)
        camera.forget()
        light.forget()
        camera.follow(points)
        light.follow(points)
        seen = np.where(generator.random((40, 40)) < 0.5, FAR_AWAY, 0.2).astype(np.float32)
        seen[:, :18], seen[:20, 18:] = FAR_AWAY, 0.2
        color = generator.integers(0, 256, (72, 96, 4)).astype(np.uint8)
        buffer = generator.uniform(0.4, 1.0, (72, 96)).astype(np.float32)
        bodies = generator.integers(-1, 1, (72, 96)).astype(np.int32)
        bodies[:36] = -1
        picture = np.empty((36, 48, 3), np.uint8)
        floor = floor_of(step, 0.0, np.array([*step.support[:2], 0.0]))
        shade(camera.lens, floor, light.lens, seen, color, buffer, bodies, picture)
        numbers[f"{step.swing} {step.landing}"] = picture
    return numbers


CASES: dict[str, Callable[[], Numbers]] = {
    case.__name__: case
    for case in (
        legs, postures, random_steps, actions, choices, genetic_planners, swing_point, shipped_policy, lattices,
        refinements, balance_space, shading,
    )
}  # fmt: skip


def main(path: str) -> None:
    """Compute all cases and write them to an npz file, the name of the case before each of its own."""
    numbers = {name: compute() for name, compute in CASES.items()}
    np.savez(path, **{f"{case}/{name}": value for case, of in numbers.items() for name, value in of.items()})


if __name__ == "__main__":
    main(sys.argv[1])
