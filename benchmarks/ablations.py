"""What makes the policy learn: one change at a time to train.py's defaults, all else alike, on a short training.

    python -m benchmarks.ablations --output runs/ablations

Every variant is trained by ``train.py`` in a folder of its own; one that has been judged already is not trained
again, so that a run that was stopped goes on. The table is Markdown.
"""

from __future__ import annotations

import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import tyro

_SOURCE = Path(__file__).resolve().parents[1]
_AHEAD = [f"{where}_points_ahead_{axis}" for where in ("three",) for axis in "xyz"]
_AHEAD += [f"one_point_ahead_{axis}" for axis in "xyz"]
_COM = [f"com_{vector}if_staying_{axis}" for vector in ("", "from_zmp_", "to_line_") for axis in "xy"]
_ALONE = ["--imitation.rounds", "0", "--critic-steps", "0", "--deviations", "0.1", "0.003"]
_ALONE += ["--learning-rates", "5e-4", "2e-5"]

_PELVIS = ["--chooses", "pelvis", "--imitation.mu", "4", "--learning-rates", "1e-4", "1e-5"]
_PELVIS += ["--deviations", "0.015", "0.003"]
# Two networks, one a leg, in place of one that sees all steps as of the left leg: by symmetry each does as one that
# learns from half of the steps and states.
_APART = ["--imitation.first-steps", "300", "--imitation.steps-per-round", "20", "--imitation.episodes", "350"]
_APART += ["--imitation.samples", "100000", "--steps", "150000"]
_HIDE = ["--hide", "edge_angle_if_staying"]  # as by default

VARIANTS: dict[str, list[str]] = {
    "the defaults": [],
    "the pelvis chosen, not the thrust": _PELVIS,
    "PPO alone": _ALONE,
    "PPO alone, violations dearer and dearer": [*_ALONE, "--rise", "0.3", "0.6"],
    "imitation alone": ["--steps", "1"],
    "imitating the optimum itself": ["--imitation.mu", "0.01"],
    "as much care where thrust is small": ["--imitation.relative-mu", "1"],
    "imitating a more careful expert": ["--imitation.mu", "15", "--imitation.relative-mu", "3e-3"],
    "path ahead not seen, landing alone": [*_HIDE, *_AHEAD],
    "landing not seen, path ahead alone": [*_HIDE, *(f"landing_{axis}" for axis in "xyz")],
    "centre of mass if staying not seen": [*_HIDE, *_COM],
    "angle of eq. (10) if staying seen": ["--hide"],
    "layers of 64": ["--hidden", "64", "64"],
    "layers of 256": ["--hidden", "256", "256"],
    "each leg apart, from half of the states": _APART,
    "half of the episodes on failed steps": ["--replay", "0.5"],
    "violation cost 5": ["--violation-cost", "5"],
    "discount 0.99": ["--gamma", "0.99"],
    "larger steps, more noise": ["--learning-rates", "5e-5", "5e-6", "--deviations", "0.008", "0.002"],
    "as much noise at the end as at first": ["--deviations", "0.004", "0.004"],
}
"""What is changed in each variant, as train.py's arguments."""


@dataclass(frozen=True)
class Settings:
    """What each variant gets."""

    output: Path = Path("runs/ablations")
    """Folder of the runs."""
    steps: int = 300_000
    """Environment steps of PPO."""
    steps_alone: int = 900_000
    """The same without imitation, which takes about as long."""
    rounds: int = 12
    """Rounds of imitation."""
    seed: int = 0
    """Seed of every run."""
    validation_steps: int = 20
    """Steps on which the best model of a run is chosen."""
    test_steps: int = 100
    """Steps on which the variants are judged."""
    jobs: int = 2
    """Variants trained side by side."""


def folder_of(settings: Settings, name: str) -> Path:
    """Return the folder of a variant's run."""
    return settings.output.resolve() / name.replace(" ", "-").replace(",", "")


def train(settings: Settings, name: str) -> bool:
    """Train a variant unless it has been; return whether that went well."""
    folder = folder_of(settings, name)
    if (folder / "test.json").exists():
        return True
    command = [sys.executable, "train.py"]
    if (folder / "checkpoint" / "model.zip").exists():
        command += ["--resume", str(folder)]
    else:
        alone = "--imitation.rounds" in VARIANTS[name]
        command += ["--output", str(folder), "--seed", str(settings.seed), "--threads", "1"]
        command += ["--steps", str(settings.steps_alone if alone else settings.steps)]
        command += [] if alone else ["--imitation.rounds", str(settings.rounds)]
        command += ["--validation-steps", str(settings.validation_steps)]
        command += ["--test-steps", str(settings.test_steps), *VARIANTS[name]]
    print(f"training: {name}", file=sys.stderr, flush=True)
    return subprocess.run(command, cwd=_SOURCE, stderr=subprocess.DEVNULL, check=False).returncode == 0


def main() -> int:
    """Run the command; return its exit code."""
    settings = tyro.cli(Settings, description=__doc__)
    pool = ThreadPoolExecutor(settings.jobs)
    jobs = [pool.submit(train, settings, name) for name in VARIANTS]
    try:
        failed = [name for name, job in zip(VARIANTS, jobs, strict=True) if not job.result()]
    except KeyboardInterrupt:
        pool.shutdown(cancel_futures=True)
        print("stopped; the same command goes on", file=sys.stderr)
        failed = []
    print_table(settings)
    for name in failed:
        print(f"training failed: {name}", file=sys.stderr)
    return 1 if failed else 0


def print_table(settings: Settings) -> None:
    """Print the scores of the variants that have been judged."""
    print("| variant | below GAS on | above the optimum, median | points violated | steps violated |")
    print("|---|---|---|---|---|")
    for name in VARIANTS:
        path = folder_of(settings, name) / "test.json"
        if path.exists():
            score = json.loads(path.read_text())["policy"]
            print(
                f"| {name} | {score['wins']:.0%} | {score['median_gap']:.0%} "
                f"| {score['violated_points']:.2%} | {score['violated_steps']:.1%} |"
            )


if __name__ == "__main__":
    sys.exit(main())
