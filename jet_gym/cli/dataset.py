"""``jet-gym dataset``: expert episodes of planners as Minari datasets."""

from __future__ import annotations

from pathlib import Path

import click

from jet_gym.cli.options import seed_option


@click.command("dataset", short_help="Planners' episodes as Minari datasets.")
@click.option(
    "--planner", "planners", multiple=True, default=("optimal", "gas"), show_default=True,
    help="An expert; give it several times.",
)  # fmt: skip
@click.option(
    "--steps",
    type=click.IntRange(min=1),
    default=100,
    show_default=True,
    help="Random steps, one an episode.",
)
@seed_option("Seed of the steps and of the planners")
@click.option(
    "--output", type=click.Path(path_type=Path, file_okay=False), default=Path("datasets"), show_default=True,
    help="Folder for the datasets jet_hr1/PLANNER-v0.",
)  # fmt: skip
def dataset_command(planners: tuple[str, ...], steps: int, seed: int, output: Path) -> None:
    """Write what planners do in JetHR1Step-v0, without physics, as datasets for offline learning.

    \b
    jet-gym dataset --steps 500 --planner optimal --output datasets
    MINARI_DATASETS_PATH=datasets python examples/clone_optimal.py

    Observations, actions and graded rewards are those of the environment's page.
    """  # noqa: D301
    from agents.dataset import make_datasets
    from jet_gym.cli.console import progress_bar, say_written

    with progress_bar("planning episodes") as report:
        folders = make_datasets(planners, steps, seed, output, report)
    say_written(*folders)
