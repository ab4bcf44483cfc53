"""Figures show what the plans hold, with units, in one scale, and without anything global."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from legends import legend_texts

import agents
from jet_gym import JetGymError, Step
from jet_gym.courses import PAPER
from jet_gym.figures import (
    check_figure_path,
    plot_estimates,
    plot_locomotion,
    plot_smoothness_sweep,
    plot_trajectories,
    save_figure,
    style,
)
from jet_gym.plan import Plan
from jet_gym.utils.statistics import Interval


@pytest.fixture(params=["side", "forward"])
def plan(request: pytest.FixtureRequest) -> Plan:
    """A plan of each of the paper's motions; the pelvis turns in the forward one."""
    return request.getfixturevalue(f"{request.param}_plan")


@pytest.fixture(scope="module")
def violated(rivals: list[Plan]) -> Plan:
    """A plan whose pelvis jumps out of the search range, and back again."""
    path = rivals[0].pelvis.copy()
    path[20, 2] += 0.04
    plan = Plan.from_pelvis_path(PAPER.side, path, planner="jumper")
    assert set(plan.violated_points) >= {20, 21}
    return plan


def row(motion: str, weight: float, value: float) -> Any:
    """Return a row of a sweep whose figures are all the same."""
    interval = Interval(value, 0.9 * value, 1.2 * value)
    names = ("mean_thrust", "peak_thrust", "pelvis_roughness", "thrust_roughness")
    summary = SimpleNamespace(planner="gas" if weight > 0.0 else "ga", **dict.fromkeys(names, interval))
    return SimpleNamespace(motion=motion, smoothness_weight=weight, summary=summary)


@pytest.fixture(scope="module")
def sweep_rows() -> list[Any]:
    """A sweep of two motions, not in order of weight."""
    weights = (5e7, 5e5, 0.0, 5e3)
    return [row(motion, weight, scale) for motion, scale in (("side", 1.0), ("forward", 2.0)) for weight in weights]


def assert_nothing_overlaps_or_is_cut(figure: Any) -> None:
    figure.draw_without_rendering()
    inches = figure.get_tightbbox()
    width, height = figure.get_size_inches()
    assert inches.x0 >= 0.0
    assert inches.y0 >= 0.0
    assert inches.x1 <= width
    assert inches.y1 <= height
    for legend in figure.legends:
        for axes in figure.axes:
            assert not legend.get_window_extent().overlaps(axes.get_tightbbox())
    for text in figure.texts:
        for axes in figure.axes:
            assert not text.get_window_extent().overlaps(axes.get_window_extent())


def test_trajectories_show_pelvis_in_millimetres_and_thrust_in_newtons(rivals: list[Plan]) -> None:
    figure = plot_trajectories(rivals)
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels == ["pelvis x [mm]", "pelvis y [mm]", "pelvis z [mm]", "thrust [N]"]
    assert figure.axes[-1].get_xlabel() == "swing point"
    for index, axes in enumerate(figure.axes[:3]):
        for line, plan in zip(axes.get_lines(), rivals, strict=True):
            np.testing.assert_allclose(line.get_ydata(), 1e3 * plan.pelvis[:, index])
    for line, plan in zip(figure.axes[3].get_lines(), rivals, strict=False):
        np.testing.assert_allclose(line.get_ydata(), plan.thrust)
        np.testing.assert_array_equal(line.get_xdata(), np.arange(plan.step.points))


def test_trajectories_can_run_over_time(rivals: list[Plan]) -> None:
    axes = plot_trajectories(rivals, against="time").axes[-1]
    assert axes.get_xlabel() == "time [s]"
    np.testing.assert_array_equal(axes.get_lines()[0].get_xdata(), rivals[0].time)


def test_each_planner_is_in_the_legend_in_its_own_colour(rivals: list[Plan]) -> None:
    figure = plot_trajectories(rivals)
    assert [text.split(":")[0] for text in legend_texts(figure)] == ["GAS", "GA", "GAEx"]
    looks = style.planner_styles(["gas", "ga", "gaex", "optimal", "policy", "mine", "yours"])
    assert len({look.color for look in looks.values()}) == 7


def test_plans_of_one_planner_are_told_apart_by_their_seed() -> None:
    plans = [agents.make_planner("ga").plan(PAPER.side, seed=seed) for seed in (3, 4)]
    assert [text.split(":")[0] for text in legend_texts(plot_trajectories(plans))] == ["GA, seed 3", "GA, seed 4"]


def test_thrust_limit_is_drawn_and_visible(rivals: list[Plan]) -> None:
    for limit in (None, 40.0):
        axes = plot_trajectories(rivals, max_thrust=limit).axes[-1]
        expected = PAPER.side.robot.max_thrust if limit is None else limit
        assert any(np.allclose(line.get_ydata(), expected) for line in axes.get_lines())
        assert axes.get_ylim()[1] > expected
        assert any(f"{expected:g} N" in text.get_text() for text in axes.texts)


def test_violated_points_are_marked_where_they_are(violated: Plan) -> None:
    figure = plot_trajectories([violated])
    k = list(violated.violated_points)
    for axes, values in zip(figure.axes, (*(1e3 * violated.pelvis.T), violated.thrust), strict=True):
        (crosses,) = [line for line in axes.get_lines() if line.get_marker() == "X"]
        np.testing.assert_array_equal(crosses.get_xdata(), k)
        np.testing.assert_allclose(crosses.get_ydata(), values[k])
    assert f"{len(k)} of {violated.step.points} points violated" in legend_texts(figure)[0]
    assert "a constraint is violated" in legend_texts(figure)


def test_no_violation_no_cross(rivals: list[Plan]) -> None:
    figure = plot_trajectories(rivals)
    assert not any(plan.violated_points for plan in rivals)
    assert not any(line.get_marker() == "X" for axes in figure.axes for line in axes.get_lines())
    assert not any("violated" in text for text in legend_texts(figure))


def test_plans_of_different_steps_do_not_share_a_figure(rivals: list[Plan]) -> None:
    other = agents.make_planner("ga").plan(PAPER.forward, seed=0)
    with pytest.raises(ValueError, match="'gas' and 'ga' differ"):
        plot_trajectories([rivals[0], other])
    with pytest.raises(ValueError, match="at least one plan"):
        plot_trajectories([])
    with pytest.raises(ValueError, match="'swing'"):
        plot_trajectories(rivals, against="swing")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("landing", "words"),
    [
        ((0.0, 0.34, 0.0), "Left foot steps 227.5 mm to the left"),
        ((-0.2, 0.1025, 0.05), "Left foot steps 200 mm backward and 10 mm to the right and 50 mm up"),
    ],
)
def test_title_names_the_motion_in_plain_words(landing: tuple[float, float, float], words: str) -> None:
    step = Step("left", (0.0, 0.1125, 0.0), landing, (0.0, -0.1125, 0.0), points=5)
    headline, where = style.describe_step(step)
    assert headline == words
    assert where.startswith("from (0, 112.5, 0) to (")
    assert where.endswith("the right foot stands at (0, \u2212112.5, 0) mm")
    plan = Plan.from_pelvis_path(step, np.tile(step.nominal_pelvis, (5, 1)), planner="still")
    assert words in [text.get_text() for text in plot_trajectories([plan]).texts]


def test_sweep_shows_means_with_intervals_over_the_weight(sweep_rows: list[Any]) -> None:
    figure = plot_smoothness_sweep(sweep_rows)
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert [label[label.index("[") :] for label in labels] == ["[N]", "[N]", "[mm]", "[N]"]
    for axes, scale in zip(figure.axes, (1.0, 1.0, 1e3, 1.0), strict=True):
        assert axes.get_xscale() == "log"
        for container, mean in zip(axes.containers, (1.0, 2.0), strict=True):
            curve, _, (bars,) = container
            np.testing.assert_allclose(np.asarray(curve.get_xdata(), float), [5e3, 5e5, 5e7])
            np.testing.assert_allclose(np.asarray(curve.get_ydata(), float), scale * mean)
            ends = np.array(bars.get_segments())[:, :, 1]
            np.testing.assert_allclose(ends, scale * mean * np.tile([0.9, 1.2], (3, 1)))
        reference = [line for line in axes.get_lines() if str(line.get_label()).startswith("GA (weight 0)")]
        assert [float(line.get_ydata()[0]) for line in reference] == [scale, 2.0 * scale]
    assert figure.axes[2].get_xlabel() == "smoothness weight ω [1/m²]"
    assert sorted(legend_texts(figure)) == [
        "GA (weight 0), forward", "GA (weight 0), side", "GAS, forward", "GAS, side",
    ]  # fmt: skip


def test_sweep_marks_the_round_units_and_the_default(sweep_rows: list[Any]) -> None:
    axes = plot_smoothness_sweep(sweep_rows).axes[0]
    marks = {text.get_text(): text.xy[0] for text in axes.texts}
    assert marks == {"50 per dm²": 5e3, "50 per cm²\n(default)": 5e5, "50 per mm²": 5e7}


def test_sweep_without_a_weight_is_refused() -> None:
    for rows in ([], [row("side", 0.0, 1.0)]):
        with pytest.raises(ValueError, match="at least one row"):
            plot_smoothness_sweep(rows)
    with pytest.raises(ValueError, match="finite numbers of 0 or more"):
        plot_smoothness_sweep([row("side", -1.0, 1.0)])


def test_nothing_overlaps_or_is_cut(plan: Plan, rivals: list[Plan], sweep_rows: list[Any], violated: Plan) -> None:
    for figure in (
        plot_locomotion(plan),
        plot_trajectories([*rivals, violated]),
        plot_smoothness_sweep(sweep_rows),
    ):
        assert_nothing_overlaps_or_is_cut(figure)


@pytest.mark.parametrize(("name", "start"), [("a.png", b"\x89PNG"), ("b.pdf", b"%PDF"), ("c.SVG", b"<?xml")])
def test_saved_figures_are_whole_and_the_same_every_time(
    tmp_path: Path, sweep_rows: list[Any], name: str, start: bytes
) -> None:
    path = tmp_path / name
    save_figure(plot_smoothness_sweep(sweep_rows), path, dots_per_inch=40.0)
    first = path.read_bytes()
    save_figure(plot_smoothness_sweep(sweep_rows), path, dots_per_inch=40.0)
    assert first.startswith(start)
    assert path.read_bytes() == first
    assert [file.name for file in tmp_path.iterdir()] == [name]


def test_a_figure_that_fails_half_way_leaves_the_old_file(tmp_path: Path) -> None:
    def fail(path: Path, **_: Any) -> None:
        path.write_bytes(b"half a figure")
        raise OSError("no space left")

    path = tmp_path / "figure.png"
    path.write_bytes(b"the old one")
    with pytest.raises(OSError, match="no space left"):
        save_figure(SimpleNamespace(savefig=fail), path)  # type: ignore[arg-type]
    assert path.read_bytes() == b"the old one"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["figure.gif", "figure", "figure.png.doc"])
def test_an_unknown_suffix_is_refused_before_anything_is_drawn(tmp_path: Path, name: str) -> None:
    for refuse in (check_figure_path, lambda path: save_figure(SimpleNamespace(), path)):  # type: ignore[arg-type]
        with pytest.raises(ValueError, match=r"its name must end in \.png, \.pdf, \.svg") as caught:
            refuse(tmp_path / name)
        assert isinstance(caught.value, JetGymError)
        assert name in str(caught.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("highest", [9.0, 31.0])
def test_estimates_show_every_peak_and_the_limit(highest: float) -> None:
    """A peak above the fan's limit is what the study is for."""
    peaks = [SimpleNamespace(peak_thrust=Interval(top - 1.0, top - 2.0, top)) for top in (6.0, 8.0, highest)]
    names = {"side": peaks[0], "side_ga": peaks[0], "forward": peaks[1], "forward_ga": peaks[2]}
    rows: list[Any] = [
        SimpleNamespace(
            quantity="pelvis mass", value=value, unit="kg", is_estimate=value == 2.8, greatest_ditch=0.5, **names
        )
        for value in (2.0, 2.8)
    ]
    figure = plot_estimates(rows, 23.0, 0.45)
    bottom, top = figure.axes[0].get_ylim()
    assert bottom == 0.0
    assert max(23.0, highest) < top < 1.2 * max(23.0, highest)


def test_a_missing_folder_is_refused_up_front(tmp_path: Path) -> None:
    assert check_figure_path(tmp_path / "figure.svg") == tmp_path / "figure.svg"
    with pytest.raises(FileNotFoundError):
        check_figure_path(tmp_path / "none" / "figure.svg")


def test_importing_figures_loads_no_matplotlib_and_drawing_no_pyplot(tmp_path: Path) -> None:
    script = f"""
import sys
import jet_gym.figures
assert "matplotlib" not in sys.modules
from jet_gym import Step
from jet_gym.plan import Plan
step = Step("left", (0, 0.1125, 0), (0, 0.2, 0), (0, -0.1125, 0), points=3)
plan = Plan.from_pelvis_path(step, [step.nominal_pelvis] * 3, planner="still")
import matplotlib
before = matplotlib.rcParams.copy()
jet_gym.figures.save_figure(jet_gym.figures.plot_locomotion(plan), {str(tmp_path / "a.png")!r}, 30.0)
jet_gym.figures.save_figure(jet_gym.figures.plot_trajectories([plan]), {str(tmp_path / "b.svg")!r})
assert matplotlib.rcParams.copy() == before
assert "matplotlib.pyplot" not in sys.modules
"""
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
