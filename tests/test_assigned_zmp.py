"""Where the zero-moment point is assigned to, and how the pelvis turns with it, eq. (4)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from standing import (
    SOLE,
    random_feet,
    random_steps,
    shrunk,
    stance,
)

from jet_gym.balance import (
    stance_of,
)
from jet_gym.leg import SIDES, Side
from jet_gym.posture import evaluate_postures
from jet_gym.robot import Robot

if TYPE_CHECKING:
    pass


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_stance_is_right_for_feet_whose_frames_are_anywhere(
    robot: Robot, rng: np.random.Generator, side: float
) -> None:
    """Jet-HR1's own ankles stand above the origins of its soles, and its fans right beside them."""
    margin = 0.01
    for _ in range(100):
        frames = [rng.uniform(-0.02, 0.02, 3) - [0.0, 0.0, 0.05] for _ in range(2)]
        swing_leg, support_leg = (robot.left._replace(sole=tuple(frame)) for frame in frames)
        swing_leg = swing_leg._replace(fan=tuple(rng.uniform(-0.08, 0.08, 3)))
        rectangle = rng.uniform([-0.1, 0.05, -0.09, 0.04], [-0.05, 0.12, -0.04, 0.07])
        support_leg = support_leg._replace(sole_rectangle=tuple(rectangle))
        support_sole = rng.uniform(-1.0, 1.0, 3)
        swing_sole = support_sole + rng.choice([-1.0, 1.0], 3) * rng.uniform(0.2, 0.5, 3)
        found = stance_of(swing_leg, support_leg, side, margin, tuple(swing_sole), tuple(support_sole))

        swing_ankle, support_ankle = swing_sole - frames[0], support_sole - frames[1]
        fan = (swing_ankle + swing_leg.fan)[:2]
        np.testing.assert_allclose(found.swing_ankle, swing_ankle, atol=1e-15)
        np.testing.assert_allclose(found.support_ankle, support_ankle, atol=1e-15)
        np.testing.assert_allclose(found.fan, fan, atol=1e-15)
        np.testing.assert_allclose(found.support, support_sole[[0, 0, 1, 1]] + rectangle, atol=1e-15)
        low, high = shrunk(found.support, margin)
        zmp = np.array(found.assigned_zmp)
        to_zmp, to_fan = zmp - support_ankle[:2], fan - support_ankle[:2]
        assert np.minimum(zmp - low, high - zmp).min() == pytest.approx(0.0, abs=1e-12)
        assert to_zmp[0] * to_fan[1] == pytest.approx(to_zmp[1] * to_fan[0], abs=1e-12)
        assert to_zmp @ to_fan > 0.0
        hip_line = side * np.array([-found.sin_yaw, found.cos_yaw])  # from the support hip to the other
        np.testing.assert_allclose(hip_line, (fan - zmp) / np.linalg.norm(fan - zmp), atol=1e-12)


@pytest.mark.parametrize("margin", [0.0, 0.01, 0.02, 0.04])
@pytest.mark.parametrize("swing", SIDES)
def test_the_assigned_zmp_is_where_the_ray_to_the_fan_leaves_the_shrunk_support(
    robot: Robot, rng: np.random.Generator, swing: Side, margin: float
) -> None:
    low, high = shrunk(SOLE, margin)
    for _ in range(100):
        swing_sole, support = random_feet(rng, swing)
        found = stance(robot, swing, swing_sole, support, margin)
        zmp, fan = np.subtract(found.assigned_zmp, support[:2]), np.subtract(found.fan, support[:2])
        assert np.minimum(zmp - low, high - zmp).min() == pytest.approx(0.0, abs=1e-12)
        assert zmp[0] * fan[1] == pytest.approx(zmp[1] * fan[0], abs=1e-12)
        assert zmp @ fan > 0.0


@pytest.mark.parametrize(("swing", "outward"), [("left", 1.0), ("right", -1.0)])
def test_the_assigned_zmp_is_80_mm_ahead_of_the_ankle_with_the_fan_straight_ahead(
    robot: Robot, swing: Side, outward: float
) -> None:
    support = np.array([0.3, 0.2, 0.0])
    swing_sole = support + np.array([0.5, -outward * 0.06, 0.0])
    assert stance(robot, swing, swing_sole, support).assigned_zmp == pytest.approx([0.38, 0.2], abs=1e-12)


def test_the_assigned_zmp_is_30_mm_beside_the_ankle_with_the_fan_straight_aside(robot: Robot) -> None:
    found = stance(robot, "left", np.array([0.0, 0.3, 0.0]), np.array([0.0, 0.0, 0.0]))
    assert found.assigned_zmp == pytest.approx([0.0, 0.03], abs=1e-12)


@pytest.mark.parametrize(("swing", "quarter"), [("left", -90.0), ("right", 90.0)])
def test_the_pelvis_turns_the_hip_line_along_the_line_to_the_fan(
    robot: Robot, rng: np.random.Generator, swing: Side, quarter: float
) -> None:
    batch = evaluate_postures(robot, swing, *random_steps(rng, swing))
    line = batch.fan[:, :2] - batch.assigned_zmp
    expected = np.arctan2(line[:, 1], line[:, 0]) + math.radians(quarter)
    np.testing.assert_allclose(np.exp(1j * batch.pelvis_yaw), np.exp(1j * expected), atol=1e-12)
    assert np.abs(batch.pelvis_yaw).max() < math.pi / 2.0  # never facing backwards in an ordinary step


@pytest.mark.parametrize(("swing", "outward"), [("left", 1.0), ("right", -1.0)])
def test_the_pelvis_does_not_turn_with_feet_side_by_side(robot: Robot, swing: Side, outward: float) -> None:
    posture = evaluate_postures(robot, swing, [0.0, outward * 0.225, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.4])
    assert posture.pelvis_yaw == pytest.approx(0.0, abs=1e-12)
