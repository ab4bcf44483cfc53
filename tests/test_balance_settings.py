"""What counts as balanced can be set: defaults, ranges, and the margin that a sole leaves."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError, replace
from typing import TYPE_CHECKING

import pytest
from standing import (
    WEIGHT,
)

from jet_gym.balance import (
    BalanceSettings,
    Point,
)
from jet_gym.errors import SettingsError
from jet_gym.leg import SIDES, Side
from jet_gym.robot import Robot

if TYPE_CHECKING:
    pass


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("thrust_model", "most", "thrust_model must be 'assigned' or 'least', not 'most'"),
        ("zmp_margin", -0.01, r"zmp_margin must be a distance of 0 m or more, not -0\.01"),
        ("zmp_margin", math.nan, "zmp_margin must be a distance"),
        ("zmp_margin", math.inf, "zmp_margin must be a distance"),
        ("zmp_margin", "wide", "zmp_margin must be a number, not 'wide'"),
        ("edge_tolerance", 0.0, r"edge_tolerance must lie between 0 and pi/2 rad, not 0\.0"),
        ("edge_tolerance", -0.1, r"edge_tolerance must lie between 0 and pi/2 rad, not -0\.1"),
        ("edge_tolerance", 5.0, r"edge_tolerance must lie between 0 and pi/2 rad, not 5\.0"),
        ("edge_tolerance", math.pi / 2.0, r"edge_tolerance must lie between 0 and pi/2 rad, not 1\.57"),
        ("edge_tolerance", math.nan, "edge_tolerance must lie"),
        ("edge_tolerance", "wide", "edge_tolerance must be a number, not 'wide'"),
        ("max_thrust", -1.0, r"max_thrust must be 0 N or more, not -1\.0"),
        ("max_thrust", "full", "max_thrust must be a number, not 'full'"),
        ("max_thrust", math.inf, "max_thrust must be 0 N or more, not inf"),
    ],
)
def test_settings_out_of_range_are_refused(name: str, value: object, message: str) -> None:
    with pytest.raises(SettingsError, match=message):
        BalanceSettings(**{name: value})


@pytest.mark.parametrize(
    ("name", "value"),
    [("zmp_margin", 0.0), ("edge_tolerance", 1e-9), ("edge_tolerance", 1.57), ("max_thrust", 0.0)],
)
def test_settings_at_the_ends_of_their_range_are_accepted(name: str, value: float) -> None:
    assert getattr(BalanceSettings(**{name: value}), name) == value


def test_settings_stay_what_they_are() -> None:
    with pytest.raises(FrozenInstanceError):
        BalanceSettings().zmp_margin = 0.03


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(
    ("ankle", "room"), [((0.06, 0.0), 0.04), ((-0.05, 0.01), 0.02), ((0.03, 0.03), 0.03), ((0.03, -0.035), 0.015)]
)
def test_the_margin_leaves_the_ankle_wherever_it_stands_over_the_sole(
    robot: Robot, side: Side, ankle: Point, room: float
) -> None:
    leg = robot.leg(side)._replace(sole=(-ankle[0], -ankle[1], -0.06), sole_rectangle=(-0.07, 0.10, -0.05, 0.06))
    robot = replace(robot, **{side: leg})
    assert BalanceSettings(zmp_margin=room - 1e-9).parameters(robot).zmp_margin == room - 1e-9
    with pytest.raises(SettingsError, match=f"which is {room:.3g} m from the edge of the sole"):
        BalanceSettings(zmp_margin=room + 1e-9).parameters(robot)


def test_a_margin_that_leaves_no_sole_around_the_ankle_is_refused(robot: Robot) -> None:
    with pytest.raises(SettingsError, match=r"zmp_margin of 0\.05 m leaves no support around the ankle"):
        BalanceSettings(zmp_margin=0.05).parameters(robot)
    assert BalanceSettings(zmp_margin=0.0499).parameters(robot).zmp_margin == 0.0499


def test_the_defaults_are_those_of_the_paper_and_the_robot(robot: Robot) -> None:
    parameters = BalanceSettings().parameters(robot)
    assert not parameters.least_thrust
    assert parameters.zmp_margin == 0.02
    assert parameters.edge_slope == pytest.approx(math.tan(math.radians(5.0)))
    assert parameters.max_thrust == 23.0
    assert parameters.weight == pytest.approx(WEIGHT)
    assert BalanceSettings(max_thrust=10.0).parameters(robot).max_thrust == 10.0


def test_a_settings_error_is_a_value_error() -> None:
    assert issubclass(SettingsError, ValueError)
