"""How tests let a robot step, in a world and in an environment, and what they read of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np

from jet_gym import Step
from jet_gym.plan import Plan
from jet_gym.posture import evaluate_postures
from jet_gym.simulation import Measurement, World


def begin(world: World, plan: Plan, point: int = 0) -> Measurement:
    posture = plan.joint_positions[point], plan.pelvis[point], plan.pelvis_yaw[point]
    return world.reset(plan.step, *posture, thrust=plan.thrust[point])


def go_to(world: World, plan: Plan, point: int, thrust_share: float = 1.0) -> Measurement:
    duration = plan.time[point] - plan.time[point - 1]
    return world.advance(plan.joint_positions[point], thrust_share * plan.thrust[point], duration)


def follow(world: World, plan: Plan, thrust_share: float = 1.0) -> list[Measurement]:
    """Execute a plan from its second point on, then stand for a second."""
    measured = []
    for point in range(1, len(plan.time)):
        measured.append(go_to(world, plan, point, thrust_share))
        if measured[-1].fallen:
            return measured
    return [*measured, world.hold(1.0)]


def begin_nominal(world: World, step: Step) -> Measurement:
    posture = evaluate_postures(step.robot, step.swing, step.start, step.support, step.nominal_pelvis)
    return world.reset(step, posture.joint_positions, posture.pelvis, float(posture.pelvis_yaw))


def fingerprint(world: World) -> bytes:
    """What the physics engine tells about the robot, to the last bit."""
    client, body = world.client, world.body.id
    base = [*client.getBasePositionAndOrientation(body), *client.getBaseVelocity(body)]
    joints = client.getJointStates(body, range(client.getNumJoints(body)))
    return np.concatenate([*base, *([state[0], state[1], state[3]] for state in joints)]).tobytes()


def trace(world: World, plan: Plan, points: int = 8) -> list[bytes]:
    begin(world, plan)
    prints = [fingerprint(world)]
    for point in range(1, points):
        go_to(world, plan, point)
        prints.append(fingerprint(world))
    return prints


def energy(world: World) -> float:
    """Mechanical energy of the robot [J]."""
    client, body = world.client, world.body.id
    total = 0.0
    for link in range(-1, client.getNumJoints(body)):
        mass, _, inertia = client.getDynamicsInfo(body, link)[:3]
        if link < 0:
            place, turn = client.getBasePositionAndOrientation(body)
            velocity, spin = client.getBaseVelocity(body)
        else:
            state = client.getLinkState(body, link, computeLinkVelocity=1, computeForwardKinematics=1)
            place, turn, velocity, spin = state[0], state[1], state[6], state[7]
        axes = np.reshape(client.getMatrixFromQuaternion(turn), (3, 3))
        local_spin = axes.T @ spin
        total += mass * world.settings.gravity * place[2] + 0.5 * mass * np.dot(velocity, velocity)
        total += 0.5 * local_spin @ (np.array(inertia) * local_spin)
    return float(total)


def replace_thrust(plan: Plan, thrust: float) -> Plan:
    return replace(plan, thrust=np.full(len(plan.time), thrust))


def replay(env: gym.Env[Any, Any], plan: Plan) -> list[tuple[Any, float, bool, bool, dict[str, Any]]]:
    """Take the plan's postures as actions."""
    env.reset(seed=0, options={"step": plan.step})
    results = []
    for pelvis in plan.pelvis:
        results.append(env.step(env.unwrapped.action_to(pelvis)))  # type: ignore[attr-defined]
        if results[-1][2]:
            break
    return results
