"""Expert episodes as Minari datasets: what planners do in ``JetHR1Step-v0`` without physics.

A dataset a planner, named ``jet_hr1/PLANNER-v0``; an episode a random step, the same steps for every planner. The
environment takes actions in single precision, which moves the pelvis by some nanometres; so the optimal planner
stays a little farther from the edges of its constraints here than elsewhere (:data:`EXPERT_MU`).
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from agents.optimal import OptimalPlanner, OptimalSettings
from agents.planner import Planner, make_planner
from jet_gym.errors import JetGymError
from jet_gym.plan import Plan
from jet_gym.step import Step
from jet_gym.utils.progress import Progress

NAMESPACE = "jet_hr1"
EXPERT_MU = 1e-2
ENVIRONMENT = {"physics": "quasistatic"}
_PATH_VARIABLE = "MINARI_DATASETS_PATH"


class MinariMissingError(JetGymError, ImportError):
    """Minari is not installed."""


def dataset_id(planner: str) -> str:
    """Return what the dataset of a planner is called."""
    return f"{NAMESPACE}/{planner.replace('+', '-')}-v0"


def make_datasets(
    planners: Sequence[str],
    steps: int,
    seed: int,
    output: str | Path,
    progress: Progress | None = None,
) -> list[Path]:
    """Write a dataset for each planner, all of them or none.

    Load one with ``MINARI_DATASETS_PATH`` set to the folder: ``minari.load_dataset("jet_hr1/optimal-v0")``.

    Args:
        planners: Names of planners.
        steps: How many random steps, each an episode.
        seed: Seed of the steps and of the planners.
        output: Folder for the datasets; it must not hold any of them yet.
        progress: Called with how many of how many episodes are done.

    Returns:
        The folders of the datasets.

    Raises:
        MinariMissingError: If Minari is not installed.
        ValueError: If there is no such planner.
        FileExistsError: If the folder holds such a dataset already.
        OSError: If the folder cannot be written.
    """
    from jet_gym.task.drawing import draw_random_steps

    _require_minari()
    experts = {name: _expert(name) for name in dict.fromkeys(planners)}
    output = Path(output).resolve()  # Minari joins relative paths twice
    folders = [output / dataset_id(name) for name in experts]
    for folder in folders:
        if folder.exists():
            raise FileExistsError(17, "it holds this dataset already", str(folder))
    drawn = draw_random_steps(steps, seed)
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=output, prefix=".making-") as temporary, _datasets_in(temporary):
        for order, (name, planner) in enumerate(experts.items()):
            episodes = []
            for number, step in enumerate(drawn):
                episodes.append(_episode(number, step, planner.plan(step, seed=seed)))
                if progress is not None:
                    progress(order * steps + number + 1, len(experts) * steps)
            _write(name, episodes, f"{steps} random steps of seed {seed} as planned by {name}")
        for name, folder in zip(experts, folders, strict=True):
            folder.parent.mkdir(exist_ok=True)
            shutil.move(Path(temporary) / dataset_id(name), folder)
    return folders


def _expert(name: str) -> Planner:
    if name == "optimal":
        return OptimalPlanner(settings=OptimalSettings(last_mu=EXPERT_MU))
    return make_planner(name)


def _episode(number: int, step: Step, plan: Plan) -> Any:
    """Return an episode buffer of Minari: a plan, replayed in the environment."""
    import gymnasium as gym
    from minari.data_collector import EpisodeBuffer

    env = gym.make("jet_gym:JetHR1Step-v0", **ENVIRONMENT)  # type: ignore[arg-type]
    inner: Any = env.unwrapped
    observation, _ = env.reset(seed=number, options={"step": step})
    observations, actions, rewards, terminations, truncations = [observation], [], [], [], []
    for pelvis in plan.pelvis:
        action = np.clip(inner.action_to(pelvis), -1.0, 1.0).astype(np.float32)
        observation, reward, terminated, truncated, _ = env.step(action)
        observations.append(observation)
        actions.append(action)
        rewards.append(float(reward))
        terminations.append(bool(terminated))
        truncations.append(bool(truncated))
    env.close()
    return EpisodeBuffer(
        id=number,
        seed=number,
        observations=observations,
        actions=actions,
        rewards=rewards,
        terminations=terminations,
        truncations=truncations,
    )


def _write(planner: str, episodes: list[Any], description: str) -> None:
    import gymnasium as gym
    import minari

    env = gym.make("jet_gym:JetHR1Step-v0", **ENVIRONMENT)  # type: ignore[arg-type]
    minari.create_dataset_from_buffers(
        dataset_id(planner),
        buffer=episodes,
        env=env,
        eval_env=env,
        algorithm_name=planner,
        author="The jet_gym developers",
        author_email="none",
        code_permalink="none",
        description=description,
        requirements=["jet-gym"],
    )
    env.close()


@contextmanager
def _datasets_in(folder: str) -> Iterator[None]:
    """Let Minari write into a folder."""
    before = os.environ.get(_PATH_VARIABLE)
    os.environ[_PATH_VARIABLE] = folder
    try:
        yield
    finally:
        if before is None:
            del os.environ[_PATH_VARIABLE]
        else:
            os.environ[_PATH_VARIABLE] = before


def _require_minari() -> None:
    from importlib.util import find_spec

    if find_spec("minari") is None:
        raise MinariMissingError("datasets need Minari: pip install 'jet-gym[dataset]'")
