"""A warm start: imitating a careful expert on the states that the policy itself gets into.

The expert is the interior-point method of the optimal planner (:mod:`agents.paths.barrier`), stopped early: on its
central path every constraint keeps some room, which is what an imitator needs. A policy that chooses the thrust
meets the limits of thrust and edge polygon by what its choices are; its expert keeps hardly any room to these.

The policy acts, and each state that it reaches is labelled with what would lead back to the expert's path (dataset
aggregation: Ross, Gordon and Bagnell, "A reduction of imitation learning and structured prediction to no-regret
online learning", 2011). Imitating the expert's own states alone, it drifts off within some points.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.policies import ActorCriticPolicy

from agents.paths.barrier import polish, shares_of_mu
from agents.paths.bring_inside import bring_inside
from agents.paths.cost import cost_of_path, search_of_step
from agents.planner import make_planner
from agents.policy import side_by_side
from agents.sb3_policy import ThrustPolicy
from agents.training.validation import drawn_steps
from jet_gym.balance import GRAVITY, BalanceSettings
from jet_gym.fitness import FitnessSettings
from jet_gym.step import Step
from jet_gym.task.choices import ASIDE, HEIGHT, IDLE, THRUST
from jet_gym.task.lanes import Lanes
from jet_gym.task.model import TaskModel
from jet_gym.task.transition import Transition
from jet_gym.utils.arrays import Array

Act = Callable[[NDArray[np.float32]], NDArray[np.float32]]

_LEAST_MU = 0.01
_FIRST_MU = 30.0  # where the expert's interior-point method begins
_THRUST_SHARE = 0.01  # of mu that the thrust's limits and the edge polygon get where the thrust is chosen
_LEAST_PENALTY = 5000.0  # a path that costs more at one point violates a constraint there
_ASTRAY = 1e-3  # [m] from the expert's path at which a state counts half: precision matters near it
_ASTRAY_BY_THRUST = 3e-3  # [m] the same where the thrust is chosen, which brings the pelvis back by itself
_FURTHEST = 0.06  # [m] from the expert, per axis, from where a lane is put back on its path
_WANDERING = np.array([0.0, 0.3e-3, 1e-3, 3e-3, 8e-3])  # [m] of random moves, of which one is drawn
_OFTEN = np.array([0.30, 0.25, 0.25, 0.15, 0.05])  # how often each
_WANDERS = 0.3  # probability of a random move at a point
_FAN_DISTANCE = 0.3  # [m] or so, from the assigned ZMP: what a newton moves the centre of mass by follows
_LEAST_UNIT, _LEAST_WIDTH = 20.0, 0.02  # [mm] that a choice of thrust, and of the place across, counts for at least


@dataclass(frozen=True)
class ImitationSettings:
    """How the warm start goes.

    Attributes:
        rounds: How often the policy acts, is labelled and learns; 0 for no warm start.
        first_steps: Steps that the expert plans before the first round.
        steps_per_round: Steps that it adds in each round.
        episodes: Steps on which the policy acts in a round.
        memory: Labelled states that are kept.
        samples: Of those, how many the policy learns from in a round.
        batch_size: States in a gradient step.
        learning_rate: At the beginning; it falls linearly to nothing.
        mu: How careful the expert is: the weight of the logarithms of its constraints' slacks, in units of fitness.
        relative_mu: What that weight is at most, over the total fitness of the step: care costs fitness, and where
            a step takes hardly any it would be all that there is.
    """

    rounds: int = 60
    first_steps: int = 600
    steps_per_round: int = 40
    episodes: int = 700
    memory: int = 500_000
    samples: int = 200_000
    batch_size: int = 1024
    learning_rate: float = 2e-3
    mu: float = 3.0
    relative_mu: float = 3e-4


class Labelled(NamedTuple):
    """States and what the expert would do."""

    observations: NDArray[np.float32]  # (N, C)
    labels: NDArray[np.float32]  # (N, 3)
    units: NDArray[np.float32]  # (N, 3) [mm] what a choice or an action of 1 is
    weights: NDArray[np.float32]  # (N,) less the farther the state is from the expert's path


def expert_path(step: Step, mu: float, thrust_share: float = 1.0, relative_mu: float = math.inf) -> Array | None:
    """Return a pelvis path (N, 3) [m] that keeps room to every constraint, or ``None`` where none was found.

    Args:
        step: The step.
        mu: Weight of the logarithms of the slacks.
        thrust_share: Share of it that the slacks of thrust and edge polygon get; with all of it the thrust is
            ``3 mu / 10`` N or more.
        relative_mu: What ``mu`` is at most, over the total fitness.
    """
    model, points = search_of_step(step, BalanceSettings(), FitnessSettings())
    path: Array = make_planner("gas").plan(step).pelvis.copy()
    bring_inside(model, points, path)
    shares = shares_of_mu(thrust_share)
    polish(model, points, _FIRST_MU, mu, shares, path)
    cost = cost_of_path(model, points, path)
    if relative_mu * cost < mu:
        polish(model, points, mu, max(relative_mu * cost, _LEAST_MU), shares, path)
        cost = cost_of_path(model, points, path)
    full_thrust = model.fitness.thrust_weight * model.robot.balance.max_thrust
    most = step.points * (full_thrust + 100.0) + 0.5 * _LEAST_PENALTY
    return path if cost < most else None


class Imitation:
    """The warm start of one policy.

    Args:
        policy: The policy; its actor is changed.
        settings: How.
        seed: Of steps and random moves.
        first_step_seed: First seed of the steps that are drawn.
        difficulty: Of these steps.
    """

    def __init__(
        self,
        policy: ActorCriticPolicy,
        settings: ImitationSettings,
        seed: int,
        first_step_seed: int,
        difficulty: float = 1.0,
    ) -> None:
        self._policy, self._settings = policy, settings
        self._random = np.random.default_rng(seed)
        self._torch_random = torch.Generator().manual_seed(seed)
        self._next_seed, self._difficulty = first_step_seed, difficulty
        self._steps: list[Step] = []
        self._paths: list[Array] = []
        self._memory: list[Labelled] = []
        self._labelled = 0
        actor = (*policy.mlp_extractor.policy_net.parameters(), *policy.action_net.parameters())
        self._optimizer = torch.optim.Adam(actor, lr=settings.learning_rate)
        self._task = TaskModel(difficulty=difficulty)
        self._by_thrust = isinstance(policy, ThrustPolicy)
        self._astray = _ASTRAY_BY_THRUST if self._by_thrust else _ASTRAY

    @property
    def states_seen(self) -> int:
        """States that were labelled."""
        return self._labelled

    def run(self, progress: Callable[[int, float], None]) -> None:
        """Imitate; ``progress`` is told each round's number and its mean error [mm]."""
        settings = self._settings
        self._plan(max(settings.first_steps - len(self._steps), 0))
        with ThreadPoolExecutor(1) as pool:
            for number in range(settings.rounds):
                more = pool.submit(self._plan_more, settings.steps_per_round)  # beside what follows
                share_of_expert = max(0.15, 1.0 - number / 6.0)
                count = min(settings.episodes, len(self._steps))
                chosen = self._random.choice(len(self._steps), count, replace=False)
                self._memory.append(self._act_and_label(chosen.tolist(), share_of_expert, self._act))
                self._labelled += len(self._memory[-1].units)
                self._forget()
                for group in self._optimizer.param_groups:
                    group["lr"] = settings.learning_rate * (1.0 - number / settings.rounds)
                error = self._learn()
                self._keep(*more.result())
                progress(number + 1, error)

    def _plan(self, count: int) -> None:
        self._keep(*self._plan_more(count))

    def _plan_more(self, count: int) -> tuple[list[Step], list[Array | None]]:
        steps = drawn_steps(count, self._next_seed, self._difficulty)
        self._next_seed += count
        return steps, [self._expert_path(step) for step in steps]

    def _expert_path(self, step: Step) -> Array | None:
        settings = self._settings
        if not self._by_thrust:
            return expert_path(step, settings.mu)
        return expert_path(step, settings.mu, _THRUST_SHARE, settings.relative_mu)

    def _keep(self, steps: Sequence[Step], paths: Sequence[Array | None]) -> None:
        for step, path in zip(steps, paths, strict=True):
            if path is not None:
                self._steps.append(step)
                self._paths.append(path)

    def _act(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        with torch.no_grad():
            actions: NDArray[np.float32] = self._mean(torch.as_tensor(observations)).numpy()
        return actions

    def _mean(self, observations: torch.Tensor) -> torch.Tensor:
        """Return the mean actions (N, 3) of the policy."""
        distribution: Any = self._policy.get_distribution(observations).distribution
        mean: torch.Tensor = distribution.mean
        return mean

    def _act_and_label(self, chosen: Sequence[int], share_of_expert: float, act: Act) -> Labelled:
        """Go through some steps, some lanes led by the expert and the others by the policy, with random moves."""
        count, task, random = len(chosen), self._task, self._random
        lanes, transition, seen = Lanes(count), Transition(count), task.empty_observations(count)
        for lane, number in enumerate(chosen):
            lanes.begin(np.array([lane]), self._steps[number])
        targets = side_by_side([self._paths[number] for number in chosen])
        led_by_expert = random.random(count) < share_of_expert
        labelled: list[Labelled] = []
        for point in range(len(targets)):
            acting = np.flatnonzero(lanes.points > point)
            reach = task.settings.first_range if point == 0 else task.settings.later_range
            task.observe(lanes, acting, seen)
            met = seen[acting]
            astray = np.linalg.norm(lanes.pelvis - targets[point - 1], axis=1) if point else np.zeros(count)
            wanted = task.actions_to(lanes, acting, targets[point, acting])
            labels, units = self._labels(met, wanted, reach)
            weights = 1.0 / (1.0 + astray[acting] / self._astray)
            labelled.append(Labelled(met, labels, units, weights.astype(np.float32)))
            decided, led_by_policy = labels.copy(), ~led_by_expert[acting]
            decided[led_by_policy] = act(met[led_by_policy])
            actions = np.zeros((count, 3))
            actions[acting] = task.actions_of_choices(met, decided) if self._by_thrust else decided
            spread = random.choice(_WANDERING, p=_OFTEN, size=(count, 1)) * (random.random((count, 1)) < _WANDERS)
            actions += spread / reach * random.standard_normal((count, 3))
            task.advance(lanes, actions, acting, transition)
            lost = np.abs(lanes.pelvis - targets[point]).max(axis=1) > _FURTHEST
            lanes.pelvis[lost] = targets[point, lost]
        return Labelled(*(np.concatenate(parts) for parts in zip(*labelled, strict=True)))

    def _labels(
        self, observations: NDArray[np.float32], wanted: Array, reach: float
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return what the policy is to say for wanted actions, and what a unit of it is [mm], (N, 3) each."""
        if not self._by_thrust:
            return np.clip(wanted, -1.0, 1.0).astype(np.float32), np.full(wanted.shape, 1e3 * reach, np.float32)
        labels = self._task.choices_of_actions(observations, wanted)
        most, weight, slope = self._task.max_thrust, self._task.robot.mass * GRAVITY, self._task.edge_slope
        along = _FAN_DISTANCE * 1e3 / weight * most  # [mm] from the assigned ZMP at full thrust
        share = np.maximum(labels[:, THRUST] - IDLE, 0.0) / (1.0 - IDLE)  # square root of the thrust's share
        units = np.empty(wanted.shape, np.float32)
        units[:, THRUST] = np.maximum(2.0 * along * share / (1.0 - IDLE), _LEAST_UNIT)
        units[:, ASIDE] = np.maximum(slope * along * share**2, _LEAST_WIDTH)
        units[:, HEIGHT] = 1e3 * reach
        return labels, units

    def _forget(self) -> None:
        """Drop the oldest states."""
        while len(self._memory) > 1 and sum(len(part.units) for part in self._memory[1:]) >= self._settings.memory:
            self._memory.pop(0)

    def _learn(self) -> float:
        """Take gradient steps on remembered states; return the mean error [mm]."""
        settings = self._settings
        observations, labels, units, weights = (
            torch.as_tensor(np.concatenate(parts)) for parts in zip(*self._memory, strict=True)
        )
        order = torch.randperm(len(units), generator=self._torch_random)[: settings.samples]
        total = 0.0
        for chosen in torch.split(order, settings.batch_size):
            error = (self._mean(observations[chosen]) - labels[chosen]) * units[chosen]
            costs = torch.nn.functional.huber_loss(error, torch.zeros_like(error), reduction="none")
            loss = (weights[chosen, None] * costs).mean()
            self._optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            self._optimizer.step()
            total += float(error.detach().abs().mean()) * len(chosen)
        return total / max(len(order), 1) if math.isfinite(total) else math.nan
