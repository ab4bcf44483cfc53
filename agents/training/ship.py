"""Makes the folder of a policy that ships out of a training run, with a card that says what it can and cannot do.

python -m agents.training.ship runs/mine --target runs/mine/card
python -m agents.training.ship runs/*-seed* --target runs/best    # of several, the best on many validation steps
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import shlex
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from agents.network import PolicyNetwork
from agents.paths.refinement import RefinementSettings
from agents.planner import make_planner
from agents.policy import PolicyPlanner
from agents.training.callbacks import MODEL, NETWORK
from agents.training.run_folder import read_run, write_json
from agents.training.validation import TEST_SEED, VALIDATION_SEED, Score, StepSet, drawn_steps
from jet_gym.errors import TOLD, SettingsError, sentence_of
from jet_gym.step import Step
from jet_gym.task import ENVIRONMENT_ID
from jet_gym.utils.files import check_writable, read_whole, write_whole
from jet_gym.utils.settings import require_whole

REFINE = RefinementSettings.candidates
_KINDS: dict[str, Callable[[Step], bool]] = {
    "forward": lambda step: step.landing[0] > 0.2,
    "backward": lambda step: step.landing[0] < -0.2,
    "sideways": lambda step: abs(step.landing[0]) <= 0.2,
    "landing within 0.4 m of the support": lambda step: _distance(step) < 0.4,
    "landing 0.4 to 0.6 m away": lambda step: 0.4 <= _distance(step) < 0.6,
    "landing 0.6 m away or more": lambda step: _distance(step) >= 0.6,
}


def _distance(step: Step) -> float:
    return math.dist(step.landing[:2], step.support[:2])


def best_run(runs: Sequence[Path], count: int) -> Path:
    """Return the run whose best policy has the least cost (:attr:`Score.cost`) on many validation steps.

    Args:
        runs: Their folders.
        count: Number of validation steps; with few of them, one violated step more or less decides.
    """
    if len(runs) == 1:
        return runs[0]
    steps = drawn_steps(count, VALIDATION_SEED)
    gas = np.array([make_planner("gas").plan(step).total_fitness for step in steps])
    costs = []
    for run in runs:
        plans = PolicyPlanner(model=PolicyNetwork.load(run / "best" / NETWORK)).plan_many(steps)
        score = StepSet(steps, gas, np.full(count, np.nan)).score_plans(plans)
        costs.append(score.cost)
        print(
            f"{run}: below GAS on {score.wins:.1%} of {count} validation steps, {score.median_ratio:.3f} of its "
            f"fitness, {score.violated_points:.3%} of points violated"
        )
    return runs[int(np.argmin(costs))]


def ship(run: Path, target: Path, count: int) -> None:
    """Judge a run's best policy on test steps and write it with its card.

    Args:
        run: The run's folder.
        target: The folder that ships.
        count: Number of test steps.

    Raises:
        PolicyFileError: If the run has no best policy, or it is damaged.
        SettingsError: If the folder holds no run.
        OSError: If a file cannot be read or written.
    """
    network = PolicyNetwork.load(run / "best" / NETWORK)
    run_settings, model = read_run(run), read_whole(run / "best" / MODEL)
    if "timesteps" not in network.about:
        raise SettingsError(f"{run / 'best' / NETWORK} does not say after how many timesteps it was written")
    target.mkdir(parents=True, exist_ok=True)
    for name in (NETWORK, MODEL, "about.json", "README.md"):
        check_writable(target / name)
    test = StepSet.drawn(count, TEST_SEED)
    plans = {name: PolicyPlanner(model=network, refine=k).plan_many(test.steps) for name, k in _variants().items()}
    scores = {name: test.score_plans(found) for name, found in plans.items()}
    kinds: dict[str, dict[str, Score]] = {}
    for kind, belongs in _KINDS.items():
        rows = [row for row, step in enumerate(test.steps) if belongs(step)]
        if not rows:  # so few steps that none is of this kind
            continue
        part = StepSet([test.steps[row] for row in rows], test.gas[rows], test.optimal[rows])
        kinds[kind] = {name: part.score_plans([found[row] for row in rows]) for name, found in plans.items()}
    about = {
        "environment": ENVIRONMENT_ID,
        "sha256": network.sha256,
        "trained_by": run_settings,
        "timesteps": network.about["timesteps"],
        "test_steps": count,
        "test_seed": TEST_SEED,
        "test": {name: dataclasses.asdict(score) for name, score in scores.items()},
        "by_kind": {
            kind: {name: dataclasses.asdict(score) for name, score in found.items()}
            for kind, found in kinds.items()
        },
    }
    replace(network, about=network.about | {"test": about["test"]}).save(target / NETWORK)
    write_whole(target / MODEL, model)
    write_json(target / "about.json", about)
    write_whole(target / "README.md", _card(about, scores, kinds).encode())


def _variants() -> dict[str, int]:
    return {"policy": 0, "policy+refine": REFINE}


def _card(about: dict[str, Any], scores: dict[str, Score], kinds: dict[str, dict[str, Score]]) -> str:
    command = shlex.join(about["trained_by"]["command"])
    settings = about["trained_by"]["settings"]
    lines = [
        f"# The policy for {ENVIRONMENT_ID}",
        "",
        "`policy.npz` holds the numbers of the network that acts (loaded without torch and without unpickling),",
        "`model.zip` the whole Stable-Baselines3 model, to train on; `about.json` has what is below as data.",
        "",
        f"* Trained by `{command}`",
        f"  (seed {settings['seed']}, {settings['imitation']['rounds']} rounds of imitation,",
        f"  {about['timesteps']:,} steps",
        f"  of PPO, quasi-static physics, revision {about['trained_by']['git_revision']}).",
        f"* Judged on {about['test_steps']} steps, seeds from {about['test_seed']}, which training never draws.",
        f"* Hidden layers of {settings['hidden']}, tanh. SHA-256 of its numbers: `{about['sha256'][:16]}...`.",
        "",
        "| steps | planner | below GAS on | fitness over GAS's, median | over the optimum, median "
        "| points violated | steps violated |",
        "|---|---|---|---|---|---|---|",
    ]
    for kind, found in {"all": scores, **kinds}.items():
        for name, score in found.items():
            lines.append(
                f"| {kind} | {name} | {score.wins:.0%} | {score.median_ratio:.2f} | {1.0 + score.median_gap:.2f} "
                f"| {score.violated_points:.2%} | {score.violated_steps:.1%} |"
            )
    lines += [
        "",
        "Where it fails: the rows above say on which kinds of steps. The policy has seen Jet-HR1 alone, the",
        "assigned thrust model, and steps as `JetHR1Step-v0` draws them (30 to 60 swing points, apex 0.05 to",
        "0.12 m); others are beyond what it has seen. The optimum of an easy step is a few units of fitness in all",
        "(hundredths of a newton), so that a ratio to it says little there.",
        "",
        "Made by `python -m agents.training.ship`, which takes of several runs the best on validation steps.",
        "",
    ]
    return "\n".join(lines)


def main() -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=Path, nargs="+", help="folders of training runs")
    parser.add_argument("--validation-steps", type=int, default=2000, help="steps that choose among several runs")
    parser.add_argument("--target", type=Path, required=True, help="folder to make")
    parser.add_argument("--steps", type=int, default=400, help="number of test steps")
    arguments = parser.parse_args()
    try:
        for name in ("steps", "validation_steps"):
            require_whole(name, getattr(arguments, name), 1)
        ship(best_run(arguments.runs, arguments.validation_steps), arguments.target, arguments.steps)
    except KeyError as error:
        print(f"error: the files of the run lack {error}", file=sys.stderr)
        return 2
    except TOLD as error:
        print(f"error: {sentence_of(error)}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
