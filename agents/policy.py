"""A trained policy as a planner: it chooses the pelvis at each swing point from what it observes.

``refine`` adds candidates around the policy's path and takes the best path through them
(:mod:`agents.refinement`), which mends a constraint that the network would break.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from threadpoolctl import ThreadpoolController

from agents.lattice import search_of_step
from agents.network import PolicyNetwork
from agents.planner import Planner, Progress, check_seed
from agents.refinement import RefinementSettings, refine_path
from jet_gym.errors import PolicyFileError, SettingsError
from jet_gym.plan import Plan
from jet_gym.step import Step
from jet_gym.urdf import Array

if TYPE_CHECKING:
    from jet_gym.envs.model import TaskModel

SHIPPED_POLICY = Path(__file__).parent / "policies" / "jet_hr1_step_v0" / "policy.npz"


@dataclass(frozen=True)
class PolicyPlanner(Planner):
    """A trained policy; deterministic, the seed changes nothing.

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

    def __post_init__(self) -> None:
        """Refuse what is not allowed, and load the policy."""
        if isinstance(self.refine, bool) or not isinstance(self.refine, int) or self.refine < 0 or self.refine == 1:
            raise SettingsError(f"refine must be 0, or 2 candidates or more, not {self.refine!r}")
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
        from jet_gym.envs.model import TaskModel

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
        """Plan many steps in one batch, which takes a fraction of the time; the plans are those of :meth:`plan`.

        The solve time of a swing point is that of the batch over all its swing points.
        """
        check_seed(seed)
        if not steps:
            return []
        if any(step.robot is not self.task.robot for step in steps):
            raise SettingsError(f"the policy was trained on {self.task.robot.name} and plans for no other robot")
        self._warm_up(steps[0])
        started = perf_counter()
        with _one_thread():
            paths = self._follow_policy(steps)
        if self.refine:
            for step, path in zip(steps, paths, strict=True):
                self._refine(step, path)
        seconds = perf_counter() - started
        points = sum(step.points for step in steps)
        plans = []
        for number, (step, path) in enumerate(zip(steps, paths, strict=True)):
            plans.append(self._plan_of(step, path, seed, seconds / points))
            if progress is not None:
                progress(number + 1, len(steps))
        return plans

    def _follow_policy(self, steps: Sequence[Step]) -> list[Array]:
        """Let the policy act in the quasi-static environment; return the pelvis paths."""
        from jet_gym.envs.lanes import Lanes
        from jet_gym.envs.transition import Transition

        task, count = self.task, len(steps)
        lanes, transition, observations = Lanes(count), Transition(count), task.empty_observations(count)
        for lane, step in enumerate(steps):
            lanes.begin(np.array([lane]), step)
        longest, acting = max(step.points for step in steps), np.arange(count)
        paths, actions = np.empty((longest, count, 3)), np.zeros((count, 3))
        for point in range(longest):
            acting = acting[lanes.point[acting] < lanes.points[acting]]
            task.observe(lanes, acting, observations)
            actions[acting] = self.network.act(observations[acting])
            task.advance(lanes, actions, acting, transition)
            paths[point] = lanes.pelvis
        return [paths[: step.points, lane].copy() for lane, step in enumerate(steps)]

    def _refine(self, step: Step, path: Array) -> None:
        ranges = self.task.settings
        model, points = search_of_step(
            step, self.balance, self.fitness, first_range=ranges.first_range, search_range=ranges.later_range
        )
        displacements = RefinementSettings(candidates=self.refine, sweeps=self.sweeps).displacements
        refine_path(model, points, displacements, path)

    def _plan_of(self, step: Step, path: Array, seed: int, seconds: float) -> Plan:
        return Plan.from_pelvis_path(
            step,
            path,
            planner="policy+refine" if self.refine else self.name,
            seed=int(seed),
            balance=self.balance,
            fitness=self.fitness,
            search_range=self.search_range,
            solve_time=np.full(step.points, seconds),
            evaluations=np.full(step.points, 2 + self.refine * self.sweeps),
        )

    def _warm_up(self, step: Step) -> None:
        """Load or compile what planning needs, so that solve times leave it out."""
        shortest = replace(step, points=2)
        with _one_thread():
            (path,) = self._follow_policy([shortest])
        if self.refine:
            self._refine(shortest, path)


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

        from agents.training.extractor import network_of
    except ImportError as error:
        raise PolicyFileError(f"loading {path!s} needs stable-baselines3: pip install 'jet-gym[train]'") from error
    try:
        model: Any = PPO.load(path, device="cpu")
    except Exception as error:  # whatever the file makes it raise
        raise PolicyFileError(f"{path!s} cannot be loaded: {error}") from error
    return network_of(model.policy)
