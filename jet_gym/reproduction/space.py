"""Section IV-A: the balance space, Fig. 5."""

from __future__ import annotations

import numpy as np

from jet_gym.balance import BalanceSettings
from jet_gym.balance_space import DIRECTIONS, BalanceSpace, compute_balance_space
from jet_gym.figures import plot_balance_section, plot_balance_space, png_bytes
from jet_gym.reproduction.model import Chapter, Claim, Picture, Settings, Table, share_of, verdict
from jet_gym.utils.progress import Progress

_MODELS = {"assigned": "assigned ZMP (the paper's)", "least": "least thrust"}
_SHARES = (1.0, 0.75, 0.5, 0.4, 0.3, 0.25)


def space_chapter(settings: Settings, report: Progress) -> Chapter:
    """Compute the balance space with both thrust models."""
    models = [BalanceSettings(), BalanceSettings(thrust_model="least")]
    resolution = 1e-3 * settings.space_resolution
    spaces = [
        compute_balance_space(resolution, model, progress=share_of(report, number, len(models)))
        for number, model in enumerate(models)
    ]
    space = spaces[0]
    volumes = [1e3 * space.volume(with_thrust=choice) for choice in (False, True)]
    reaches = [(d, [1e3 * space.reach(d, with_thrust=choice) for choice in (False, True)]) for d in DIRECTIONS]
    grows = all(after > before for before, after in (volumes, *(both for _, both in reaches)))
    claim = Claim(
        "IV-A, Fig. 5",
        "The ducted-fan propulsion system improves the stepping performance: with a thrust of 23 N the balance "
        "space is larger than without.",
        f"{volumes[1]:.0f} litres with 23 N against {volumes[0]:.0f} without, {volumes[1] / volumes[0]:.2f} times "
        "as much; reach on level ground "
        + ", ".join(f"{direction} {after:.0f} against {before:.0f} mm" for direction, (before, after) in reaches),
        verdict(grows),
    )
    return Chapter(
        "balance-space",
        "The balance space",
        (
            "All places of the swing foot at which some posture balances, by exhaustion over the pelvis: every "
            f"place of a grid of {settings.space_resolution:g} mm for every place of the foot on such a grid. With "
            "thrust, a posture meets the constraints (8) to (11) or balances without; without, its joints are "
            "within their limits and its centre of mass is above the support sole, 20 mm from its edge. Heights "
            "begin at the support sole's. The paper prints the clouds and no number.",
            "No paper shows what the servos' torque does to this space: the static torques of each posture, from "
            "gravity, thrust and the ground's force, are held against the servos' limits. They take nothing from "
            "it; the second table has what weaker servos would.",
        ),
        claims=(claim,),
        tables=(_volumes(spaces), _shares(spaces)),
        pictures=(
            Picture(
                "fig-05-balance-space",
                "Fig. 5: the balance space",
                "Places of the swing foot at which the robot balances, without thrust and with up to 23 N.",
                png_bytes(plot_balance_space(space)),
            ),
            Picture(
                "fig-05-section",
                "Fig. 5, continued: thrust and torque on level ground",
                "The least thrust and the least share of the servos' torque with which some posture balances.",
                png_bytes(plot_balance_section(space)),
            ),
        ),
    )


def _volumes(spaces: list[BalanceSpace]) -> Table:
    rows = []
    for space in spaces:
        for within_torque in (False, True):
            without = space.volume(with_thrust=False, within_torque=within_torque)
            for with_thrust in (False, True):
                volume = space.volume(with_thrust=with_thrust, within_torque=within_torque)
                reach = (
                    f"{1e3 * space.reach(direction, with_thrust=with_thrust, within_torque=within_torque):.0f}"
                    for direction in DIRECTIONS
                )
                rows.append(
                    (
                        _MODELS[space.settings.thrust_model],
                        "yes" if within_torque else "no",
                        f"up to {space.settings.max_thrust:g} N" if with_thrust else "none",
                        f"{1e3 * volume:.1f}",
                        f"{volume / without:.2f}" if without > 0.0 else "",
                        *reach,
                    )
                )
    headings = (
        "thrust model", "torque limited", "thrust", "volume (litres)", "ratio",
        *(f"{direction} (mm)" for direction in DIRECTIONS),
    )  # fmt: skip
    return Table("balance-space", "Volume and furthest reach on level ground", headings, tuple(rows))


def _shares(spaces: list[BalanceSpace]) -> Table:
    rows = []
    for space in spaces:
        shares = space.torque_share[np.isfinite(space.torque_share)]
        left = (f"{(shares <= share).mean():.1%}" for share in _SHARES)
        rows.append((_MODELS[space.settings.thrust_model], f"{shares.max():.0%}", *left))
    headings = ("thrust model", "largest share that is needed", *(f"at {share:.0%}" for share in _SHARES))
    return Table(
        "balance-space-torque",
        "What is left of the volume with thrust, if the servos had only a share of their torque",
        headings,
        tuple(rows),
    )
