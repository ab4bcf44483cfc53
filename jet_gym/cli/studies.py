"""``jet-gym sweep`` and ``jet-gym claims``: what the smoothness weight does, and what the paper says, measured."""

from __future__ import annotations

from pathlib import Path

import click

from jet_gym.cli.options import seeds_option


@click.command("sweep", short_help="What the smoothness weight omega does.")
@seeds_option
@click.option("--plot", type=click.Path(path_type=Path), help="Picture of the sweep (png, pdf, svg).")
def sweep_command(seeds: int, plot: Path | None) -> None:
    """Plan both motions of the paper with GAS at many smoothness weights, and with GA.

    This is where the unit of the paper's omega = 50 was settled: per cm^2 it trades thrust against smoothness,
    per m^2 it does nothing, per mm^2 it freezes the pelvis.
    """
    from agents.studies.sweep import UNITS, sweep_smoothness
    from jet_gym.cli.console import console, number, plain_table, progress_bar, say_written
    from jet_gym.figures import check_figure_path

    if plot is not None:
        check_figure_path(plot)
    with progress_bar("smoothness weights") as report:
        rows = sweep_smoothness(range(seeds), progress=report)
    for motion in ("side", "forward"):
        table = plain_table(f"{motion}, {seeds} seeds, mean ± 95 % interval")
        for heading in (
            "omega\n(1/m²)",
            "",
            "mean\nthrust\n(N)",
            "peak\nthrust\n(N)",
            "pelvis\nroughness\n(mm)",
            "thrust\nroughness\n(N)",
        ):
            table.add_column(heading, justify="right")
        for row in rows:
            if row.motion == motion:
                s = row.summary
                table.add_row(
                    f"{row.smoothness_weight:.0e}" if row.smoothness_weight > 0.0 else "0",
                    UNITS.get(row.smoothness_weight, "GA" if row.smoothness_weight == 0.0 else ""),
                    number(s.mean_thrust, 2),
                    number(s.peak_thrust, 2),
                    number(s.pelvis_roughness, 2, 1e3),
                    number(s.thrust_roughness, 3),
                )
        console.print(table)
    if plot is not None:
        from jet_gym.figures import plot_smoothness_sweep, save_figure

        save_figure(plot_smoothness_sweep(rows), plot)
        say_written(plot)


@click.command("claims", short_help="What the paper says of GAS, GA and GAEx, measured.")
@seeds_option
def claims_command(seeds: int) -> None:
    """Plan both motions with the paper's three planners and hold its claims against the result."""
    from agents.studies.claims import measure_claims
    from jet_gym.cli.console import console, plain_table, progress_bar, summary_table

    with progress_bar("plans") as report:
        result = measure_claims(range(seeds), progress=report)
    for motion, by_planner in result.summaries.items():
        console.print(summary_table(f"{motion}, {seeds} seeds, mean ± 95 % interval", list(by_planner.values())))
    table = plain_table("the paper's claims")
    for heading in ("motion", "claim", "measured", "holds"):
        table.add_column(heading)
    for claim in result.claims:
        table.add_row(claim.motion, claim.statement, claim.measured, "yes" if claim.holds else "NO")
    console.print(table)
