"""Section IV-B: GAS, GA and GAEx on the two motions, Tables 2 and 3 and Figs. 6 to 9."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agents.genetic import INITIAL_PHASE, GeneticSettings
from agents.planner import make_planner
from agents.studies.claims import SLIGHTLY, ClaimsReport, measure_claims
from agents.studies.sweep import sweep_smoothness
from agents.summary import PlanSummary, summarize
from jet_gym.arrays import Array
from jet_gym.balance_space import least_thrust_of_step
from jet_gym.courses import DITCH_SPAN, PAPER
from jet_gym.figures import plot_locomotion, plot_smoothness_sweep, plot_trajectories, png_bytes
from jet_gym.fitness import FitnessSettings
from jet_gym.joint_torques import static_torques
from jet_gym.plan import Plan
from jet_gym.posture import evaluate_postures
from jet_gym.progress import Progress
from jet_gym.reproduction.model import (
    Chapter,
    Claim,
    Picture,
    Settings,
    Table,
    listed,
    verdict,
    with_interval,
)  # fmt: skip
from jet_gym.step import Step

PLANNERS = ("gas", "ga", "gaex")
_NAMES = {"gas": "GAS", "ga": "GA", "gaex": "GAEx", "optimal": "optimum"}
_MOTIONS = {"side": "to the side", "forward": "forward across the ditch"}


def planning_chapter(settings: Settings, report: Progress) -> Chapter:
    """Plan both motions with the paper's planners and hold its claims against the plans."""
    plans = {
        motion: [make_planner(name).plan(PAPER[motion], seed=settings.seed) for name in PLANNERS]
        for motion in _MOTIONS
    }
    result = measure_claims(settings.seeds(settings.plans), progress=report)
    optima = {motion: _optimum(PAPER[motion]) for motion in _MOTIONS}
    least = {
        motion: least_thrust_of_step(PAPER[motion], resolution=1e-3 * settings.thrust_resolution)
        for motion in _MOTIONS
    }
    return Chapter(
        "planning",
        "Comparison of posture optimisation",
        (
            "GAS is the paper's method; GA leaves out the smoothness term f3; GAEx searches a cube of 12 mm by 1 "
            "mm for a posture that satisfies the constraints. The paper gives neither the landing points nor the "
            f"number of swing points: here they are {PAPER.side.points} and {PAPER.forward.points}, about 5 mm "
            "apart. Roughness is the root mean square second difference along the step.",
            f"Trajectories and locomotion are those of seed {settings.seed}; tables and verdicts are means over "
            f"{settings.plans} seeds, with 95 % bootstrap intervals. The optimum, which the paper does not have, "
            "is the least total fitness of a whole step that this package knows to find.",
        ),
        claims=(
            _inside_claim(least, settings.thrust_resolution),
            *_claims(result, least, settings.thrust_resolution),
            _balance_claim(result),
            _continuity_claim(plans),
            *_ditch_claims(result, plans),
        ),
        tables=(_parameters(), *(_comparison(motion, result, optima[motion]) for motion in _MOTIONS)),
        pictures=tuple(_pictures(plans)),
    )


def smoothness_chapter(settings: Settings, report: Progress) -> Chapter:
    """Show how the unit of omega was settled."""
    rows = sweep_smoothness(settings.seeds(settings.study_plans), progress=report)
    return Chapter(
        "smoothness",
        "The smoothness weight",
        (
            "The paper prints omega = 50 and no unit. Per m² it does nothing, per mm² it freezes the pelvis; per "
            "cm² it trades thrust against smoothness, and that is what is taken.",
        ),
        pictures=(
            Picture(
                "smoothness-weight",
                "What the smoothness weight does",
                "Thrust and roughness of GAS over the smoothness weight, with GA beside it.",
                png_bytes(plot_smoothness_sweep(rows)),
            ),
        ),
    )


def _optimum(step: Step) -> PlanSummary:
    planner = make_planner("optimal")
    planner.plan(replace(step, points=4))  # compiles, so that no point waits for it
    return summarize([planner.plan(step)])


def _inside_claim(least: dict[str, Array], resolution: float) -> Claim:
    balanced = [f"{np.isfinite(thrusts).sum()} of {len(thrusts)} {motion}" for motion, thrusts in least.items()]
    return Claim(
        "IV-B",
        "The trajectories of the swing foot were required to be inside the balance space.",
        f"Swing points at which some posture balances, on a grid of {resolution:g} mm: {listed(balanced)}.",
        verdict(all(np.isfinite(thrusts).all() for thrusts in least.values())),
    )


def _continuity_claim(plans: dict[str, list[Plan]]) -> Claim:
    measured, smoother = [], True
    for motion, (gas, ga, _) in plans.items():
        jumps = [(1e3 * _largest_jump(plan.pelvis), _largest_jump(plan.thrust[:, None])) for plan in (gas, ga)]
        smoother &= jumps[0][0] < jumps[1][0] and jumps[0][1] < jumps[1][1]
        of_gas, of_ga = (f"{pelvis:.1f} mm and {thrust:.2f} N" for pelvis, thrust in jumps)
        measured.append(f"{motion} {of_gas}, GA {of_ga}")
    return Claim(
        "abstract",
        "The significant advantage of the method is the continuity and smoothness of the thrust and pelvis "
        "trajectories.",
        f"Largest change from one swing point to the next: {'; '.join(measured)}.",
        verdict(smoother),
    )


def _largest_jump(trajectory: Array) -> float:
    return float(np.linalg.norm(np.diff(trajectory, axis=0), axis=1).max())


def _claims(result: ClaimsReport, least: dict[str, Array], resolution: float) -> list[Claim]:
    """Return the claims about the planners, each over both motions."""
    claims = [
        _joined(result, "GAS needs slightly more thrust than GA", "V",
                "Compared with the GA, the thrust generated by GAS was slightly higher."),
        _joined(result, "the pelvis moves much more smoothly with GAS than with GA", "V, Figs. 7(a) and 9(a)",
                "The shocks of the trajectory decreased significantly: the pelvis."),
        _joined(result, "the thrust varies much more smoothly with GAS than with GA", "V, Figs. 7(b) and 9(b)",
                "The shocks of the trajectory decreased significantly: the thrust."),
        _joined(result, "GAEx needs much more thrust than GAS", "V",
                "The thrust cannot be effectively optimised by GAEx and was much higher than in the proposed "
                "method."),
    ]  # fmt: skip
    measured, near = [], True
    for motion, thrusts in least.items():
        of_gas = result.summaries[motion]["gas"].mean_thrust.mean
        measured.append(f"{motion} {np.nanmean(thrusts):.2f} N on average, GAS {of_gas:.2f} N")
        near &= of_gas - float(np.nanmean(thrusts)) < SLIGHTLY
    claims.insert(
        0,
        Claim(
            "abstract, V",
            "GAS can effectively minimise the thrust by optimising the robot's posture.",
            f"With the least thrust of any posture, by exhaustion over the pelvis on a grid of {resolution:g} mm: "
            f"{listed(measured)}. Less than {SLIGHTLY:g} N more counts as effective.",
            verdict(near),
        ),
    )
    return claims


def _balance_claim(result: ClaimsReport) -> Claim:
    measured, better = [], True
    for motion, summaries in result.summaries.items():
        gas, *others = (summaries[name].total_fitness for name in PLANNERS)
        better &= all(gas.high < other.low for other in others)
        fitness = ", ".join(f"{_NAMES[name]} {summaries[name].total_fitness.mean:.0f}" for name in PLANNERS)
        measured.append(f"{motion}: {fitness}")
    return Claim(
        "V",
        "The proposed method can obtain a better balance between the minimised needed thrust and the locomotion "
        "smoothness.",
        f"Total fitness, eq. (15), which weighs both; less is better. {'; '.join(measured)}.",
        verdict(better),
    )


def _joined(result: ClaimsReport, statement: str, where: str, words: str) -> Claim:
    of_motions = [claim for claim in result.claims if claim.statement == statement]
    measured = "; ".join(f"{claim.motion}: {claim.measured}" for claim in of_motions)
    holding = [claim.motion for claim in of_motions if claim.holds]
    if 0 < len(holding) < len(of_motions):
        measured += f". It holds on the step {listed([_MOTIONS[motion] for motion in holding])} alone"
    return Claim(where, words, measured, verdict(len(holding) == len(of_motions)))


def _ditch_claims(result: ClaimsReport, plans: dict[str, list[Plan]]) -> list[Claim]:
    """Return the claims about what the robot can do, as far as plans show it."""
    robot = PAPER.forward.robot
    side, forward = (result.summaries[motion]["gas"] for motion in ("side", "forward"))
    broken = sorted(side.violations | forward.violations)
    largest = max(side.largest_thrust, forward.largest_thrust)
    share = DITCH_SPAN / robot.leg_length
    roll = [name for name in robot.joint_names if "roll" in name]
    torques = {name: _peak_torque(plans, name) for name in roll}
    heaviest = max(torques, key=lambda name: torques[name])
    servo = next(servo for servo in robot.servos if servo.joint == heaviest)
    return [
        Claim(
            "abstract, V",
            "By keeping a quasistatic balance, the robot could step over a ditch with a span of 450 mm (as much as "
            "97 % of the length of the robot's leg).",
            f"{1e3 * DITCH_SPAN:.0f} mm are {100.0 * share:.1f} % of a leg of {1e3 * robot.leg_length:.0f} mm. GAS "
            f"plans it with at most {largest:.2f} N of the fan's {robot.max_thrust:g} N; constraints that any of "
            f"its plans violates at any swing point: {', '.join(broken) or 'none'}.",
            verdict(not broken and largest <= robot.max_thrust),
        ),
        Claim(
            "abstract",
            "The method enables the landing point of the swing foot to be not only in the forward but also in a "
            "side direction.",
            f"Motion 1 lands {1e3 * (PAPER.side.landing[1] - PAPER.side.start[1]):.0f} mm to the side with a peak "
            f"of {side.peak_thrust.mean:.1f} N, violating {', '.join(sorted(side.violations)) or 'nothing'}.",
            verdict(not side.violations),
        ),
        Claim(
            "II",
            "The gear mechanism was installed in the hip and ankle roll joints to improve the robot's ability to "
            "step over a ditch in 3D stepping.",
            f"In GAS's plans, standing still, the {heaviest.replace('_', ' ')} holds {torques[heaviest]:.1f} N m "
            f"at most; {servo.count} servo{'s' * (servo.count > 1)} without the gear have "
            f"{servo.count * servo.torque:.1f} N m, with it {servo.count * servo.torque * servo.gear_ratio:.1f} N "
            "m.",
            verdict(torques[heaviest] > servo.count * servo.torque),
        ),
    ]


def _peak_torque(plans: dict[str, list[Plan]], joint: str) -> float:
    """Return the largest static torque [N m] of a joint in GAS's plans."""
    peak = 0.0
    for of_motion in plans.values():
        plan = of_motion[0]
        step, robot = plan.step, plan.step.robot
        postures = evaluate_postures(robot, step.swing, plan.swing_sole, step.support, plan.pelvis)
        torques = np.abs(static_torques(robot, step.swing, postures))
        peak = max(peak, float(torques[:, robot.joint_names.index(joint)].max()))
    return peak


def _parameters() -> Table:
    rows = []
    for name, paper, ours in (
        ("Table 2, initial phase", ("200", "50", "±150", "0.5", "0.01"), INITIAL_PHASE),
        ("Table 3, later phase", ("150", "8", "±25", "0.5", "0.01"), GeneticSettings()),
    ):
        here = (
            f"{ours.population}", f"{ours.generations}", f"±{1e3 * ours.half_range:g}", f"{ours.crossover:g}",
            f"{ours.mutation:g}",
        )  # fmt: skip
        rows += [(name, "paper", *paper), (name, "here", *here)]
    fitness = FitnessSettings()
    return Table(
        "tables-2-and-3-search",
        "Tables 2 and 3: parameters of the genetic search",
        ("", "", "population", "generations", "range (mm)", "crossover", "mutation"),
        tuple(rows),
        f"Penalties C1 {fitness.joint_limit_penalty:g}, C2 {fitness.edge_penalty:g}, C4-1 "
        f"{fitness.thrust_penalty:g}, weights C4-2 {fitness.thrust_weight:g} per N and omega "
        f"{fitness.smoothness_weight / 1e4:g} per cm².",
    )


def _comparison(motion: str, result: ClaimsReport, optimum: PlanSummary) -> Table:
    rows = tuple(_summary_row(summary) for summary in (*result.summaries[motion].values(), optimum))
    headings = (
        "planner", "mean thrust (N)", "peak thrust (N)", "pelvis roughness (mm)", "thrust roughness (N)",
        "total fitness", "violated points", "a point takes (µs)",
    )  # fmt: skip
    return Table(f"planners-{motion}", f"Planners on the step {_MOTIONS[motion]}", headings, rows)


def _summary_row(s: PlanSummary) -> tuple[str, ...]:
    return (
        _NAMES[s.planner],
        with_interval(s.mean_thrust, 2),
        with_interval(s.peak_thrust, 2),
        with_interval(s.pelvis_roughness, 2, 1e3),
        with_interval(s.thrust_roughness, 3),
        with_interval(s.total_fitness, 0),
        with_interval(s.violated_points, 1),
        with_interval(s.milliseconds_per_point, 0, 1e3),
    )


def _pictures(plans: dict[str, list[Plan]]) -> list[Picture]:
    pictures = []
    for motion, (locomotion, trajectories) in {"side": (6, 7), "forward": (8, 9)}.items():
        steps = f"stepping {_MOTIONS[motion]}"
        pictures += [
            Picture(
                f"fig-{locomotion:02d}-locomotion-{motion}",
                f"Fig. {locomotion}: locomotion {steps}",
                "The robot at several swing points of GAS's plan, in stereo view and from above.",
                png_bytes(plot_locomotion(plans[motion][0])),
            ),
            Picture(
                f"fig-{trajectories:02d}-trajectories-{motion}",
                f"Fig. {trajectories}: trajectories {steps}",
                "Pelvis and thrust of GAS, GA and GAEx over the swing points.",
                png_bytes(plot_trajectories(plans[motion])),
            ),
        ]
    return pictures
