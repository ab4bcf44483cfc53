"""A robot in its world: it stands and steps where the plan has it, and falls when it must."""

from __future__ import annotations

import math

import numpy as np
import pytest
from stepping import begin, begin_nominal, energy, follow, go_to

from agents.planner import make_planner
from jet_gym import Step
from jet_gym.courses import CARTON_HEIGHT, PAPER
from jet_gym.errors import StepError
from jet_gym.posture import evaluate_postures
from jet_gym.simulation import SimulationSettings, World

pytest.importorskip("pybullet")


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
        assert min(m.support_sole_margin for m in rest) > 0.02
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
        assert measured.zmp_margin == pytest.approx(min(edges), abs=1e-3)

    def test_on_one_foot_the_margin_is_that_of_its_zmp(self, world, side_plan):
        begin(world, side_plan, point=40)
        standing = world.hold(0.5)
        assert not standing.swing_contact
        assert standing.zmp_margin == standing.support_sole_margin

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
        assert min(m.support_sole_margin for m in measured) > 0.0
        assert np.percentile([m.support_sole_margin for m in measured], 5) > 8e-3
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

    def test_the_time_that_a_fall_cut_off_is_not_made_up_for(self, world, side_plan):
        begin(world, side_plan)
        world.client.resetBaseVelocity(world.body.id, (0.0, 0.0, 1.5))
        fallen = world.hold(0.2)
        held = world.hold(0.05, stop_on_fall=False)
        assert held.time - fallen.time == pytest.approx(0.05)
        cut = world.advance(side_plan.joint_positions[0], 0.0, 0.2)
        assert cut.time - held.time < 0.1
        moved = world.advance(side_plan.joint_positions[0], 0.0, 0.05, stop_on_fall=False)
        assert moved.time - cut.time == pytest.approx(0.05)

    def test_what_is_rounded_off_a_duration_is_made_up_for(self, world, side_plan):
        begin(world, side_plan)
        for _ in range(20):
            world.hold(1.45 * world.settings.time_step)
        assert world.time == pytest.approx(29.0 * world.settings.time_step)

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
