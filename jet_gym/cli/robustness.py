"""``jet-gym robustness``: the paper's course many times over, each time with something else amiss."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from jet_gym.cli.changes import changes_option, with_changes
from jet_gym.cli.options import seed_option, with_suffixes

if TYPE_CHECKING:
    from rich.table import Table

    from jet_gym.plan import Plan
    from jet_gym.simulation.execution import ThrustControl
    from jet_gym.simulation.limits import Limit
    from jet_gym.simulation.robustness import Association
    from jet_gym.simulation.trials import Experiment, Trial

_FILE = "robustness.json"
_SHOWN = 6


@click.command("robustness", short_help="The course under disturbances, many times over.")
@click.argument("plans", nargs=-1, metavar="[PLAN...]")
@click.option(
    "--trials", type=click.IntRange(min=1), default=100, show_default=True,
    help="Draws of the disturbances; each is tried with feed-forward and with PID.",
)  # fmt: skip
@seed_option("Seed of the disturbances and of the IMU's noise")
@click.option(
    "--output", type=click.Path(path_type=Path), default=Path(_FILE), show_default=True,
    help=f"File for the trials (json), or a folder for {_FILE}; the limits get a file beside it.",
)  # fmt: skip
@click.option("--resume", is_flag=True, help="Go on with the trials that the file holds.")
@click.option(
    "--scale", type=click.FloatRange(min=0.0), default=1.0, show_default=True,
    help="How much further than stated the disturbances reach [1].",
)  # fmt: skip
@click.option("--jobs", type=int, default=-1, show_default=True, help="Processes; -1 is one a core.")
@click.option(
    "--limits/--no-limits", default=True, show_default=True,
    help="Also how far each disturbance by itself may go, up to five times its range.",
)  # fmt: skip
@click.option(
    "--thrust", type=click.Choice(["feedforward", "pid"]), multiple=True,
    help="Way to control the thrust; may be given twice, both by default.",
)  # fmt: skip
@changes_option
@click.option("--plot", type=click.Path(path_type=Path), help="Picture of the result (png, pdf, svg).")
def robustness_command(
    plans: tuple[str, ...],
    trials: int,
    seed: int,
    output: Path,
    resume: bool,
    scale: float,
    jobs: int,
    limits: bool,
    thrust: tuple[Any, ...],
    changes: tuple[str, ...],
    plot: Path | None,
) -> None:
    """Execute plans, by default the paper's course as GAS plans it, under disturbances drawn at random.

    \b
    jet-gym robustness --trials 200 --plot robustness.png
    jet-gym robustness --trials 400 --resume --plot robustness.png
    jet-gym robustness --thrust pid --set pid.proportional=60 --output other-gains.json

    Link masses, the pelvis' centre of mass, friction, sole stiffness, IMU, fan lag, thrust gain, the height of the
    cartons and pushes differ from trial to trial. Prints success rates with 95 % intervals, what gave way, and
    which disturbances failures have to do with; then how far each disturbance by itself may reach beyond its range.
    The result depends on the seed alone, not on the number of processes; on Ctrl-C what there is so far is printed
    and kept, and --resume goes on with it.
    """  # noqa: D301
    from jet_gym.cli.console import progress_bar, say_written
    from jet_gym.figures import plot_robustness, save_figure
    from jet_gym.simulation.bullet import require_bullet
    from jet_gym.simulation.disturbances import DisturbanceRanges
    from jet_gym.simulation.limits import find_limits, load_limits
    from jet_gym.simulation.trials import Experiment, load_trials, run_trials

    require_bullet()
    if jobs == 0 or jobs < -1:
        raise click.UsageError("--jobs must be 1 or more, or -1 for one a core")
    path, limits_path = _checked_paths(output, plot)
    experiment = Experiment(tuple(_plans(plans)), ranges=DisturbanceRanges().scaled(scale), seed=seed)
    controls = tuple(dict.fromkeys(thrust)) or experiment.controls
    experiment = replace(experiment, settings=with_changes(experiment.settings, changes), controls=controls)
    kept = load_trials(path, experiment) if resume and path.exists() else []
    kept_limits = load_limits(limits_path, experiment) if resume and limits and limits_path.exists() else []
    study = _Study(experiment, path, limits_path, kept, kept_limits)
    try:
        with progress_bar("executions") as report:
            study.trials = run_trials(experiment, trials, jobs, kept, report, study.save_trials)
        if limits:
            with progress_bar("one disturbance at a time") as report:
                study.limits = find_limits(experiment, jobs, kept_limits, report, study.save_limits)
    except KeyboardInterrupt:
        study.report(finished=False)
        raise
    study.report(finished=True)
    if plot is not None:
        save_figure(plot_robustness(study.trials, controls, study.limits), plot)
    say_written(path, limits_path if limits else None, plot)


def _checked_paths(output: Path, plot: Path | None) -> tuple[Path, Path]:
    """Return the files for trials and limits; refuse what cannot be written before the work begins."""
    from jet_gym.figures import check_figure_path
    from jet_gym.utils.files import check_writable

    path = output / _FILE if output.is_dir() else output
    limits_path = with_suffixes(path, "limits")
    check_writable(path)
    check_writable(limits_path)
    if plot is not None:
        check_figure_path(plot)
    return path, limits_path


class _Study:
    """What there is so far, and its files."""

    def __init__(
        self,
        experiment: Experiment,
        path: Path,
        limits_path: Path,
        trials: Sequence[Trial],
        limits: Sequence[Limit],
    ) -> None:
        self._experiment, self._path, self._limits_path = experiment, path, limits_path
        self._kept, self._kept_limits = trials, limits
        self.trials: Sequence[Trial] = ()
        self.limits: Sequence[Limit] = ()

    def save_trials(self, so_far: Sequence[Trial]) -> None:
        """Keep the trials, with those in the file that a shorter call does not ask for."""
        from jet_gym.simulation.trials import save_trials

        self.trials = so_far
        kept = {trial.key: trial for trial in (*self._kept, *so_far)}
        save_trials(self._path, self._experiment, [kept[key] for key in sorted(kept)])

    def save_limits(self, so_far: Sequence[Limit]) -> None:
        """Keep the limits likewise."""
        from jet_gym.simulation.limits import save_limits

        self.limits = so_far
        kept = {limit.key: limit for limit in (*self._kept_limits, *so_far)}
        save_limits(self._limits_path, self._experiment, list(kept.values()))

    def report(self, finished: bool) -> None:
        """Print what there is; what breaks the course first is known only when all is finished."""
        from jet_gym.cli.console import console

        controls = [
            control for control in self._experiment.controls if any(t.control == control for t in self.trials)
        ]
        if not controls:
            return
        console.print(_rate_table(controls, self.trials, self._experiment.seed))
        for table in _association_tables(controls, self.trials):
            console.print(table)
        if self.limits:
            console.print(_limits_table(self._experiment.controls, self.limits))
        if self.limits and finished:
            for sentence in _first_to_break(self._experiment.controls, self.limits):
                console.print(sentence, soft_wrap=True)


def _plans(names: Sequence[str]) -> list[Plan]:
    from agents.planner import make_planner
    from jet_gym.courses import PAPER
    from jet_gym.plan import Plan

    if names:
        return [Plan.load(name) for name in names]
    planner = make_planner("gas")
    return [planner.plan(step, seed=0) for step in PAPER]


def _rate_table(controls: Sequence[ThrustControl], trials: Sequence[Trial], seed: int) -> Table:
    from jet_gym.cli.console import plain_table
    from jet_gym.simulation.execution import CONTROL_NAMES
    from jet_gym.simulation.robustness import causes, success_rate

    rates = {control: success_rate(trials, control) for control in controls}
    table = plain_table(f"{max(rate.trials for rate in rates.values())} trials, seed {seed}")
    for heading in ("thrust", "succeeds", "of", "rate", "95 % interval"):
        table.add_column(heading, justify="left" if heading == "thrust" else "right")
    table.add_column("what gave way")
    for control, rate in rates.items():
        table.add_row(
            CONTROL_NAMES[control],
            str(rate.successes),
            str(rate.trials),
            f"{100.0 * rate.rate:.1f} %",
            f"{100.0 * rate.low:.1f} to {100.0 * rate.high:.1f} %",
            ", ".join(f"{cause} {count}" for cause, count in causes(trials, control).most_common(4)) or "nothing",
        )
    return table


def _association_tables(controls: Sequence[ThrustControl], trials: Sequence[Trial]) -> list[Table]:
    from jet_gym.cli.console import plain_table
    from jet_gym.simulation.execution import CONTROL_NAMES
    from jet_gym.simulation.robustness import associations

    tables = []
    for control in controls:
        ranked: list[Association] = associations(trials, control)
        if not ranked:
            continue
        table = plain_table(f"{CONTROL_NAMES[control]}: what failures have to do with")
        table.add_column("disturbance")
        table.add_column("more of it in\na failed trial", justify="right")
        table.add_column("p", justify="right")
        for entry in ranked[:_SHOWN]:
            table.add_row(entry.quantity, f"{100.0 * entry.probability:.0f} %", f"{entry.p_value:.2g}")
        tables.append(table)
    return tables


def _limits_table(controls: Sequence[ThrustControl], limits: Sequence[Limit]) -> Table:
    from jet_gym.cli.console import plain_table
    from jet_gym.simulation.execution import CONTROL_NAMES
    from jet_gym.simulation.limits import ends_by_limit

    table = plain_table("one disturbance at a time: where the robot fails, in times its range, and what gives way")
    table.add_column("disturbance")
    for control in controls:
        table.add_column(CONTROL_NAMES[control])
    found = {limit.key: limit for limit in limits}
    for quantity, end in ends_by_limit(limits):
        cells = [found.get((quantity, end, control)) for control in controls]
        table.add_row(f"{quantity}, {end}", *("" if cell is None else cell.text for cell in cells))
    return table


def _first_to_break(controls: Sequence[ThrustControl], limits: Sequence[Limit]) -> list[str]:
    from jet_gym.simulation.execution import CONTROL_NAMES
    from jet_gym.simulation.limits import FACTORS, in_order_of_breaking

    sentences = []
    for control in controls:
        order = in_order_of_breaking(limits, control)
        if not order:
            sentences.append(f"{CONTROL_NAMES[control]}: nothing breaks it at {FACTORS[-1]:g} times its range")
            continue
        first = [limit for limit in order if limit.factor == order[0].factor]
        named = ", ".join(f"{limit.quantity} of {limit.value}" for limit in first)
        sentences.append(f"{CONTROL_NAMES[control]}: breaks first at {first[0].factor:g} times the range: {named}")
    return sentences
