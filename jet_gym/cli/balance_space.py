"""``jet-gym balance-space``: Fig. 5 of the paper, where the swing foot can be while some posture balances."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from jet_gym.cli.options import balance_options, seed_option, with_suffixes

if TYPE_CHECKING:
    from rich.table import Table

    from jet_gym.balance import BalanceSettings
    from jet_gym.balance_space import BalanceSpace


@click.command("balance-space", short_help="Where the swing foot can be in balance, Fig. 5.")
@click.option(
    "--resolution", type=float, default=0.02, show_default=True,
    help="Spacing of the places of the swing foot and of the pelvis [m].",
)  # fmt: skip
@click.option("--swing", type=click.Choice(["left", "right"]), default="left", show_default=True, help="The leg.")
@click.option(
    "--lowest", type=float, default=0.0, show_default=True,
    help="Lowest height of the swing foot above the support foot [m].",
)  # fmt: skip
@balance_options
@seed_option("Taken as by every command; nothing is drawn at random")
@click.option("--output", type=click.Path(path_type=Path), help="File for the space (npz).")
@click.option(
    "--plot", type=click.Path(path_type=Path),
    help="Picture of both clouds of points (png, pdf, svg), and beside it FILE-section of the level ground.",
)  # fmt: skip
def balance_space_command(
    resolution: float,
    swing: Any,
    lowest: float,
    balance: BalanceSettings,
    seed: int,  # noqa: ARG001
    output: Path | None,
    plot: Path | None,
) -> None:
    """Find all places of the swing foot at which some posture balances the robot, with thrust and without.

    \b
    jet-gym balance-space --resolution 0.04
    jet-gym balance-space --output space.npz --plot space.png
    jet-gym balance-space --thrust-model least --max-thrust 30

    By exhaustion over the places of the pelvis, for every place of the swing foot; the same with joint torques
    within the servos'. Half the spacing takes about 50 times as long. Nothing is drawn at random, so that --seed
    changes nothing.
    """  # noqa: D301
    from jet_gym.balance_space import compute_balance_space
    from jet_gym.cli.console import console, progress_bar, say_written
    from jet_gym.figures import check_figure_path
    from jet_gym.utils.files import check_writable

    section = None if plot is None else with_suffixes(plot, "section")
    if output is not None:
        if output.suffix != ".npz":
            raise click.UsageError(f"--output must end in .npz, unlike {output}")
        check_writable(output)
    for picture in filter(None, (plot, section)):
        check_figure_path(picture)
    if section is not None and lowest > 0.0:
        raise click.UsageError("--plot shows level ground too, which --lowest leaves out; take 0 or less")
    with progress_bar("balance space") as report:
        space = compute_balance_space(resolution, balance, swing=swing, lowest=lowest, progress=report)
    console.print(_space_table(space))
    console.print(_torque_sentence(space), soft_wrap=True)
    if output is not None:
        space.save(output)
    if plot is not None and section is not None:
        from jet_gym.figures import plot_balance_section, plot_balance_space, save_figure

        save_figure(plot_balance_space(space), plot)
        save_figure(plot_balance_section(space), section)
    say_written(output, plot, section)


def _space_table(space: BalanceSpace) -> Table:
    """Return the table of volumes and reaches."""
    from jet_gym.balance_space import DIRECTIONS
    from jet_gym.cli.console import plain_table

    table = plain_table(
        f"balance space of the {space.swing} foot, {1e3 * space.resolution:g} mm, "
        f"thrust model {space.settings.thrust_model}; reach on level ground"
    )
    table.add_column("")
    for heading in ("volume\n(litres)", "ratio", *(f"{direction}\n(mm)" for direction in DIRECTIONS)):
        table.add_column(heading, justify="right")
    for within_torque, what in ((False, ""), (True, ", torque within the servos'")):
        without = space.volume(with_thrust=False, within_torque=within_torque)
        for with_thrust, how in ((False, "without thrust"), (True, f"up to {space.settings.max_thrust:g} N")):
            volume = space.volume(with_thrust=with_thrust, within_torque=within_torque)
            table.add_row(
                how + what,
                f"{1e3 * volume:.1f}",
                f"{volume / without:.2f}" if without > 0.0 else "",
                *(
                    f"{1e3 * space.reach(direction, with_thrust=with_thrust, within_torque=within_torque):.0f}"
                    if 0.0 in space.z else ""
                    for direction in DIRECTIONS
                ),
            )  # fmt: skip
    return table


def _torque_sentence(space: BalanceSpace) -> str:
    """Say how much of the space with thrust is left to weaker servos."""
    import numpy as np

    shares = space.torque_share[np.isfinite(space.torque_share)]
    if len(shares) == 0:
        return "no place of the swing foot balances"
    left = ", ".join(f"{(shares <= share).mean():.1%} at {share:.0%}" for share in (0.75, 0.5, 0.25))
    return (
        f"the space asks for at most {shares.max():.0%} of the servos' torque; "
        f"of its volume there is left, with servos of less torque: {left}"
    )
