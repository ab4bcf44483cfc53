"""Train a posture policy for ``JetHR1Step-v0`` with PPO, and judge it against GAS and the optimum.

1. A careful expert, the optimal planner stopped early, is imitated on the states that the policy gets into.
2. PPO of Stable-Baselines3 goes on from there in the batched environment, with ever less exploration.
3. The model that was best on the validation steps is judged on test steps, which training never draws.

    python train.py                                  # the default policy, in minutes on two cores
    python train.py --seed 3 --output runs/three
    python train.py --resume runs/three              # go on with a run that was stopped
    python train.py --physics bullet --start-from runs/three/best/model.zip --steps 50000

The run's folder holds ``run.json`` (settings, versions, revision), ``best/`` and ``checkpoint/`` (``policy.npz`` as
plain numbers, ``model.zip`` of Stable-Baselines3), ``progress.json`` (each validation), ``tensorboard/`` and at the
end ``test.json``.
"""

from __future__ import annotations

import dataclasses
import json
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from time import perf_counter
from typing import Any, Literal

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

try:
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.env_util import make_vec_env
    from stable_baselines3.common.logger import configure
    from stable_baselines3.common.vec_env import VecEnv

    from agents.training.arguments import parse_arguments
except ModuleNotFoundError as missing:
    if __name__ != "__main__":
        raise
    sys.exit(f"training needs {missing.name}: pip install torch==2.13.0, and then 'jet-gym[train]'")

import jet_gym  # noqa: F401  registers the environment
from agents.network import Chooses
from agents.sb3_policy import ScaledObservation, ThrustPolicy, network_of
from agents.training.callbacks import MODEL, Curriculum, Validate
from agents.training.imitation import Imitation, ImitationSettings
from agents.training.run_folder import PROGRESS, RUN, describe_run, read_run, write_json
from agents.training.scaling import observation_scale
from agents.training.schedule import Geometric
from agents.training.validation import TEST_SEED, VALIDATION_SEED, Score, StepSet
from agents.training.vec_env import StepVecEnv
from jet_gym.envs.choices import ChooseThrust
from jet_gym.errors import TOLD, SettingsError, sentence_of
from jet_gym.task import ENVIRONMENT_ID
from jet_gym.task.observation import COMPONENTS
from jet_gym.task.settings import TaskSettings
from jet_gym.utils.files import check_writable, read_whole
from jet_gym.utils.interrupts import no_interrupt_lost, terminated_as_interrupted
from jet_gym.utils.settings import require_within

console = Console(stderr=True, markup=False)
_FIRST_SCALE_SEED = 900_000_000  # of the steps that give the scale of observations; training stays below
_OBSERVED = tuple(component.name for component in COMPONENTS)
_FIRST_IMITATION_SEED, _IMITATION_SEEDS_OF_A_RUN = 10_000_000, 100_000  # of the steps that the expert plans
_MOST_SEED = (_FIRST_SCALE_SEED - _FIRST_IMITATION_SEED) // _IMITATION_SEEDS_OF_A_RUN - 1
_VALIDATE_ROUNDS = 5  # of imitation


@dataclass(frozen=True)
class TrainSettings:
    """Settings of a training run."""

    seed: int = 0
    """Seed of everything that is random, 0 to 8899; that of lane i of PPO is seed + i."""
    output: Path | None = None
    """Folder of the run; runs/<date>-seed<seed> where omitted. A folder with a run in it is refused."""
    resume: Path | None = None
    """Folder of a run to go on with, with its own settings."""
    start_from: Path | None = None
    """A model.zip of an earlier run to start from, in place of imitation. Loading it can run code that is in it."""
    physics: Literal["quasistatic", "bullet"] = "quasistatic"
    """The model alone, in a batch, or PyBullet's dynamics, to fine-tune in."""
    steps: int = 1_200_000
    """Environment steps of PPO."""
    lanes: int = 64
    """Environments side by side."""
    rollout: int = 96
    """Steps of each environment between two updates."""
    batch_size: int = 2048
    """States in a gradient step of PPO."""
    epochs: int = 10
    """How often PPO goes through a rollout."""
    learning_rates: tuple[float, float] = (1e-5, 2e-6)
    """Of PPO at the beginning and at the end; it falls geometrically, as the actions' deviation does."""
    target_kl: float | None = 0.03
    """Divergence from the last policy beyond which an update stops early."""
    gamma: float = 0.95
    """Discount factor of a swing point."""
    gae_lambda: float = 0.95
    """Of generalised advantage estimation."""
    deviations: tuple[float, float] = (0.004, 0.001)
    """Standard deviation of what is chosen, of 1, at the beginning and at the end; geometric in between."""
    violation_cost: float = TaskSettings.violation_cost
    """What a violated constraint costs PPO at least, in units of a point at full thrust."""
    rise: tuple[float, float] = (0.0, 0.0)
    """Shares of the training between which the cost of a violation rises from nothing; 0 0 for all at once."""
    replay: float = 0.0
    """Share of PPO's episodes that take up a step again that the policy lately failed on; without physics alone."""
    critic_steps: int = 150_000
    """Environment steps at first in which the critic learns and the actor stays as it is."""
    chooses: Chooses = "thrust"
    """What the policy chooses: the thrust, a place across the edge polygon and the height, from which the pelvis
    follows, or the move of the pelvis itself."""
    hidden: tuple[int, ...] = (128, 128)
    """Sizes of the hidden layers, of actor and critic each."""
    hide: tuple[str, ...] = ("edge_angle_if_staying",)
    """Components of the observation that the policy does not get to see."""
    imitation: ImitationSettings = field(default_factory=ImitationSettings)
    """The warm start; --imitation.rounds 0 leaves it out."""
    difficulty: float = 1.0
    """How far the steps may go that training draws, from 0 to 1."""
    validation_steps: int = 200
    """Steps on which the best model is chosen."""
    test_steps: int = 200
    """Steps on which it is judged at the end."""
    validate_every: int = 250_000
    """Environment steps from one validation and checkpoint to the next."""
    device: str = "cpu"
    """Where torch computes: cpu, or cuda."""
    threads: int = 2
    """Threads of torch."""

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed."""
        whole = ("lanes", "rollout", "batch_size", "epochs", "validation_steps", "test_steps", "validate_every")
        for name in (*whole, "steps", "threads"):
            if getattr(self, name) < 1:
                raise SettingsError(f"{name} must be 1 or more, not {getattr(self, name)}")
        require_within("learning_rates", min(self.learning_rates), above=True)
        require_within("target_kl", 1.0 if self.target_kl is None else self.target_kl, above=True)
        require_within("deviations", min(self.deviations), above=True)
        if not 0.0 <= self.rise[0] <= self.rise[1] <= 1.0:
            raise SettingsError(f"rise must be two shares of the training, the first one first, not {self.rise}")
        for name in ("gamma", "gae_lambda", "difficulty", "replay"):
            require_within(name, getattr(self, name), most=1.0)
        if not 0 <= self.seed <= _MOST_SEED:
            reason = "so that training draws no validation or test step"
            raise SettingsError(f"seed must be 0 to {_MOST_SEED}, {reason}; not {self.seed}")
        if self.lanes > _IMITATION_SEEDS_OF_A_RUN:
            raise SettingsError(f"lanes must be {_IMITATION_SEEDS_OF_A_RUN} or fewer, not {self.lanes}")
        if self.physics == "bullet" and self.replay > 0.0:
            raise SettingsError("replay must be 0 with bullet physics: only the batch takes up failed steps again")
        if not set(self.hide) <= set(_OBSERVED):
            raise SettingsError(f"hide must name components of the observation, {', '.join(_OBSERVED)}")
        if not self.hidden or min(self.hidden) < 1:
            raise SettingsError(f"hidden must be sizes of 1 or more, not {self.hidden}")
        if self.batch_size > self.lanes * self.rollout:
            raise SettingsError(f"batch_size must be at most lanes times rollout, {self.lanes * self.rollout}")
        if self.device.startswith("cuda") and not torch.cuda.is_available():
            raise SettingsError(f"there is no {self.device} here; use --device cpu")


def train(settings: TrainSettings, command: Sequence[str]) -> Score:
    """Train a policy; return its score on the test steps.

    Args:
        settings: How.
        command: What it was asked by, for the run's record.
    """
    folder, settings = _open_folder(settings)
    torch.set_num_threads(settings.threads)
    started = perf_counter()
    with console.status("planning the validation steps with GAS and to the optimum"):
        validation = StepSet.drawn(settings.validation_steps, VALIDATION_SEED)
    envs = _environments(settings)

    checkpoint = folder / "checkpoint"
    if (checkpoint / MODEL).exists():
        model, about = _go_on(settings, envs, checkpoint)
        best = float(json.loads((checkpoint / "about.json").read_text())["best_cost"])
        console.print(f"going on after {model.num_timesteps} steps")
    else:
        model = _fresh_model(settings, envs)
        about, best = describe_run(settings, command), math.inf
        write_json(folder / RUN, about)
        if settings.imitation.rounds > 0 and settings.start_from is None:
            _imitate(model, settings, validation, folder)
            console.print(f"after imitation: {validation.score(network_of(model.policy))}")

    def report(steps: int, score: Score) -> None:
        console.print(f"{steps:>10,} steps, {perf_counter() - started:5.0f} s: {score}")

    model.set_logger(configure(str(folder / "tensorboard"), ["tensorboard"]))
    curriculum = Curriculum(
        settings.deviations, settings.rise, settings.violation_cost, settings.steps, settings.critic_steps
    )
    validate = Validate(validation, folder, settings.validate_every, about, report, best)
    steps_left = settings.steps - model.num_timesteps
    if steps_left > 0:
        try:
            model.learn(
                steps_left, [curriculum, validate], reset_num_timesteps=False, progress_bar=console.is_terminal
            )
        except KeyboardInterrupt:
            validate.validate()
            console.print(f"stopped; go on with: python train.py --resume {folder}")
            raise
        finally:
            model.logger.close()
    envs.close()

    return _judge(folder, settings)


def _environments(settings: TrainSettings) -> VecEnv:
    if settings.physics == "quasistatic":
        envs: VecEnv = StepVecEnv(
            settings.lanes,
            settings.replay,
            settings.seed,
            settings.chooses,
            difficulty=settings.difficulty,
            violation_cost=settings.violation_cost,
        )
    else:
        arguments = {
            "physics": "bullet",
            "difficulty": settings.difficulty,
            "violation_cost": settings.violation_cost,
        }
        wrapper = ChooseThrust if settings.chooses == "thrust" else None
        envs = make_vec_env(
            f"jet_gym:{ENVIRONMENT_ID}", settings.lanes, env_kwargs=arguments, wrapper_class=wrapper
        )
    return envs


def _fresh_model(settings: TrainSettings, envs: VecEnv) -> PPO:
    """Make a model, or take over what another one learnt."""
    with console.status("planning some steps with GAS for the scale of what is observed"):
        center, scale = observation_scale(150, _FIRST_SCALE_SEED)
    scale[[name in settings.hide for name in _OBSERVED]] = np.inf
    policy: dict[str, Any] = {
        "net_arch": list(settings.hidden),
        "log_std_init": math.log(settings.deviations[0]),
        "features_extractor_class": ScaledObservation,
        "features_extractor_kwargs": {"center": center, "scale": scale},
    }
    model = PPO(
        ThrustPolicy if settings.chooses == "thrust" else "MlpPolicy",
        envs,
        n_steps=settings.rollout,
        batch_size=settings.batch_size,
        n_epochs=settings.epochs,
        learning_rate=Geometric(*settings.learning_rates),
        gamma=settings.gamma,
        gae_lambda=settings.gae_lambda,
        target_kl=settings.target_kl,
        policy_kwargs=policy,
        seed=settings.seed,
        device=settings.device,
    )
    if settings.start_from is not None:
        try:
            model.set_parameters(str(settings.start_from), device=settings.device)
        except Exception as error:  # whatever torch and Stable-Baselines3 raise on another network, or on no model
            raise SettingsError(
                f"{settings.start_from} does not fit this network, or is no model: {error}"
            ) from error
    return model


def _imitate(model: PPO, settings: TrainSettings, validation: StepSet, folder: Path) -> None:
    imitation = Imitation(
        model.policy,
        settings.imitation,
        settings.seed,
        settings.seed * _IMITATION_SEEDS_OF_A_RUN + _FIRST_IMITATION_SEED,
        settings.difficulty,
    )
    columns = (TextColumn("imitating the expert"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    scores: list[dict[str, float]] = []
    started = perf_counter()
    with Progress(*columns, TextColumn("{task.fields[error]}"), console=console) as bar:
        task = bar.add_task("imitation", total=settings.imitation.rounds, error="")

        def note(done: int, error: float) -> None:
            bar.update(task, completed=done, error=f"error {error:.2f} mm")
            if done <= 3 or done % _VALIDATE_ROUNDS == 0:
                score = dataclasses.asdict(validation.score(network_of(model.policy)))
                reached = {"round": done, "states": imitation.states_seen}
                scores.append({**reached, "seconds": round(perf_counter() - started, 1), **score})
                write_json(folder / PROGRESS, {"imitation": scores})

        try:
            imitation.run(note)
        except KeyboardInterrupt:
            console.print(f"stopped; begin imitation anew with: python train.py --resume {folder}")
            raise


def _go_on(settings: TrainSettings, envs: VecEnv, checkpoint: Path) -> tuple[PPO, dict[str, Any]]:
    """Load the checkpoint of a run; what it saw of its environments is lost, and they begin anew."""
    model = PPO.load(checkpoint / MODEL, envs, device=settings.device)
    return model, read_run(checkpoint.parent)


def _judge(folder: Path, settings: TrainSettings) -> Score:
    """Judge the best model of a run on the test steps; return its score."""
    with console.status("judging the best model on the test steps"):
        test = StepSet.drawn(settings.test_steps, TEST_SEED)
        trained = PPO.load(folder / "best" / MODEL, device="cpu")
        network = network_of(trained.policy)
        score, refined = test.score(network), test.score(network, refine=16)
    content = {"policy": dataclasses.asdict(score), "policy+refine": dataclasses.asdict(refined)}
    write_json(folder / "test.json", content | {"steps": settings.test_steps, "seed": TEST_SEED})
    console.print(f"test, policy:            {score}")
    console.print(f"test, refined policy:    {refined}")
    console.print(f"{folder / 'best'} holds the policy")
    return score


def _open_folder(settings: TrainSettings) -> tuple[Path, TrainSettings]:
    """Return the run's folder, which is there and can be written to, and the settings, if resumed the run's own."""
    folder = settings.resume or settings.output or _new_folder(settings.seed)
    if settings.resume is not None:
        settings = _settings_of(folder)
    elif (folder / RUN).exists():
        raise SettingsError(
            f"there is a run in {folder} already; go on with it by --resume {folder}, or choose another"
        )
    elif settings.start_from is not None:
        read_whole(settings.start_from)
    folder.mkdir(parents=True, exist_ok=True)
    check_writable(folder / RUN)
    return folder, settings


def _new_folder(seed: int) -> Path:
    return Path("runs") / f"{datetime.now():%Y-%m-%d-%H%M%S}-seed{seed}"


def _settings_of(folder: Path) -> TrainSettings:
    """Return the settings of an earlier run."""
    saved = read_run(folder)["settings"]
    try:
        paths = {name: Path(saved[name]) if saved[name] else None for name in ("output", "resume", "start_from")}
        imitation = ImitationSettings(**saved.pop("imitation"))
        pairs = {name: tuple(saved[name]) for name in ("hidden", "learning_rates", "deviations", "rise", "hide")}
        return TrainSettings(**(saved | paths | pairs), imitation=imitation)
    except (KeyError, TypeError, ValueError) as error:
        raise SettingsError(f"{folder} holds no run to go on with: {error}") from error


def main(arguments: Sequence[str] | None = None, program: str = "train.py") -> int:
    """Run the command; return its exit code.

    Args:
        arguments: Its arguments; those of this process where ``None``.
        program: What ``--help`` calls it.
    """
    arguments = sys.argv[1:] if arguments is None else arguments
    try:
        with no_interrupt_lost(), terminated_as_interrupted():
            settings = parse_arguments(TrainSettings, arguments, __doc__, program)
            train(settings, ["python", "train.py", *arguments])
    except TOLD as error:
        console.print(f"error: {sentence_of(error)}", style="red", soft_wrap=True, highlight=False)
        return 2
    except KeyboardInterrupt:
        console.print("interrupted; what was written is whole")
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
