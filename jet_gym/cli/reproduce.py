"""``jet-gym reproduce``: the whole paper, and a page that holds its claims against what was measured."""

from __future__ import annotations

from pathlib import Path

import click

from jet_gym.cli.options import seed_option


@click.command("reproduce", short_help="Every figure and table of the paper, and its claims, measured.")
@click.option(
    "--output", type=click.Path(path_type=Path), default=Path("reproduction"), show_default=True,
    help="Folder for the page (index.html), pictures, tables (csv) and numbers (json).",
)  # fmt: skip
@click.option("--quick", is_flag=True, help="Fewer seeds and coarser grids, in about half of the time.")
@seed_option("First seed of plans, executions and statistics; further ones follow it")
def reproduce_command(output: Path, quick: bool, seed: int) -> None:
    """Reproduce the paper on Jet-HR1: Figs. 5 to 11, its tables, and each of its claims.

    \b
    jet-gym reproduce --output reproduction
    jet-gym reproduce --output quick --quick

    Writes one page that needs nothing else, with every claim of the paper beside what was measured, and prints the
    claims. Files are written when all is done.
    """  # noqa: D301
    from time import monotonic

    from rich.markup import escape

    from jet_gym.cli.console import console, plain_table, progress_bar
    from jet_gym.reproduction.model import Settings
    from jet_gym.reproduction.run import PARTS, check_output, write_reproduction

    settings = Settings(seed=seed)
    settings = settings.quick() if quick else settings
    check_output(output)
    started, chapters = monotonic(), []
    for number, part in enumerate(PARTS, start=1):
        began = monotonic()
        with progress_bar(f"{number} of {len(PARTS)}: {part.title}") as report:
            chapters.append(part.make(settings, report))
        console.print(f"{number} of {len(PARTS)}: {part.title}, {monotonic() - began:.0f} s")
    command = f"jet-gym reproduce{' --quick' if quick else ''} --seed {seed}"
    page = write_reproduction(output, chapters, settings, command, monotonic() - started)
    table = plain_table("the paper's claims")
    for heading in ("where", "the paper", "measured", ""):
        table.add_column(heading)
    for chapter in chapters:
        for claim in chapter.claims:
            table.add_row(*map(escape, (claim.where, claim.statement, claim.measured, claim.verdict)))
    console.print(table)
    console.print(f"wrote {page} and what is on it, in {monotonic() - started:.0f} s", soft_wrap=True)
