"""``jet-gym plan``: plan steps, print what they need, write plans and pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from jet_gym.cli.options import Command, given, seed_option, settings_options, with_suffixes

if TYPE_CHECKING:
    from rich.table import Table

    from jet_gym.balance import BalanceSettings
    from jet_gym.fitness import FitnessSettings
    from jet_gym.plan import Plan
    from jet_gym.step import Step

_TABLE_ROWS = 12


@dataclass(frozen=True)
class Job:
    """One step to plan with every planner that was asked for.

    Attributes:
        motion: What the step is called in tables and file names.
        step: The step.
    """

    motion: str
    step: Step


def _position_option(name: str, text: str) -> Callable[[Command], Command]:
    return click.option(name, type=(float, float, float), metavar="X Y Z", help=f"{text} [m].")


@click.command("plan", short_help="Plan a step or the paper's motions.")
@click.argument("motion", type=click.Choice(["side", "forward", "paper"]), required=False)
@click.option("--swing", type=click.Choice(["left", "right"]), help="The leg that swings.")
@_position_option("--start", "Where the swing sole leaves")
@_position_option("--landing", "Where the swing sole lands")
@_position_option("--support", "Where the support sole stands")
@click.option("--apex", type=float, help="Height of the swing path above the line from start to landing [m]; 0.08.")
@click.option("--points", type=int, help="Number of swing points; 30, or the motion's own.")
@click.option(
    "--planner", "planners", multiple=True, default=("gas",), show_default=True,
    help="gas, ga, gaex, optimal, policy or policy+refine; give it several times to compare.",
)  # fmt: skip
@seed_option("Seed of the search")
@settings_options
@click.option(
    "--output", type=click.Path(path_type=Path), default=Path("plan.json"), show_default=True,
    help="File for the plan; of several, -MOTION and -PLANNER are put into its name.",
)  # fmt: skip
@click.option(
    "--plot", type=click.Path(path_type=Path),
    help="Picture of pelvis and thrust (png, pdf, svg), and beside it FILE-locomotion of the postures.",
)  # fmt: skip
def plan_command(
    motion: str | None,
    planners: tuple[str, ...],
    seed: int,
    output: Path,
    plot: Path | None,
    balance: BalanceSettings,
    fitness: FitnessSettings,
    **own_step: Any,
) -> int:
    """Plan the paper's motion SIDE or FORWARD, both (PAPER), or a step of your own.

    \b
    jet-gym plan side
    jet-gym plan paper --planner gas --planner ga --planner gaex --plot paper.png
    jet-gym plan --swing left --start 0 0.1125 0 --landing 0.3 0.15 0 --support 0 -0.1125 0

    Prints a table, writes the plan as JSON. Exits with 1 if a plan violates a constraint, and with 2, writing
    nothing, if no posture at all can make one of the swing points.
    """  # noqa: D301
    from agents.planner import make_planner
    from jet_gym.cli.console import console, progress_bar, summary_table

    jobs = _jobs(motion, own_step)
    names = list(dict.fromkeys(planners))
    agents_by_name = [make_planner(name, balance=balance, fitness=fitness) for name in names]
    files = {
        (job.motion, name): with_suffixes(
            output, job.motion if len(jobs) > 1 else "", name if len(names) > 1 else ""
        )
        for job in jobs
        for name in names
    }
    pictures = _picture_paths(plot, jobs)
    _check_paths(files.values(), pictures.values())

    plans: dict[str, list[Plan]] = {}
    for job in jobs:
        plans[job.motion] = []
        for planner in agents_by_name:
            with progress_bar(f"{planner.name}, {job.motion}") as report:
                plans[job.motion].append(planner.plan(job.step, seed=seed, progress=report))
        _require_feasible(job.step, plans[job.motion], balance)

    from agents.summary import summarize

    for job in jobs:
        console.print(summary_table(_title(job), [summarize([plan]) for plan in plans[job.motion]]))
        if len(names) == 1:
            console.print(_point_table(plans[job.motion][0]))
    _write(jobs, names, plans, files, pictures)
    return _report_violations(plans)


def _jobs(motion: str | None, own_step: dict[str, Any]) -> list[Job]:
    """Return the steps that were asked for."""
    from dataclasses import replace

    from jet_gym.courses import PAPER
    from jet_gym.step import Step

    own = given(**own_step)
    if motion is not None:
        fixed = sorted({"swing", "start", "landing", "support"} & set(own))
        if fixed:
            raise click.UsageError(
                f"the motion {motion!r} has its own {', '.join(fixed)}; leave out one or the other"
            )
        motions = ("side", "forward") if motion == "paper" else (motion,)
        return [Job(name, replace(PAPER[name], **own)) for name in motions]
    missing = [f"--{name}" for name in ("swing", "start", "landing", "support") if name not in own]
    if missing:
        raise click.UsageError(
            f"name a motion (side, forward, paper) or give the step: {', '.join(missing)} missing"
        )
    return [Job("step", Step(**own))]


def _picture_paths(plot: Path | None, jobs: list[Job]) -> dict[tuple[str, str], Path]:
    """Return the paths of the pictures by motion and kind."""
    if plot is None:
        return {}
    paths = {}
    for job in jobs:
        name = job.motion if len(jobs) > 1 else ""
        paths[job.motion, "trajectories"] = with_suffixes(plot, name)
        paths[job.motion, "locomotion"] = with_suffixes(plot, name, "locomotion")
    return paths


def _check_paths(files: Iterable[Path], pictures: Iterable[Path]) -> None:
    """Refuse paths that cannot be written before the work begins."""
    from jet_gym.figures import check_figure_path
    from jet_gym.utils.files import check_writable

    files, pictures = list(files), list(pictures)
    for path in files:
        check_writable(path)
    for path in pictures:
        check_figure_path(path)
    targets = [path.resolve() for path in (*files, *pictures)]
    if len(set(targets)) < len(targets):
        raise click.UsageError("--output and --plot name the same file")


def _require_feasible(step: Step, plans: list[Plan], balance: BalanceSettings) -> None:
    """Refuse the step if no posture makes a point that every planner failed at."""
    from jet_gym.feasibility import require_feasible

    suspects = set.intersection(*(set(plan.violated_points) for plan in plans))
    if suspects:
        require_feasible(step, balance, suspects)


def _title(job: Job) -> str:
    step = job.step
    start, landing = (", ".join(f"{value:g}" for value in point) for point in (step.start, step.landing))
    return f"{job.motion}: {step.swing} foot from ({start}) to ({landing}) m, {step.points} points"


def _point_table(plan: Plan) -> Table:
    """Return a table of some swing points, evenly spaced, ends and violated ones included."""
    import numpy as np

    from jet_gym.cli.console import plain_table

    table = plain_table(f"{plan.planner}, some of its swing points; pelvis in mm")
    for heading in ("point", "time\n(s)", "x", "y", "z", "thrust\n(N)", "edge angle\n(deg)", "fitness", "violated"):
        table.add_column(heading, justify="right")
    count = plan.step.points
    shown = np.linspace(0, count - 1, min(count, _TABLE_ROWS)).round().astype(int).tolist()
    for k in sorted({*shown, *plan.violated_points[:_TABLE_ROWS]}):
        table.add_row(
            str(k),
            f"{plan.time[k]:.2f}",
            *(f"{1e3 * value:.0f}" for value in plan.pelvis[k]),
            f"{plan.thrust[k]:.2f}",
            f"{np.degrees(plan.edge_angle[k]):.2f}",
            f"{plan.fitness[k]:.1f}",
            ", ".join(plan.violations[k]),
        )
    return table


def _write(
    jobs: list[Job],
    names: list[str],
    plans: dict[str, list[Plan]],
    files: dict[tuple[str, str], Path],
    pictures: dict[tuple[str, str], Path],
) -> None:
    from jet_gym.cli.console import say_written

    for job in jobs:
        for name, plan in zip(names, plans[job.motion], strict=True):
            plan.save(files[job.motion, name])
    written = [*files.values()]
    if pictures:
        from jet_gym.figures import plot_locomotion, plot_trajectories, save_figure

        for job in jobs:
            save_figure(plot_trajectories(plans[job.motion]), pictures[job.motion, "trajectories"])
            save_figure(plot_locomotion(plans[job.motion][0]), pictures[job.motion, "locomotion"])
        written.extend(pictures.values())
    say_written(*written)


def _report_violations(plans: dict[str, list[Plan]]) -> int:
    """Say which plan violates what and where; return the exit code."""
    code = 0
    for motion, of_motion in plans.items():
        for plan in of_motion:
            points = plan.violated_points
            if points:
                names = sorted({name for k in points for name in plan.violations[k]})
                which = ", ".join(map(str, points[:8])) + (", ..." if len(points) > 8 else "")
                click.echo(
                    f"{motion}: the plan of {plan.planner} violates {', '.join(names)} at swing point {which}",
                    err=True,
                )
                code = 1
    return code
