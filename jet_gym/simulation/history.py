"""What an execution was like: time series, and their summary."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jet_gym.leg import SIDES, Side
from jet_gym.plan import Plan
from jet_gym.simulation.course import Course
from jet_gym.simulation.diagnosis import Demands, Failure, Summary, summarize
from jet_gym.simulation.measurement import Measurement
from jet_gym.simulation.support import support_margin, zmp_of_feet
from jet_gym.simulation.world import World
from jet_gym.utils.arrays import Array
from jet_gym.utils.files import write_whole

_CARRYING = 0.02  # share of the load above which a foot carries the robot


@dataclass(frozen=True, eq=False)
class Execution:
    """An execution of plans. Each series has N rows, in the world frame and SI units.

    There is a row every ``sample_every`` simulation steps, 60 a second by default.

    Attributes:
        plans: The plans.
        thrust_control: ``"feedforward"`` or ``"pid"``.
        seed: Of the IMU.
        time: Time since the robot had settled (N,) [s].
        phase: Name of the phase (N,), such as ``"motion 1"``.
        plan: Index of the plan whose step is being made (N,); it changes when the support foot does.
        swing_is_left: Whether the left foot is the swing foot (N,).
        joint_targets: What the servos were told (N, 12) [rad].
        joint_positions: Where the joints were (N, 12) [rad].
        joint_torques: Largest magnitude of each servo's torque since the row before (N, 12) [N m].
        thrust_planned: Feed-forward thrust of the swing foot's fan (N,) [N].
        thrust_commanded: What that fan was told (N,) [N]: with the PID's correction, within its limit.
        thrust_delivered: What the left and the right fan delivered (N, 2) [N].
        pelvis: Pelvis origin (N, 3) [m].
        pelvis_orientation: Quaternion x, y, z, w of the pelvis (N, 4).
        tilt: Angle between the pelvis' z axis and the vertical (N,) [rad].
        roll: Rotation of the pelvis about x of the frame that shares its yaw (N,) [rad].
        pitch: Likewise about y (N,) [rad].
        estimated_roll: Roll as the IMU's filter sees it (N,) [rad]; NaN where the thrust does not need it.
        estimated_pitch: Pitch likewise (N,) [rad].
        center_of_mass: Centre of mass (N, 3) [m].
        zmp: Centre of the ground's forces on both feet (N, 2) [m]; NaN without contact.
        zmp_margin: Distance [m] of that point from the edge of the soles that carry the robot, of their convex
            hull if both do (N,); negative outside, NaN without contact. A foot with more than 2 % of the load
            counts, so that a sole that is only grazed does not widen the hull; in a
            :class:`~jet_gym.simulation.Measurement` one that touches does.
        foot_forces: Vertical force of the ground on the left and the right foot (N, 2) [N].
        soles: Where the left and the right sole are (N, 2, 3) [m].
        slip: How far the support sole has slid since it became one (N,) [m].
        summary: What it comes to.
    """

    plans: tuple[Plan, ...] = field(repr=False)
    thrust_control: str
    seed: int
    time: Array = field(repr=False)
    phase: NDArray[np.str_] = field(repr=False)
    plan: NDArray[np.int64] = field(repr=False)
    swing_is_left: NDArray[np.bool_] = field(repr=False)
    joint_targets: Array = field(repr=False)
    joint_positions: Array = field(repr=False)
    joint_torques: Array = field(repr=False)
    thrust_planned: Array = field(repr=False)
    thrust_commanded: Array = field(repr=False)
    thrust_delivered: Array = field(repr=False)
    pelvis: Array = field(repr=False)
    pelvis_orientation: Array = field(repr=False)
    tilt: Array = field(repr=False)
    roll: Array = field(repr=False)
    pitch: Array = field(repr=False)
    estimated_roll: Array = field(repr=False)
    estimated_pitch: Array = field(repr=False)
    center_of_mass: Array = field(repr=False)
    zmp: Array = field(repr=False)
    zmp_margin: Array = field(repr=False)
    foot_forces: Array = field(repr=False)
    soles: Array = field(repr=False)
    slip: Array = field(repr=False)
    summary: Summary

    def columns(self) -> dict[str, Array | NDArray[np.str_]]:
        """Return the series as flat columns (N,) by name, with their units in the names."""
        joints = self.plans[0].step.robot.joint_names
        table: dict[str, Array | NDArray[np.str_]] = {"time_s": self.time, "phase": self.phase}
        table["support"] = np.where(self.swing_is_left, "right", "left")
        for name, unit, values in (
            ("target", "rad", self.joint_targets),
            ("position", "rad", self.joint_positions),
            ("torque", "Nm", self.joint_torques),
        ):
            table |= {f"{joint}_{name}_{unit}": values[:, k] for k, joint in enumerate(joints)}
        table["thrust_planned_N"] = self.thrust_planned
        table["thrust_commanded_N"] = self.thrust_commanded
        for k, side in enumerate(SIDES):
            table[f"{side}_thrust_N"] = self.thrust_delivered[:, k]
            table[f"{side}_foot_force_N"] = self.foot_forces[:, k]
            table |= {f"{side}_sole_{axis}_m": self.soles[:, k, i] for i, axis in enumerate("xyz")}
        for name in ("tilt", "roll", "pitch", "estimated_roll", "estimated_pitch"):
            table[f"{name}_rad"] = getattr(self, name)
        table |= {f"pelvis_{axis}_m": self.pelvis[:, i] for i, axis in enumerate("xyz")}
        table |= {f"pelvis_q{axis}": self.pelvis_orientation[:, i] for i, axis in enumerate("xyzw")}
        table |= {f"com_{axis}_m": self.center_of_mass[:, i] for i, axis in enumerate("xyz")}
        table |= {f"zmp_{axis}_m": self.zmp[:, i] for i, axis in enumerate("xy")}
        table["zmp_margin_m"] = self.zmp_margin
        table["slip_m"] = self.slip
        return table

    def save_csv(self, path: str | Path) -> None:
        """Write the series as a CSV file, whole or not at all; no number where there is none.

        Raises:
            OSError: If the file cannot be written.
        """
        table = self.columns()
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(table)
        for row in zip(*(column.tolist() for column in table.values()), strict=True):
            writer.writerow([_cell(value) for value in row])
        write_whole(path, text.getvalue().encode())


def _cell(value: object) -> str:
    if not isinstance(value, float):
        return str(value)
    return f"{value:.7g}" if math.isfinite(value) else ""


class History:
    """Gathers the rows of an execution.

    Attributes:
        forces: Vertical force of the ground on the left and the right foot now [N].

    Args:
        world: Where it takes place.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._rows: dict[str, list[object]] = {}
        self.forces: tuple[float, float] = (0.0, 0.0)

    def begin(self) -> None:
        """Look at the robot as it has settled."""
        self.forces = self._look()[0]

    def add(
        self, measured: Measurement, phase: str, plan: int, swing: Side, thrust: float, estimated_up: Array | None
    ) -> None:
        """Add a row.

        Args:
            measured: What was measured since the last one.
            phase: Name of the phase.
            plan: Index of the plan.
            swing: The swing leg.
            thrust: Feed-forward thrust [N].
            estimated_up: The vertical (3,) in the pelvis' frame, as the IMU's filter sees it, if one is used.
        """
        world = self._world
        self.forces, centers = self._look()
        loads = np.array(self.forces)
        zmp = zmp_of_feet(loads, centers)
        soles = [world.body.sole(side) for side in SIDES]
        robot = world.robot
        carrying = np.isfinite(centers).all(axis=1) & (loads > _CARRYING * max(sum(self.forces), 1e-9))
        x, y, z = (math.nan,) * 3 if estimated_up is None else estimated_up.tolist()
        row = {
            "time": measured.time,
            "phase": phase,
            "plan": plan,
            "swing_is_left": swing == "left",
            "joint_targets": world.actuators.target,
            "joint_positions": measured.joint_positions,
            "joint_torques": measured.peak_joint_torques,
            "thrust_planned": thrust,
            "thrust_commanded": world.actuators.told,
            "thrust_delivered": [world.actuators.delivered("left"), world.actuators.delivered("right")],
            "pelvis": measured.pelvis,
            "pelvis_orientation": measured.pelvis_orientation,
            "tilt": measured.tilt,
            "roll": measured.roll,
            "pitch": measured.pitch,
            "estimated_roll": math.atan2(y, z),
            "estimated_pitch": math.atan2(-x, math.hypot(y, z)),
            "center_of_mass": measured.center_of_mass,
            "zmp": zmp,
            "zmp_margin": support_margin(
                zmp, [(robot.leg(s), soles[k]) for k, s in enumerate(SIDES) if carrying[k]]
            ),
            "foot_forces": self.forces,
            "soles": [sole.position for sole in soles],
            "slip": measured.support_slip,
        }
        for name, value in row.items():
            self._rows.setdefault(name, []).append(value)

    def execution(
        self, course: Course, thrust_control: str, seed: int, failure: Failure | None, demands: Demands
    ) -> Execution:
        """Return what was gathered.

        Args:
            course: What was executed.
            thrust_control: How the thrust was controlled.
            seed: Of the IMU.
            failure: Why it ended early, if it did.
            demands: What is asked of it.
        """
        series = {name: np.array(values) for name, values in self._rows.items()}
        summary = summarize(course.plans, series, failure, demands)
        return Execution(plans=course.plans, thrust_control=thrust_control, seed=seed, summary=summary, **series)

    def _look(self) -> tuple[tuple[float, float], Array]:
        """Return the feet's forces and the centres of what pushes them (2, 2) [m]."""
        body = self._world.body
        left, right = (body.contact(body.foot(side), body.fan(side)) for side in SIDES)
        return (left.force, right.force), np.array([left.center, right.center])
