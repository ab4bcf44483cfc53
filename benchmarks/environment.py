"""How fast ``JetHR1Step-v0`` is: in a batch, single and with physics, and where the time of the physics goes.

All take random actions and begin a new episode when one ends, as ``gymnasium.utils.performance`` does, whose
functions these are; batches run the same loop. The contestants take turns. Rates are over processor time, but that
of the batch, which works in threads on all cores, is by the clock, and is printed over processor time too.
Simulated time is counted by the calls of ``stepSimulation``, those that settle the robot included.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import tracemalloc
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from time import perf_counter, process_time
from typing import Any
from unittest.mock import patch

import gymnasium as gym
import numpy as np
from gymnasium.utils.performance import benchmark_init, benchmark_render, benchmark_step
from gymnasium.vector import AutoresetMode

from benchmarks.report import Report, command_line
from jet_gym.task import ENVIRONMENT_ID

_LANES, _SYNC_LANES = 4096, 64
_TURN: Any = 0.5  # [s]; Gymnasium asks for an int and only compares
_MOST_ROUNDS = 9  # of such turns
_FIRST_USE_ROUNDS = 2
_PROFILE = 3  # [s]
_DRONES = 15.5  # times real time
_PUBLISHED = "gym-pybullet-drones' 15.5 is from its README (i7-8850H, one drone, 240 Hz), not measured."
_NO_PANDA = "panda_gym is not installed and left out; pip install panda-gym adds it."
_SOURCE = Path(__file__).resolve().parents[1]
_CORES = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()  # before all keep to one
_FIRST_USE = f"""
import time, gymnasium, jet_gym
envs = gymnasium.make_vec("{ENVIRONMENT_ID}", num_envs={_LANES}, vectorization_mode="vector_entry_point")
started = time.perf_counter()
envs.reset(seed=0)
envs.step(envs.action_space.sample())
print(time.perf_counter() - started)
"""


@dataclass
class _Runner:
    """A contestant and what its turns gave.

    Attributes:
        name: What it is called in the table.
        turn: Takes a turn and returns how many steps it made each second by the clock.
        simulated: Returns the time simulated so far [s].
        by_clock: Steps a second by the clock, one number a turn.
        by_processor: Steps a second of processor time, likewise.
        real_time: Simulated seconds a second of processor time, likewise.
    """

    name: str
    turn: Callable[[], float]
    simulated: Callable[[], float] = float
    by_clock: list[float] = field(default_factory=list)
    by_processor: list[float] = field(default_factory=list)
    real_time: list[float] = field(default_factory=list)

    def take_turn(self) -> None:
        """Take a turn and note what it gave."""
        simulated, clock, processor = self.simulated(), perf_counter(), process_time()
        rate = self.turn()
        clock, processor = perf_counter() - clock, process_time() - processor
        self.by_clock.append(rate)
        self.by_processor.append(rate * clock / processor)
        self.real_time.append((self.simulated() - simulated) / processor)


def measure(rounds: int) -> Report:
    """Let the contestants race; then measure what is no race."""
    report = Report(f"{ENVIRONMENT_ID}, random actions")
    rounds = min(rounds, _MOST_ROUNDS)
    with _all_cores():  # where the batch starts its threads
        batch_envs = gym.make_vec(ENVIRONMENT_ID, num_envs=_LANES, vectorization_mode="vector_entry_point")
        _vector_rate(batch_envs, 0.0)
    sync_envs = gym.make_vec(ENVIRONMENT_ID, _SYNC_LANES, vectorization_mode="sync", physics="quasistatic")
    single_env = gym.make(ENVIRONMENT_ID, physics="quasistatic")
    batch = _Runner(f"batch of {_LANES}", lambda: _vector_rate(batch_envs, _TURN))
    sync = _Runner(f"SyncVectorEnv of {_SYNC_LANES}", lambda: _vector_rate(sync_envs, _TURN))
    single = _Runner("single, quasi-static", lambda: benchmark_step(single_env, _TURN))
    single_env.action_space.seed(0)
    actions = [single_env.action_space.sample() for _ in range(1000)]
    given = _Runner(f"{single.name}, actions drawn before", lambda: _single_rate(single_env, actions, _TURN))
    physics = _bullet() if report.has("pybullet") else None
    panda = _panda(report) if physics else None
    runners = [runner for runner in (batch, sync, single, given, physics, panda) if runner]
    for runner in runners:
        runner.turn()  # loads and compiles what is not yet
    for _ in range(rounds):
        for runner in runners:
            with _all_cores():
                runner.take_turn()

    _add(report, f"{batch.name}, by the clock on {len(_CORES) or os.cpu_count()} cores", batch.by_clock, "/s", 1e6)
    _add(report, f"{batch.name}, over processor time", batch.by_processor, "/s")
    _add(report, sync.name, sync.by_processor, "/s")
    _add(report, f"batch over {sync.name}, by the clock", _ratios(batch.by_clock, sync.by_clock), "x", 50.0)
    over = _ratios(batch.by_processor, sync.by_processor)
    _add(report, f"batch over {sync.name}, over processor time", over, "x")
    _add(report, single.name, single.by_processor, "/s", 2e4)
    _add(report, given.name, given.by_processor, "/s")
    if physics:
        _add(report, physics.name, physics.by_processor, "/s")
        _add(report, f"{physics.name}, over real time", physics.real_time, "x", 15.0)
        report.add("gym-pybullet-drones over real time, as published", _DRONES, "x")
        report.notes.append(_PUBLISHED)
    if physics and panda:
        _add(report, panda.name, panda.by_processor, "/s")
        _add(report, f"{panda.name}, over real time", panda.real_time, "x")
        _add(report, "ours over panda-gym, each over real time", _ratios(physics.real_time, panda.real_time), "x")
    for envs in (batch_envs, sync_envs, single_env):
        envs.close()
    if physics:
        _add_shares(report)
    _add_resets(report, rounds)
    _add_benchmarks_of_gymnasium(report, bullet=physics is not None)
    _add_first_use(report)
    return report


@contextmanager
def _all_cores() -> Iterator[None]:
    """Leave the one core that benchmarks keep to; threads that start here may use all of them for good."""
    before = os.sched_getaffinity(0) if _CORES else set()
    if _CORES:
        os.sched_setaffinity(0, _CORES)
    yield
    if before:
        os.sched_setaffinity(0, before)


def _vector_rate(envs: gym.vector.VectorEnv[Any, Any, Any], duration: float) -> float:
    """Return the steps a second by the clock of all lanes together; what only resets a lane is no step."""
    envs.reset()
    ended = np.zeros(envs.num_envs, dtype=np.bool_)
    waits = envs.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    steps, started = 0, perf_counter()
    while True:
        _, _, terminated, truncated, _ = envs.step(envs.action_space.sample())
        steps += envs.num_envs - (np.count_nonzero(ended) if waits else 0)
        ended = terminated | truncated
        if (passed := perf_counter() - started) > duration:
            return steps / passed


def _single_rate(env: gym.Env[Any, Any], actions: list[Any], duration: float) -> float:
    """Return the steps a second by the clock with these actions, resets included."""
    env.reset()
    steps, started = 0, perf_counter()
    while perf_counter() - started < duration:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
        steps += len(actions)
    return steps / (perf_counter() - started)


def _bullet() -> _Runner:
    env = gym.make(ENVIRONMENT_ID)
    world = _world(env)
    clock = _clock(world.client, "stepSimulation", world.settings.time_step)
    return _Runner("single, bullet", lambda: benchmark_step(env, _TURN), clock)


def _panda(report: Report) -> _Runner | None:
    """Return the reaching arm of panda-gym, another environment with PyBullet, where it is installed."""
    if find_spec("panda_gym") is None:
        report.notes.append(_NO_PANDA)
        return None
    import_module("panda_gym")
    env = gym.make("PandaReach-v3")
    inner: Any = env.unwrapped
    clock = _clock(inner.sim, "step", inner.sim.n_substeps * inner.sim.timestep)
    return _Runner("panda-gym's PandaReach-v3", lambda: benchmark_step(env, _TURN), clock)


def _world(env: gym.Env[Any, Any]) -> Any:
    """Return the simulation of an environment, which is there from its first reset on."""
    env.reset(seed=0)
    inner: Any = env.unwrapped
    return inner._physics.world


def _clock(simulator: Any, method: str, time_step: float) -> Callable[[], float]:
    """Count the calls of a method that simulates; return what tells how much time they simulated [s]."""
    simulate, calls = getattr(simulator, method), [0]

    def counted() -> None:
        calls[0] += 1
        simulate()

    setattr(simulator, method, counted)
    return lambda: calls[0] * time_step


def _add(report: Report, what: str, values: list[float], unit: str, goal: float | None = None) -> None:
    report.add(what, median(values), unit, lowest=min(values), highest=max(values), goal=goal, at_least=True)


def _ratios(values: list[float], references: list[float]) -> list[float]:
    return [value / reference for value, reference in zip(values, references, strict=True)]


def _add_shares(report: Report) -> None:
    """Add where the time with physics goes; it counts for the innermost of the shares that it is in."""
    from jet_gym.simulation.actuators import Actuators
    from jet_gym.simulation.recorder import Recorder

    env = gym.make(ENVIRONMENT_ID)
    client = _world(env).client
    shares, inside, since = Counter[str](), ["everything else"], perf_counter()

    def switch() -> None:
        nonlocal since
        before, since = since, perf_counter()
        shares[inside[-1]] += since - before  # type: ignore[assignment]

    def timed(share: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def run(*arguments: Any, **named: Any) -> Any:
            switch()
            inside.append(share)
            result = call(*arguments, **named)
            switch()
            inside.pop()
            return result

        return run

    with ExitStack() as patches:
        for owner, name, share in (
            (client, "stepSimulation", "stepSimulation"),
            (client, "getContactPoints", "contact queries"),
            (Actuators, "step", "motor and fan commands"),
            *((Recorder, name, "other measurement") for name in ("step", "sample", "measurement")),
        ):
            patches.enter_context(patch.object(owner, name, timed(share, getattr(owner, name)), create=True))
        benchmark_step(env, _PROFILE)
        switch()
    env.close()
    for share, seconds in shares.most_common():
        report.add(f"with bullet, share of {share}", 100.0 * seconds / shares.total(), "%")


def _add_resets(report: Report, rounds: int) -> None:
    """Add how long the batch takes to begin anew, and the memory that it keeps and that a step takes besides."""
    tracemalloc.start()
    envs = gym.make_vec(ENVIRONMENT_ID, num_envs=_LANES, vectorization_mode="vector_entry_point")
    envs.reset(seed=0)
    actions = envs.action_space.sample()
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.reset_peak()
    envs.step(actions)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    report.add(f"memory of {_LANES} lanes", kept, "B")
    report.add("the most that one of their steps takes besides", peak - kept, "B")
    for what, seed in (("with seeds", 0), ("without seeds", None)):
        times = []
        for _ in range(rounds):
            started = process_time()
            envs.reset(seed=seed)
            times.append(process_time() - started)
        _add(report, f"reset of {_LANES} lanes, {what}", times, "s")
    envs.close()


def _add_benchmarks_of_gymnasium(report: Report, *, bullet: bool) -> None:
    """Add how long it takes to make an environment with its first reset, and to render."""
    for physics in ("quasistatic", *(("bullet",) if bullet else ())):
        rate = benchmark_init(partial(gym.make, ENVIRONMENT_ID, physics=physics), 1)
        report.add(f"make and first reset, {physics}", 1.0 / rate, "s")
    if bullet:
        env = gym.make(ENVIRONMENT_ID, render_mode="rgb_array")
        env.reset(seed=0)
        env.render()  # makes the renderer
        report.add("render a frame", 1.0 / benchmark_render(env, 1), "s")
        env.close()


def _add_first_use(report: Report) -> None:
    """Add the time of a process's first reset and step of the batch, with nothing compiled and with everything."""
    path = os.pathsep.join([str(_SOURCE), *filter(None, [os.environ.get("PYTHONPATH")])])
    times: dict[str, list[float]] = {"ever, which compiles": [], "of a process": []}
    for _ in range(_FIRST_USE_ROUNDS):
        with tempfile.TemporaryDirectory() as cache:
            variables = {**os.environ, "PYTHONPATH": path, "NUMBA_CACHE_DIR": cache}
            for seconds in times.values():
                process = subprocess.run(
                    [sys.executable, "-c", _FIRST_USE], env=variables, check=True, capture_output=True, text=True
                )
                seconds.append(float(process.stdout.split()[-1]))
    for what, seconds in times.items():
        _add(report, f"batch, first reset and step {what}", seconds, "s")


if __name__ == "__main__":
    command_line(__doc__, measure)
