"""Pictures of the simulated robot, held against PyBullet's own, and what is drawn over them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from jet_gym.courses import PAPER
from jet_gym.errors import SettingsError
from jet_gym.ground import ditch_of
from jet_gym.posture import evaluate_postures
from jet_gym.simulation import CameraSettings, Overlay, Renderer, World, WorldStateError
from jet_gym.simulation.pictures.camera import Camera
from jet_gym.simulation.pictures.overlay import METERS_PER_NEWTON
from jet_gym.simulation.pictures.shading import FAR_AWAY, SHADE, Floor, shade
from jet_gym.step import Step

pytest.importorskip("pybullet")

STEP = PAPER.forward
Picture = NDArray[np.uint8]


@pytest.fixture
def renderer() -> Iterator[Renderer]:
    with Renderer(width=320, height=240, supersampling=1) as drawing:
        yield drawing


def stand(world: World, step: Step = STEP, forward: float = 0.0) -> None:
    """Put the robot into the nominal posture, its pelvis moved forward."""
    pelvis = step.nominal_pelvis + np.array([forward, 0.0, 0.0])
    posture = evaluate_postures(step.robot, step.swing, step.start, step.support, pelvis)
    world.place_cartons(step)
    world.pose(posture.joint_positions, posture.pelvis, float(posture.pelvis_yaw))


def changed(one: Picture, other: Picture, least: int = 20) -> NDArray[np.bool_]:
    return np.abs(one.astype(int) - other.astype(int)).max(axis=2) > least


def middle_of(mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Mean of pixels' middles, x and y."""
    rows, columns = np.nonzero(mask)
    return np.array([columns.mean() + 0.5, rows.mean() + 0.5])


class TestPictures:
    def test_a_picture_has_the_size_and_type_that_was_asked_for(self, world):
        stand(world)
        for width, height, supersampling in ((320, 240, 1), (200, 100, 2), (96, 128, 3)):
            with Renderer(width=width, height=height, supersampling=supersampling) as renderer:
                picture = renderer.render(world)
            assert picture.shape == (height, width, 3)
            assert picture.dtype == np.uint8

    def test_the_default_picture_is_640_by_480(self, world):
        stand(world)
        with Renderer() as renderer:
            assert renderer.render(world).shape == (480, 640, 3)

    def test_the_robot_is_in_the_picture(self, world, renderer):
        stand(world)
        with_robot = renderer.render(world)
        world.body.place(np.zeros(12), world.body.pelvis().pose._replace(position=np.array([0.0, 0.0, -30.0])))
        renderer.camera.settings = CameraSettings(follow=0.0)
        mask = changed(with_robot, renderer.render(world))
        assert 0.02 < mask.mean() < 0.5
        assert with_robot[mask].mean() < 120.0  # carbon is dark

    def test_the_picture_changes_when_the_robot_moves(self, world, renderer):
        stand(world)
        first = renderer.render(world)
        assert np.array_equal(renderer.render(world), first)
        stand(world, forward=0.05)
        assert changed(renderer.render(world), first).mean() > 0.005

    def test_drawing_changes_nothing_in_the_world(self, world, renderer):
        posture = evaluate_postures(STEP.robot, STEP.swing, STEP.start, STEP.support, STEP.nominal_pelvis)
        start = posture.joint_positions, posture.pelvis, float(posture.pelvis_yaw)
        ends = []
        for draw in (False, True):
            world.reset(STEP, *start)
            for _ in range(5):
                measured = world.advance(posture.joint_positions + 0.01, 5.0, 0.05)
                if draw:
                    renderer.render(world, Overlay(zmp=measured.zmp))
            ends.append((measured.pelvis.tobytes(), measured.joint_torques.tobytes(), measured.zmp.tobytes()))
        assert ends[0] == ends[1]

    def test_without_a_step_there_is_nothing_to_draw(self, renderer):
        with World() as empty, pytest.raises(WorldStateError, match="nothing to draw"):
            renderer.render(empty)

    def test_closing_twice_is_harmless(self):
        renderer = Renderer(width=8, height=8)
        renderer.close()
        renderer.close()

    @pytest.mark.parametrize("size", [{"width": 0}, {"height": -1}, {"width": 64.0}, {"supersampling": 0}])
    def test_sizes_that_make_no_sense_are_refused(self, size):
        with pytest.raises(SettingsError, match=next(iter(size))):
            Renderer(**size)


class TestOverlay:
    @pytest.mark.parametrize("place", [(0.25, 0.1), (0.6, 0.0), (0.1, -0.3)])
    @pytest.mark.parametrize("height", [0.0, 0.15])
    def test_points_are_drawn_where_pybullet_renders_a_marker_there(self, world, renderer, place, height):
        stand(world)
        plain = renderer.render(world)
        drawn = changed(renderer.render(world, Overlay(zmp=place, ground=height)), plain)
        drawn[190:, :130] = False  # what the signs mean
        client = renderer.stage.client
        ball = client.createVisualShape(client.GEOM_SPHERE, radius=0.02, rgbaColor=(1.0, 0.0, 1.0, 1.0))
        client.createMultiBody(0.0, -1, ball, basePosition=(*place, height))
        picture = renderer.render(world).astype(int)
        marker = changed(picture, plain) & (np.minimum(picture[..., 0], picture[..., 2]) - picture[..., 1] > 60)
        assert 20 < marker.sum() < 1000
        assert 4 < drawn.sum() < 100
        assert middle_of(drawn) == pytest.approx(middle_of(marker), abs=1.2)
        assert middle_of(drawn) == pytest.approx(renderer.camera.project((*place, height))[0], abs=0.7)

    @pytest.mark.parametrize("thrust", [5.0, 10.0, 20.0])
    def test_the_thrust_arrow_is_as_long_as_the_thrust(self, world, renderer, thrust):
        stand(world)
        mask = changed(renderer.render(world, Overlay(fan=(0.3, 0.0, 0.0), thrust=thrust)), renderer.render(world))
        places = np.array([(0.3, 0.0, share * METERS_PER_NEWTON * thrust) for share in (0.0, 0.5, 0.9, 1.0)])
        tail, middle, head, tip = np.floor(renderer.camera.project(places)[0]).astype(int)
        assert mask[middle[1], middle[0]]
        assert mask[head[1], head[0]]
        assert not mask[tail[1] + 3, tail[0]]
        assert not mask[: tip[1] - 12, tip[0]].any()  # above the arrow and its number

    def test_everything_at_once_and_nothing_at_all(self, world, renderer):
        stand(world)
        plain = renderer.render(world)
        assert np.array_equal(renderer.render(world, Overlay()), plain)
        assert np.array_equal(renderer.render(world, Overlay(fan=(0.0, 0.0, 0.1), thrust=0.0)), plain)
        full = Overlay.of_step(
            STEP,
            center_of_mass=(0.1, 0.3, 0.2),
            assigned_zmp=(0.02, 0.31),
            zmp=(0.03, 0.3),
            fan=(0.2, 0.0, 0.1),
            thrust=12.3,
            caption="forward",
        )
        assert changed(renderer.render(world, full), plain).mean() > 0.01

    def test_a_zmp_that_is_not_there_is_not_drawn(self, world, renderer):
        stand(world)
        nowhere = Overlay(zmp=(math.nan, math.nan))
        mask = changed(renderer.render(world, nowhere), renderer.render(world))
        mask[190:, :130] = False
        assert not mask.any()

    def test_the_support_is_the_sole_and_the_margin_shrinks_it(self):
        overlay = Overlay.of_step(STEP, zmp_margin=0.02)
        x_min, x_max, y_min, y_max = STEP.robot.left.sole_rectangle
        whole, safe = np.array(overlay.support), np.array(overlay.safe_support)
        assert np.ptp(whole, axis=0) == pytest.approx((x_max - x_min, y_max - y_min, 0.0))
        assert np.ptp(whole, axis=0) - np.ptp(safe, axis=0) == pytest.approx((0.04, 0.04, 0.0))


class TestCamera:
    @pytest.mark.parametrize("azimuth", [-2.0, -0.9, 0.0, 2.5])
    @pytest.mark.parametrize("elevation", [0.1, 0.35, 1.2])
    def test_everything_fits_within_the_margins_and_touches_them(self, rng, azimuth, elevation):
        camera = Camera(640, 480, CameraSettings(azimuth=azimuth, elevation=elevation, margin=0.05))
        points = rng.uniform(-0.5, 0.5, (30, 3)) + np.array([0.2, 0.1, 0.0])
        camera.follow(points)
        pixels, depth = camera.project(points)
        share = pixels / (640.0, 480.0)
        assert depth.min() > camera.settings.near
        assert share.min() >= 0.05 - 1e-9
        assert share.max() <= 0.95 + 1e-9
        touched = np.isclose(share.min(axis=0), 0.05) & np.isclose(share.max(axis=0), 0.95)
        assert touched.any()

    def test_it_follows_smoothly_and_arrives(self):
        camera = Camera(64, 48)
        points = np.array([[0.0, 0.0, 0.0], [0.1, 0.2, 0.3]])
        camera.follow(points)
        start, further = camera.eye, points + np.array([1.0, 0.0, 0.0])
        camera.follow(further)
        assert camera.eye - start == pytest.approx((0.12, 0.0, 0.0))
        for _ in range(120):
            camera.follow(further)
        assert camera.eye - start == pytest.approx((1.0, 0.0, 0.0), abs=1e-5)

    def test_depths_come_back_from_the_buffer(self):
        camera = Camera(64, 48)
        near, far = camera.settings.near, camera.settings.far
        assert camera.depth(np.array([0.0, 1.0], dtype=np.float32)) == pytest.approx([near, far], rel=1e-5)

    @pytest.mark.parametrize("change", [{"elevation": 2.0}, {"follow": math.nan}, {"near": 20.0}])
    def test_settings_that_make_no_sense_are_refused(self, change):
        with pytest.raises(SettingsError, match=next(iter(change))):
            CameraSettings(**change)


class TestShading:
    def test_what_lies_behind_something_is_in_its_shadow(self):
        """The floor from above, lit from almost above, with something in front of half of what the light sees."""
        above = CameraSettings(azimuth=0.0, elevation=math.radians(80.0), near=1.0, far=30.0)
        light, camera = Camera(64, 64, above), Camera(40, 30, above)
        corners = np.array(list(itertools.product((-0.5, 0.5), (-0.5, 0.5), (0.0,))))
        light.follow(corners)
        camera.follow(0.6 * corners)
        floor = Floor(0.0, (0.0, 0.0), False, 0, 0.0, 0.0, 0.0)
        nothing = np.zeros((30, 40, 4), np.uint8), np.ones((30, 40), np.float32), np.full((30, 40), -1, np.int32)
        lit, half_lit = np.empty((2, 30, 40, 3), np.uint8)
        depth = np.full((64, 64), FAR_AWAY, dtype=np.float32)
        shade(camera.lens, floor, light.lens, depth, *nothing, lit)
        depth[:, :32] = 0.2
        shade(camera.lens, floor, light.lens, depth, *nothing, half_lit)
        rows, columns = np.mgrid[:30, :40] + 0.5
        rays = np.stack(
            [camera.slope_x * (columns / 20.0 - 1.0), camera.slope_y * (1.0 - rows / 15.0), np.ones_like(rows)]
        )
        directions = np.einsum("ki,krc->rci", camera.axes, rays)
        points = camera.eye - directions * (camera.eye[2] / directions[..., 2])[..., None]
        across = light.project(points)[0][..., 0]
        dark, bright = across < 30.0, across > 34.0
        assert 0.2 < dark.mean() < 0.8
        assert half_lit[bright] == pytest.approx(lit[bright])
        assert half_lit[dark] == pytest.approx(lit[dark] * np.array(SHADE), abs=1.0)

    def test_edges_are_smooth_because_a_pixel_is_the_mean_of_what_it_covers(self):
        camera = Camera(1, 1)
        camera.eye = np.array([0.0, 0.0, 5.0])
        floor = Floor(0.0, (0.0, 0.0), False, 0, 0.0, 0.0, 0.0)
        color = np.zeros((2, 2, 4), np.uint8)
        color[..., 0] = 200
        bare, covered = np.empty((2, 1, 1, 3), np.uint8)
        depth = np.full((8, 8), FAR_AWAY, dtype=np.float32)
        buffer = np.full((2, 2), 0.5, np.float32)  # near
        for picture, bodies in ((bare, [[-1, -1], [-1, -1]]), (covered, [[-1, 0], [-1, -1]])):
            shade(camera.lens, floor, Camera(8, 8).lens, depth, color, buffer, np.array(bodies, np.int32), picture)
        assert covered[0, 0] == pytest.approx(0.75 * bare[0, 0] + 0.25 * np.array([200.0, 0.0, 0.0]), abs=1.0)

    def test_a_carton_that_is_higher_stands_on_a_plinth(self, world, renderer):
        high = Step("right", (0.0, -0.1125, 0.0), (0.6, -0.1125, 0.08), (0.3, 0.1125, 0.0))
        stand(world, high)
        picture = renderer.render(world)
        x, y = np.floor(renderer.camera.project((0.6 + 0.06, -0.1125, -0.10))[0]).astype(int)
        plinth = picture[y, x].astype(int)
        assert plinth[0] - plinth[2] > 25  # brown, where the floor is a bluish grey

    def test_the_ditch_of_the_paper_spans_450_mm(self):
        ditch = ditch_of(STEP)
        assert ditch is not None
        assert ditch.axis == 0
        assert ditch.edges[1] - ditch.edges[0] == pytest.approx(0.45)

    def test_cartons_side_by_side_leave_no_ditch(self):
        step = Step("left", (0.0, 0.25, 0.0), (0.05, 0.3, 0.0), (0.0, 0.0, 0.0))
        assert ditch_of(step) is None
