"""Many executions under disturbances: run in parallel, kept on disk, taken up again where they were interrupted."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from jet_gym.plan import Plan
from jet_gym.simulation.course import make_course
from jet_gym.simulation.disturbances import Disturbance, DisturbanceRanges
from jet_gym.simulation.execution import ExecutionSettings, ThrustControl, execute
from jet_gym.simulation.parallel import run_in_parallel
from jet_gym.simulation.results_file import ResultsFile
from jet_gym.simulation.settings import SimulationSettings
from jet_gym.utils.progress import Progress


def _coarse_settings() -> ExecutionSettings:
    """Return settings with 30 rows a second, which costs a third less time than 60."""
    return ExecutionSettings(simulation=SimulationSettings(sample_every=8))


@dataclass(frozen=True)
class Trial:
    """One execution under a disturbance.

    Attributes:
        number: Which draw.
        control: How the thrust was controlled.
        disturbance: What was drawn.
        success: Whether the robot made all steps and stands.
        cause: What gave way, in a word or two; empty on success.
        outcome: The sentence that says so.
        duration: Simulated time [s].
        worst_tilt: Largest tilt of the pelvis [rad].
        low_zmp_margin: Distance of the ZMP from the soles' edge, 99 % of the time [m]; ``None`` if unknown.
        peak_thrust: Largest thrust that a fan delivered [N].
    """

    number: int
    control: ThrustControl
    disturbance: Disturbance
    success: bool
    cause: str
    outcome: str
    duration: float
    worst_tilt: float
    low_zmp_margin: float | None
    peak_thrust: float

    @property
    def key(self) -> tuple[int, str]:
        """What tells it from the others."""
        return self.number, self.control


@dataclass(frozen=True)
class Experiment:
    """What the trials are of. Trial k depends on this and on k alone.

    Attributes:
        plans: What is executed.
        settings: How; the thrust is controlled in each of the ways of ``controls``.
        ranges: From what the disturbances are drawn.
        seed: From which all else follows: the disturbances, and what the IMU gets wrong.
        controls: Ways to control the thrust, each under the same disturbances.
    """

    plans: tuple[Plan, ...]
    settings: ExecutionSettings = dataclasses.field(default_factory=_coarse_settings)
    ranges: DisturbanceRanges = dataclasses.field(default_factory=DisturbanceRanges)
    seed: int = 0
    controls: tuple[ThrustControl, ...] = get_args(ThrustControl)

    def disturbance(self, number: int) -> Disturbance:
        """Draw the disturbance of a trial."""
        generator = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(number,)))
        duration = make_course(self.plans, self.settings.course).duration
        return self.ranges.draw(generator, duration, len(self.plans))

    def imu_seed(self, number: int) -> int:
        """Draw the seed of a trial's IMU, which has nothing to do with the trial's disturbance."""
        sequence = np.random.SeedSequence(self.seed, spawn_key=(number, 1))
        return int(sequence.generate_state(1, np.uint64)[0])

    def run(self, number: int, control: ThrustControl, disturbance: Disturbance | None = None) -> Trial:
        """Run a trial, or the same with a disturbance of one's own."""
        chosen = self.disturbance(number) if disturbance is None else disturbance
        settings = dataclasses.replace(self.settings, thrust=control)
        summary = execute(self.plans, settings, self.imu_seed(number), disturbance=chosen).summary
        return Trial(
            number=number,
            control=control,
            disturbance=chosen,
            success=summary.success,
            cause=summary.cause,
            outcome=summary.outcome,
            duration=summary.duration,
            worst_tilt=summary.worst_tilt,
            low_zmp_margin=summary.low_zmp_margin if np.isfinite(summary.low_zmp_margin) else None,
            peak_thrust=summary.peak_thrust,
        )

    def description(self) -> dict[str, Any]:
        """Return what tells this experiment from others, as plain data."""
        plans = json.dumps([{**plan.to_dict(), "solve_time": None} for plan in self.plans], sort_keys=True)
        return {
            "seed": self.seed,
            "plans": hashlib.sha256(plans.encode()).hexdigest()[:16],
            "settings": _plain(self.settings),
            "ranges": _plain(self.ranges),
        }


_FILE = ResultsFile("jet-gym-robustness/2", "trials", Trial)
save_trials = _FILE.save
"""Writes trials to a file: :meth:`~jet_gym.simulation.results_file.ResultsFile.save`."""
load_trials = _FILE.load
"""Reads them: :meth:`~jet_gym.simulation.results_file.ResultsFile.load`."""


def run_trials(
    experiment: Experiment,
    trials: int,
    jobs: int = -1,
    done: Sequence[Trial] = (),
    progress: Progress | None = None,
    save: Callable[[Sequence[Trial]], None] | None = None,
) -> list[Trial]:
    """Run trials 0 to N - 1 with each way to control the thrust.

    The work goes through joblib, so that another backend, such as Dask's, takes it where one is registered
    (``with joblib.parallel_config(backend="dask")``). The result does not depend on the number of jobs.

    Args:
        experiment: What the trials are of.
        trials: Number of draws.
        jobs: Processes; -1 is one a core.
        done: Trials that need not be run again.
        progress: Called with how many executions are done and how many there are.
        save: Called with what there is every few seconds, at the end, and on Ctrl-C.

    Returns:
        The trials, by number and control.
    """
    wanted = [(number, control) for number in range(trials) for control in experiment.controls]
    kept: dict[tuple[int, str], Trial] = {trial.key: trial for trial in done if trial.key in set(wanted)}
    missing = [key for key in wanted if key not in kept]

    def take(trial: Trial) -> None:
        kept[trial.key] = trial
        if progress is not None:
            progress(len(kept), len(wanted))

    run_in_parallel(experiment.run, missing, jobs, take, None if save is None else lambda: save(_in_order(kept)))
    return _in_order(kept)


def _in_order(trials: Mapping[tuple[int, str], Trial]) -> list[Trial]:
    return [trials[key] for key in sorted(trials)]


def _plain(settings: Any) -> dict[str, Any]:
    """Return settings as plain data, without how the thrust is controlled, which each trial says itself."""
    return {name: value for name, value in dataclasses.asdict(settings).items() if name != "thrust"}
