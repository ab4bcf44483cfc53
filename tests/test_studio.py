"""The studio without a browser: inputs, the worker, what is planned and said, motions, and the server."""

from __future__ import annotations

import io
import math
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest
from PIL import Image

from agents import make_planner
from agents.policy import SHIPPED_POLICY
from jet_gym.balance import BalanceSettings
from jet_gym.balance_space import compute_balance_space
from jet_gym.cli import run
from jet_gym.errors import PolicyFileError, StepError
from jet_gym.fitness import FitnessSettings
from jet_gym.kinematics import forward_kinematics
from jet_gym.plan import Plan
from jet_gym.posture import evaluate_postures
from jet_gym.studio import planning
from jet_gym.studio.balance_cloud import boundary_of, hull_of
from jet_gym.studio.balance_view import edge_polygon
from jet_gym.studio.curves import fitness_terms, zmp_margin
from jet_gym.studio.errors import PortInUseError
from jet_gym.studio.ground_view import meet_horizontal_plane
from jet_gym.studio.inputs import FEET, Inputs
from jet_gym.studio.motion import Motion
from jet_gym.studio.own_models import read_model
from jet_gym.studio.panel import mirrored
from jet_gym.studio.physics import Physics
from jet_gym.studio.player import Player
from jet_gym.studio.plots import Curve, Samples, _Plot
from jet_gym.studio.recording import encode_film, film_times
from jet_gym.studio.robot_shapes import robot_tree
from jet_gym.studio.robot_view import joints_near_limits
from jet_gym.studio.server import Studio
from jet_gym.studio.table import comparison_table
from jet_gym.studio.worker import LatestWorker

SIDE = Inputs.of_motion("side")


@pytest.fixture(scope="module")
def plan() -> Plan:
    return make_planner("gas").plan(SIDE.step, seed=0)


def never() -> bool:
    return False


# ---- inputs


def test_defaults_of_the_page_are_those_of_the_package() -> None:
    assert SIDE.balance == BalanceSettings()
    assert SIDE.fitness == FitnessSettings()


@pytest.mark.parametrize("foot", FEET)
def test_moved_foot_is_the_only_thing_that_changes(foot: str) -> None:
    moved = SIDE.moved(foot, (0.01, 0.02, 0.03))
    assert moved.position(foot) == (0.01, 0.02, 0.03)
    assert all(moved.position(other) == SIDE.position(other) for other in FEET if other != foot)
    assert moved.moved(foot, SIDE.position(foot)) == SIDE


def test_unknown_foot_is_refused() -> None:
    with pytest.raises(ValueError, match="a foot is one of"):
        SIDE.moved("head", (0.0, 0.0, 0.0))


def test_step_that_makes_no_sense_is_refused_when_it_is_asked_for() -> None:
    inputs = SIDE.moved("landing", SIDE.start)
    with pytest.raises(StepError, match="same place"):
        _ = inputs.step


def test_mirrored_step_takes_the_same_thrust() -> None:
    """The robot is symmetric, so least thrusts of mirrored postures are equal."""
    other = mirrored(SIDE)
    assert other.swing == "right"
    pelvis = SIDE.step.nominal_pelvis
    thrusts = [
        evaluate_postures(i.step.robot, i.swing, i.landing, i.support, pelvis * np.array([1, sign, 1])).thrust
        for i, sign in ((SIDE, 1), (other, -1))
    ]
    assert thrusts[0] == pytest.approx(thrusts[1], abs=1e-9)


# ---- the worker


def test_worker_does_the_newest_job_and_skips_what_came_in_between() -> None:
    started, go_on, done = threading.Event(), threading.Event(), []

    def work(job: int, stale: Any) -> None:
        started.set()
        go_on.wait(10.0)
        done.append((job, stale()))

    worker = LatestWorker(work, "test")
    worker.submit(1)
    assert started.wait(10.0)
    for job in (2, 3, 4):
        worker.submit(job)
    go_on.set()
    assert worker.wait_until_idle(10.0)
    assert done == [(1, True), (4, False)]
    worker.close()


def test_worker_drops_what_waits_and_makes_stale_what_it_does() -> None:
    seen, go_on = [], threading.Event()

    def work(_job: int, stale: Any) -> None:
        go_on.wait(10.0)
        seen.append(stale())

    worker = LatestWorker(work, "test")
    worker.submit(1)
    time.sleep(0.05)
    worker.drop()
    go_on.set()
    assert worker.wait_until_idle(10.0)
    assert seen in ([], [True])
    worker.close()


def test_patient_worker_waits_until_no_newer_job_comes() -> None:
    done: list[int] = []
    begun: list[float] = []
    patience = 0.3
    worker = LatestWorker(lambda job, _: (done.append(job), begun.append(time.monotonic())), "test", patience)
    before, after = [], []  # each job's submission
    for job in range(5):
        before.append(time.monotonic())
        worker.submit(job)
        after.append(time.monotonic())
    assert worker.wait_until_idle(60.0)
    assert done[-1] == 4
    assert begun[-1] >= before[-1] + patience
    overtaken = {job for job in range(4) if after[job + 1] - before[job] < patience}
    assert not overtaken & set(done)
    worker.close()


def test_closed_worker_ends_its_thread_and_takes_no_job() -> None:
    done: list[int] = []
    worker = LatestWorker(lambda job, _: done.append(job), "test")
    worker.close()
    worker.close()
    worker.submit(1)
    deadline = time.monotonic() + 10.0
    while worker.alive:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert done == []


def test_player_passes_the_time_of_the_clock_and_stops() -> None:
    passed: list[float] = []
    player = Player(passed.append, "test")
    player.speed = 2.0
    started = time.monotonic()
    player.playing = True
    deadline = started + 60.0
    while len(passed) < 3:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    player.playing = False
    count = len(passed)
    assert 0.0 < sum(passed) <= 2.0 * (time.monotonic() - started)
    time.sleep(0.1)
    assert len(passed) == count
    player.close()


def test_player_is_paused_only_when_nothing_is_on_its_way_any_more() -> None:
    advancing, go_on, paused = threading.Event(), threading.Event(), threading.Event()
    player = Player(lambda _: (advancing.set(), go_on.wait(60.0)), "test")
    player.playing = True
    assert advancing.wait(60.0)

    def pause() -> None:
        player.playing = False
        paused.set()

    threading.Thread(target=pause, daemon=True).start()
    assert not paused.wait(0.2)
    go_on.set()
    assert paused.wait(60.0)
    player.close()


def test_player_can_be_paused_by_what_it_calls() -> None:
    calls: list[float] = []
    paused = threading.Event()

    def advance(elapsed: float) -> None:
        calls.append(elapsed)
        player.playing = False
        paused.set()

    player = Player(advance, "test")
    player.playing = True
    assert paused.wait(60.0)
    player.playing = False  # from outside: waits until that call has returned
    assert len(calls) == 1
    player.close()


# ---- a policy of the user's own


def policy_file(name: str) -> bytes:
    return SHIPPED_POLICY.with_name(name).read_bytes()


def test_own_policy_plans_as_the_package_does_with_it_under_its_own_name() -> None:
    inputs = replace(SIDE, models=(read_model("mine.npz", policy_file("policy.npz"), trust=False),))
    assert inputs.planners[-2:] == ("mine.npz", "mine.npz+refine")
    for own, shipped in (("mine.npz", "policy"), ("mine.npz+refine", "policy+refine")):
        plan, same = planning.plan_with(own, inputs, never), planning.plan_with(shipped, inputs, never)
        assert plan is not None
        assert same is not None
        np.testing.assert_array_equal(plan.pelvis, same.pelvis)
        assert plan.planner == own
        assert f">{own}</td>" in comparison_table([plan]).replace("<wbr>", "")


def test_own_policy_of_the_same_name_takes_the_place_of_the_old_one() -> None:
    first, second = (read_model("mine.npz", policy_file("policy.npz"), trust=False) for _ in range(2))
    inputs = SIDE.with_model(first).with_model(second)
    assert inputs.models == (second,)
    assert inputs.planner == "mine.npz"


def test_trusted_zip_is_loaded() -> None:
    pytest.importorskip("stable_baselines3")
    plain = read_model("mine.npz", policy_file("policy.npz"), trust=False).network
    network = read_model("model.zip", policy_file("model.zip"), trust=True).network
    middle = np.zeros((1, len(plain.center)), dtype=np.float32)
    np.testing.assert_allclose(network.act(middle), plain.act(middle), atol=1e-5)


def damaged_policy() -> bytes:
    """A file whose numbers are not those that it was hashed with."""
    with np.load(SHIPPED_POLICY) as file:
        content = {name: file[name] for name in file.files}
    content["biases_0"] = content["biases_0"] + 1.0
    written = io.BytesIO()
    np.savez(written, **content)
    return written.getvalue()


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("mine.npz", b"nothing", "mine.npz is not a policy"),
        ("mine.npz", damaged_policy(), "mine.npz is damaged"),
        ("mine.txt", b"", "must end in .npz or .zip"),
        ("mine.zip", b"", "tick that you trust it"),
    ],
)
def test_file_that_is_no_policy_is_refused_by_its_own_name(name: str, content: bytes, words: str) -> None:
    with pytest.raises(PolicyFileError, match=words) as error:
        read_model(name, content, trust=False)
    assert "tmp" not in str(error.value)


def test_network_of_another_shape_is_refused_before_anybody_plans_with_it() -> None:
    network = read_model("mine.npz", policy_file("policy.npz"), trust=False).network
    (first, *others) = network.layers
    bent = replace(network, layers=((first[0][:, 1:], first[1]), *others))
    with pytest.raises(PolicyFileError, match=r"mine\.zip does not take the observations"):
        bent.require_actions("mine.zip")
    blind = replace(network, center=np.full_like(network.center, np.nan))
    with pytest.raises(PolicyFileError, match=r"mine\.zip does not make the actions"):
        blind.require_actions("mine.zip")


# ---- what is planned and said


def test_plan_of_the_page_is_the_planners_own(plan: Plan) -> None:
    again = planning.plan_with("gas", SIDE, never)
    assert again is not None
    np.testing.assert_array_equal(again.pelvis, plan.pelvis)


def test_planning_gives_up_once_it_is_stale() -> None:
    assert planning.plan_with("gas", SIDE, lambda: True) is None


def test_verdict_of_a_plan_that_holds_tells_its_peak_thrust(plan: Plan) -> None:
    verdict = planning.judge(plan, SIDE)
    assert verdict.kind == "holds"
    assert f"{plan.thrust.max():.1f} N of 23 N" in verdict.sentence


@pytest.mark.parametrize(("y", "word"), [(2.0, "out of the legs' reach"), (0.8, "takes a thrust of")])
def test_infeasible_step_is_told_with_point_and_constraint(y: float, word: str) -> None:
    inputs = SIDE.moved("landing", (0.0, y, 0.0))
    plan = planning.plan_with("gas", replace(inputs, points=10), never)
    assert plan is not None
    verdict = planning.explain(plan, inputs, never)
    assert verdict is not None
    assert verdict.kind == "infeasible"
    assert verdict.sentence.startswith("No posture makes swing point 9 (of 0 to 9): ")
    assert word in verdict.sentence


def test_infeasible_step_is_told_even_while_it_is_dragged_on() -> None:
    inputs = replace(SIDE.moved("landing", (0.0, 2.0, 0.0)), points=10)
    plan = planning.plan_with("gas", inputs, never)
    assert plan is not None
    verdict = planning.explain(plan, inputs, lambda: True)
    assert verdict is not None
    assert verdict.kind == "infeasible"


def test_planner_that_misses_a_posture_is_told_apart_from_an_infeasible_step() -> None:
    """GAEx cannot follow a swing foot that moves 22 mm a point, though postures exist at each."""
    inputs = replace(Inputs.of_motion("forward"), points=30)
    plan = planning.plan_with("gaex", inputs, never)
    assert plan is not None
    assert plan.violated_points
    few = replace(
        plan, violations=tuple(v if k == plan.violated_points[-1] else () for k, v in enumerate(plan.violations))
    )
    verdict = planning.explain(few, inputs, never)
    assert verdict is not None
    assert verdict.kind == "violated"
    assert "though a posture exists there" in verdict.sentence


# ---- curves, table, motion


def test_fitness_terms_sum_to_the_fitness_of_the_plan(plan: Plan) -> None:
    np.testing.assert_allclose(fitness_terms(plan, SIDE.fitness).sum(axis=1), plan.fitness, rtol=1e-12)


def test_zmp_margin_is_zero_on_the_edge_and_negative_outside(plan: Plan) -> None:
    x_min, x_max, y_min, y_max = plan.step.robot.right.sole_rectangle
    x, y, _ = plan.step.support
    points = np.array([[x + x_max, y], [x + x_min - 0.01, y], [x, y + y_min + 0.005], [x, y + y_max + 0.002]])
    np.testing.assert_allclose(zmp_margin(plan.step, points), [0.0, -0.01, 0.005, -0.002], atol=1e-12)


def test_table_has_a_row_for_each_plan(plan: Plan) -> None:
    table = comparison_table([plan, replace(plan, planner="ga")])
    assert table.count("<tr") == 3
    assert f"{plan.thrust.max():.2f}" in table


def test_motion_meets_the_plan_at_its_swing_points_and_lies_between_them_elsewhere(plan: Plan) -> None:
    motion = Motion.of_plan(plan)
    pose = motion.at(float(plan.time[7]))
    np.testing.assert_allclose(pose.pelvis, plan.pelvis[7], atol=1e-12)
    np.testing.assert_allclose(pose.joint_positions, plan.joint_positions[7], atol=1e-12)
    between = motion.at(float(plan.time[7:9].mean()))
    np.testing.assert_allclose(between.pelvis, plan.pelvis[7:9].mean(axis=0), atol=1e-12)
    assert np.linalg.norm(between.orientation) == pytest.approx(1.0)
    np.testing.assert_array_equal(motion.at(1e3).pelvis, plan.pelvis[-1])
    np.testing.assert_array_equal(motion.at(-1.0).pelvis, plan.pelvis[0])


# ---- geometry


def test_edge_polygon_is_where_equation_10_lets_the_centre_of_mass_be(rng: np.random.Generator) -> None:
    """On the outline the angle between ZMP, centre of mass and ankle is rho; by the formula, not by the arc."""
    zmp, ankle, rho = np.array([0.02, -0.1]), np.array([0.4, 0.3]), math.radians(7.0)
    outline = edge_polygon(zmp, ankle, rho, 24)
    inner = np.concatenate([outline[1:23], outline[25:47]])
    to_com, to_ankle = inner - zmp, ankle - inner
    angle = np.arctan2(to_com[:, 1], to_com[:, 0]) - np.arctan2(to_ankle[:, 1], to_ankle[:, 0])
    np.testing.assert_allclose(np.abs(angle), rho, rtol=1e-9)
    np.testing.assert_allclose(outline[[0, 24]], [zmp, zmp], atol=1e-12)
    np.testing.assert_allclose(outline[[23, 47]], [ankle, ankle], atol=1e-12)


def test_pointer_meets_the_plane_of_a_block(rng: np.random.Generator) -> None:
    eye, target = np.array([1.0, -2.0, 1.5]), np.array([0.3, 0.4, 0.1])
    through = eye + 0.37 * (target - eye)
    np.testing.assert_allclose(meet_horizontal_plane(eye, through, 0.1), target, atol=1e-12)
    assert meet_horizontal_plane(eye, eye + np.array([1.0, 0.0, 0.0]), 0.1) is None
    assert meet_horizontal_plane(eye, eye + np.array([1.0, 0.0, 0.2]), 0.1) is None


def test_robot_on_the_page_is_put_together_as_kinematics_has_it(plan: Plan) -> None:
    """The scene's chain of frames, multiplied out, leads to the soles that the kinematics knows."""
    from viser.transforms import SE3, SO3

    robot = plan.step.robot
    urdf = robot_tree(robot.urdf_path).urdf
    joints = plan.joint_positions[11]
    body = forward_kinematics(robot, joints)
    for side, leg in enumerate((robot.names.left, robot.names.right)):
        pose = np.eye(4)
        for name in leg.joints:
            joint = urdf.joints[name]
            turn = SO3.exp(joints[robot.joint_names.index(name)] * joint.axis)
            pose = pose @ joint.origin @ SE3.from_rotation(turn).as_matrix()
        foot = leg.joints[-1]
        sole = np.linalg.inv(urdf.zero_poses[urdf.joints[foot].child]) @ urdf.zero_poses[leg.sole]
        np.testing.assert_allclose((pose @ sole)[:3, 3], body.soles[side], atol=1e-9)


def test_every_link_with_a_visual_is_drawn_with_its_colours() -> None:
    tree = robot_tree(SIDE.step.robot.urdf_path)
    assert {"pelvis", "left_thigh", "right_foot"} <= set(tree.shapes)
    assert "left_fan" not in tree.shapes  # it belongs to the foot that carries it
    feet = np.concatenate([shape.vertices for shape in tree.shapes["left_foot"]])
    assert feet[:, 2].min() == pytest.approx(-0.06, abs=2e-3)  # the sole is 60 mm below the ankle
    assert len({shape.color for shape in tree.shapes["pelvis"]}) >= 4


def test_joint_near_its_limit_is_named_with_what_is_left() -> None:
    robot = SIDE.step.robot
    joints = 0.5 * (robot.lower + robot.upper)
    joints[3] = robot.upper[3] - math.radians(2.0)
    assert joints_near_limits(robot, joints) == [("left_knee_pitch", pytest.approx(math.radians(2.0)))]


# ---- films


PICTURES = [np.full((33, 47, 3), 40 * k, dtype=np.uint8) for k in range(5)]


def test_mp4_has_every_frame(tmp_path: Path) -> None:
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    file = tmp_path / "film.mp4"
    file.write_bytes(encode_film(PICTURES, "mp4", 20.0))
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(file))
    assert (frames, seconds) == (5, pytest.approx(0.25, abs=0.06))


def test_gif_has_every_frame_at_an_even_size() -> None:
    with Image.open(io.BytesIO(encode_film(PICTURES, "gif", 20.0))) as film:
        assert (film.format, film.n_frames, film.size) == ("GIF", 5, (46, 32))
        film.seek(3)
        assert film.convert("RGB").getpixel((10, 10)) == (120, 120, 120)


def test_film_of_nothing_or_of_another_kind_is_refused() -> None:
    with pytest.raises(ValueError, match="one picture at least"):
        encode_film([], "mp4", 20.0)
    with pytest.raises(ValueError, match="one of mp4, gif"):
        encode_film([np.zeros((8, 8, 3), np.uint8)], "avi", 20.0)  # type: ignore[arg-type]


def test_film_lasts_as_long_as_the_motion_at_its_speed() -> None:
    times = film_times(-1.0, 3.0, speed=2.0, frames_per_second=10.0)
    assert (times[0], times[-1], len(times)) == (-1.0, 3.0, 21)


# ---- the server


def test_page_is_served_to_this_machine_alone() -> None:
    with Studio(port=0) as studio:
        assert studio.url.startswith("http://127.0.0.1:")
        with urllib.request.urlopen(studio.url, timeout=30) as page:
            assert b"viser" in page.read().lower()
        sockets = [line for line in listening() if line.endswith(f":{studio.port:04X}")]
        assert sockets == [f"0100007F:{studio.port:04X}"]
    with pytest.raises(OSError, match=r"refused|reset"):
        urllib.request.urlopen(studio.url, timeout=5)


def listening() -> list[str]:
    """Return the addresses at which this machine listens, as Linux writes them."""
    found = []
    for table in (Path("/proc/net/tcp"), Path("/proc/net/tcp6")):
        lines = table.read_text().splitlines()[1:] if table.exists() else []
        found += [fields[1] for fields in map(str.split, lines) if fields[3] == "0A"]
    return found


def test_port_in_use_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(PortInUseError, match=f"port {port} of 127.0.0.1 is in use"):
            Studio(port=port)
        assert run(["studio", "--port", str(port)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith(f"jet-gym: port {port} of 127.0.0.1 is in use")
    assert captured.err.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--port", "70000"], "70000"),
        (["--host", "no such host"], "cannot listen at no such host"),
        (["--motion", "up"], "up"),
    ],
)
def test_bad_input_is_one_sentence(arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["studio", *arguments]) == 2
    captured = capsys.readouterr()
    assert words in captured.err
    assert captured.err.count("\n") == 1


def test_ctrl_c_ends_it_at_once() -> None:
    command = [sys.executable, "-m", "jet_gym.cli", "studio", "--port", "0"]
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # noqa: PLW1509
    )
    assert process.stdout is not None
    line = process.stdout.readline()
    assert "http://127.0.0.1:" in line
    os.kill(process.pid, signal.SIGINT)
    out, error = process.communicate(timeout=60)
    assert process.returncode == 130
    assert out == ""
    assert "Traceback" not in error
    assert error.strip().count("\n") == 0


# ---- the balance space


def test_boundary_of_a_set_of_cells_is_closed_and_holds_their_volume(rng: np.random.Generator) -> None:
    """By the divergence theorem: a closed surface with its front outside encloses as many cells as the set has."""
    inside = rng.random((5, 6, 4)) < 0.4
    corners, faces = boundary_of(inside)
    a, b, c = (corners[faces[:, k]] for k in range(3))
    assert (np.einsum("ni,ni->n", a, np.cross(b, c)) / 6.0).sum() == pytest.approx(inside.sum())
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    assert (uses % 2 == 0).all()


def test_boundary_of_nothing_has_no_face() -> None:
    assert len(boundary_of(np.zeros((3, 3, 3), dtype=bool))[1]) == 0


def test_hull_of_the_balance_space_lies_around_its_places() -> None:
    space = compute_balance_space(0.08, threads=1)
    inside = space.reachable(with_thrust=True)
    vertices, _ = hull_of(space, inside)
    places = np.stack(np.meshgrid(space.x, space.y, space.z, indexing="ij"), axis=-1)[inside] - space.support
    assert (np.abs(vertices.min(axis=0) - places.min(axis=0)) < 0.08).all()
    assert (np.abs(vertices.max(axis=0) - places.max(axis=0)) < 0.08).all()


# ---- physics


def test_simulated_motion_is_on_the_clock_of_its_plan() -> None:
    """Lift-off at zero, landing at the plan's duration, and the robot where the kinematics has it all the while."""
    pytest.importorskip("pybullet")
    plan = planning.plan_with("gas", replace(SIDE, points=10, duration=2.5), never)
    assert plan is not None
    done = threading.Event()
    results: list[Any] = []
    shares: list[float] = []
    physics = Physics(shares.append, lambda _plan, result: (results.append(result), done.set()))
    physics.send(plan)
    assert done.wait(120.0)
    (simulated,) = results
    assert not simulated.fallen, simulated.outcome
    assert shares == sorted(shares)
    motion = simulated.motion
    assert motion.start < 0.0 < plan.step.duration < motion.end
    lifted = motion.poses.swing_sole[:, 2] > 0.01
    assert -0.2 < motion.time[lifted][0] < 0.5 * plan.step.duration
    landed = motion.at(plan.step.duration)
    np.testing.assert_allclose(landed.swing_sole, plan.step.landing, atol=5e-3)
    pose = motion.at(0.5 * plan.step.duration)
    np.testing.assert_allclose(pose.pelvis, Motion.of_plan(plan).at(0.5 * plan.step.duration).pelvis, atol=0.02)
    fan = plan.step.robot.left.fan[2] - plan.step.robot.left.sole[2]
    assert pose.fan[2] - pose.swing_sole[2] == pytest.approx(fan, abs=2e-3)


def test_dropped_simulation_is_not_reported(plan: Plan) -> None:
    pytest.importorskip("pybullet")
    results: list[Any] = []
    physics = Physics(lambda _: None, lambda _plan, result: results.append(result))
    thread = physics.send(plan)
    physics.drop()
    thread.join(60.0)
    assert not thread.is_alive()
    assert results == []


def test_plot_shows_all_of_a_measured_motion_that_lasts_longer_than_the_plan() -> None:
    gui: Any = MagicMock()
    planned = Samples(Curve("planned", "#000000"), np.array([0.0, 1.0]), np.array([1.0, 3.0]))
    measured = Samples(Curve("measured", "#111111"), np.array([-1.0, 2.0]), np.array([0.0, 5.0]))
    _Plot(gui, MagicMock(), 0.0, "Thrust", "N").show([planned, measured], 0.5)
    scales = gui.add_uplot.call_args.kwargs["scales"]
    assert scales["x"]["range"] == (-1.0, 2.0)
    low, high = scales["y"]["range"]
    assert low < 0.0
    assert high > 5.0
