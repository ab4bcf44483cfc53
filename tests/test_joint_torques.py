"""Static joint torques against pinocchio's inverse dynamics, and against the work of the forces."""

from __future__ import annotations

import importlib
from typing import Any, Literal

import numpy as np
import pytest

from jet_gym import Robot
from jet_gym.balance import GRAVITY
from jet_gym.courses import PAPER
from jet_gym.joint_torques import static_torques
from jet_gym.kinematics import forward_kinematics
from jet_gym.leg import opposite
from jet_gym.posture import Postures, evaluate_postures
from jet_gym.utils.arrays import Array


def _postures(robot: Robot, swing: Literal["left", "right"], rng: np.random.Generator, count: int) -> Postures:
    """Return postures in reach, over both of the paper's steps or their mirror images."""
    mirror = np.array([1.0, 1.0 if swing == "left" else -1.0, 1.0])
    soles = np.concatenate([PAPER.side.swing_sole, PAPER.forward.swing_sole * (1.0, -1.0, 1.0)])
    soles[len(PAPER.side.swing_sole) :, 1] += 0.34 - 0.1125
    chosen = soles[rng.integers(len(soles), size=50 * count)]
    pelvis = np.array([0.0, -0.02, 0.4]) + rng.uniform(-0.15, 0.15, (50 * count, 3)) + 0.25 * chosen
    postures = evaluate_postures(robot, swing, chosen * mirror, (0.0, -0.1125, 0.0) * mirror, pelvis * mirror)
    kept = np.flatnonzero((postures.out_of_reach == 0.0) & (np.abs(postures.thrust) < 40.0))[:count]
    assert len(kept) == count
    return Postures(**{name: values[kept] for name, values in vars(postures).items()})


def _inverse_dynamics(oracle: Any, swing: str, postures: Postures, index: int) -> tuple[Array, Array]:
    """Return pinocchio's joint torques (12,) and what force and moment are left over at the pelvis (6,)."""
    pin = importlib.import_module("pinocchio")
    model, data = oracle.model, oracle.data
    q = pin.neutral(model)
    yaw = postures.pelvis_yaw[index]
    q[:3] = postures.pelvis[index]
    q[3:7] = 0.0, 0.0, np.sin(0.5 * yaw), np.cos(0.5 * yaw)
    for name, angle in zip(oracle.joint_names, postures.joint_positions[index], strict=True):
        q[model.joints[model.getJointId(name)].idx_q] = angle
    pin.forwardKinematics(model, data, q)
    mass = sum(inertia.mass for inertia in model.inertias)
    thrust = postures.thrust[index]
    ground = np.array([*postures.zmp[index], 0.0])
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
    forces = pin.StdVec_Force()
    for _ in range(model.njoints):
        forces.append(pin.Force.Zero())
    other = opposite(swing)
    for side, up, place in ((swing, thrust, postures.fan[index]), (other, mass * GRAVITY - thrust, ground)):
        joint = model.getJointId(f"{side}_ankle_roll")
        push = np.array([0.0, 0.0, up])
        in_world = pin.Force(push, np.cross(place, push))
        forces[joint] = data.oMi[joint].actInv(in_world)
    torques = pin.rnea(model, data, q, np.zeros(model.nv), np.zeros(model.nv), forces)
    joints = [model.joints[model.getJointId(name)].idx_v for name in oracle.joint_names]
    return torques[joints].copy(), torques[:6].copy()


@pytest.mark.parametrize("swing", ["left", "right"])
def test_torques_are_those_of_inverse_dynamics_and_leave_nothing_at_the_pelvis(
    swing: Literal["left", "right"], robot: Robot, pinocchio_robot: Any, rng: np.random.Generator
) -> None:
    postures = _postures(robot, swing, rng, 60)
    torques = static_torques(robot, swing, postures)
    assert np.abs(torques).max() > 5.0
    for index in range(len(torques)):
        expected, left_over = _inverse_dynamics(pinocchio_robot, swing, postures, index)
        np.testing.assert_allclose(torques[index], expected, atol=1e-9)
        np.testing.assert_allclose(left_over, 0.0, atol=1e-9)


def test_torques_do_the_work_of_the_forces(robot: Robot, rng: np.random.Generator) -> None:
    postures = _postures(robot, "left", rng, 10)
    torques = static_torques(robot, "left", postures)
    step = 1e-6

    def work(joints: Array, index: int) -> float:
        """Return the work of weight, thrust and ground on the robot whose level pelvis is held."""
        body = forward_kinematics(robot, joints)
        thrust, weight = postures.thrust[index], robot.mass * GRAVITY
        yaw = postures.pelvis_yaw[index]
        away = np.array([*postures.zmp[index], 0.0]) - postures.pelvis[index]
        turn = np.array([[np.cos(yaw), np.sin(yaw), 0.0], [-np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
        now = forward_kinematics(robot, postures.joint_positions[index])
        arm = now.foot_rotations[1].T @ (turn @ away - now.soles[1])
        pressed = body.soles[1] + body.foot_rotations[1] @ arm
        return float(thrust * body.fans[0, 2] + (weight - thrust) * pressed[2] - weight * body.center_of_mass[2])

    for index in range(len(torques)):
        for joint in range(12):
            more, less = (postures.joint_positions[index].copy() for _ in range(2))
            more[joint] += step
            less[joint] -= step
            slope = (work(more, index) - work(less, index)) / (2.0 * step)
            assert torques[index, joint] == pytest.approx(-slope, abs=1e-6)


def test_leading_shape_is_kept(robot: Robot) -> None:
    step = PAPER.side
    pelvis = step.nominal_pelvis + np.zeros((2, 3, 3))
    postures = evaluate_postures(robot, "left", step.start, step.support, pelvis)
    torques = static_torques(robot, "left", postures)
    assert torques.shape == (2, 3, 12)
    np.testing.assert_array_equal(torques, np.broadcast_to(torques[0, 0], torques.shape))
    single = evaluate_postures(robot, "left", step.start, step.support, step.nominal_pelvis)
    np.testing.assert_array_equal(static_torques(robot, "left", single), torques[0, 0])
