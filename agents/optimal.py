"""The reference: the least total fitness of a whole step, by dynamic programming and then in the continuum.

GAS and its kin are greedy: they minimise each swing point's fitness alone. Here the sum over the step is minimised
under the same constraints and search ranges:

1. dynamic programming over a coarse lattice of pelvis positions at every swing point, with constraints relaxed by
   half a spacing, which finds the valley that the path has to take (:mod:`agents.paths.lattice`);
2. the same on ever finer lattices in a tube around the path, at last with exact constraints;
3. an interior-point method on the whole path at once (:mod:`agents.paths.barrier`), and exact lattices and this
   again until the total changes by less than the tolerance.

The plan of GAS is refined in the same way, and so are the paths that a wide cloud around both leads to
(:mod:`agents.paths.refinement`): a lattice along the axes, however fine, can miss a way along the thin wedge of the
edge polygon. The best path is taken. So the result is never worse than that plan; that it is the global optimum is
checked against brute force, policies and many restarts, not proven. Where a constraint stays broken, the lattice
may have stepped over a feasible set that is too thin: then the best of many plans of GAS and GA is refined too.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import ClassVar

import numpy as np

from agents.genetic import GaPlanner, GasPlanner
from agents.paths.barrier import polish, shares_of_mu
from agents.paths.bring_inside import bring_inside
from agents.paths.cost import FAR, cost_of_path, search_of_step
from agents.paths.lattice import Lattices, accumulate, make_lattices, trace_back
from agents.paths.refinement import WIDE, RefinementSettings, refine_path, violates
from agents.paths.relaxation import reach_boxes, with_wider_joints
from agents.planner import Planner
from jet_gym.constraints import FIRST_RANGE, LATER_RANGE
from jet_gym.plan import Plan
from jet_gym.step import Step
from jet_gym.utils.arrays import Array
from jet_gym.utils.progress import Progress
from jet_gym.utils.settings import require_seed, require_whole, require_within
from jet_gym.utils.threads import for_each

_INSIDE = 1e-7  # [m] that lattices keep from the edges of the search ranges, so that a path can be polished
_MU = (1.0, 0.1, 10.0)  # where the interior-point method begins, in turns
_RANDOM_SEARCHES = 20  # each of GAS and GA, where a constraint stays broken
_MOST_NODES = 40_000_000  # of a coarse search, kept in memory as floats


@dataclass(frozen=True)
class OptimalSettings:
    """How finely the optimum is searched; the defaults are those of every number in the documentation.

    Attributes:
        spacing: Of the coarse lattice [m].
        refinements: How often the spacing is halved.
        tube: Nodes on either side of the path, per axis.
        tolerance: Change of the total fitness below which the search ends.
        rounds: Most rounds at the finest lattice.
        last_mu: What each constraint that matters may keep the total fitness from its optimum by, about. The
            larger, the farther the path stays from the edges of the constraints.
        zmp_penalty: What a ZMP outside of the support foot, eq. (11), costs in the search. The paper's fitness has
            no term for it; with this one, no ZMP leaves the foot where that can be avoided.
    """

    spacing: float = 0.0249
    refinements: int = 5
    tube: int = 3
    tolerance: float = 0.05
    rounds: int = 8
    last_mu: float = 1e-4
    zmp_penalty: float = 9000.0

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed."""
        for name in ("spacing", "tolerance", "last_mu", "zmp_penalty"):
            require_within(name, getattr(self, name), above=True)
        for name in ("refinements", "tube", "rounds"):
            require_whole(name, getattr(self, name), 1)


@dataclass(frozen=True)
class OptimalPlanner(Planner):
    """The optimal reference, deterministic: the seed changes nothing.

    Attributes:
        settings: How finely it searches.
        first_range: Range of the pelvis about the nominal one at the first swing point, per axis [m], Table 2.
        search_range: Largest move of the pelvis between two swing points, per axis [m], eq. (13).
    """

    settings: OptimalSettings = field(default_factory=OptimalSettings)
    first_range: float = FIRST_RANGE
    search_range: float = LATER_RANGE
    name: ClassVar[str] = "optimal"
    deterministic: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuse ranges outside of what is allowed."""
        for name in ("first_range", "search_range"):
            require_within(name, getattr(self, name), 1e-4)

    def plan(self, step: Step, seed: int = 0, progress: Progress | None = None) -> Plan:
        """Plan a step; see :meth:`Planner.plan`.

        The time of the plan is spread evenly over its swing points, and so are the postures evaluated. Progress
        counts the swing points of the coarse search, which takes half of the time, and the last one at the end.
        """
        require_seed(seed)
        _warm_up()
        started = perf_counter()
        search = _Search(self, step)
        starts = [GasPlanner(self.balance, self.fitness).plan(step).pelvis]
        coarse = search.coarse_path(progress)
        if coarse is not None:
            starts.append(coarse)
        refined = [search.refine(path) for path in (*starts, *map(search.shaken, starts))]
        best, least = min(refined, key=lambda found: found[1])
        if violates(search.model, search.points, best):
            path, total = search.refine(self._best_of_random_searches(search, step))
            if total < least:
                best = path
        seconds = perf_counter() - started
        if progress is not None:
            progress(step.points, step.points)
        return Plan.from_pelvis_path(
            step,
            best,
            planner=self.name,
            seed=int(seed),
            balance=self.balance,
            fitness=self.fitness,
            search_range=self.search_range,
            solve_time=np.full(step.points, seconds / step.points),
            evaluations=np.full(step.points, math.ceil(search.evaluations / step.points)),
        )

    def _best_of_random_searches(self, search: _Search, step: Step) -> Array:
        """Return the path (N, 3) [m] to start from where the lattice stepped over a feasible set that is too thin.

        It is the best of several plans of GAS and GA, each refined.
        """
        clouds, costs = RefinementSettings().clouds, []
        paths: list[Array] = []
        for planner in (GasPlanner(self.balance, self.fitness), GaPlanner(self.balance, self.fitness)):
            for seed in range(_RANDOM_SEARCHES):
                paths.append(planner.plan(step, seed).pelvis.copy())
                costs.append(refine_path(search.model, search.points, clouds, paths[-1]))
        return paths[int(np.argmin(costs))]

    def plan_many(self, steps: Sequence[Step], *, threads: int = 2, progress: Progress | None = None) -> list[Plan]:
        """Plan many steps side by side; the plans are those of :meth:`plan`.

        Args:
            steps: The steps.
            threads: How many to plan at a time; compiled code lets go of the interpreter.
            progress: Called after each step with how many are done and how many there are.

        Raises:
            SettingsError: A ``ValueError``, if there is not one thread at least.
        """
        require_whole("threads", threads, 1)
        plans: dict[int, Plan] = {}

        def plan(number: int) -> None:
            plans[number] = self.plan(steps[number])

        for_each(plan, range(len(steps)), threads, progress)
        return [plans[number] for number in range(len(steps))]


@functools.cache
def _warm_up() -> None:
    """Load or compile what planning needs, so that solve times leave it out."""
    step = Step("left", (0.0, 0.1125, 0.0), (0.05, 0.25, 0.0), (0.0, -0.1125, 0.0), points=2)
    planner = OptimalPlanner()
    search = _Search(planner, step)
    search.coarse_path(None)
    path, _ = search.refine(GasPlanner().plan(step).pelvis)
    refine_path(search.model, search.points, RefinementSettings(sweeps=1).clouds, path.copy())
    violates(search.model, search.points, path)


class _Search:
    """The search for one step's optimum."""

    def __init__(self, planner: OptimalPlanner, step: Step) -> None:
        self.settings = planner.settings
        self.centre = step.nominal_pelvis
        self.evaluations = 0
        self.model, self.points = search_of_step(
            step,
            planner.balance,
            planner.fitness,
            first_range=planner.first_range,
            search_range=planner.search_range,
            zmp_penalty=self.settings.zmp_penalty,
        )

    def coarse_path(self, progress: Progress | None) -> Array | None:
        """Return the best path (N, 3) [m] of the coarse lattice, or nothing where it connects no two ends."""
        spacing = self.settings.spacing
        lattices = make_lattices(self._coarse_lines(spacing))
        if lattices.offsets[-1] > _MOST_NODES:
            return None
        path, total = self._best_path(lattices, 0.5 * spacing, progress)
        return path if total < FAR else None

    def shaken(self, path: Array) -> Array:
        """Return a path (N, 3) [m] at least as good as the one given, from a wide cloud around it."""
        found: Array = path.copy()
        refine_path(self.model, self.points, WIDE.clouds, found)
        return found

    def refine(self, path: Array) -> tuple[Array, float]:
        """Return a path (N, 3) [m] at least as good as the one given, and its total cost."""
        best, least = path, self._cost(path)
        spacing = self.settings.spacing
        for _ in range(self.settings.refinements):
            spacing *= 0.5
            path, _ = self._best_path(self._tube(path, spacing), 0.5 * spacing)
        bring_inside(self.model, self.points, path)
        path, total = self._best_path(self._tube(path, spacing), 0.0)
        unchanged = 0
        for number in range(self.settings.rounds):
            polished = self._polished(path, _MU[number % len(_MU)])
            if self._cost(polished) < total:
                path = polished
            path, reached = self._best_path(self._tube(path, spacing), 0.0)
            unchanged = unchanged + 1 if total - reached < self.settings.tolerance else 0
            total = reached
            if unchanged == 2:
                break
        return (path, total) if total < least else (best, least)

    def _cost(self, path: Array) -> float:
        cost: float = cost_of_path(self.model, self.points, path)
        return cost

    def _polished(self, path: Array, first_mu: float) -> Array:
        polished: Array = path.copy()
        polish(self.model, self.points, first_mu, self.settings.last_mu, shares_of_mu(), polished)
        return polished

    def _best_path(
        self, lattices: Lattices, relaxation: float, progress: Progress | None = None
    ) -> tuple[Array, float]:
        """Return the best path (N, 3) [m] on lattices, and its total cost."""
        model = self.model._replace(search_range=self.model.search_range - _INSIDE)
        if relaxation > 0.0:
            model = with_wider_joints(model, relaxation)
        points = len(self.points.soles)
        values, path = np.empty(lattices.offsets[-1]), np.empty((points, 3))
        at_a_time = points if progress is None else 1
        for first in range(0, points, at_a_time):
            last = min(first + at_a_time, points)
            accumulate(model, self.points, lattices, relaxation, first, last, values)
            if progress is not None and last < points:
                progress(last, points)
        self.evaluations += len(values)
        return path, trace_back(model, lattices, values, path)

    def _coarse_lines(self, spacing: float) -> list[list[Array]]:
        """Return a lattice over where both soles are within reach, aligned at the nominal pelvis."""
        boxes = np.empty((len(self.points.soles), 2, 3))
        reach_boxes(self.model, self.points, 0.5 * spacing, boxes)
        away = self.points.first_range - _INSIDE + self.model.search_range * np.arange(len(boxes))[:, None]
        lowest, highest = self.centre - away, self.centre + away
        low, high = np.clip(boxes[:, 0], lowest, highest), np.clip(boxes[:, 1], lowest, highest)
        thin = high - low < 3.0 * spacing  # out of reach, or nearly so: some nodes all the same
        middle = 0.5 * (low + high)
        low = np.where(thin, np.maximum(middle - 2.0 * spacing, lowest), low)
        high = np.where(thin, np.minimum(middle + 2.0 * spacing, highest), high)
        first = np.ceil((low - self.centre) / spacing).astype(int)
        last = np.floor((high - self.centre) / spacing).astype(int)
        return [
            [self.centre[axis] + spacing * np.arange(a[axis], b[axis] + 1) for axis in range(3)]
            for a, b in zip(first, last, strict=True)
        ]

    def _tube(self, path: Array, spacing: float) -> Lattices:
        """Return small lattices around a path."""
        count = self.settings.tube
        lines = path[:, :, None] + spacing * np.arange(-count, count + 1)
        inside = self.points.first_range - _INSIDE
        lines[0] = np.clip(lines[0], (self.centre - inside)[:, None], (self.centre + inside)[:, None])
        return make_lattices([list(triple) for triple in lines])
