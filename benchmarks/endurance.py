"""Thousands of simulated episodes across parallel environments: does memory grow, is a number not finite?

    python -m benchmarks.endurance                        # ten thousand episodes, an hour or two on two idle cores
    python -m benchmarks.endurance --episodes 200         # minutes

Each process holds several environments at once, as vectorised training does, and keeps them to the end. In every
other environment the policy that comes with the package acts; in the rest actions are random, and the robot falls.
Exits with 1 if a process dies, a number is not finite, or the memory of a process grows.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import queue
import sys
import traceback
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
from rich.console import Console
from scipy.stats import theilslopes

from jet_gym.cli.console import progress_bar
from jet_gym.utils.files import check_writable, write_whole
from jet_gym.utils.machine import machine

_SAMPLES = 200  # of the memory, of each process
_WARM_UP = 0.2  # share of the episodes in which caches fill
LEAK = 2.0  # [kB] that a process may gain an episode; what is settled after the warm-up wobbles by less
_HEARTBEAT = 20.0  # [s] after which a process tells how far it is, if no episode ends
_SILENCE = 900.0  # [s] after which a process that says nothing counts as hung


@dataclass
class Endurance:
    """What a run found.

    Attributes:
        asked: Episodes that were to be run.
        episodes: Episodes that ended, by how: ``"success"``, ``"violated"``, ``"fell"``.
        steps: Swing points simulated.
        not_finite: Numbers that are not finite, by where they stood.
        memory: Resident memory [kB] of each process, with the episodes that it had run: (episodes, memory).
        failures: What went wrong, a sentence each.
        seconds: How long it took.
    """

    asked: int
    episodes: Counter[str] = field(default_factory=Counter)
    steps: int = 0
    not_finite: Counter[str] = field(default_factory=Counter)
    memory: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)
    seconds: float = 0.0

    def growth(self) -> dict[int, tuple[float, float, float]]:
        """Return how much memory each process gains an episode after the warm-up [kB]: median, 95 % interval."""
        slopes = {}
        for process, samples in self.memory.items():
            settled = [sample for sample in samples if sample[0] >= _WARM_UP * samples[-1][0]]
            episodes, memory = zip(*settled, strict=True)
            if len(set(episodes)) >= 3:
                slope, _, low, high = theilslopes(memory, episodes)
                slopes[process] = (float(slope), float(low), float(high))
        return slopes

    def problems(self) -> list[str]:
        """Return what is wrong, a sentence each."""
        found = list(self.failures)
        done = self.episodes.total()
        if done < self.asked and not found:
            found.append(f"only {done} of {self.asked} episodes were run")
        found += [f"{count} times {where} was not finite" for where, count in self.not_finite.items()]
        for process, (_, low, _) in self.growth().items():
            if low > LEAK:
                found.append(f"process {process} gains at least {low:.1f} kB an episode")
        return found

    def sentence(self) -> str:
        """Say it in a line."""
        ends = ", ".join(f"{count} {how}" for how, count in sorted(self.episodes.items()))
        gains = ", ".join(f"{slope:+.2f} [{low:+.2f}, {high:+.2f}]" for slope, low, high in self.growth().values())
        last = ", ".join(f"{samples[-1][1] / 1e3:.0f}" for samples in self.memory.values())
        return (
            f"{self.episodes.total()} of {self.asked} episodes ({ends}), {self.steps} swing points in "
            f"{self.seconds / 60.0:.1f} min; not finite: {self.not_finite.total()}; memory (MB): {last}; "
            f"gain after the first {_WARM_UP:.0%} (kB an episode): {gains or 'too few episodes to tell'}"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "machine": machine(),
            "asked": self.asked,
            "episodes": dict(self.episodes),
            "steps": self.steps,
            "seconds": round(self.seconds, 1),
            "not_finite": dict(self.not_finite),
            "memory_kB": {str(process): samples for process, samples in self.memory.items()},
            "gain_kB_per_episode": {str(process): slope for process, slope in self.growth().items()},
            "problems": self.problems(),
        }


def endure(
    episodes: int, processes: int, environments: int, seed: int = 0, physics: str = "bullet", report: Any = None
) -> Endurance:
    """Run episodes.

    Args:
        episodes: How many, over all processes.
        processes: How many processes.
        environments: Environments in each.
        seed: Of steps and random actions.
        physics: ``"bullet"`` or ``"quasistatic"``.
        report: Called with how many episodes are done and how many there are.
    """
    found, started = Endurance(episodes), monotonic()
    context = multiprocessing.get_context("spawn")
    told: Any = context.Queue()
    shares = [episodes // processes + (number < episodes % processes) for number in range(processes)]
    workers = [
        context.Process(target=_work, args=(told, number, share, environments, seed, physics), daemon=True)
        for number, share in enumerate(shares)
    ]
    try:
        for worker in workers:
            worker.start()
        for message in _messages(told, workers, found):
            _take(found, *message)
            if report is not None:
                report(min(found.episodes.total(), episodes), episodes)
    finally:
        for worker in workers:
            if worker.is_alive():
                worker.terminate()
        found.seconds = monotonic() - started
    return found


def _messages(told: Any, workers: list[Any], found: Endurance) -> Iterator[tuple[int, str, Any]]:
    """Yield what processes tell until all of them are done; note those that die or fall silent."""
    waiting, heard = set(range(len(workers))), monotonic()
    while waiting:
        try:
            message = told.get(timeout=1.0)
        except queue.Empty:
            for number in [n for n in waiting if workers[n].exitcode is not None]:
                found.failures.append(f"process {number} died with exit code {workers[number].exitcode}")
                waiting.remove(number)
            if monotonic() - heard > _SILENCE:
                found.failures.append(f"processes {sorted(waiting)} have been silent for {_SILENCE:.0f} s")
                return
            continue
        heard = monotonic()
        number, kind, _ = message
        if kind in ("done", "failed"):
            waiting.remove(number)
        yield message


def _take(found: Endurance, number: int, kind: str, content: Any) -> None:
    if kind == "failed":
        found.failures.append(f"process {number}: {content}")
    elif kind == "progress":
        ended, steps, not_finite, done, memory = content
        found.episodes.update(ended)
        found.not_finite.update(not_finite)
        found.steps += steps
        found.memory.setdefault(number, []).append((done, memory))


def _work(told: Any, number: int, episodes: int, environments: int, seed: int, physics: str) -> None:
    """Run a share of the episodes in this process and tell about it."""
    try:
        for progress in _episodes(episodes, environments, seed + 1000 * number, physics):
            told.put((number, "progress", progress))
        told.put((number, "done", None))
    except Exception:
        told.put((number, "failed", traceback.format_exc()))


def _episodes(episodes: int, environments: int, seed: int, physics: str) -> Iterator[tuple[Any, ...]]:
    """Run episodes in a vector of environments; yield ends, steps, numbers not finite, episodes done, memory."""
    import gymnasium

    import jet_gym  # noqa: F401  registers the environment
    from agents import make_planner
    from jet_gym.task import ENVIRONMENT_ID

    envs = gymnasium.make_vec(
        ENVIRONMENT_ID, num_envs=environments, vectorization_mode="sync", physics=physics, difficulty=1.0
    )
    network = make_planner("policy").network  # type: ignore[attr-defined]
    random = np.random.default_rng(seed)
    observations, infos = envs.reset(seed=seed)
    every = max(1, episodes // _SAMPLES)
    done, steps, noted, told = 0, 0, 0, monotonic()
    ended: Counter[str] = Counter()
    bad: Counter[str] = Counter()
    while done < episodes:
        actions = random.uniform(-1.0, 1.0, (environments, 3)).astype(np.float32)
        actions[::2] = network.act(observations[::2])
        observations, rewards, terminated, truncated, infos = envs.step(actions)
        steps += environments
        numbers = {"observation": observations, "reward": rewards, **infos}
        bad.update(name for name, values in numbers.items() if not _finite(values))
        for lane in np.flatnonzero(terminated | truncated)[: episodes - done]:
            ended[_end(infos, int(lane))] += 1
            done += 1
        if done - noted >= every or done == episodes or monotonic() - told > _HEARTBEAT:
            yield dict(ended), steps, dict(bad), done, _memory()
            ended, bad, steps, noted, told = Counter(), Counter(), 0, done, monotonic()
    envs.close()


def _finite(values: Any) -> bool:
    return not (isinstance(values, np.ndarray) and values.dtype.kind == "f") or bool(np.isfinite(values).all())


def _end(infos: dict[str, Any], lane: int) -> str:
    if infos.get("fall") is not None and infos["fall"][lane]:
        return "fell"
    return "success" if infos["is_success"][lane] else "violated"


def _memory() -> int:
    """Return the resident memory of this process [kB]."""
    if Path("/proc/self/statm").exists():
        return int(Path("/proc/self/statm").read_text().split()[1]) * (os.sysconf("SC_PAGE_SIZE") // 1024)
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


class _Lines:
    """Tells how far it is where there is no terminal for a progress bar: a line every twentieth."""

    def __init__(self) -> None:
        self._told, self._started = 0, monotonic()

    def __call__(self, done: int, total: int) -> None:
        """Print a line if it is time."""
        if (done * 20) // total > self._told:
            self._told = (done * 20) // total
            print(f"{done} of {total} episodes, {(monotonic() - self._started) / 60.0:.1f} min", file=sys.stderr)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        prog="python -m benchmarks.endurance",
    )
    parser.add_argument("--episodes", type=int, default=10_000, help="how many (default: %(default)s)")
    parser.add_argument("--processes", type=int, default=2, help="how many (default: %(default)s)")
    parser.add_argument("--environments", type=int, default=8, help="in each process (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of steps and actions (default: %(default)s)")
    parser.add_argument(
        "--physics", choices=["bullet", "quasistatic"], default="bullet", help="(default: %(default)s)"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what was found to this file too")
    asked = parser.parse_args(arguments)
    for name in ("episodes", "processes", "environments"):
        if getattr(asked, name) < 1:
            parser.error(f"--{name} must be 1 or more, not {getattr(asked, name)}")
    if asked.seed < 0:
        parser.error(f"--seed must be 0 or more, not {asked.seed}")
    console = Console(highlight=False)
    try:
        if asked.json is not None:
            check_writable(asked.json)
        with progress_bar("episodes") as bar:
            report = bar if sys.stderr.isatty() else _Lines()
            found = endure(asked.episodes, asked.processes, asked.environments, asked.seed, asked.physics, report)
        if asked.json is not None:
            write_whole(asked.json, (json.dumps(found.to_dict(), indent=1) + "\n").encode())
    except OSError as error:
        parser.error(f"{error.filename}: {error.strerror}")
    except KeyboardInterrupt:
        console.print("interrupted")
        return 130
    console.print(found.sentence(), soft_wrap=True)
    problems = found.problems()
    for problem in problems:
        console.print(f"[red]{problem}[/red]", soft_wrap=True)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
