"""The same postures by other means: PyBullet's inverse kinematics, and a numerical one with Pinocchio.

Both start every posture from the same guess, both go on until the soles are within a tolerance, and both then
give the joint positions and the centre of mass. Thrust, ZMP and constraints they are spared.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np

from jet_gym.robot import Robot
from jet_gym.utils.arrays import Array

TOLERANCE = 1e-6  # [m] of the sole's position, and [rad]
_MOST_ITERATIONS = 100
# PyBullet's damping pulls towards the guess: with its default a sole ends 10 mm from where it should be.
_BULLET_JOINT_DAMPING = 1e-6
_PIN_DAMPING = 1e-9


class Solver(Protocol):
    """Finds a posture."""

    def solve(self, pelvis: Array, yaw: float) -> tuple[Array, Array]:
        """Return joint positions (12,) [rad] and centre of mass (3,) [m] for a level pelvis.

        Args:
            pelvis: Position of the pelvis origin (3,) [m].
            yaw: Its yaw [rad].
        """


class BulletSolver:
    """``calculateInverseKinematics`` for each leg, then ``getLinkStates`` for the centre of mass.

    Args:
        robot: The robot.
        soles: Where the left and the right sole should be (2, 3) [m].
        guess: Joint positions (12,) [rad] to start from.
    """

    def __init__(self, robot: Robot, soles: Array, guess: Array) -> None:
        import pybullet
        from pybullet_utils.bullet_client import BulletClient

        self._client: Any = BulletClient(pybullet.DIRECT)
        self._body = self._client.loadURDF(str(robot.urdf_path))  # a fixed base would have no mass
        infos = [self._client.getJointInfo(self._body, i) for i in range(self._client.getNumJoints(self._body))]
        joints = {info[1].decode(): info[0] for info in infos}
        links = {info[12].decode(): info[0] for info in infos}
        self._joints = [joints[name] for name in robot.joint_names]
        movable = [info[0] for info in infos if info[2] != pybullet.JOINT_FIXED]
        self._order = [movable.index(joint) for joint in self._joints]
        self._links = list(range(len(infos)))
        self._soles = [(links[leg.sole], sole) for leg, sole in zip(_legs(robot), soles.tolist(), strict=True)]
        dynamics = [self._client.getDynamicsInfo(self._body, link) for link in (-1, *self._links)]
        self._masses = np.array([entry[0] for entry in dynamics])
        self._base_inertial = np.array(dynamics[0][3])  # PyBullet places a base by its centre of mass
        self._damping = [_BULLET_JOINT_DAMPING] * len(movable)
        self._guess = [[angle] for angle in guess.tolist()]

    def solve(self, pelvis: Array, yaw: float) -> tuple[Array, Array]:
        """Return joint positions and centre of mass; see :class:`Solver`."""
        client, body = self._client, self._body
        cos, sin = math.cos(yaw), math.sin(yaw)
        x, y, z = self._base_inertial
        base = pelvis + np.array([cos * x - sin * y, sin * x + cos * y, z])
        client.resetBasePositionAndOrientation(body, base, (0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)))
        client.resetJointStatesMultiDof(body, self._joints, self._guess)
        legs = [
            client.calculateInverseKinematics(
                body,
                link,
                sole,
                (0.0, 0.0, 0.0, 1.0),
                jointDamping=self._damping,
                maxNumIterations=_MOST_ITERATIONS,
                residualThreshold=TOLERANCE,
            )
            for link, sole in self._soles
        ]
        angles = [legs[joint // 6][place] for joint, place in enumerate(self._order)]
        client.resetJointStatesMultiDof(body, self._joints, [[angle] for angle in angles])
        states = client.getLinkStates(body, self._links, computeForwardKinematics=True)
        centers = np.array([base, *(state[0] for state in states)])
        return np.array(angles), self._masses @ centers / self._masses.sum()


class PinSolver:
    """Damped least squares on both legs at once, with Pinocchio's Jacobians and centre of mass.

    Args:
        robot: The robot.
        soles: Where the left and the right sole should be (2, 3) [m].
        guess: Joint positions (12,) [rad] to start from.
    """

    def __init__(self, robot: Robot, soles: Array, guess: Array) -> None:
        import pinocchio

        self._pin: Any = pinocchio
        self._model = pinocchio.buildModelFromUrdf(str(robot.urdf_path), pinocchio.JointModelFreeFlyer())
        self._data = self._model.createData()
        joints = [self._model.joints[self._model.getJointId(name)] for name in robot.joint_names]
        self._positions = np.array([joint.idx_q for joint in joints])
        columns = np.array([joint.idx_v for joint in joints])
        self._feet = [
            (self._model.getFrameId(leg.sole), pinocchio.SE3(np.eye(3), sole), own_columns)
            for leg, sole, own_columns in zip(_legs(robot), soles, columns.reshape(2, 6), strict=True)
        ]
        self._start = pinocchio.neutral(self._model)
        self._start[self._positions] = guess

    def solve(self, pelvis: Array, yaw: float) -> tuple[Array, Array]:
        """Return joint positions and centre of mass; see :class:`Solver`."""
        pin, model, data, configuration = self._pin, self._model, self._data, self._start.copy()
        configuration[:3] = pelvis
        configuration[3:7] = 0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)
        errors, jacobians, damping = np.empty((2, 6)), np.empty((2, 6, 6)), _PIN_DAMPING * np.eye(6)
        for _ in range(_MOST_ITERATIONS):
            pin.computeJointJacobians(model, data, configuration)
            for side, (frame, target, _) in enumerate(self._feet):
                errors[side] = pin.log6(pin.updateFramePlacement(model, data, frame).actInv(target)).vector
            if np.abs(errors).max() < TOLERANCE:
                break
            for side, (frame, _, columns) in enumerate(self._feet):
                jacobians[side] = pin.getFrameJacobian(model, data, frame, pin.LOCAL)[:, columns]
            transposed = jacobians.transpose(0, 2, 1)
            steps = transposed @ np.linalg.solve(jacobians @ transposed + damping, errors[:, :, None])
            configuration[self._positions] += steps.ravel()
        return configuration[self._positions], pin.centerOfMass(model, data, configuration).copy()

    def place(self, pelvis: Array, yaw: float, joint_positions: Array) -> tuple[Array, Array]:
        """Return both soles (2, 3) [m] and the centre of mass (3,) [m] of a posture given by its joints."""
        pin, model, data, configuration = self._pin, self._model, self._data, self._start.copy()
        configuration[:3] = pelvis
        configuration[3:7] = 0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)
        configuration[self._positions] = joint_positions
        pin.framesForwardKinematics(model, data, configuration)
        soles = np.array([data.oMf[frame].translation for frame, _, _ in self._feet])
        return soles, pin.centerOfMass(model, data, configuration).copy()


def _legs(robot: Robot) -> tuple[Any, Any]:
    return robot.names.left, robot.names.right
