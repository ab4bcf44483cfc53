"""The robot inside PyBullet: its indices, its state, its motors and its fans."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from jet_gym.errors import RobotError
from jet_gym.leg import SIDES, LegNames, Side, Vector
from jet_gym.robot import Robot
from jet_gym.simulation import rotation
from jet_gym.simulation.rotation import Quaternion
from jet_gym.simulation.settings import SimulationSettings
from jet_gym.utils.arrays import Array


class Pose(NamedTuple):
    """A frame in the world."""

    position: Array  # (3,) [m]
    quaternion: Quaternion  # x, y, z, w

    @property
    def axes(self) -> Array:
        """The frame's axes as the columns of a matrix (3, 3)."""
        return rotation.matrix(self.quaternion)

    def point(self, local: ArrayLike) -> Array:
        """Return a point (3,) [m] of the frame in the world."""
        moved: Array = self.position + self.axes @ np.asarray(local)
        return moved


class PelvisState(NamedTuple):
    """The pelvis in the world."""

    pose: Pose
    velocity: Array  # (3,) [m/s] of its origin
    angular_velocity: Array  # (3,) [rad/s]


class Contact(NamedTuple):
    """What the ground does to a foot."""

    touching: bool
    force: float  # [N] vertical
    center: Array  # (2,) [m] centre of the normal forces, NaN without contact


class RobotBody:
    """A robot loaded into a physics server. Twelve-vectors are in the order of ``robot.joint_names``.

    Attributes:
        robot: The robot.
        id: PyBullet body.

    Args:
        client: The physics server.
        robot: The robot.
        visible: Whether to load what only serves to be seen.

    Raises:
        RobotError: If PyBullet cannot load the robot, such as for want of a mesh.
    """

    def __init__(self, client: Any, robot: Robot, visible: bool) -> None:
        self._client = client
        self.robot = robot
        # Not URDF_MERGE_FIXED_LINKS: it forgets where the merged links' centres of mass are.
        flags = client.URDF_USE_INERTIA_FROM_FILE | (0 if visible else client.URDF_IGNORE_VISUAL_SHAPES)
        try:
            self.id: int = client.loadURDF(str(robot.urdf_path), basePosition=(0.0, 0.0, 10.0), flags=flags)
        except client.error as error:
            raise RobotError(
                f"PyBullet cannot load {robot.urdf_path}; the meshes that it names must lie where it says"
            ) from error
        infos = [client.getJointInfo(self.id, index) for index in range(client.getNumJoints(self.id))]
        joints = {info[1].decode(): info[0] for info in infos}
        self._links: dict[str, int] = {info[12].decode(): info[0] for info in infos}
        self._joints = [joints[name] for name in robot.joint_names]
        self._parents = {info[0]: info[16] for info in infos}
        self._inertial = {link: self._inertial_frame(link) for link in (-1, *self._links.values())}
        self._thrusters = {side: self._thruster(side) for side in SIDES}
        self._effort = [float(value) for value in robot.effort]
        self._imu = self._place_of_imu()

    def link(self, name: str) -> int:
        """Return the index of a link."""
        return self._links[name]

    def leg(self, side: Side) -> list[int]:
        """Return the indices of a leg's links, from the hip down."""
        links = [self._joints[0 if side == "left" else 6]]  # a link has the index of the joint that moves it
        for link, parent in sorted(self._parents.items()):
            if parent in links:
                links.append(link)
        return links

    def leg_parts(self, side: Side) -> list[list[int]]:
        """Return the links that each of a leg's six joints moves up to the next one, from the hip down."""
        joints = self._joints[:6] if side == "left" else self._joints[6:]
        parts: dict[int, list[int]] = {joint: [] for joint in joints}
        part_of = {joint: joint for joint in joints}
        for link, parent in sorted(self._parents.items()):
            if link in part_of or parent in part_of:
                part_of.setdefault(link, part_of.get(parent, link))
                parts[part_of[link]].append(link)
        return list(parts.values())

    def foot(self, side: Side) -> int:
        """Return the index of the link that carries a sole."""
        parent: int = self._parents[self._links[self._names(side).sole]]
        return parent

    def fan(self, side: Side) -> int:
        """Return the index of the link where a fan pushes."""
        return self._links[self._names(side).fan]

    def set_up(self, settings: SimulationSettings) -> None:
        """Set friction, damping and the speed limits of the servos."""
        client = self._client
        self.set_contacts(settings, settings.sole_friction, settings.contact_stiffness)
        for joint, speed in zip(self._joints, self.robot.velocity.tolist(), strict=True):
            # A motor keeps this limit; the calls for many motors at once cannot set it.
            client.setJointMotorControl2(self.id, joint, client.POSITION_CONTROL, 0.0, maxVelocity=speed)
        self._position_gains = [settings.position_gain] * 12
        self._velocity_gains = [settings.velocity_gain] * 12

    def set_contacts(self, settings: SimulationSettings, friction: float, stiffness: float) -> None:
        """Set what the robot's links are like to touch.

        Args:
            settings: Damping and the rest.
            friction: Coulomb friction [1].
            stiffness: Stiffness of a contact point [N/m].
        """
        for link in (-1, *self._links.values()):
            self._client.changeDynamics(
                self.id,
                link,
                lateralFriction=friction,
                spinningFriction=settings.spinning_friction,
                rollingFriction=settings.rolling_friction,
                contactStiffness=stiffness,
                contactDamping=settings.contact_damping,
                restitution=settings.restitution,
                frictionAnchor=1,  # else the solver's residual lets a standing robot creep by 0.4 mm/s
                linearDamping=0.0,
                angularDamping=0.0,
                jointDamping=0.0,
            )

    def place(self, joint_positions: Array, pelvis: Pose) -> None:
        """Put the robot somewhere, at rest.

        Args:
            joint_positions: Joint positions (12,) [rad].
            pelvis: Pose of the pelvis.
        """
        client = self._client
        inertial = self._inertial[-1]
        orientation = rotation.product(pelvis.quaternion, inertial.quaternion)
        client.resetBasePositionAndOrientation(self.id, pelvis.point(inertial.position).tolist(), orientation)
        client.resetBaseVelocity(self.id, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        for joint, value in zip(self._joints, joint_positions.tolist(), strict=True):
            client.resetJointState(self.id, joint, value, 0.0)

    def drive(self, positions: list[float], velocities: list[float]) -> None:
        """Tell the servos where to be and how fast to move after the next simulation step."""
        self._client.setJointMotorControlArray(
            self.id,
            self._joints,
            self._client.POSITION_CONTROL,
            targetPositions=positions,
            targetVelocities=velocities,
            forces=self._effort,
            positionGains=self._position_gains,
            velocityGains=self._velocity_gains,
        )

    def blow(self, side: Side, thrust: float) -> None:
        """Let a fan push along the z axis of its frame during the next simulation step."""
        link, (x, y, z), place = self._thrusters[side]
        force = (x * thrust, y * thrust, z * thrust)
        self._client.applyExternalForce(self.id, link, force, place, self._client.LINK_FRAME)

    def joints(self) -> tuple[list[float], list[float], list[float]]:
        """Return the joints' positions [rad], velocities [rad/s] and motor torques [N m]."""
        positions, velocities, _, torques = zip(*self._client.getJointStates(self.id, self._joints), strict=True)
        return list(positions), list(velocities), list(torques)

    def torques(self) -> list[float]:
        """Return the torques of the motors over the last simulation step [N m]."""
        return [state[3] for state in self._client.getJointStates(self.id, self._joints)]

    def pelvis(self) -> PelvisState:
        """Return position, axes and velocities of the pelvis."""
        position, orientation = self._client.getBasePositionAndOrientation(self.id)
        pose = self._link_frame(-1, position, orientation)
        linear, angular = self._client.getBaseVelocity(self.id)
        turning = rotation.cross(angular, (pose.position - position).tolist())
        return PelvisState(pose, np.add(linear, turning), np.array(angular))

    def imu_motion(self) -> tuple[Array, Array, Array]:
        """Return the axes (3, 3) of the pelvis, along which the IMU measures, and the IMU's velocities.

        The velocities are that of its origin (3,) [m/s] and the angular one (3,) [rad/s], both in the world.
        """
        pelvis = self.pelvis()
        axes = pelvis.pose.axes
        turning = rotation.cross(pelvis.angular_velocity.tolist(), (axes @ self._imu).tolist())
        return axes, pelvis.velocity + turning, pelvis.angular_velocity

    def frame(self, name: str) -> Pose:
        """Return the pose of a link's frame."""
        link = self._links[name]
        # The state's own link frame went through single precision.
        position, orientation = self._client.getLinkState(self.id, link, computeForwardKinematics=1)[:2]
        return self._link_frame(link, position, orientation)

    def sole(self, side: Side) -> Pose:
        """Return the pose of a sole frame."""
        return self.frame(self._names(side).sole)

    def fan_pose(self, side: Side) -> Pose:
        """Return the pose of a fan's frame, along whose z axis it pushes."""
        return self.frame(self._names(side).fan)

    def contact(self, *links: int) -> Contact:
        """Return what anything does to some links."""
        points = [p for link in links for p in self._client.getContactPoints(bodyA=self.id, linkIndexA=link)]
        total = force = x = y = 0.0
        for point in points:
            normal_force = point[9]
            total += normal_force
            x += normal_force * point[6][0]
            y += normal_force * point[6][1]
            force += normal_force * point[7][2] + point[10] * point[11][2] + point[12] * point[13][2]
        center = (x / total, y / total) if total > 0.0 else (math.nan, math.nan)
        return Contact(total > 0.0, force, np.array(center))

    def _place_of_imu(self) -> Array:
        """Return where the IMU is (3,) [m] in the pelvis' frame; at its origin if the robot has none."""
        if self.robot.names.imu not in self._links:
            return np.zeros(3)
        pelvis = self.pelvis().pose
        return np.asarray((self.frame(self.robot.names.imu).position - pelvis.position) @ pelvis.axes)

    def _names(self, side: Side) -> LegNames:
        return self.robot.names.left if side == "left" else self.robot.names.right

    def _thruster(self, side: Side) -> tuple[int, Vector, Vector]:
        """Return a fan's link, and axis and origin of its frame in what PyBullet takes for the link's frame.

        That is the frame of the link's inertia.
        """
        inertial = self._inertial[self.fan(side)]
        axis, origin = inertial.axes[2].tolist(), (-inertial.position @ inertial.axes).tolist()
        return self.fan(side), tuple(axis), tuple(origin)

    def _inertial_frame(self, link: int) -> Pose:
        """Return a link's frame of inertia in the link's own frame."""
        info = self._client.getDynamicsInfo(self.id, link)
        return Pose(np.array(info[3]), info[4])

    def _link_frame(self, link: int, position: Vector, orientation: Quaternion) -> Pose:
        """Return a link's frame from that of its inertia."""
        inertial = self._inertial[link]
        quaternion = rotation.product(orientation, rotation.inverse(inertial.quaternion))
        return Pose(np.array(position) - rotation.matrix(quaternion) @ inertial.position, quaternion)
