"""Not in the paper: how robust the experiment is."""

from __future__ import annotations

from importlib.util import find_spec

from agents.planner import make_planner
from jet_gym.courses import PAPER
from jet_gym.figures import plot_robustness, png_bytes
from jet_gym.reproduction.experiment import SUCCESS
from jet_gym.reproduction.model import Chapter, Picture, Settings, Table
from jet_gym.simulation import DisturbanceRanges
from jet_gym.simulation.execution import CONTROL_NAMES
from jet_gym.simulation.robustness import causes, success_rate
from jet_gym.simulation.trials import Experiment, Trial, run_trials
from jet_gym.utils.progress import Progress


def robustness_chapter(settings: Settings, report: Progress) -> Chapter:
    """Execute the course under disturbances drawn at random, with the plan's thrust and with the PID."""
    title = "How robust it is"
    if find_spec("pybullet") is None:
        return Chapter("robustness", title, ("PyBullet is not installed, so that this is left out.",))
    plans = tuple(make_planner("gas").plan(step, seed=settings.seed) for step in PAPER)
    experiment = Experiment(plans, seed=settings.seed)
    trials = run_trials(experiment, settings.draws, progress=report)
    return Chapter(
        "robustness",
        title,
        (
            f"The paper repeated its experiment five times on one robot. Here {settings.draws} robots, floors and "
            f"days are drawn at random, each tried with the plan's thrust alone and with the PID. {SUCCESS} How "
            "far each disturbance by itself may go, and what other gains do, jet-gym robustness finds out.",
        ),
        tables=(_rates(trials, experiment), _ranges(experiment.ranges)),
        pictures=(
            Picture(
                "robustness",
                "Success under random disturbances",
                "Share of the trials that succeed, with 95 % intervals, and, where enough fail, what failures "
                "have to do with.",
                png_bytes(plot_robustness(trials, experiment.controls)),
            ),
        ),
    )


def _rates(trials: list[Trial], experiment: Experiment) -> Table:
    rows = []
    for control in experiment.controls:
        rate = success_rate(trials, control)
        gave_way = ", ".join(f"{cause} {count}" for cause, count in causes(trials, control).most_common())
        rows.append(
            (
                CONTROL_NAMES[control],
                f"{rate.successes} of {rate.trials}",
                f"{100.0 * rate.rate:.0f} %",
                f"{100.0 * rate.low:.0f} to {100.0 * rate.high:.0f} %",
                gave_way or "nothing",
            )
        )
    headings = ("thrust", "succeeds", "rate", "95 % interval", "what gave way")
    return Table("robustness", "Success under random disturbances", headings, tuple(rows))


def _ranges(r: DisturbanceRanges) -> Table:
    soft, hard = (1e-3 * value for value in r.contact_stiffness)
    rows = (
        ("mass of each link", f"±{100.0 * r.mass:g} %"),
        ("centre of mass of the pelvis, each axis", f"±{1e3 * r.pelvis_com:g} mm"),
        ("friction between soles and cartons", f"{r.friction[0]:g} to {r.friction[1]:g}"),
        ("stiffness of a contact point of a sole", f"{soft:g} to {hard:g} N/mm"),
        ("noise and bias of the IMU", f"{r.imu_noise[0]:g} to {r.imu_noise[1]:g} times"),
        ("delay of the IMU", f"{1e3 * r.imu_delay[0]:g} to {1e3 * r.imu_delay[1]:g} ms"),
        ("lag of the fans", f"{r.fan_lag[0]:g} to {r.fan_lag[1]:g} s"),
        ("thrust gain", f"±{100.0 * r.thrust_gain:g} %"),
        ("height of each landing carton", f"±{1e3 * r.block_height:g} mm"),
        (
            f"{r.pushes} pushes on the pelvis, any direction",
            f"{r.push_impulse[0]:g} to {r.push_impulse[1]:g} N s in {r.push_duration:g} s",
        ),
    )
    return Table("robustness-ranges", "What is drawn", ("disturbance", "range"), rows)
