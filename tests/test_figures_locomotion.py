"""The picture of the locomotion: stick figures on their soles, cartons under them, one scale on all axes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from legends import legend_texts
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from jet_gym import Step
from jet_gym.courses import CARTON_HEIGHT, DITCH_SPAN, PAPER
from jet_gym.figures import plot_locomotion, style
from jet_gym.figures.scene import bodies_of
from jet_gym.figures.stereo_view import THRUST_SCALE
from jet_gym.ground import cartons_of, ditch_of
from jet_gym.leg import SIDES
from jet_gym.plan import Plan

FRAMES = 4


@pytest.fixture(params=["side", "forward"])
def plan(request: pytest.FixtureRequest) -> Plan:
    """A plan of each of the paper's motions; the pelvis turns in the forward one."""
    return request.getfixturevalue(f"{request.param}_plan")


def lines_of(axes: Any, shape: tuple[int, ...]) -> Iterator[np.ndarray]:
    """Yield what the lines of 3D axes show [m], if it has a shape."""
    for line in axes.lines:
        data = np.array(line.get_data_3d()).T / 1e3
        if data.shape == shape:
            yield data


def test_stick_figures_stand_on_the_soles_of_the_plan(plan: Plan) -> None:
    bodies = bodies_of(plan)
    swing = SIDES.index(plan.step.swing)
    np.testing.assert_allclose(bodies.soles[:, swing], plan.swing_sole, atol=1e-9)
    support = np.broadcast_to(plan.step.support, plan.swing_sole.shape)
    np.testing.assert_allclose(bodies.soles[:, 1 - swing], support, atol=1e-9)
    np.testing.assert_allclose(bodies.fans[:, swing], plan.fan, atol=1e-9)


def test_pelvis_is_in_the_middle_of_the_hips_and_turned_by_its_yaw(plan: Plan) -> None:
    hips = bodies_of(plan).hips
    np.testing.assert_allclose(hips.mean(axis=1), plan.pelvis, atol=1e-12)
    across = hips[:, 0] - hips[:, 1]
    np.testing.assert_allclose(np.arctan2(-across[:, 0], across[:, 1]), plan.pelvis_yaw, atol=1e-12)
    np.testing.assert_allclose(bodies_of(plan).trunk_corners[:, :4].mean(axis=1), plan.pelvis, atol=1e-12)


def test_links_keep_their_lengths_in_the_world(plan: Plan) -> None:
    bodies = bodies_of(plan)
    for side, leg in enumerate((plan.step.robot.left, plan.step.robot.right)):
        chains = np.array([bodies.leg_chain(k, side) for k in range(plan.step.points)])
        lengths = np.linalg.norm(np.diff(chains, axis=1), axis=2)
        expected = [np.linalg.norm(link) for link in (leg.thigh, leg.shank, leg.sole)]
        np.testing.assert_allclose(lengths, np.tile(expected, (plan.step.points, 1)), atol=1e-12)


def test_sole_outlines_have_the_size_of_the_foot_and_lie_level(plan: Plan) -> None:
    corners = bodies_of(plan).sole_corners
    for side, leg in enumerate((plan.step.robot.left, plan.step.robot.right)):
        x_min, x_max, y_min, y_max = leg.sole_rectangle
        np.testing.assert_allclose(np.ptp(corners[:, side, :, 0], axis=1), x_max - x_min, atol=1e-9)
        np.testing.assert_allclose(np.ptp(corners[:, side, :, 1], axis=1), y_max - y_min, atol=1e-9)
        np.testing.assert_allclose(np.ptp(corners[:, side, :, 2], axis=1), 0.0, atol=1e-9)


def test_both_views_draw_the_frames_that_they_name(plan: Plan) -> None:
    stereo, above, _ = plot_locomotion(plan, FRAMES).axes
    points = [round(k) for k in np.linspace(0, plan.step.points - 1, FRAMES)]
    bodies = bodies_of(plan)
    swing = SIDES.index(plan.step.swing)
    chains = list(lines_of(stereo, (4, 3)))
    outlines = list(lines_of(stereo, (5, 3)))
    flat = [np.array(line.get_xydata()) / 1e3 for line in above.get_lines()]
    assert len(chains) == len(outlines) == 2 * FRAMES
    for point in points:
        chain, corners = bodies.leg_chain(point, swing), bodies.sole_corners[point, swing]
        assert any(np.allclose(drawn, chain, rtol=0.0, atol=1e-9) for drawn in chains)
        assert any(np.allclose(drawn[:4], corners, rtol=0.0, atol=1e-9) for drawn in outlines)
        assert any(d.shape == (4, 2) and np.allclose(d, chain[:, :2], rtol=0.0, atol=1e-9) for d in flat)
        assert any(d.shape == (1, 2) and np.allclose(d, plan.com[point, :2]) for d in flat)
        assert any(d.shape == (1, 2) and np.allclose(d, plan.zmp[point]) for d in flat)
        assert any(d.shape == (1, 2) and np.allclose(d, plan.assigned_zmp[point]) for d in flat)


def test_thrust_arrows_are_as_long_as_their_scale_says(plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    faces: list[Any] = []
    draw = Poly3DCollection.set_verts

    def note_and_draw(self: Poly3DCollection, vertices: Any, closed: bool = True) -> None:
        faces.extend(vertices)
        draw(self, vertices, closed)

    monkeypatch.setattr(Poly3DCollection, "set_verts", note_and_draw)
    stereo = plot_locomotion(plan, 2).axes[0]
    arrow_tips = [np.array(face) for face in faces if len(face) == 3]
    for point in (0, plan.step.points - 1):
        tip = 1e3 * plan.fan[point] + [0.0, 0.0, THRUST_SCALE * plan.thrust[point]]
        assert any(np.allclose(face[0], tip) for face in arrow_tips)
    assert any(text.get_text() == "10 N" for text in stereo.texts)


def test_early_frames_are_fainter_than_late_ones() -> None:
    strengths = [style.strength(order, 6) for order in range(6)]
    assert strengths == sorted(strengths)
    assert strengths[0] > 0.2
    assert strengths[-1] == 1.0
    np.testing.assert_allclose(style.tint("#000000", 0.25), 0.75)


def test_locomotion_has_one_scale_on_all_axes_and_labels_with_units(plan: Plan) -> None:
    figure = plot_locomotion(plan)
    stereo, *flat = figure.axes
    figure.draw_without_rendering()
    ranges = [np.ptp(stereo.get_xlim3d()), np.ptp(stereo.get_ylim3d()), np.ptp(stereo.get_zlim3d())]
    scale = np.array(stereo._box_aspect) / ranges
    np.testing.assert_allclose(scale, scale[0])
    assert [stereo.get_xlabel(), stereo.get_ylabel(), stereo.get_zlabel()] == ["x [mm]", "y [mm]", "z [mm]"]
    for axes in flat:
        assert axes.get_aspect() == 1.0
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [mm]", "y [mm]")
    legend = " ".join(legend_texts(figure))
    for word in (
        "left leg",
        "right leg",
        "support polygon",
        "thrust",
        "carton",
        "gap",
        "achieved ZMP",
        "assigned ZMP",
    ):
        assert word in legend


def test_cartons_carry_the_soles_and_leave_the_papers_ditch() -> None:
    step = PAPER.forward
    for carton, sole in zip(cartons_of(step), (step.start, step.support, step.landing), strict=True):
        leg = step.robot.left
        assert carton.x[0] <= sole[0] + leg.sole_rectangle[0]
        assert carton.x[1] >= sole[0] + leg.sole_rectangle[1]
        np.testing.assert_allclose(carton.z, (-CARTON_HEIGHT, 0.0))
    ditch = ditch_of(step)
    assert ditch is not None
    assert ditch.axis == 0
    np.testing.assert_allclose(ditch.span, DITCH_SPAN)
    assert ditch.label == "450 mm"


def test_a_short_step_has_no_ditch_and_is_drawn_all_the_same() -> None:
    step = Step("right", (0.0, -0.1125, 0.0), (0.05, -0.1125, 0.03), (0.0, 0.1125, 0.0), points=3)
    assert ditch_of(step) is None
    plan = Plan.from_pelvis_path(step, np.tile(step.nominal_pelvis, (3, 1)), planner="still")
    figure = plot_locomotion(plan, frames=50)
    assert "gap" not in " ".join(legend_texts(figure))
    assert any("swing points 0, 1 and 2" in text.get_text() for text in figure.texts)


@pytest.mark.parametrize("frames", [1, 0, 2.5, True])
def test_frames_that_are_no_number_of_frames_are_refused(rivals: list[Plan], frames: Any) -> None:
    with pytest.raises(ValueError, match="frames must be a whole number of 2 or more"):
        plot_locomotion(rivals[0], frames)
