import math
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.planner import make_planner
from jet_gym import JetGymError, Robot, Step, load_robot
from jet_gym.courses import CARTON_HEIGHT, PAPER
from jet_gym.errors import RobotError, SettingsError, StepError
from jet_gym.plan import Plan
from jet_gym.posture import evaluate_postures
from jet_gym.simulation import (
    BulletMissingError,
    DisplayMissingError,
    Measurement,
    SimulationSettings,
    World,
    WorldStateError,
)
from jet_gym.simulation.motion import CommandBlend, FanLag

pytest.importorskip("pybullet")


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    """A world that the tests use one after the other; none may notice what another did to it."""
    with World() as shared:
        yield shared


@pytest.fixture(scope="module")
def side_plan() -> Plan:
    return make_planner("gas").plan(PAPER.side, seed=0)


@pytest.fixture(scope="module")
def forward_plan() -> Plan:
    return make_planner("gas").plan(PAPER.forward, seed=0)


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


def run_python(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout


class TestServers:
    def test_two_worlds_do_not_disturb_each_other(self, side_plan, forward_plan):
        with World() as alone:
            expected = trace(alone, side_plan, 5), trace(alone, forward_plan, 5)
        with World() as first, World() as second:
            begin(first, side_plan)
            begin(second, forward_plan)
            for point in range(1, 5):
                go_to(first, side_plan, point)
                go_to(second, forward_plan, point)
                assert fingerprint(first) == expected[0][point]
                assert fingerprint(second) == expected[1][point]

    def test_closing_a_world_leaves_the_others(self, side_plan):
        first, second = World(), World()
        begin(second, side_plan)
        first.close()
        with World() as third:  # gets the number of the first one's server
            first.close()
            del first
            begin(third, side_plan)
            assert not go_to(third, side_plan, 1).fallen
        assert not go_to(second, side_plan, 1).fallen
        second.close()

    def test_a_closed_world_says_so(self, side_plan):
        world = World()
        begin(world, side_plan)
        world.close()
        world.close()
        posture = side_plan.joint_positions[0], side_plan.pelvis[0], 0.0
        for use in (
            lambda: world.hold(0.1),
            lambda: world.reset(side_plan.step, *posture),
            lambda: world.pose(*posture),
        ):
            with pytest.raises(WorldStateError, match="closed"):
                use()

    def test_moving_before_a_reset_is_refused(self, side_plan):
        with World() as world:
            with pytest.raises(WorldStateError, match="reset"):
                world.hold(0.1)
            world.place_cartons(side_plan.step)
            world.pose(side_plan.joint_positions[5], side_plan.pelvis[5], side_plan.pelvis_yaw[5])
            with pytest.raises(WorldStateError, match="reset"):
                world.hold(0.1)

    def test_without_pybullet_one_sentence_says_what_to_install(self, monkeypatch):
        monkeypatch.setitem(sys.modules, "pybullet", None)
        with pytest.raises(BulletMissingError, match=r"pip install 'jet-gym\[bullet\]'") as caught:
            World()
        assert isinstance(caught.value, JetGymError)

    @pytest.mark.skipif(not sys.platform.startswith("linux"), reason="DISPLAY is a matter of X11")
    def test_without_a_display_a_window_is_refused(self, monkeypatch):
        monkeypatch.delenv("DISPLAY", raising=False)
        with pytest.raises(DisplayMissingError, match="display"):
            World(gui=True)

    def test_importing_the_package_imports_no_pybullet_and_prints_nothing(self):
        code = "import sys, jet_gym.simulation; assert 'pybullet' not in sys.modules"
        assert run_python(code) == ""
        assert run_python("from jet_gym.simulation import World; World().close()") == ""


class TestRepeatability:
    def test_the_same_commands_give_the_same_states_after_other_episodes(self, world, side_plan, forward_plan):
        first = trace(world, side_plan)
        trace(world, forward_plan, 3)
        begin(world, forward_plan)
        world.hold(1.0, stop_on_fall=False)
        world.advance(side_plan.joint_positions[40], 23.0, 0.3, stop_on_fall=False)  # throws it over
        world.hold(1.0, stop_on_fall=False)
        begin(world, side_plan, point=59)
        world.next_step(forward_plan.step)  # gives the cartons other parts to play
        world.hold(0.2)
        assert trace(world, side_plan) == first

    def test_two_worlds_give_the_same_states(self, world, forward_plan):
        with World() as other:
            assert trace(other, forward_plan) == trace(world, forward_plan)

    def test_memory_stays_flat_over_resets(self):
        code = """
import resource
from jet_gym.courses import PAPER
from jet_gym.posture import evaluate_postures
from jet_gym.simulation import SimulationSettings, World
step = PAPER.side
p = evaluate_postures(step.robot, step.swing, step.start, step.support, step.nominal_pelvis)
world = World(settings=SimulationSettings(settle_time=0.02))
for episode in range(300):
    world.reset(step, p.joint_positions, p.pelvis, float(p.pelvis_yaw))
    world.hold(0.05)
    if episode == 99:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / before)
"""
        assert float(run_python(code)) < 1.005


class TestStanding:
    def test_the_robot_weighs_what_its_description_says(self, world, robot):
        client, body = world.client, world.body.id
        dynamics = [client.getDynamicsInfo(body, link) for link in range(-1, client.getNumJoints(body))]
        assert sum(info[0] for info in dynamics) == pytest.approx(robot.mass, abs=1e-9)
        assert robot.mass == pytest.approx(6.8)
        assert dynamics[0][3] == pytest.approx((0.0, 0.0, 0.05))  # what merging fixed links would forget

    def test_a_reset_puts_the_soles_on_their_cartons(self, side_plan):
        with World(settings=SimulationSettings(settle_time=0.0)) as world:
            begin(world, side_plan)
            step = side_plan.step
            assert world.body.sole("left").position == pytest.approx(step.start, abs=1e-4)
            assert world.body.sole("right").position == pytest.approx(step.support, abs=1e-4)
            floor = world.client.getBasePositionAndOrientation(world.cartons.floor)[0]
            assert floor[2] == pytest.approx(-CARTON_HEIGHT)

    def test_the_support_sole_stands_on_its_carton_wherever_the_pelvis_is_said_to_be(self, world, side_plan):
        settled = world.reset(side_plan.step, side_plan.joint_positions[0], (1.0, 2.0, 3.0), 0.0)
        assert settled.pelvis == pytest.approx(side_plan.pelvis[0], abs=2e-3)

    def test_the_nominal_posture_stands_still(self, world, robot):
        first = begin_nominal(world, PAPER.side)
        rest = [world.hold(0.1) for _ in range(30)]
        assert rest[-1].time == pytest.approx(3.0)
        assert max(np.abs(m.pelvis - first.pelvis).max() for m in rest) < 2e-3
        assert min(m.zmp_margin for m in rest) > 0.02
        assert all(m.support_contact and m.swing_contact and not m.fallen for m in rest)
        assert np.all(np.max([m.peak_joint_torques for m in rest], axis=0) < robot.effort)
        assert max(m.support_slip for m in rest) < 1e-4

    def test_while_both_feet_stand_the_margin_is_that_of_the_rectangle_around_both(self, world, robot):
        begin_nominal(world, PAPER.side)
        measured = world.hold(world.settings.time_step)
        assert measured.swing_contact
        contacts = {
            side: world.body.contact(world.body.foot(side), world.body.fan(side)) for side in ("left", "right")
        }
        force = sum(contact.force for contact in contacts.values())
        x, y = sum(contact.force * contact.center for contact in contacts.values()) / force
        soles = {side: world.body.sole(side).position for side in contacts}
        x_min, x_max, y_min, _ = robot.right.sole_rectangle
        y_max = robot.left.sole_rectangle[3]
        middle = soles["right"][0]
        edges = middle + x_max - x, x - middle - x_min, soles["left"][1] + y_max - y, y - soles["right"][1] - y_min
        assert measured.stability_margin == pytest.approx(min(edges), abs=1e-3)

    def test_on_one_foot_the_margin_is_that_of_its_zmp(self, world, side_plan):
        begin(world, side_plan, point=40)
        standing = world.hold(0.5)
        assert not standing.swing_contact
        assert standing.stability_margin == standing.zmp_margin

    def test_no_energy_appears(self, world):
        begin_nominal(world, PAPER.side)
        energies = []
        for _ in range(30):
            world.hold(0.1)
            energies.append(energy(world))
        assert energies[0] == pytest.approx(6.8 * 9.81 * 0.25, rel=0.3)
        assert max(energies) < energies[0] + 2e-3

    def test_ground_and_fan_carry_the_weight(self, world, side_plan):
        weight = world.robot.mass * world.settings.gravity
        begin(world, side_plan, point=40)
        standing = world.hold(1.0)
        assert not standing.swing_contact
        assert standing.mean_thrust == pytest.approx(side_plan.thrust[40], rel=0.02)
        assert standing.support_force + standing.mean_thrust == pytest.approx(weight, rel=0.02)

    @pytest.mark.parametrize(("friction", "slides"), [(0.3, False), (0.1, True)])
    def test_a_pushed_robot_slides_when_the_push_exceeds_friction(self, friction, slides):
        """12 N against 0.3 or 0.1 times 67 N, just above the soles so that nothing tips."""
        with World(settings=SimulationSettings(sole_friction=friction)) as world:
            x, y, _ = begin_nominal(world, PAPER.side).pelvis
            for _ in range(60):
                frame = world.client.WORLD_FRAME
                world.client.applyExternalForce(world.body.id, -1, (12.0, 0.0, 0.0), (x, y, 0.02), frame)
                measured = world.hold(world.settings.time_step)
        assert (measured.support_slip > 0.02) == slides
        assert slides or measured.support_slip < 1e-4

    @pytest.mark.parametrize("thrust", [0.0, 3.0, 6.0])
    def test_the_zmp_is_where_the_balance_equations_put_it(self, world, side_plan, thrust):
        begin(world, side_plan, point=30)
        world.advance(side_plan.joint_positions[30], thrust, 0.3)
        measured = [world.hold(0.05) for _ in range(30)][10:]
        weight = world.robot.mass * world.settings.gravity
        com, fan = measured[-1].center_of_mass[:2], world.body.frame("left_fan").position[:2]
        expected = (weight * com - thrust * fan) / (weight - thrust)
        assert np.mean([m.zmp for m in measured], axis=0) == pytest.approx(expected, abs=1.5e-3)


class TestSteps:
    @pytest.mark.parametrize("name", ["side", "forward"])
    def test_a_gas_plan_of_the_paper_keeps_the_robot_standing(self, world, request, robot, name):
        plan = request.getfixturevalue(f"{name}_plan")
        assert plan.violated_points == ()
        begin(world, plan)
        measured = follow(world, plan)
        assert [m.reason for m in measured if m.fallen] == []
        assert measured[-1].time == pytest.approx(plan.step.duration + 1.0, abs=world.settings.time_step)
        assert min(m.zmp_margin for m in measured) > 0.0
        assert np.percentile([m.zmp_margin for m in measured], 5) > 8e-3
        assert np.all(np.max([m.peak_joint_torques for m in measured], axis=0) < robot.effort)
        assert max(m.peak_tilt for m in measured) < math.radians(1.0)
        assert max(m.support_slip for m in measured) < 1e-3
        assert measured[-1].swing_contact
        landed = world.body.sole(plan.step.swing).position
        assert landed == pytest.approx(plan.step.landing, abs=2e-3)

    def test_the_measured_zmp_is_the_planned_one(self, world, forward_plan):
        """Over two seconds in the middle of the step; the measured one comes later, by half of the blend time."""
        begin(world, forward_plan)
        measured = [go_to(world, forward_plan, point) for point in range(1, 120)]
        zmp, planned = np.array([m.zmp for m in measured[90:]]), forward_plan.zmp[88:117]
        assert zmp.mean(axis=0) == pytest.approx(planned.mean(axis=0), abs=4e-3)

    def test_without_its_fan_the_robot_falls(self, world, forward_plan):
        begin(world, forward_plan)
        measured = follow(world, forward_plan, thrust_share=0.0)
        assert measured[-1].fallen
        assert "tilts" in measured[-1].reason or "lost" in measured[-1].reason
        assert measured[-1].time < forward_plan.step.duration

    def test_a_crouch_below_the_least_height_is_a_fall(self, side_plan):
        standing = side_plan.pelvis[0, 2] / side_plan.step.robot.leg_length
        with World(settings=SimulationSettings(least_height=0.95 * standing)) as world:
            assert not begin(world, side_plan).fallen
        with World(settings=SimulationSettings(least_height=1.05 * standing)) as world:
            assert "above the support sole" in begin(world, side_plan).reason

    def test_speeds_beyond_reason_are_an_explosion(self, world, side_plan):
        begin(world, side_plan)
        world.client.resetBaseVelocity(world.body.id, (0.0, 0.0, 30.0))
        assert "exploded" in world.hold(0.1).reason
        assert not begin(world, side_plan).fallen

    def test_a_lost_support_foot_is_a_fall(self, world, side_plan):
        begin(world, side_plan)
        world.client.resetBaseVelocity(world.body.id, (0.0, 0.0, 1.5))
        lost = world.hold(0.2)
        assert "support foot" in lost.reason
        assert not lost.support_contact
        assert lost.time < 0.1

    def test_both_motions_in_a_row(self, world, side_plan, forward_plan):
        """The side step, four seconds in double support, the step across the ditch: the paper's 24 s."""
        begin(world, side_plan)
        follow(world, side_plan)
        forward = forward_plan.step
        world.next_step(forward)
        for share in np.linspace(0.0, 1.0, 40)[1:]:
            pelvis = (1.0 - share) * side_plan.pelvis[-1] + share * forward_plan.pelvis[0]
            posture = evaluate_postures(forward.robot, "right", forward.start, forward.support, pelvis)
            thrust = share * forward_plan.thrust[0]
            assert not world.advance(posture.joint_positions, thrust, 0.1).fallen
        measured = follow(world, forward_plan)
        assert not measured[-1].fallen
        assert world.body.sole("right").position == pytest.approx(forward.landing, abs=4e-3)

    def test_the_next_step_must_begin_where_the_last_one_ended(self, world, side_plan, forward_plan):
        begin(world, forward_plan)
        with pytest.raises(StepError, match="start of the next step"):
            world.next_step(side_plan.step)

    def test_a_carton_that_the_landing_needs_is_cleared_after_take_off(self, world):
        step = Step("left", (0.0, 0.24, 0.0), (0.12, 0.26, 0.05), (0.0, 0.0, 0.0), points=30, duration=6.0)
        plan = make_planner("gas").plan(step, seed=0)
        settled = begin(world, plan)
        start, landing = (world.cartons.bodies[role] for role in ("start", "landing"))
        assert world.cartons.conflict("start", "landing")
        assert settled.swing_contact
        assert settled.tilt < math.radians(0.5)
        measured = follow(world, plan)
        assert not measured[-1].fallen
        assert measured[-1].swing_contact
        assert world.client.getBasePositionAndOrientation(start)[0][2] < -1.0
        assert world.client.getBasePositionAndOrientation(landing)[0][2] == pytest.approx(0.05)
        assert world.body.sole("left").position == pytest.approx(step.landing, abs=3e-3)


class TestCommands:
    def test_whole_simulation_steps_do_not_add_up_to_a_wrong_time(self, world, side_plan):
        begin(world, side_plan)
        for _ in range(10):
            measured = world.hold(0.0187)
        assert measured.time == pytest.approx(0.187, abs=0.5 / 240.0)

    def test_the_fan_reaches_63_percent_after_one_time_constant(self, world, side_plan, robot):
        begin(world, replace_thrust(side_plan, 0.0))
        world.advance(side_plan.joint_positions[0], 6.0, world.settings.time_step)
        after = world.hold(robot.fans[0].time_constant - world.settings.time_step)
        assert after.thrust == pytest.approx(6.0 * (1.0 - math.exp(-1.0)), rel=1e-6)
        assert world.hold(2.0).thrust == pytest.approx(6.0, rel=1e-5)

    def test_a_fan_gives_no_more_than_it_can_and_never_pulls(self, robot):
        fan = FanLag(robot.fans[0], 0.01)
        assert max(fan.step(100.0) for _ in range(500)) == pytest.approx(robot.fans[0].max_thrust)
        assert min(fan.step(-100.0) for _ in range(500)) >= 0.0

    def test_a_blend_goes_in_a_straight_line_and_arrives_half_its_width_late(self):
        blend = CommandBlend(11)
        blend.reset(np.array([1.0]))
        path = np.concatenate([blend.advance(np.array([3.0]), 40), blend.advance(np.array([3.0]), 20)])[:, 0]
        assert path[24] == pytest.approx(1.0 + 2.0 * 20 / 40)  # row 24 is step 25, the command of step 20
        assert np.all(np.diff(path) >= -1e-15)
        assert path[-1] == pytest.approx(3.0, abs=1e-15)
        assert np.abs(np.diff(path, n=2)).max() < 2.0 / 40 * 2.0 / 11

    def test_a_blend_does_not_depend_on_how_the_way_is_divided(self):
        once, twice = CommandBlend(9), CommandBlend(9)
        for blend in (once, twice):
            blend.reset(np.zeros(2))
        whole = once.advance(np.array([1.0, -2.0]), 20)
        parts = [twice.advance(np.array([0.5, -1.0]), 10), twice.advance(np.array([1.0, -2.0]), 10)]
        assert whole == pytest.approx(np.concatenate(parts), abs=1e-14)

    def test_servos_stay_below_their_speed_limits(self, world, side_plan, robot):
        begin(world, side_plan)
        speeds = []
        for _ in range(30):  # a knee told to jump
            target = side_plan.joint_positions[0].copy()
            target[3] += 0.5
            measured = world.advance(target, 0.0, 0.005, stop_on_fall=False)
            speeds.append(np.abs(measured.joint_velocities))
        assert np.all(np.max(speeds, axis=0) < 1.15 * robot.velocity)

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"joint_positions": np.zeros(11)}, "joint_positions"),
            ({"joint_positions": np.full(12, math.nan)}, "joint_positions"),
            ({"thrust": math.inf}, "thrust"),
            ({"duration": 0.0}, "duration"),
            ({"duration": math.nan}, "duration"),
        ],
    )
    def test_commands_that_make_no_sense_are_refused(self, world, side_plan, change, message):
        begin(world, side_plan)
        command: dict[str, Any] = {"joint_positions": side_plan.joint_positions[0], "thrust": 0.0, "duration": 0.1}
        before = fingerprint(world)
        with pytest.raises(ValueError, match=message):
            world.advance(**{**command, **change})
        assert fingerprint(world) == before

    def test_a_step_of_another_robot_is_refused(self, world, tmp_path, robot, side_plan):
        other_file = tmp_path / "other.urdf"
        other_file.write_text(robot.urdf_path.read_text())
        step = replace(PAPER.side, robot=load_robot(other_file))
        with pytest.raises(ValueError, match="made for jet_hr1"):
            world.reset(step, side_plan.joint_positions[0], side_plan.pelvis[0], 0.0)


class TestSettings:
    @pytest.mark.parametrize(
        "change",
        [
            {"rate": 0.0},
            {"rate": math.nan},
            {"position_gain": 1.5},
            {"sole_friction": -0.1},
            {"solver_iterations": 0},
            {"solver_iterations": 50.0},
            {"sample_every": True},
            {"gravity": "9.81"},
        ],
    )
    def test_settings_that_make_no_sense_are_refused(self, change):
        with pytest.raises(SettingsError, match=next(iter(change))):
            SimulationSettings(**change)

    @pytest.mark.parametrize(
        "settings",
        [
            SimulationSettings(position_gain=0.2),
            SimulationSettings(position_gain=0.8),
            SimulationSettings(solver_iterations=25),
            SimulationSettings(solver_iterations=100),
            SimulationSettings(sole_friction=0.4),
            SimulationSettings(contact_stiffness=1e5),
            SimulationSettings(contact_stiffness=1e6),
            SimulationSettings(rate=480.0),
        ],
    )
    def test_the_estimated_settings_do_not_decide_whether_the_robot_stands(self, settings, side_plan):
        with World(settings=settings) as world:
            begin(world, side_plan)
            measured = follow(world, side_plan)
        assert not measured[-1].fallen
        assert np.percentile([m.zmp_margin for m in measured], 5) > 8e-3


def replace_thrust(plan: Plan, thrust: float) -> Plan:
    return replace(plan, thrust=np.full(len(plan.time), thrust))


def test_robot_whose_meshes_are_missing_is_refused(robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / "mine.urdf"
    path.write_bytes(robot.urdf_path.read_bytes())
    with pytest.raises(RobotError, match=r"PyBullet cannot load .*mine\.urdf; the meshes"):
        World(load_robot(path))
