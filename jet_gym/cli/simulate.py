"""``jet-gym simulate``: execute plans in PyBullet and say what happened."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from jet_gym.cli.changes import changes_option, with_changes
from jet_gym.cli.options import seed_option

if TYPE_CHECKING:
    from rich.table import Table

    from jet_gym.plan import Plan
    from jet_gym.simulation.diagnosis import Summary
    from jet_gym.simulation.history import Execution
    from jet_gym.simulation.pictures.film import FilmSettings

_PAPER = "paper"
FELL = 1


@click.command("simulate", short_help="Execute plans in PyBullet.")
@click.argument("plans", nargs=-1, required=True, metavar="PLAN...")
@click.option(
    "--thrust", type=click.Choice(["feedforward", "pid"]), default="feedforward", show_default=True,
    help="The plan's thrust, or with a PID on the pelvis' attitude from the IMU.",
)  # fmt: skip
@seed_option("Seed of the planner of PAPER and of the IMU's noise")
@click.option("--planner", default="gas", show_default=True, help="Who plans the course PAPER.")
@click.option("--gui", is_flag=True, help="Show PyBullet's window, in real time.")
@click.option("--video", type=click.Path(path_type=Path), help="Film (mp4), drawn without a window; extra [video].")
@click.option(
    "--size", type=(int, int), metavar="W H", default=(640, 480), show_default=True, help="Size of the film [px]."
)
@click.option("--fps", type=float, default=12.0, show_default=True, help="Frames per second of the film [1/s].")
@click.option(
    "--log",
    type=click.Path(path_type=Path),
    help="Time series (csv), one row every sample_every simulation steps, 60 a second by default.",
)
@changes_option
def simulate_command(
    plans: tuple[str, ...],
    thrust: Any,
    seed: int,
    planner: str,
    gui: bool,
    video: Path | None,
    size: tuple[int, int],
    fps: float,
    log: Path | None,
    changes: tuple[str, ...],
) -> int:
    """Execute plans one after the other, or the paper's course (PAPER), which GAS plans by itself.

    \b
    jet-gym simulate paper --thrust pid --video course.mp4 --log course.csv
    jet-gym plan side --output side.json && jet-gym simulate side.json
    jet-gym simulate paper --set fan_power=0

    The robot stands, shifts its weight, steps, changes its support foot, steps, and stands. Prints a table; exits
    with 1 if the robot falls, or a foot touches down or slides further from its place than is allowed.
    """  # noqa: D301
    from jet_gym.cli.console import console, progress_bar, say_written
    from jet_gym.simulation.bullet import require_bullet
    from jet_gym.simulation.execution import ExecutionSettings, execute
    from jet_gym.simulation.pictures.film import FilmSettings, check_film_path, film
    from jet_gym.utils.files import check_writable

    require_bullet()
    settings = with_changes(ExecutionSettings(thrust=thrust), changes)
    film_settings = FilmSettings(*size, frames_per_second=fps)
    if log is not None:
        check_writable(log)
    if video is not None:
        check_film_path(video)
    with progress_bar("planning") as report:
        chosen = _plans(plans, planner, seed, report)
    with progress_bar("simulating") as report:
        execution = execute(chosen, settings, seed, gui=gui, progress=report)
    console.print(_table(execution))
    console.print(_torque_table(execution.summary, chosen[0].step.robot.joint_names))
    if log is not None:
        execution.save_csv(log)
        say_written(log)
    if video is not None:
        _film(execution, video, film_settings, film)
    if execution.summary.success:
        console.print(execution.summary.outcome, soft_wrap=True)
        return 0
    click.echo(execution.summary.outcome, err=True)
    return FELL


def _plans(names: Sequence[str], planner: str, seed: int, report: Any) -> list[Plan]:
    from agents.planner import make_planner
    from jet_gym.courses import PAPER
    from jet_gym.plan import Plan

    if _PAPER not in names:
        return [Plan.load(name) for name in names]
    if len(names) > 1:
        raise click.UsageError(f"{_PAPER} is a course by itself; leave out the other plans")
    chosen = make_planner(planner)
    return [chosen.plan(step, seed=seed, progress=report) for step in PAPER]


def _film(execution: Execution, video: Path, settings: FilmSettings, film: Any) -> None:
    from jet_gym.cli.console import progress_bar, say_written

    with progress_bar("filming") as report:
        film(execution, video, settings, report)
    say_written(video)


def _table(execution: Execution) -> Table:
    from math import degrees

    from jet_gym.cli.console import plain_table
    from jet_gym.simulation.execution import CONTROL_NAMES

    s = execution.summary
    thrust = CONTROL_NAMES[execution.thrust_control]
    table = plain_table(f"{len(execution.plans)} plan{'s' * (len(execution.plans) > 1)}, thrust by {thrust}")
    table.show_header = False
    table.add_column()
    table.add_column(justify="right")
    limit = execution.plans[0].step.robot.max_thrust
    for name, value in (
        ("duration (s)", f"{s.duration:.1f}"),
        (f"peak thrust, of {limit:g} (N)", f"{s.peak_thrust:.2f}"),
        ("mean thrust in the motions (N)", f"{s.mean_thrust:.2f}"),
        ("worst tilt (deg)", f"{degrees(s.worst_tilt):.2f}"),
        ("least ZMP margin (mm)", f"{1e3 * s.least_zmp_margin:.1f}"),
        ("ZMP margin 99 % of the time (mm)", f"{1e3 * s.low_zmp_margin:.1f}"),
        ("worst slip of a support foot (mm)", f"{1e3 * s.worst_slip:.2f}"),
        ("soles from their places at touchdown (mm)", f"{1e3 * s.touchdown_error:.1f}"),
        ("soles from their places at the end (mm)", f"{1e3 * s.landing_error:.1f}"),
        ("touchdown before a motion's end (s)", f"{s.earliest_touchdown:.2f}"),
        ("outcome", s.verdict),
    ):
        table.add_row(name, value)
    return table


def _torque_table(summary: Summary, joint_names: Sequence[str]) -> Table:
    """Return the table of each servo's peak torque against its limit."""
    from jet_gym.cli.console import plain_table

    table = plain_table("peak torque (N m)")
    for heading in ("joint", "left", "right", "limit"):
        table.add_column(heading, justify="left" if heading == "joint" else "right")
    for k, name in enumerate(joint_names[:6]):
        left, right = summary.peak_torques[[k, k + 6]]
        limit = summary.torque_limits[k]
        table.add_row(name.removeprefix("left_").replace("_", " "), f"{left:.2f}", f"{right:.2f}", f"{limit:.2f}")
    return table
