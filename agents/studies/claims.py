"""What the paper says of GAS, GA and GAEx in its section V, measured on its two motions over many seeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from agents.planner import make_planner
from agents.summary import PlanSummary, summarize
from jet_gym.courses import PAPER
from jet_gym.utils.progress import Progress

ClaimKey = Literal[
    "gas-thrust", "pelvis-smoothness", "thrust-smoothness", "gaex-thrust", "gaex-time", "constraints"
]

_PLANNERS = ("gas", "ga", "gaex")
SLIGHTLY = 2.0  # [N] less is "slightly" more thrust, more is "much" more: about a tenth of the fan's 23 N
MUCH_SMOOTHER = 2.0  # from this factor on, shocks have "decreased significantly"


@dataclass(frozen=True)
class Claim:
    """A statement of the paper, or of this package about its plans, and what was measured.

    Attributes:
        key: Which claim it is.
        statement: What is claimed.
        motion: ``"side"`` or ``"forward"``.
        measured: What was measured, in words.
        holds: Whether it holds.
    """

    key: ClaimKey
    statement: str
    motion: str
    measured: str
    holds: bool


@dataclass(frozen=True)
class ClaimsReport:
    """The measurements behind the claims, and the claims.

    Attributes:
        summaries: Figures by motion and planner.
        claims: The claims, motion by motion.
    """

    summaries: dict[str, dict[str, PlanSummary]]
    claims: list[Claim]

    def of(self, key: ClaimKey) -> list[Claim]:
        """Return a claim as measured on each motion.

        Raises:
            KeyError: If it was not measured.
        """
        found = [claim for claim in self.claims if claim.key == key]
        if not found:
            raise KeyError(key)
        return found


def measure_claims(seeds: Sequence[int], progress: Progress | None = None) -> ClaimsReport:
    """Plan both motions with the paper's three planners and hold the claims against the result.

    Args:
        seeds: Seeds of the plans.
        progress: Called with how many of how many plans are done.
    """
    motions = ("side", "forward")
    total, done = len(motions) * len(_PLANNERS) * len(seeds), 0
    summaries: dict[str, dict[str, PlanSummary]] = {}
    for motion in motions:
        summaries[motion] = {}
        for name in _PLANNERS:
            planner, plans = make_planner(name), []
            for seed in seeds:
                plans.append(planner.plan(PAPER[motion], seed=seed))
                done += 1
                if progress is not None:
                    progress(done, total)
            summaries[motion][name] = summarize(plans)
    claims = [claim for motion in motions for claim in _claims_of(motion, summaries[motion])]
    return ClaimsReport(summaries, claims)


def _claims_of(motion: str, by_planner: dict[str, PlanSummary]) -> list[Claim]:
    gas, ga, gaex = (by_planner[name] for name in _PLANNERS)
    thrust = {name: by_planner[name].mean_thrust.mean for name in _PLANNERS}
    times = {name: by_planner[name].milliseconds_per_point.mean for name in _PLANNERS}
    pelvis_ratio = ga.pelvis_roughness.mean / gas.pelvis_roughness.mean
    thrust_ratio = ga.thrust_roughness.mean / gas.thrust_roughness.mean
    violated = sorted(set().union(*(s.violations for s in (gas, ga, gaex))))
    largest = max(s.largest_thrust for s in (gas, ga, gaex))
    return [
        Claim(
            "gas-thrust",
            "GAS needs slightly more thrust than GA",
            motion,
            f"mean {thrust['gas']:.2f} N against {thrust['ga']:.2f} N",
            0.0 < thrust["gas"] - thrust["ga"] < SLIGHTLY,
        ),
        Claim(
            "pelvis-smoothness",
            "the pelvis moves much more smoothly with GAS than with GA",
            motion,
            f"GA is {pelvis_ratio:.1f} times as rough",
            pelvis_ratio >= MUCH_SMOOTHER,
        ),
        Claim(
            "thrust-smoothness",
            "the thrust varies much more smoothly with GAS than with GA",
            motion,
            f"GA is {thrust_ratio:.1f} times as rough",
            thrust_ratio >= MUCH_SMOOTHER,
        ),
        Claim(
            "gaex-thrust",
            "GAEx needs much more thrust than GAS",
            motion,
            f"mean {thrust['gaex']:.2f} N against {thrust['gas']:.2f} N",
            gaex.mean_thrust.low - gas.mean_thrust.high > SLIGHTLY,
        ),
        Claim(
            "gaex-time",
            "GAEx is the fastest of the three",
            motion,
            ", ".join(f"{name} {1e3 * time:.0f} µs" for name, time in times.items()) + " a swing point",
            times["gaex"] < min(times["gas"], times["ga"]),
        ),
        Claim(
            "constraints",
            "no plan exceeds 23 N, breaks a joint limit, leaves the edge polygon or lets the ZMP leave the foot",
            motion,
            f"largest thrust {largest:.2f} N, violated: {', '.join(violated) or 'nothing'}",
            not violated,
        ),
    ]
