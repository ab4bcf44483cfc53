"""``jet-gym studio``: a page in the browser where a step is dragged and the robot follows."""

from __future__ import annotations

import threading
from dataclasses import replace

import click

from jet_gym.cli.options import seed_option


@click.command("studio", short_help="Drag a step in the browser, watch it planned.")
@click.option(
    "--port", type=click.IntRange(0, 65535), default=8080, show_default=True, help="Port; 0 for any free."
)
@click.option(
    "--host", default="127.0.0.1", show_default=True,
    help="Address to listen at; 0.0.0.0 lets other machines in.",
)  # fmt: skip
@click.option(
    "--motion", type=click.Choice(["forward", "side"]), default="forward", show_default=True,
    help="The paper's motion that the page begins with.",
)  # fmt: skip
@seed_option("Seed of the search")
def studio_command(port: int, host: str, motion: str, seed: int) -> None:
    """Serve a page on which a step is dragged, planned, played and simulated; Ctrl-C ends it.

    Every tab has its own step. Only this machine can open the page, unless --host says otherwise.
    """
    from jet_gym.cli.console import console
    from jet_gym.studio.inputs import Inputs
    from jet_gym.studio.server import Studio

    with Studio(host, port, replace(Inputs.of_motion(motion), seed=seed)) as studio:
        console.print(f"the studio is at {studio.url}; Ctrl-C ends it", soft_wrap=True)
        threading.Event().wait()
