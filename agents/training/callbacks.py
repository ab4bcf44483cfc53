"""What happens beside PPO's own updates: the curriculum, validation, checkpoints, TensorBoard."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import Any

from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

from agents.network import PolicyNetwork
from agents.sb3_policy import network_of
from agents.training.run_folder import PROGRESS, read_progress, write_json
from agents.training.schedule import Geometric
from agents.training.validation import Score, StepSet
from agents.training.vec_env import StepVecEnv
from jet_gym.utils.files import write_whole_with

MODEL, NETWORK = "model.zip", "policy.npz"


def save_model(model: PPO, folder: Path, about: dict[str, Any]) -> PolicyNetwork:
    """Write a model, its actor as plain arrays and what is known of them into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    network = network_of(model.policy, about)
    network.save(folder / NETWORK)
    write_json(folder / "about.json", about)
    write_whole_with(
        folder / MODEL, model.save
    )  # last: where there is a model, killed or not, the rest is there too
    return network


class Curriculum(BaseCallback):
    """Makes violations dear and exploration small as training goes on.

    At first a violated constraint costs only what it is violated by, so that the policy finds where the paths of
    least thrust run, which lie on the constraints; were the violation itself dear from the beginning, noisy actions
    would teach it to keep far away from them. Then the cost rises to that of the environment while the noise
    falls, and the policy moves to the inside by as little as its remaining noise asks for. A policy that has
    imitated begins inside, and needs no such rise; there the critic learns first, before the actor moves.

    Args:
        deviations: Standard deviation of the actions at the beginning and at the end [search range]; it falls
            geometrically and is not learnt.
        rise: Shares of the training at which the cost of a violation begins to rise from nothing, and at which it
            has risen; both 0 to leave it as it is.
        violation_cost: What it rises to.
        steps: Environment steps of the training.
        critic_steps: Environment steps at first in which the actor stays as it is.
    """

    def __init__(
        self,
        deviations: tuple[float, float],
        rise: tuple[float, float],
        violation_cost: float,
        steps: int,
        critic_steps: int = 0,
    ) -> None:
        super().__init__()
        self._deviations, self._rise, self._violation_cost = deviations, rise, violation_cost
        self._steps, self._critic_steps = steps, critic_steps

    def _on_rollout_start(self) -> None:
        policy: Any = self.model.policy
        share = min(self.num_timesteps / self._steps, 1.0)
        deviation = Geometric(*self._deviations)(1.0 - share)
        policy.log_std.requires_grad_(False)
        policy.log_std.data.fill_(math.log(deviation))
        self.logger.record("train/deviation", deviation)
        for module in (policy.mlp_extractor.policy_net, policy.action_net):
            module.requires_grad_(self.num_timesteps >= self._critic_steps)
        begin, end = self._rise
        if end > 0.0:
            risen = min(max((share - begin) / max(end - begin, 1e-9), 0.0), 1.0)
            self._set_violation_cost(risen * self._violation_cost)
            self.logger.record("train/violation_cost", risen * self._violation_cost)

    def _set_violation_cost(self, cost: float) -> None:
        """Set it in the batch, or in each environment, below its wrappers, where set_attr would stop."""
        if isinstance(self.training_env, StepVecEnv):
            self.training_env.set_attr("violation_cost", cost)
        else:
            self.training_env.env_method("set_wrapper_attr", "violation_cost", cost)

    def _on_step(self) -> bool:
        return True


class Validate(BaseCallback):
    """Judges the policy now and then, keeps the best one, and writes a checkpoint each time.

    Args:
        steps: The validation set.
        folder: The run's folder; the best model goes to ``best``, the latest to ``checkpoint``.
        every: Environment steps from one time to the next.
        about: What is written beside each model.
        report: Is told each score.
        best: The best cost so far, of a run that is resumed.
    """

    def __init__(
        self,
        steps: StepSet,
        folder: Path,
        every: int,
        about: dict[str, Any],
        report: Callable[[int, Score], None],
        best: float = math.inf,
    ) -> None:
        super().__init__()
        self._steps, self._folder, self._every, self._about, self._report = steps, folder, every, about, report
        self.best = best
        self._next, self._seconds_before, self._started = 0, 0.0, perf_counter()

    def _on_training_start(self) -> None:
        self._next = self.num_timesteps
        noted = read_progress(self._folder)["validations"]
        self._seconds_before = noted[-1]["seconds"] if noted else 0.0
        self._started = perf_counter()

    def _on_rollout_start(self) -> None:
        if isinstance(self.training_env, StepVecEnv):
            for name, value in self.training_env.noticed().items():
                self.logger.record(f"reward/{name}", value)
        if self.num_timesteps >= self._next:
            self._next = self.num_timesteps + self._every
            self.validate()

    def _on_training_end(self) -> None:
        self.validate()

    def _on_step(self) -> bool:
        return True

    def validate(self) -> None:
        """Judge the policy as it is."""
        assert isinstance(self.model, PPO)
        score = self._steps.score(network_of(self.model.policy))
        for name, value in dataclasses.asdict(score).items():
            self.logger.record(f"validation/{name}", value)
        about = self._about | {"timesteps": self.num_timesteps, "validation": dataclasses.asdict(score)}
        if score.cost < self.best:
            self.best = score.cost
            save_model(self.model, self._folder / "best", about)
        save_model(self.model, self._folder / "checkpoint", about | {"best_cost": self.best})
        self._note(score)
        self._report(self.num_timesteps, score)

    def _note(self, score: Score) -> None:
        """Add a score to the run's progress, in place of what a run that is resumed noted after its checkpoint."""
        progress = read_progress(self._folder)
        noted = [row for row in progress["validations"] if row["steps"] < self.num_timesteps]
        seconds = self._seconds_before + perf_counter() - self._started
        noted.append({"steps": self.num_timesteps, "seconds": round(seconds, 1)} | dataclasses.asdict(score))
        write_json(self._folder / PROGRESS, progress | {"validations": noted})
