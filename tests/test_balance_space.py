"""The balance space against plain loops, its symmetry, its file, its figures and its command."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from jet_gym import Robot, Step
from jet_gym.balance import BalanceSettings
from jet_gym.balance_space import DIRECTIONS, BalanceSpace, compute_balance_space, least_thrust_of_step
from jet_gym.cli import run
from jet_gym.constraints import EDGE_POLYGON
from jet_gym.courses import PAPER
from jet_gym.errors import BalanceSpaceFileError, SettingsError, StepError
from jet_gym.figures import plot_balance_section, plot_balance_space, save_figure
from jet_gym.joint_torques import static_torques
from jet_gym.posture import Postures, evaluate_postures
from jet_gym.utils.arrays import Array

COARSE = 0.1


@pytest.fixture(scope="module")
def space() -> BalanceSpace:
    """A coarse balance space."""
    return compute_balance_space(0.06)


def _plainly(robot: Robot, space: BalanceSpace, settings: BalanceSettings) -> tuple[Array, Array, Array]:
    """Find the balance space by loops over the places and every pelvis that the support leg might carry."""
    line = space.resolution * np.arange(-math.ceil(0.6 / space.resolution), math.ceil(0.6 / space.resolution) + 1)
    pelvis = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3) + space.support
    off = BalanceSettings(thrust_model="least", zmp_margin=settings.zmp_margin, max_thrust=0.0)
    thrust, held, share = (np.full(space.thrust.shape, math.nan) for _ in range(3))
    for i, x in enumerate(space.x):
        for j, y in enumerate(space.y):
            if abs(x - space.support[0]) < 0.17 - 1e-9 and abs(y - space.support[1]) < 0.1 - 1e-9:
                continue
            for k, z in enumerate(space.z):
                above = pelvis[pelvis[:, 2] >= max(z, space.support[2]) - 1e-9]
                found = []
                for choice, ignored in ((off, EDGE_POLYGON), (settings, 0)):
                    postures = evaluate_postures(robot, space.swing, (x, y, z), space.support, above, choice)
                    kept = np.flatnonzero(postures.violations & ~ignored == 0)
                    balanced = Postures(**{name: values[kept] for name, values in vars(postures).items()})
                    torques = np.abs(static_torques(robot, space.swing, balanced)) / robot.effort
                    found += list(zip(balanced.thrust, torques.max(axis=-1), strict=True))
                if found:
                    thrust[i, j, k] = min(newtons for newtons, _ in found)
                    share[i, j, k] = min(part for _, part in found)
                    held[i, j, k] = min((newtons for newtons, part in found if part <= 1.0), default=math.nan)
    return thrust, held, share


@pytest.mark.parametrize("gap", [0.09995, 0.0998])
def test_places_count_where_a_step_may_stand(robot: Robot, gap: float) -> None:
    """Soles, 0.1 m wide, that overlap by 0.05 mm only touch; by 0.2 mm they do not."""
    space = compute_balance_space(gap, BalanceSettings(thrust_model="least"))
    support = space.support
    beside = int(np.flatnonzero(np.abs(space.y - support[1] - gap) < 1e-9)[0])
    found = np.isfinite(space.thrust[np.abs(space.x - support[0]) < 1e-9, beside]).any()
    allowed = True
    try:
        Step("left", (support[0], float(space.y[beside]), 0.0), (0.3, 0.2, 0.0), support, robot=robot)
    except StepError:
        allowed = False
    assert found == allowed == (gap == 0.09995)


@pytest.mark.parametrize(("model", "swing", "margin"), [("assigned", "left", 0.02), ("least", "right", 0.01)])
def test_equals_plain_loops_over_every_posture(
    model: Literal["assigned", "least"], swing: Literal["left", "right"], margin: float, robot: Robot
) -> None:
    settings = BalanceSettings(thrust_model=model, zmp_margin=margin)
    space = compute_balance_space(COARSE, settings, swing=swing, lowest=-COARSE, threads=2)
    thrust, held, share = _plainly(robot, space, settings)
    assert np.count_nonzero(thrust == 0.0) > 20
    assert np.count_nonzero(thrust > 0.0) > 20
    np.testing.assert_allclose(space.thrust, thrust, atol=1e-9)
    np.testing.assert_allclose(space.thrust_within_torque, held, atol=1e-9)
    np.testing.assert_allclose(space.torque_share, share, atol=1e-9)


def test_weak_servos_hold_less(robot: Robot, tmp_path: Path) -> None:
    from jet_gym import load_robot

    text = robot.urdf_path.read_text()
    weak_file = tmp_path / "weak.urdf"
    weak_file.write_text(
        text.replace('effort="15.6"', 'effort="3.0"').replace("meshes/", f"{robot.urdf_path.parent}/")
    )
    weak, strong = compute_balance_space(0.08, robot=load_robot(weak_file)), compute_balance_space(0.08)
    np.testing.assert_array_equal(weak.thrust, strong.thrust)
    for with_thrust in (False, True):
        held = weak.reachable(with_thrust=with_thrust, within_torque=True)
        assert 0 < np.count_nonzero(held) < np.count_nonzero(weak.reachable(with_thrust=with_thrust))
    asked = np.isfinite(weak.thrust)
    np.testing.assert_array_equal(weak.torque_share[asked] <= 1.0, np.isfinite(weak.thrust_within_torque[asked]))


def test_thrust_widens_the_space_and_more_thrust_more(space: BalanceSpace) -> None:
    without, with_thrust = (space.reachable(with_thrust=choice) for choice in (False, True))
    assert (with_thrust | ~without).all()
    assert space.volume(with_thrust=True) > 1.5 * space.volume(with_thrust=False) > 0.0
    for direction in DIRECTIONS:
        assert space.reach(direction, with_thrust=True) > space.reach(direction, with_thrust=False)
    half = compute_balance_space(space.resolution, BalanceSettings(max_thrust=11.5))
    np.testing.assert_array_equal(half.reachable(with_thrust=True), space.thrust <= 11.5)


def test_the_other_leg_has_the_mirror_image(space: BalanceSpace) -> None:
    other = compute_balance_space(space.resolution, swing="right", threads=1)
    np.testing.assert_allclose(other.y, -space.y[::-1], atol=1e-12)
    np.testing.assert_allclose(other.thrust[:, ::-1], space.thrust, atol=1e-6)
    for direction in DIRECTIONS:
        ours, theirs = (each.reach(direction, with_thrust=True) for each in (space, other))
        assert ours == pytest.approx(theirs)


def test_no_foot_stands_on_the_other(space: BalanceSpace) -> None:
    i = int(np.argmin(np.abs(space.x - space.support[0])))
    j = int(np.argmin(np.abs(space.y - space.support[1])))
    assert np.isnan(space.thrust[i, j]).all()


def test_the_file_gives_the_space_back(space: BalanceSpace, tmp_path: Path) -> None:
    space.save(tmp_path / "space.npz")
    again = BalanceSpace.load(tmp_path / "space.npz")
    assert (again.robot, again.swing, again.support) == (space.robot, space.swing, space.support)
    assert (again.resolution, again.settings) == (space.resolution, space.settings)
    for name in ("x", "y", "z", "thrust", "thrust_within_torque", "torque_share"):
        np.testing.assert_array_equal(getattr(again, name), getattr(space, name))


def test_another_file_is_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "other.npz", format="something/2")
    (tmp_path / "text.npz").write_text("no archive")
    for name in ("other.npz", "text.npz"):
        with pytest.raises(BalanceSpaceFileError, match=name):
            BalanceSpace.load(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("support", np.ones(3) * 1j, "its part 'support' must be numbers"),
        ("resolution", 1j, "its part 'resolution' must be numbers"),
        ("zmp_margin", "0.02", "its part 'zmp_margin' must be numbers"),
        ("swing", "up", "its part 'swing' must be 'left' or 'right', not 'up'"),
        ("thrust_model", "some", "thrust_model must be"),
    ],
)
def test_settings_that_make_no_sense_are_refused(
    name: str, value: object, sentence: str, space: BalanceSpace, tmp_path: Path
) -> None:
    space.save(tmp_path / "space.npz")
    with np.load(tmp_path / "space.npz") as file:
        content = dict(file) | {name: np.array(value)}
    np.savez(tmp_path / "space.npz", **content)
    with pytest.raises(BalanceSpaceFileError, match=sentence):
        BalanceSpace.load(tmp_path / "space.npz")


@pytest.mark.parametrize(("resolution", "lowest"), [(0.0, 0.0), (math.nan, 0.0), (1.0, 0.0), (0.1, math.inf)])
def test_senseless_grids_are_refused(resolution: float, lowest: float) -> None:
    with pytest.raises(SettingsError):
        compute_balance_space(resolution, lowest=lowest)


def test_reach_wants_a_known_direction_and_level_ground(space: BalanceSpace) -> None:
    with pytest.raises(ValueError, match="direction"):
        space.reach("upward", with_thrust=True)
    with pytest.raises(ValueError, match="height"):
        compute_balance_space(0.2, lowest=0.1).reach("forward", with_thrust=True)


def test_progress_ends_with_all_of_the_work() -> None:
    seen: list[tuple[int, int]] = []
    compute_balance_space(0.2, progress=lambda done, total: seen.append((done, total)))
    assert [done for done, _ in seen] == list(range(1, seen[0][1] + 1))


def test_figures_show_as_many_points_as_there_are(space: BalanceSpace, tmp_path: Path) -> None:
    clouds = plot_balance_space(space)
    drawn = [len(axes.collections[0].get_offsets()) for axes in clouds.axes]
    assert drawn == [np.count_nonzero(space.reachable(with_thrust=choice)) for choice in (False, True)]
    for figure in (clouds, plot_balance_section(space)):
        save_figure(figure, tmp_path / "figure.png", dots_per_inch=40.0)


def test_command_writes_space_and_pictures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = ["--output", str(tmp_path / "a.npz"), "--plot", str(tmp_path / "a.png")]
    assert run(["balance-space", "--resolution", "0.1", "--thrust-model", "least", *files]) == 0
    printed = capsys.readouterr().out
    space = BalanceSpace.load(tmp_path / "a.npz")
    assert space.settings.thrust_model == "least"
    assert f"{1e3 * space.volume(with_thrust=True):.1f}" in printed
    assert {path.name for path in tmp_path.iterdir()} == {"a.npz", "a.png", "a-section.png"}


@pytest.mark.parametrize(
    "arguments",
    [
        ["--resolution", "0"],
        ["--resolution", "fine"],
        ["--zmp-margin", "0.5"],
        ["--output", "space.json"],
        ["--plot", "space.bmp"],
        ["--plot", "space.png", "--lowest", "0.1"],
        ["--output", "nowhere/space.npz"],
    ],
)
def test_command_tells_bad_input_in_a_line(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["balance-space", *arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("jet-gym: ")
    assert error.count("\n") == 1


def test_least_thrust_of_a_step_is_that_of_plain_loops(robot: Robot) -> None:
    step = replace(PAPER.forward, points=7)
    least = least_thrust_of_step(step, resolution=0.04)
    line = 0.04 * np.arange(-15, 16)
    grid = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3) + step.support
    for sole, found in zip(step.swing_sole, least, strict=True):
        above = grid[grid[:, 2] >= max(sole[2], 0.0) - 1e-9]
        postures = evaluate_postures(robot, step.swing, sole, step.support, above)
        plainly = postures.thrust[postures.violations == 0].min(initial=math.inf)
        assert found == pytest.approx(plainly) or (math.isnan(found) and plainly == math.inf)
    assert np.isfinite(least).any()
    with pytest.raises(SettingsError):
        least_thrust_of_step(step, resolution=0.0)
