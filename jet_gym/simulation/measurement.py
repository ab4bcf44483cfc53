"""What is measured while the robot moves."""

from __future__ import annotations

from dataclasses import dataclass

from jet_gym.utils.arrays import Array


@dataclass(frozen=True, eq=False)
class Measurement:
    """What happened over one interval of simulation. World frame unless stated.

    "At the end" means after the interval's last simulation step; means and extremes are over the interval.

    Attributes:
        time: Simulated time since the reset, at the end [s].
        thrust: Thrust that the swing foot's fan delivers at the end [N].
        mean_thrust: Mean of it [N].
        zmp: Zero-moment point of the support foot, the centre of its contact forces, at the end (2,) [m]; NaN
            without contact.
        support_sole_margin: Least distance from that point to the edge of the support sole [m]; NaN without
            contact.
        zmp_margin: Least distance [m] from the centre of the ground's forces on both feet to the edge of the soles
            that carry the robot, of their convex hull where both do; NaN without contact. A foot that touches
            counts, however little it carries; in an :class:`~jet_gym.simulation.Execution` it takes 2 % of the
            load, so that a sole that is only grazed does not widen the hull there.
        support_contact: Whether the support foot is in contact at the end.
        swing_contact: Whether the swing foot or its fan is.
        support_force: Mean vertical force of the ground on the support foot [N].
        swing_force: Mean vertical force of the ground on the swing foot and its fan [N].
        support_slip: How far the support sole has slid from where the step began, at the end [m].
        support_lift: How high the support sole's origin is over its carton at the end [m]; negative where the
            contact yields.
        tilt: Angle between the pelvis' z axis and the vertical at the end [rad].
        peak_tilt: Largest tilt [rad].
        roll: Rotation of the pelvis about x of the frame that shares its yaw, at the end [rad].
        pitch: Likewise about y [rad].
        pelvis: Position of the pelvis origin at the end (3,) [m].
        pelvis_orientation: Quaternion x, y, z, w of the pelvis at the end (4,).
        pelvis_velocity: Velocity of the pelvis origin at the end (3,) [m/s].
        pelvis_angular_velocity: Angular velocity of the pelvis at the end (3,) [rad/s].
        joint_positions: Joint positions at the end (12,) [rad].
        joint_velocities: Joint velocities at the end (12,) [rad/s].
        joint_torques: Torques of the servos at the end (12,) [N m].
        peak_joint_torques: Their largest magnitudes (12,) [N m].
        center_of_mass: Centre of mass at the end (3,) [m].
        reason: Why the robot counts as fallen; empty while it stands.
    """

    time: float
    thrust: float
    mean_thrust: float
    zmp: Array
    support_sole_margin: float
    zmp_margin: float
    support_contact: bool
    swing_contact: bool
    support_force: float
    swing_force: float
    support_slip: float
    support_lift: float
    tilt: float
    peak_tilt: float
    roll: float
    pitch: float
    pelvis: Array
    pelvis_orientation: Array
    pelvis_velocity: Array
    pelvis_angular_velocity: Array
    joint_positions: Array
    joint_velocities: Array
    joint_torques: Array
    peak_joint_torques: Array
    center_of_mass: Array
    reason: str = ""

    @property
    def fallen(self) -> bool:
        """Whether the robot fell."""
        return bool(self.reason)
