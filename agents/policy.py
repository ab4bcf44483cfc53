"""A trained policy as a planner: it chooses the pelvis at each swing point from what it observes.

``refine`` adds candidates around the policy's path and takes the best path through them
(:mod:`agents.paths.refinement`), which mends most constraints that the network would break. Where one stays broken,
many more candidates are spread more widely, at last around the paths of GAS and GA, and the best path is taken.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from threadpoolctl import ThreadpoolController

from agents.genetic import GaPlanner, GasPlanner
from agents.network import PolicyNetwork
from agents.paths.cost import search_of_step
from agents.paths.refinement import WIDE, RefinementSettings, refine_path, violates
from agents.planner import BatchPlanner
from jet_gym.errors import PolicyFileError, SettingsError
from jet_gym.plan import Plan
from jet_gym.step import Step
from jet_gym.task.drawing import LEAST_DRAWN_POINTS, MOST_DRAWN_POINTS
from jet_gym.utils.arrays import Array
from jet_gym.utils.progress import Progress
from jet_gym.utils.settings import require_seed, require_whole

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from jet_gym.task.lanes import Lanes
    from jet_gym.task.model import TaskModel

    Act = Callable[[Lanes, NDArray[np.float32], NDArray[np.int64]], NDArray[np.float32]]

SHIPPED_POLICY = Path(__file__).parent / "policies" / "jet_hr1_step_v0" / "policy.npz"


@dataclass(frozen=True)
class PolicyPlanner(BatchPlanner):
    """A trained policy; deterministic, the seed changes nothing.

    It was trained on steps of 30 to 60 swing points, as ``JetHR1Step-v0`` draws them. A step with fewer or more is
    gone through with 30 or 60, and the path interpolated, with the thrusts that it then chooses.

    Attributes:
        model: A network, or a policy file: ``.npz`` as ``train.py`` writes it, or with ``trust`` a
            Stable-Baselines3 ``.zip``; the one that comes with the package where omitted.
        refine: Candidates at each swing point in each sweep of the refinement; 0 leaves the path as it is.
        sweeps: Sweeps of the refinement.
        trust: Whether ``model`` may be a ``.zip``, whose loading can run any code that is in it.
    """

    model: PolicyNetwork | str | Path | None = None
    refine: int = 0
    sweeps: int = RefinementSettings.sweeps
    trust: bool = False
    name: ClassVar[str] = "policy"
    deterministic: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuse what is not allowed, and load the policy."""
        require_whole("refine", self.refine, 0)
        if self.refine == 1:
            raise SettingsError("refine must be 0, or 2 candidates or more, not 1")
        RefinementSettings(sweeps=self.sweeps)
        _ = self.network, self.task

    @functools.cached_property
    def network(self) -> PolicyNetwork:
        """The policy's network."""
        if isinstance(self.model, PolicyNetwork):
            return self.model
        return load_policy(self.model or SHIPPED_POLICY, trust=self.trust)

    @functools.cached_property
    def task(self) -> TaskModel:
        """The task that the policy is asked to do, with this planner's balance and fitness."""
        from jet_gym.task.model import TaskModel

        return TaskModel(balance=self.balance, fitness=self.fitness)

    @property
    def search_range(self) -> float:
        """Largest move of the pelvis between two swing points, per axis [m], eq. (13)."""
        return self.task.settings.later_range

    def plan(self, step: Step, seed: int = 0, progress: Progress | None = None) -> Plan:
        """Plan a step; see :meth:`Planner.plan`."""
        (plan,) = self.plan_many([step], seed)
        if progress is not None:
            progress(step.points, step.points)
        return plan

    def plan_many(self, steps: Sequence[Step], seed: int = 0, progress: Progress | None = None) -> list[Plan]:
        """Plan many steps in one batch, which takes a fraction of the time.

        The plans are those of :meth:`plan`, but for how matrix products of another size round. The solve time of a
        swing point is that of the batch over all its swing points.
        """
        require_seed(seed)
        if not steps:
            return []
        for step in steps:
            step.require_robot(self.task.robot)
        self._warm_up(steps[0])
        started = perf_counter()
        with _one_thread():
            paths = self._propose(steps)
        if self.refine:
            paths = [self._refined(step, path) for step, path in zip(steps, paths, strict=True)]
        seconds = perf_counter() - started
        points = sum(step.points for step in steps)
        plans = Plan.from_pelvis_paths(
            steps,
            paths,
            planner=RefinedPolicyPlanner.name if self.refine else PolicyPlanner.name,
            seed=int(seed),
            balance=self.balance,
            fitness=self.fitness,
            search_range=self.search_range,
            solve_time=seconds / points,
            evaluations=2.0 + self.refine * self.sweeps,
        )
        if progress is not None:
            progress(len(steps), len(steps))
        return plans

    def _propose(self, steps: Sequence[Step]) -> list[Array]:
        """Return the policy's pelvis paths; of a step with other than the points it knows, interpolated."""
        known = [
            step
            if LEAST_DRAWN_POINTS <= step.points <= MOST_DRAWN_POINTS
            else replace(step, points=min(max(step.points, LEAST_DRAWN_POINTS), MOST_DRAWN_POINTS))
            for step in steps
        ]
        paths = self._walk(known, lambda _, seen, __: self.network.act(seen, self.task))
        if self.network.chooses == "pelvis":
            return [_resampled(path, step.points) for step, path in zip(steps, paths, strict=True)]
        odd = [number for number, step in enumerate(steps) if step.points != len(paths[number])]
        if odd:
            between = [_resampled(paths[number], steps[number].points) for number in odd]
            for number, path in zip(odd, self._balanced([steps[number] for number in odd], between), strict=True):
                paths[number] = path
        return paths

    def _balanced(self, steps: Sequence[Step], paths: Sequence[Array]) -> list[Array]:
        """Return paths near those given that choose the same thrusts, places across and heights."""
        task = self.task
        targets = side_by_side(paths)

        def act(lanes: Lanes, seen: NDArray[np.float32], acting: NDArray[np.int64]) -> NDArray[np.float32]:
            points = lanes.point[acting].astype(np.int64)
            wanted = task.actions_to(lanes, acting, targets[points, acting])
            return task.actions_of_choices(seen, task.choices_of_actions(seen, wanted))

        return self._walk(steps, act)

    def _walk(self, steps: Sequence[Step], act: Act) -> list[Array]:
        """Act in the quasi-static environment on all steps side by side; return the pelvis paths."""
        from jet_gym.task.lanes import Lanes
        from jet_gym.task.transition import Transition

        task, count = self.task, len(steps)
        lanes, transition, observations = Lanes(count), Transition(count), task.empty_observations(count)
        for lane, step in enumerate(steps):
            lanes.begin(np.array([lane]), step)
        longest, acting = max(step.points for step in steps), np.arange(count)
        paths, actions = np.empty((longest, count, 3)), np.zeros((count, 3))
        for point in range(longest):
            acting = acting[lanes.point[acting] < lanes.points[acting]]
            task.observe(lanes, acting, observations)
            actions[acting] = act(lanes, observations[acting], acting)
            task.advance(lanes, actions, acting, transition)
            paths[point] = lanes.pelvis
        return [paths[: step.points, lane].copy() for lane, step in enumerate(steps)]

    def _refined(self, step: Step, path: Array) -> Array:
        """Refine a path; where a constraint stays broken, search more widely, at last from GAS's and GA's."""
        ranges = self.task.settings
        model, points = search_of_step(
            step, self.balance, self.fitness, first_range=ranges.first_range, search_range=ranges.later_range
        )
        clouds = RefinementSettings(candidates=self.refine, sweeps=self.sweeps).clouds
        least = refine_path(model, points, clouds, path)
        for sign, planner in ((1.0, None), (-1.0, None), (1.0, GasPlanner), (1.0, GaPlanner)):
            if not violates(model, points, path):
                break
            start = path if planner is None else planner(self.balance, self.fitness).plan(step).pelvis
            other: Array = start.copy()
            refine_path(model, points, sign * WIDE.clouds, other)
            cost = refine_path(model, points, clouds, other)
            if cost < least:
                path, least = other, cost
        return path

    def _warm_up(self, step: Step) -> None:
        """Load or compile what planning needs, so that solve times leave it out."""
        shortest = replace(step, points=2)
        with _one_thread():
            (path,) = self._propose([shortest])
        if self.refine:
            self._refined(shortest, path)
            _ = WIDE.clouds
            for planner in (GasPlanner, GaPlanner):
                planner(self.balance, self.fitness).warm_up(shortest)


@dataclass(frozen=True)
class RefinedPolicyPlanner(PolicyPlanner):
    """A trained policy whose path is refined, as ``make_planner("policy", refine=16)`` makes it."""

    refine: int = RefinementSettings.candidates
    name: ClassVar[str] = "policy+refine"


def side_by_side(paths: Sequence[Array]) -> Array:
    """Return paths (N, 3) of different lengths as one array (longest, paths, 3); each stays where it ends."""
    longest = max(len(path) for path in paths)
    padded = [np.pad(path, ((0, longest - len(path)), (0, 0)), mode="edge") for path in paths]
    return np.stack(padded, axis=1)


def _resampled(path: Array, points: int) -> Array:
    """Return a path (N, 3) at another number of equally spaced points."""
    if len(path) == points:
        return path
    old, new = np.linspace(0.0, 1.0, len(path)), np.linspace(0.0, 1.0, points)
    return np.stack([np.interp(new, old, path[:, axis]) for axis in range(3)], axis=1)


def _one_thread() -> AbstractContextManager[Any]:
    """Keep matrix products to one thread: those of a small network lose more by a second one than they gain."""
    limits: AbstractContextManager[Any] = _threads().limit(limits=1, user_api="blas")
    return limits


@functools.cache
def _threads() -> ThreadpoolController:
    return ThreadpoolController()


def load_policy(path: str | Path, *, trust: bool = False) -> PolicyNetwork:
    """Load a policy.

    Args:
        path: A ``.npz`` file of numbers alone, or a Stable-Baselines3 ``.zip``.
        trust: Whether it may be a ``.zip``. Loading one unpickles it, which can run any code that is in it.

    Raises:
        PolicyFileError: If it cannot be read, is not trusted or does not fit the environment.
    """
    if Path(path).suffix != ".zip":
        return PolicyNetwork.load(path)
    if not trust:
        raise PolicyFileError(
            f"{path!s} is a Stable-Baselines3 file, and loading one can run code that is in it; "
            "load the policy.npz beside it, or say trust=True"
        )
    return _load_zip(path)


def _load_zip(path: str | Path) -> PolicyNetwork:
    try:
        from stable_baselines3 import PPO

        from agents.sb3_policy import network_of
    except ImportError as error:
        raise PolicyFileError(f"loading {path!s} needs stable-baselines3: pip install 'jet-gym[train]'") from error
    try:
        model: Any = PPO.load(path, device="cpu")
    except Exception as error:  # whatever the file makes it raise
        raise PolicyFileError(f"{path!s} cannot be loaded: {error}") from error
    return network_of(model.policy)
