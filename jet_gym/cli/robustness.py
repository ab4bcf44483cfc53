"""``jet-gym robustness``: the paper's course many times over, each time with something else amiss."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from jet_gym.cli.options import seed_option

if TYPE_CHECKING:
    from rich.table import Table

    from jet_gym.plan import Plan
    from jet_gym.simulation.robustness import Association, Extreme, Rate
    from jet_gym.simulation.trials import Experiment, Trial

_FILE = "robustness.json"
_SHOWN = 6
_NAMES = {"feedforward": "feed-forward", "pid": "feed-forward and PID"}


@click.command("robustness", short_help="The course under disturbances, many times over.")
@click.argument("plans", nargs=-1, metavar="[PLAN...]")
@click.option(
    "--trials", type=click.IntRange(min=1), default=100, show_default=True,
    help="Draws of the disturbances; each is tried with feed-forward and with PID.",
)  # fmt: skip
@seed_option
@click.option(
    "--output", type=click.Path(path_type=Path), default=Path(_FILE), show_default=True,
    help=f"File for the trials (json), or a folder for {_FILE}.",
)  # fmt: skip
@click.option("--resume", is_flag=True, help="Go on with the trials that the file holds.")
@click.option(
    "--scale", type=click.FloatRange(min=0.0), default=1.0, show_default=True,
    help="How much further than stated the disturbances reach [1].",
)  # fmt: skip
@click.option("--jobs", type=int, default=-1, show_default=True, help="Processes; -1 is one a core.")
@click.option("--extremes/--no-extremes", default=True, show_default=True, help="Also one disturbance at a time.")
@click.option("--plot", type=click.Path(path_type=Path), help="Picture of the result (png, pdf, svg).")
def robustness_command(
    plans: tuple[str, ...],
    trials: int,
    seed: int,
    output: Path,
    resume: bool,
    scale: float,
    jobs: int,
    extremes: bool,
    plot: Path | None,
) -> None:
    """Execute plans, by default the paper's course as GAS plans it, under disturbances drawn at random.

    \b
    jet-gym robustness --trials 200 --plot robustness.png
    jet-gym robustness --trials 400 --resume --plot robustness.png

    Link masses, the pelvis' centre of mass, friction, sole stiffness, IMU, fan lag, thrust gain, the height of the
    cartons and pushes differ from trial to trial. Prints success rates with 95 % intervals, what gave way, and
    which disturbances failures have to do with. The result depends on the seed alone, not on the number of
    processes; on Ctrl-C the trials so far are kept, and --resume goes on with them.
    """  # noqa: D301
    from jet_gym.cli.console import console, progress_bar
    from jet_gym.figures import check_figure_path
    from jet_gym.files import check_writable
    from jet_gym.simulation.disturbances import DisturbanceRanges
    from jet_gym.simulation.robustness import run_extremes, success_rate
    from jet_gym.simulation.trials import Experiment, load_trials, run_trials, save_trials

    if jobs == 0:
        raise click.UsageError("--jobs must be 1 or more, or -1 for one a core")
    path = output / _FILE if output.is_dir() else output
    check_writable(path)
    if plot is not None:
        check_figure_path(plot)
    experiment = Experiment(tuple(_plans(plans)), ranges=DisturbanceRanges().scaled(scale), seed=seed)
    done = load_trials(path, experiment) if resume and path.exists() else []

    def save(so_far: Sequence[Trial]) -> None:
        # What a shorter call does not ask for stays in the file.
        kept = {trial.key: trial for trial in (*done, *so_far)}
        save_trials(path, experiment, [kept[key] for key in sorted(kept)])

    with progress_bar("executions") as report:
        result = run_trials(experiment, trials, jobs, done, report, save)
    found: list[Extreme] = []
    if extremes:
        with progress_bar("one disturbance at a time") as report:
            found = run_extremes(experiment, jobs, report)
    rates = {control: success_rate(result, control) for control in experiment.controls}
    console.print(_rate_table(rates, result, seed))
    for table in _association_tables(experiment, result):
        console.print(table)
    if found:
        console.print(_extreme_table(experiment, found))
    written = [str(path)]
    if plot is not None:
        _plot(experiment, result, found, plot)
        written.append(str(plot))
    console.print("wrote " + ", ".join(written), soft_wrap=True)


def _plans(names: Sequence[str]) -> list[Plan]:
    from agents.planner import make_planner
    from jet_gym.courses import PAPER
    from jet_gym.plan import Plan

    if names:
        return [Plan.load(name) for name in names]
    planner = make_planner("gas")
    return [planner.plan(step, seed=0) for step in PAPER]


def _rate_table(rates: dict[Any, Rate], trials: Sequence[Trial], seed: int) -> Table:
    from jet_gym.cli.console import plain_table
    from jet_gym.simulation.robustness import causes

    table = plain_table(f"{max(rate.trials for rate in rates.values())} trials, seed {seed}")
    for heading in ("thrust", "stands", "of", "rate", "95 % interval"):
        table.add_column(heading, justify="left" if heading == "thrust" else "right")
    table.add_column("what gave way")
    for control, rate in rates.items():
        table.add_row(
            _NAMES[control],
            str(rate.successes),
            str(rate.trials),
            f"{100.0 * rate.rate:.1f} %",
            f"{100.0 * rate.low:.1f} to {100.0 * rate.high:.1f} %",
            ", ".join(f"{cause} {count}" for cause, count in causes(trials, control).most_common(4)) or "nothing",
        )
    return table


def _association_tables(experiment: Experiment, trials: Sequence[Trial]) -> list[Table]:
    from jet_gym.cli.console import plain_table
    from jet_gym.simulation.robustness import associations

    tables = []
    for control in experiment.controls:
        ranked: list[Association] = associations(trials, control)
        if not ranked:
            continue
        table = plain_table(f"{_NAMES[control]}: what failures have to do with")
        table.add_column("disturbance")
        table.add_column("more of it in\na failed trial", justify="right")
        table.add_column("p", justify="right")
        for entry in ranked[:_SHOWN]:
            table.add_row(entry.quantity, f"{100.0 * entry.probability:.0f} %", f"{entry.p_value:.2g}")
        tables.append(table)
    return tables


def _extreme_table(experiment: Experiment, found: Sequence[Extreme]) -> Table:
    from jet_gym.cli.console import plain_table

    table = plain_table("one disturbance at a time: ZMP margin 99 % of the time (mm), or what gave way")
    table.add_column("disturbance")
    table.add_column("value", justify="right")
    for control in experiment.controls:
        table.add_column(_NAMES[control], justify="right")
    rows: dict[tuple[str, str], list[str]] = {}
    for entry in found:
        trial = entry.trial
        margin = trial.low_zmp_margin
        stands = f"{1e3 * margin:.1f}" if margin is not None else "stands"
        rows.setdefault((entry.quantity, entry.value), []).append(stands if trial.success else trial.cause)
    for (quantity, value), outcomes in rows.items():
        table.add_row(quantity, value, *outcomes)
    return table


def _plot(experiment: Experiment, trials: Sequence[Trial], found: Sequence[Extreme], plot: Path) -> None:
    from jet_gym.figures import plot_robustness, save_figure

    save_figure(plot_robustness(trials, experiment.controls, found), plot)
