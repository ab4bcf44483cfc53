"""The command line ``jet-gym``: one file a command, and how errors are told."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import click

from jet_gym import __version__
from jet_gym.cli.balance_space import balance_space_command
from jet_gym.cli.compare import compare_command
from jet_gym.cli.dataset import dataset_command
from jet_gym.cli.plan import plan_command
from jet_gym.cli.reproduce import reproduce_command
from jet_gym.cli.robustness import robustness_command
from jet_gym.cli.simulate import simulate_command
from jet_gym.cli.studies import claims_command, sweep_command
from jet_gym.cli.studio import studio_command
from jet_gym.cli.train import train_command
from jet_gym.errors import TOLD, in_one_line, sentence_of
from jet_gym.utils.interrupts import no_interrupt_lost, terminated_as_interrupted

BAD_INPUT = 2
INTERRUPTED = 130


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="jet-gym")
def cli() -> None:
    """Plan, simulate and learn how Jet-HR1 steps over what it can't step across.

    Units are m, N, s and rad unless a name says otherwise; x is forward, y left, z up.
    """


for command in (
    plan_command,
    simulate_command,
    robustness_command,
    balance_space_command,
    sweep_command,
    claims_command,
    reproduce_command,
    compare_command,
    dataset_command,
    train_command,
    studio_command,
):
    cli.add_command(command)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit.

    Exits with 0 on success, 1 if the result is not what was asked for (a plan that violates a constraint),
    2 on bad input and 130 on Ctrl-C or SIGTERM; an error is one sentence on standard error.
    """
    sys.exit(run(arguments))


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    try:
        with no_interrupt_lost(), terminated_as_interrupted():
            outcome = cli.main(args=arguments, prog_name="jet-gym", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message(), err=True)
        return BAD_INPUT
    except click.ClickException as error:
        return _fail(in_one_line(error.format_message()))
    except (click.Abort, KeyboardInterrupt):
        return _fail("interrupted; what was written is whole", INTERRUPTED)
    except TOLD as error:
        return _fail(sentence_of(error))
    return outcome if isinstance(outcome, int) else 0


def _fail(sentence: str, code: int = BAD_INPUT) -> int:
    click.echo(f"jet-gym: {sentence}", err=True)
    return code
