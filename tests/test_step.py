"""Steps, their arcs, and what makes no sense."""

from __future__ import annotations

import json
import math
import pickle
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from jet_gym import Step, courses
from jet_gym.errors import StepError
from jet_gym.step import LARGEST_OVERLAP
from jet_gym.swing_path import feet_apart
from jet_gym.utils.arrays import Array

SIDE = {"swing": "left", "start": (0.0, 0.1125, 0.0), "landing": (0.0, 0.34, 0.0), "support": (0.0, -0.1125, 0.0)}


def step(**changes: Any) -> Step:
    """Return the paper's step to the side with something changed."""
    return Step(**(SIDE | changes))


@st.composite
def steps(draw: st.DrawFn) -> Step:
    """A step of either leg over even or uneven ground."""
    swing = draw(st.sampled_from(["left", "right"]))
    outward = 1.0 if swing == "left" else -1.0
    places = [
        (draw(st.floats(-0.4, 0.4)), outward * draw(st.floats(0.12, 0.4)), draw(st.floats(-0.15, 0.15)))
        for _ in range(2)
    ]
    assume(math.dist(places[0][:2], places[1][:2]) > 0.01)
    apex, points = draw(st.floats(0.01, 0.3)), draw(st.integers(2, 40))
    try:
        return Step(swing, places[0], places[1], (0.0, 0.0, 0.0), apex=apex, points=points)
    except StepError:  # a steep arc leans over the support foot
        assume(False)
        raise


def chord_frame(of: Step) -> tuple[Array, Array, Array]:
    """Return unit vectors along the chord, across its vertical plane, and across the chord in that plane."""
    along = np.subtract(of.landing, of.start)
    along /= np.linalg.norm(along)
    across = np.cross([0.0, 0.0, 1.0], along)
    across /= np.linalg.norm(across)
    return along, across, np.cross(along, across)


# ---------------------------------------------------------------------- the arc


@given(steps())
def test_the_swing_sole_goes_from_start_to_landing(of: Step) -> None:
    path = of.swing_sole
    assert path.shape == (of.points, 3)
    assert tuple(path[0]) == of.start
    assert tuple(path[-1]) == of.landing


@given(steps())
def test_swing_points_are_equally_spaced(of: Step) -> None:
    lengths = np.linalg.norm(np.diff(of.swing_sole, axis=0), axis=1)
    np.testing.assert_allclose(lengths, lengths[0], rtol=1e-9)


@given(steps())
def test_swing_points_stay_in_the_vertical_plane_of_start_and_landing(of: Step) -> None:
    _, across, _ = chord_frame(of)
    np.testing.assert_allclose((of.swing_sole - of.start) @ across, 0.0, atol=1e-12)


@given(steps())
def test_swing_points_lie_on_one_circle_that_rises_by_the_apex(of: Step) -> None:
    along, _, up = chord_frame(of)
    middle = 0.5 * np.add(of.start, of.landing)
    half = 0.5 * math.dist(of.start, of.landing)
    top = middle + of.apex * up
    assert up[2] > 0.0
    # The circle through start, landing and the top of the arc: its centre is as far from the top as from both.
    drop = (half**2 - of.apex**2) / (2.0 * of.apex)
    center = middle - drop * up
    radius = np.linalg.norm(np.subtract(of.start, center))
    assert np.linalg.norm(top - center) == pytest.approx(radius)
    np.testing.assert_allclose(np.linalg.norm(of.swing_sole - center, axis=1), radius, rtol=1e-9)
    rise, run = (of.swing_sole - middle) @ up, (of.swing_sole - middle) @ along
    assert (rise >= -1e-9).all()
    np.testing.assert_allclose(rise, rise[::-1], atol=1e-9)
    np.testing.assert_allclose(run, -run[::-1], atol=1e-9)
    if of.points % 2:
        np.testing.assert_allclose(of.swing_sole[of.points // 2], top, atol=1e-9)


def test_the_arc_is_highest_in_the_middle_of_a_level_step() -> None:
    path = step(apex=0.1, points=31).swing_sole
    assert path[:, 2].argmax() == 15
    np.testing.assert_allclose(path[15], [0.0, 0.22625, 0.1], atol=1e-12)


def test_an_apex_beyond_half_the_chord_makes_more_than_half_a_circle() -> None:
    path = step(start=(0.0, 0.2, 0.0), landing=(0.0, 0.3, 0.0), apex=0.12, points=41).swing_sole
    assert path[:, 1].min() < 0.2
    assert path[:, 1].max() > 0.3
    assert path[20] == pytest.approx([0.0, 0.25, 0.12])


def test_a_step_onto_a_block_ends_on_the_block() -> None:
    path = step(landing=(0.1, 0.3, 0.14), apex=0.1).swing_sole
    assert path[-1, 2] == 0.14
    assert path[:, 2].max() > 0.14


@pytest.mark.parametrize(("swing", "outward"), [("left", 1.0), ("right", -1.0)])
@pytest.mark.parametrize("rise", [0.14, -0.14])
def test_a_step_straight_up_or_down_bulges_away_from_the_support_foot(
    swing: str, outward: float, rise: float
) -> None:
    start = (0.0, outward * 0.2, 0.0)
    path = Step(swing, start, (*start[:2], rise), (0.0, 0.0, 0.0), apex=0.05, points=21).swing_sole
    np.testing.assert_allclose(path[10], [0.0, outward * 0.25, 0.5 * rise], atol=1e-12)
    np.testing.assert_array_equal(path[:, 0], 0.0)
    assert (outward * path[1:-1, 1] > 0.2).all()


def test_time_runs_evenly_over_the_duration() -> None:
    np.testing.assert_allclose(step(points=5, duration=8.0).time, [0.0, 2.0, 4.0, 6.0, 8.0])


# ---------------------------------------------------------------------- the nominal pelvis


@pytest.mark.parametrize("height", [0.0, 0.3])
def test_the_nominal_pelvis_is_over_the_middle_of_parallel_feet(height: float) -> None:
    at = step(start=(0.0, 0.1125, height), landing=(0.0, 0.34, height), support=(0.0, -0.1125, height))
    np.testing.assert_allclose(at.nominal_pelvis, [0.0, 0.0, height + 0.9 * 0.46], atol=1e-12)


def test_the_nominal_pelvis_is_no_nearer_to_the_swing_foot_in_a_narrow_stance() -> None:
    np.testing.assert_allclose(step(start=(0.0, 0.0, 0.0)).nominal_pelvis[:2], [0.0, -0.05625], atol=1e-12)


def test_the_nominal_pelvis_stays_near_the_support_foot_in_a_wide_stance() -> None:
    wide = step(start=(0.0, 0.4, 0.0), landing=(0.3, 0.4, 0.0))
    np.testing.assert_allclose(wide.nominal_pelvis[:2], [0.0, 0.0], atol=1e-12)


# ---------------------------------------------------------------------- plain data


def test_a_step_survives_json() -> None:
    of = step(points=7, apex=0.05, duration=3.0)
    assert Step(**json.loads(json.dumps(of.to_dict()))) == of


def test_a_step_survives_pickling() -> None:
    assert pickle.loads(pickle.dumps(step())) == step()


def test_numbers_of_other_kinds_become_plain_ones() -> None:
    of = step(start=np.array([0, 0.1125, 0]), points=np.int64(9), apex=np.float32(0.125), duration=4)
    assert of.start == (0.0, 0.1125, 0.0)
    assert json.loads(json.dumps(of.to_dict()))["points"] == 9
    assert type(of.duration) is float


# ---------------------------------------------------------------------- what is refused

NO_SENSE: dict[str, tuple[Mapping[str, Any], str]] = {
    "swing of both": ({"swing": "both"}, "swing must be 'left' or 'right', not 'both'"),
    "swing of no one": ({"swing": None}, "swing must be 'left' or 'right', not None"),
    "same place": ({"landing": SIDE["start"]}, r"start and landing are the same place, \(0\.0, 0\.1125, 0\.0\)"),
    "almost the same place": ({"landing": (0.0, 0.1129, 0.0)}, "start and landing are the same place"),
    "start is nowhere": ({"start": (0.0, math.nan, 0.0)}, "start must be finite, not nan"),
    "landing is far": ({"landing": (math.inf, 0.34, 0.0)}, "landing must be finite"),
    "support is nowhere": ({"support": (0.0, -0.1125, math.nan)}, "support must be finite"),
    "start in the plane": ({"start": (0.0, 0.1125)}, "start must be three numbers x, y, z in m"),
    "start in words": ({"start": "here"}, "start must be three numbers"),
    "no start": ({"start": None}, "start must be three numbers"),
    "one point": ({"points": 1}, "points must be a whole number of 2 or more, not 1"),
    "no points": ({"points": 0}, "points must be a whole number of 2 or more, not 0"),
    "half points": ({"points": 9.5}, r"points must be a whole number of 2 or more, not 9\.5"),
    "points of truth": ({"points": True}, "points must be a whole number of 2 or more, not True"),
    "flat": ({"apex": 0.0}, "apex must lie between 0.0001 and 100, not 0"),
    "through the ground": ({"apex": -0.1}, "apex must lie between 0.0001 and 100, not -0.1"),
    "apex in the sky": ({"apex": math.inf}, "apex must be finite, not inf"),
    "apex in words": ({"apex": "high"}, "apex must be a number, not 'high'"),
    "at once": ({"duration": 0.0}, "duration must lie between"),
    "for ever": ({"duration": math.nan}, "duration must be finite"),
    "feet start in each other": ({"start": (0.0, -0.02, 0.0)}, "the feet overlap at the start: .* 7.5 mm into"),
    "feet land in each other": ({"landing": (0.05, -0.08, 0.0)}, "the feet overlap at the landing"),
    "foot swings through foot": ({"landing": (0.0, -0.34, 0.0)}, r"the feet overlap on the way"),
    "the other foot swings": ({"swing": "right", "landing": (0.0, -0.14, 0.0)}, "the feet overlap"),
}


@pytest.mark.parametrize(("changes", "message"), NO_SENSE.values(), ids=NO_SENSE)
def test_what_makes_no_sense_is_refused(changes: Mapping[str, Any], message: str) -> None:
    with pytest.raises(StepError, match=message):
        step(**changes)


def test_a_step_error_is_a_value_error() -> None:
    assert issubclass(StepError, ValueError)


@pytest.mark.parametrize(("gap", "ahead"), [(0.1001, 0.0), (0.0, 0.1701)])
def test_feet_side_by_side_or_one_before_the_other_are_allowed(gap: float, ahead: float) -> None:
    at = step(start=(ahead, gap - 0.1125, 0.0), landing=(ahead + 0.1, gap, 0.0))
    assert at.start[1] == pytest.approx(gap - 0.1125)


def _share_ground(one: list[float], other: list[float]) -> bool:
    """Tell whether two rectangles x_min, x_max, y_min, y_max have ground in common."""
    return all(max(one[k], other[k]) < min(one[k + 1], other[k + 1]) for k in (0, 2))


@pytest.mark.parametrize("seed", range(4))
def test_soles_are_apart_as_far_as_they_have_to_move_or_to_grow_to_touch(seed: int) -> None:
    """Soles of any sizes: where they overlap, the shortest way out; otherwise twice what each may grow."""
    generator = np.random.default_rng(seed)
    swing, support = (np.sort(generator.uniform(-0.1, 0.1, (2, 2))).ravel().tolist() for _ in range(2))
    dx, dy = generator.uniform(-0.15, 0.15, (2, 300))
    apart = feet_apart(tuple(swing), tuple(support), dx, dy)
    assert (apart < 0.0).any()
    assert (apart > 0.0).any()
    for x, y, distance in zip(dx.tolist(), dy.tolist(), apart.tolist(), strict=True):
        assert feet_apart(tuple(swing), tuple(support), x, y) == distance

        def touch(by: float, x: float = x, y: float = y, distance: float = distance) -> bool:
            if distance > 0.0:
                grown = [0.5 * by * distance * sign for sign in (-1.0, 1.0, -1.0, 1.0)]
                at = np.add(swing, [x, x, y, y]) + grown
                return _share_ground(at.tolist(), np.add(support, grown).tolist())
            ways = [(x + by * distance, y), (x - by * distance, y), (x, y + by * distance), (x, y - by * distance)]
            return all(_share_ground(np.add(swing, [a, a, b, b]).tolist(), support) for a, b in ways)

        assert touch(0.999) == (distance < 0.0)
        assert touch(1.001) == (distance > 0.0)


@pytest.mark.parametrize(("share", "allowed"), [(0.9, True), (1.1, False)])
def test_soles_may_overlap_by_what_counts_as_touching(share: float, allowed: bool) -> None:
    gap = 0.1 - share * LARGEST_OVERLAP
    changes = {"start": (0.0, gap - 0.1125, 0.0), "landing": (0.3, gap, 0.0)}
    if allowed:
        step(**changes)
    else:
        with pytest.raises(StepError, match="the feet overlap at the start"):
            step(**changes)


# ---------------------------------------------------------------------- the paper's course


def test_the_course_is_the_papers_two_motions() -> None:
    side, forward = courses.PAPER
    assert len(courses.PAPER) == 2
    assert courses.PAPER["side"] is side is courses.PAPER.side
    assert courses.PAPER["forward"] is forward is courses.PAPER.forward
    assert (side.swing, side.start, side.landing, side.support) == (
        "left", (0.0, 0.1125, 0.0), (0.0, 0.34, 0.0), (0.0, -0.1125, 0.0),
    )  # fmt: skip
    assert (forward.swing, forward.start, forward.support) == ("right", side.support, side.landing)
    assert forward.landing == pytest.approx((0.66, 0.1275, 0.0))


def test_the_ditch_is_450_mm_wide_between_cartons_of_210_mm() -> None:
    forward = courses.PAPER.forward
    near_edge, far_edge = forward.support[0] + 0.210 / 2.0, forward.landing[0] - 0.210 / 2.0
    assert far_edge - near_edge == pytest.approx(0.450)
    sole = forward.robot.right.sole_rectangle
    assert sole[1] - sole[0] < 0.210  # the foot fits on a carton


def test_the_course_fills_the_papers_24_s_with_a_transition_of_4_s() -> None:
    assert sum(motion.duration for motion in courses.PAPER) + 4.0 == 24.0
