"""``jet-gym compare``: planners side by side on random steps."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from jet_gym.cli.options import seed_option, settings_options, with_suffixes

if TYPE_CHECKING:
    from rich.table import Table

    from agents.compare import Comparison
    from jet_gym.balance import BalanceSettings
    from jet_gym.fitness import FitnessSettings
    from jet_gym.plan import Plan

_EXAMPLE_SHARES = (0.1, 0.5, 0.9)  # of the steps, in the order of their least total fitness


@click.command("compare", short_help="Planners side by side on random steps.")
@click.option(
    "--planner", "planners", multiple=True, help="A planner; give it several times. All that there are by default."
)
@click.option("--steps", type=click.IntRange(min=2), default=100, show_default=True, help="How many random steps.")
@seed_option("Seed of the steps")
@click.option(
    "--planner-seeds", type=click.IntRange(min=1), default=1, show_default=True,
    help="How often a planner plans each step, with seeds from 0 on.",
)  # fmt: skip
@click.option(
    "--physics", type=click.Choice(["quasistatic", "bullet"]), default="quasistatic", show_default=True,
    help="Bullet also executes each plan in simulation: falls, measured margin of the ZMP [m].",
)  # fmt: skip
@click.option(
    "--processes",
    type=click.IntRange(min=1),
    default=2,
    show_default=True,
    help="How many plan and simulate.",
)
@settings_options
@click.option("--json", "output", type=click.Path(path_type=Path), help="File for all numbers.")
@click.option(
    "--plot", type=click.Path(path_type=Path),
    help="Picture of gaps and times (png, pdf, svg), and beside it FILE-examples of three steps.",
)  # fmt: skip
def compare_command(
    planners: tuple[str, ...],
    steps: int,
    seed: int,
    planner_seeds: int,
    physics: Any,
    processes: int,
    balance: BalanceSettings,
    fitness: FitnessSettings,
    output: Path | None,
    plot: Path | None,
) -> None:
    """Plan the same random steps with several planners, and hold each against the optimal reference.

    \b
    jet-gym compare --steps 200 --seed 1 --json compare.json --plot compare.png
    jet-gym compare --planner gas --planner ga --steps 20 --physics bullet

    The steps depend on the seed alone. Gaps are of the total fitness to the least there is. Tables show means,
    interquartile means (IQM) or medians with the 95 % bootstrap interval over steps and seeds below them. Time is
    the processor time of whole plans in one process on one core, the planners taking turns.
    """  # noqa: D301
    from agents.compare import CompareSettings, compare
    from agents.planner import PLANNERS
    from jet_gym.cli.console import console, progress_bar, say_written
    from jet_gym.figures import check_figure_path
    from jet_gym.utils.files import check_writable, write_whole

    settings = CompareSettings(
        planners=tuple(dict.fromkeys(planners or PLANNERS)),
        steps=steps,
        seed=seed,
        planner_seeds=planner_seeds,
        physics=physics,
        processes=processes,
        balance=balance,
        fitness=fitness,
    )
    if output is not None:
        check_writable(output)
    pictures = () if plot is None else (plot, with_suffixes(plot, "examples"))
    for picture in pictures:
        check_figure_path(picture)
    with progress_bar("comparing") as report:
        found = compare(settings, report)
    for table in _tables(found):
        console.print(table)
    console.print(_improvement_table(found))
    if output is not None:
        write_whole(output, json.dumps(found.to_dict(), indent=1).encode())
    if pictures:
        _draw(found, *pictures)
    say_written(output, *pictures)


Column = tuple[str, str, str, float, int]  # heading, figure, statistic, scale, digits

_PLANS: tuple[Column, ...] = (
    ("mean\nthrust\n(N)", "mean_thrust", "mean", 1.0, 2),
    ("peak\nthrust\n(N)", "peak_thrust", "mean", 1.0, 2),
    ("pelvis\nrough.\n(mm)", "pelvis_roughness", "mean", 1e3, 2),
    ("thrust\nrough.\n(N)", "thrust_roughness", "mean", 1.0, 3),
    ("violated\npoints\n(%)", "violated_points", "mean", 1e2, 2),
    ("violated\nsteps\n(%)", "violated_steps", "mean", 1e2, 1),
)
_WORTH: tuple[Column, ...] = (
    ("total\nfitness\n(IQM)", "total_fitness", "iqm", 1.0, 0),
    ("above\noptimum\n(IQM)", "excess_fitness", "iqm", 1.0, 0),
    ("gap,\nmedian\n(%)", "optimality_gap", "median", 1e2, 0),
    ("a point\ntakes\n(ms)", "ms_per_point", "median", 1.0, 3),
    ("in a\nbatch\n(ms)", "ms_per_point_in_batch", "median", 1.0, 4),
)
_PHYSICS: tuple[Column, ...] = (
    ("falls\n(%)", "falls", "mean", 1e2, 1),
    ("ZMP\nmargin\n(mm)", "zmp_margin", "mean", 1e3, 1),
)


def _tables(found: Comparison) -> list[Table]:
    """Return what the plans are like, and what they are worth and cost; each fits into 80 columns."""
    settings = found.settings
    plans = f", {settings.planner_seeds} plans each" if settings.planner_seeds > 1 else ""
    title = f"{settings.steps} random steps of seed {settings.seed}{plans}, with 95 % intervals"
    physics = _PHYSICS if settings.physics == "bullet" else ()
    return [
        _table(found, title, (*_PLANS, *physics)),
        _table(found, "what they are worth, and cost", _WORTH),
    ]


def _table(found: Comparison, title: str, columns: tuple[Column, ...]) -> Table:
    from agents.compare import RIVAL
    from jet_gym.cli.console import plain_table

    table = plain_table(title)
    table.add_column("planner", no_wrap=True, min_width=13)
    for heading, *_ in columns:
        table.add_column(heading, justify="right")
    shows_wins = columns is _WORTH and RIVAL in found.measured
    if shows_wins:
        table.add_column("steps\nbelow\nGAS (%)", justify="right")
    for name in found.settings.planners:
        cells = []
        for _, figure, statistic, scale, digits in columns:
            if figure not in found.measured[name]:
                cells.append("")
                continue
            interval = found.estimate(name, figure, statistic)
            cell = f"{scale * interval.mean:.{digits}f}"
            if interval.high > interval.low:
                cell += f"\n[dim]{scale * interval.low:.{digits}f}\n{scale * interval.high:.{digits}f}[/dim]"
            cells.append(cell)
        if shows_wins:
            cells.append("" if name == RIVAL else f"{100.0 * found.win_share(name):.0f}")
        table.add_row(name, *cells)
    return table


def _improvement_table(found: Comparison) -> Table:
    from jet_gym.cli.console import plain_table

    table = plain_table("probability that the total fitness of the row is below that of the column (%)")
    names = found.settings.planners
    table.add_column("", no_wrap=True, min_width=13)
    for name in names:
        table.add_column(name, justify="right")
    for name in names:
        cells = []
        for other in names:
            interval = found.improvement(name, other)
            low, high = 100.0 * interval.low, 100.0 * interval.high
            cells.append(
                "" if other == name else f"{100.0 * interval.mean:.1f}\n[dim]{low:.0f} to {high:.0f}[/dim]"
            )
        table.add_row(name, *cells)
    return table


def _draw(found: Comparison, plot: Path, examples: Path) -> None:
    from agents.compare import REFERENCE
    from jet_gym.figures import plot_comparison, plot_examples, save_figure

    names, settings = found.settings.planners, found.settings
    figure = plot_comparison(
        {name: found.measured[name]["optimality_gap"] for name in names},
        {name: found.estimate(name, _time_of(found, name), "median") for name in names},
        {name: found.estimate(name, "optimality_gap", "median") for name in names},
        subtitle=f"{settings.steps} random steps of seed {settings.seed}, policies in a batch",
    )
    save_figure(figure, plot)
    order = sorted(range(len(found.steps)), key=lambda k: found.plans[REFERENCE][k].total_fitness)
    chosen = [order[round(share * (len(order) - 1))] for share in _EXAMPLE_SHARES]
    save_figure(
        plot_examples([(_title(k, found.plans[REFERENCE][k]), [found.plans[n][k] for n in names]) for k in chosen]),
        examples,
    )


def _time_of(found: Comparison, planner: str) -> str:
    """Return which time of a planner is drawn: in a batch, where it plans many steps at once."""
    batch = "ms_per_point_in_batch"
    return batch if batch in found.measured[planner] else "ms_per_point"


def _title(number: int, plan: Plan) -> str:
    import math

    step = plan.step
    dx, dy, dz = (1e3 * (b - a) for a, b in zip(step.start, step.landing, strict=True))
    way = f"{step.swing} foot {math.hypot(dx, dy):.0f} mm, {dz:+.0f} mm up"
    return f"step {number}: {way}\nleast total fitness {plan.total_fitness:.0f}"
