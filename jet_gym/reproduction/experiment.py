"""Section IV-C: the experiment, Fig. 11, in simulation."""

from __future__ import annotations

import math
from importlib.util import find_spec

import numpy as np

from agents.planner import make_planner
from jet_gym.courses import PAPER
from jet_gym.figures import plot_execution, plot_pictures, png_bytes
from jet_gym.reproduction.model import Chapter, Claim, Picture, Settings, Table, verdict
from jet_gym.simulation import Execution, ExecutionSettings, execute
from jet_gym.simulation.execution import CONTROL_NAMES
from jet_gym.simulation.parallel import run_in_parallel
from jet_gym.simulation.pictures.camera import CameraSettings
from jet_gym.simulation.pictures.film import FilmSettings, frames
from jet_gym.utils.progress import Progress

_FRAMES_OF_A_MOTION = (0.0, 0.4, 0.7, 1.0)  # shares of its time
_FRAME = FilmSettings(width=480, height=360)
_STILL = CameraSettings(follow=1.0)  # between stills it need not move smoothly
_LONGEST = 24.0  # [s]
_NO_BULLET = "PyBullet is not installed, so that the experiment is left out; pip install jet-gym[bullet] adds it."


_DEMANDED = ExecutionSettings()
SUCCESS = (
    "A trial succeeds if the robot stands at the end, each foot touched down within "
    f"{1e3 * _DEMANDED.landing_tolerance:g} mm of its place and stays there, and no support foot slid by more than "
    f"{1e3 * _DEMANDED.slip_tolerance:g} mm."
)


def experiment_chapter(settings: Settings, report: Progress) -> Chapter:
    """Let GAS's plans be executed in PyBullet, with the PID as in the paper, without it, and with the fans off."""
    where, statement = "IV-C, V", "The robot completed both steps in each of five trials, in 24 s on average."
    if find_spec("pybullet") is None:
        claim = Claim(where, statement, _NO_BULLET, "not tested")
        return Chapter("experiment", "The experiment", (_NO_BULLET,), claims=(claim,))
    with_pid, alone, off = ExecutionSettings(thrust="pid"), ExecutionSettings(), ExecutionSettings(fan_power=0.0)
    seeds = settings.seeds(settings.trials)
    calls = [*((how, seed) for how in (with_pid, alone) for seed in seeds), (off, settings.seed)]
    runs: dict[tuple[ExecutionSettings, int], Execution] = {}

    def take(result: tuple[ExecutionSettings, Execution]) -> None:
        how, execution = result
        runs[how, execution.seed] = execution
        report(len(runs), len(calls))

    run_in_parallel(_trial, calls, -1, take)
    trials, feedforward = ([runs[how, seed] for seed in seeds] for how in (with_pid, alone))
    without = runs[off, settings.seed]
    return Chapter(
        "experiment",
        "The experiment",
        (
            "The paper's robot stood on cartons, its joints following GAS, its thrust controlled by a PID on the "
            "IMU. Here PyBullet takes the robot's place: cartons of 210 × 110 × 140 mm, servos and fans with their "
            "limits and lags, an IMU with noise, bias and delay. It shows what rigid bodies, friction and these "
            "servos do, not what carbon plates, gear play and the air do.",
            f"Seeds {seeds[0]} to {seeds[-1]} are those of GAS and of the IMU's errors. {SUCCESS}",
        ),
        claims=_claims(trials, without, where, statement),
        tables=(_table(trials, feedforward, without), _torques(trials[0])),
        pictures=(_film(trials[0]), _series(trials[0])),
    )


def _trial(how: ExecutionSettings, seed: int) -> tuple[ExecutionSettings, Execution]:
    plans = [make_planner("gas").plan(step, seed=seed) for step in PAPER]
    return how, execute(plans, how, seed)


def _claims(trials: list[Execution], without: Execution, where: str, statement: str) -> tuple[Claim, ...]:
    made = [trial for trial in trials if trial.summary.success]
    durations = [trial.summary.duration for trial in trials]
    peak = max(trial.summary.peak_thrust for trial in trials)
    limit = trials[0].plans[0].step.robot.max_thrust
    fallen = [trial.summary.outcome for trial in trials if not trial.summary.success]
    tilt = math.degrees(max(trial.summary.worst_tilt for trial in trials))
    return (
        Claim(
            where,
            statement,
            f"In simulation {len(made)} of {len(trials)}, in {np.mean(durations):.1f} s on average"
            + "".join(f"; {outcome}" for outcome in fallen),
            verdict(len(made) == len(trials) and float(np.mean(durations)) <= _LONGEST),
        ),
        Claim(
            "V",
            "The thrust of the ducted fan effectively compensated for the gravity and kept the robot in "
            "quasistatic balance.",
            f"Peak thrust {peak:.1f} of {limit:g} N, worst tilt of the pelvis {tilt:.1f}° with the fans; without "
            f"them {without.summary.outcome}.",
            verdict(len(made) == len(trials) and without.summary.fallen),
        ),
    )


def _table(trials: list[Execution], feedforward: list[Execution], without: Execution) -> Table:
    rows = []
    for name, run in (
        *((f"{CONTROL_NAMES[run.thrust_control]}, seed {run.seed}", run) for run in (*trials, *feedforward)),
        (f"fans off, seed {without.seed}", without),
    ):
        s = run.summary
        rows.append(
            (
                name,
                s.verdict,
                f"{s.duration:.1f}",
                f"{s.peak_thrust:.2f}",
                f"{s.mean_thrust:.2f}",
                f"{math.degrees(s.worst_tilt):.2f}",
                f"{1e3 * s.low_zmp_margin:.1f}",
                f"{1e3 * s.worst_slip:.2f}",
                f"{1e3 * s.touchdown_error:.1f}",
            )
        )
    headings = (
        "trial", "outcome", "duration (s)", "peak thrust (N)", "mean thrust in the motions (N)", "worst tilt (deg)",
        "ZMP margin 99 % of the time (mm)", "worst slip (mm)",
        "touchdown from its place (mm)",
    )  # fmt: skip
    return Table("experiment", "Trials", headings, tuple(rows))


def _torques(trial: Execution) -> Table:
    s, names = trial.summary, trial.plans[0].step.robot.joint_names
    rows = tuple(
        (
            name.removeprefix("left_").replace("_", " "),
            f"{s.peak_torques[k]:.2f}",
            f"{s.peak_torques[k + 6]:.2f}",
            f"{s.torque_limits[k]:.2f}",
        )
        for k, name in enumerate(names[:6])
    )
    return Table(
        "experiment-torques",
        f"Peak torque of the servos (N m), seed {trial.seed}",
        ("joint", "left", "right", "limit"),
        rows,
    )


def _film(trial: Execution) -> Picture:
    rows: list[int] = []
    for motion in range(1, len(trial.plans) + 1):
        during = np.flatnonzero(trial.phase == f"motion {motion}")
        if len(during):
            rows += [int(during[round(share * (len(during) - 1))]) for share in _FRAMES_OF_A_MOTION]
    captions = [f"{trial.time[row]:.1f} s, {trial.phase[row]}" for row in rows]
    return Picture(
        "fig-11-experiment",
        "Fig. 11: motions 1 and 2",
        "The robot on its cartons in simulation; the arrow is the thrust.",
        png_bytes(plot_pictures(list(frames(trial, rows, _FRAME, _STILL)), captions), dots_per_inch=150.0),
    )


def _series(trial: Execution) -> Picture:
    return Picture(
        "experiment-time-series",
        "Thrust, tilt and ZMP over the time",
        "Planned, commanded and delivered thrust, tilt of the pelvis, and distance of the ZMP from the soles' "
        "edge.",
        png_bytes(plot_execution(trial)),
    )
