"""Options that several commands share, and the settings made from them."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])

seeds_option = click.option(
    "--seeds", type=click.IntRange(min=2), default=20, show_default=True, help="How many seeds, from 0 on."
)


def seed_option(seeded: str) -> Callable[[Command], Command]:
    """Return the option ``--seed``, whose help says what it seeds."""
    return click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help=f"{seeded}.")


def balance_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options that make balance settings, which the command gets as its argument ``balance``."""

    @functools.wraps(command)
    def with_balance(
        *arguments: Any, thrust_model: Any, zmp_margin: float | None, max_thrust: float | None, **others: Any
    ) -> Any:
        from jet_gym.balance import BalanceSettings

        asked = given(thrust_model=thrust_model, zmp_margin=zmp_margin, max_thrust=max_thrust)
        return command(*arguments, balance=BalanceSettings(**asked), **others)

    return _with_options(
        with_balance,
        click.option(
            "--thrust-model",
            type=click.Choice(["assigned", "least"]),
            default="assigned",
            show_default=True,
            help="Thrust that puts the ZMP at the assigned point, or the least that balances.",
        ),
        click.option("--zmp-margin", type=float, help="Distance of the ZMP from the sole's edge [m]; 0.02."),
        click.option("--max-thrust", type=float, help="Largest thrust [N]; the robot's own by default."),
    )


def settings_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options that make balance and fitness settings, the arguments ``balance`` and ``fitness``."""

    @functools.wraps(command)
    def with_fitness(*arguments: Any, smoothness_weight: float | None, **others: Any) -> Any:
        from jet_gym.fitness import FitnessSettings

        return command(*arguments, fitness=FitnessSettings(**given(smoothness_weight=smoothness_weight)), **others)

    weight = click.option("--smoothness-weight", type=float, help="omega of eq. (18) [1/m^2]; 5e5 = 50 per cm^2.")
    return balance_options(weight(with_fitness))


def given(**options: Any) -> dict[str, Any]:
    """Keep the options that were given, so that defaults stand in one place."""
    return {name: value for name, value in options.items() if value is not None}


def with_suffixes(path: Path, *suffixes: str) -> Path:
    """Put suffixes between a file's stem and its ending; a path without a name is left for the check to refuse."""
    if not path.name:
        return path
    return path.with_name("-".join((path.stem, *filter(None, suffixes))) + path.suffix)


def _with_options(command: Command, *options: Callable[[Command], Command]) -> Command:
    for option in reversed(options):
        command = option(command)
    return command
