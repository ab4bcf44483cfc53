"""Damaged, foreign and hostile robots, and steps of any numbers: a typed error of one line or a sound object.

``make fuzz`` tries many more examples than the suite does.
"""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import fuzz_settings
from damage import NUMBERS, check_sentence, damaged_bytes
from hypothesis import given
from hypothesis import strategies as st
from watching import watched

from jet_gym import Robot, Step, jet_hr1, load_robot
from jet_gym.errors import JetGymError, RobotError, StepError
from jet_gym.posture import evaluate_postures

ATTRIBUTES = [
    "",
    "0",
    "-1",
    "nan",
    "inf",
    "1e-320",
    "1e308",
    "1e400",
    "1 2 3",
    "0 0 0",
    "0 0 1",
    "3.2 1 0.5",
    "fixed",
    "prismatic",
    "continuous",
    "left_foot",
    "pelvis",
    "9" * 5000,
    "٣",
    "1_0",
    "0x1",
    "1e-9",
    "0.3 0.3 0.3",
]


@pytest.fixture(scope="module")
def urdf_text() -> str:
    return jet_hr1().urdf_path.read_text(encoding="utf-8")


def refused_or_stands(path: Path, tmp_path: Path) -> None:
    """Load a robot; on one that loads, postures are evaluated."""
    with watched() as deeds:
        try:
            robot = load_robot(path)
        except RobotError as error:
            check_sentence(error)
        else:
            stand(robot)
    assert deeds.elsewhere(tmp_path) == []
    assert deeds.unpickled == deeds.run == []


def stand(robot: Robot) -> None:
    """Evaluate some postures; what is within the constraints is finite."""
    try:
        step = Step("left", (0.0, 0.15, 0.0), (0.1, 0.35, 0.0), (0.0, -0.15, 0.0), points=3, robot=robot)
    except StepError:
        return
    pelvis = step.nominal_pelvis
    assert np.isfinite(pelvis).all()
    try:
        postures = evaluate_postures(robot, "left", step.swing_sole, step.support, np.tile(pelvis, (3, 1)))
    except JetGymError as error:
        check_sentence(error)
        return
    for values in (postures.joint_positions, postures.thrust, postures.zmp, postures.center_of_mass):
        assert np.isfinite(values[postures.violations == 0]).all()


@given(data=st.data())
@fuzz_settings(60)
def test_a_damaged_robot_is_refused_or_sound(data: st.DataObject, urdf_text: str, tmp_path: Path) -> None:
    path = tmp_path / f"robot-{data.draw(st.integers(0, 10**9))}.urdf"
    path.write_bytes(data.draw(damaged_bytes(urdf_text.encode())))
    refused_or_stands(path, tmp_path)


@given(data=st.data())
@fuzz_settings(60)
def test_a_robot_with_other_attributes_is_refused_or_sound(
    data: st.DataObject, urdf_text: str, tmp_path: Path
) -> None:
    from xml.etree import ElementTree

    root = ElementTree.fromstring(urdf_text)
    values = st.sampled_from(ATTRIBUTES)
    for _ in range(data.draw(st.integers(1, 3))):
        elements = list(root.iter())
        element = data.draw(st.sampled_from(elements))
        kind = data.draw(st.sampled_from(["attribute", "attribute", "attribute", "remove", "clear", "twice"]))
        children = list(element)
        if kind == "attribute" and element.attrib:
            element.set(data.draw(st.sampled_from(sorted(element.attrib))), data.draw(values))
        elif kind == "remove" and children:
            element.remove(data.draw(st.sampled_from(children)))
        elif kind == "twice" and children:
            element.append(data.draw(st.sampled_from(children)))
        elif kind == "clear":
            element.clear()
    path = tmp_path / f"robot-{data.draw(st.integers(0, 10**9))}.urdf"
    ElementTree.ElementTree(root).write(path, encoding="utf-8")
    refused_or_stands(path, tmp_path)


@given(scale=st.floats(0.05, 20.0), mass=st.floats(1e-3, 1e3), thrust=st.floats(0.0, 1e4))
@fuzz_settings(15)
def test_a_robot_of_another_size_stands(
    scale: float, mass: float, thrust: float, urdf_text: str, tmp_path: Path
) -> None:
    """Lengths, masses and fans multiplied: the same legs, so it loads and has the size that it should."""
    from xml.etree import ElementTree

    root = ElementTree.fromstring(urdf_text)

    def multiply(tag: str, names: tuple[str, ...], factor: float) -> None:
        for element in root.iter(tag):
            for name in names:
                if name in element.attrib:
                    element.set(name, " ".join(repr(factor * float(word)) for word in element.attrib[name].split()))

    multiply("origin", ("xyz",), scale)
    for shape in ("box", "cylinder", "sphere"):
        multiply(shape, ("size", "radius", "length"), scale)
    multiply("mass", ("value",), mass)
    multiply("fan", ("max_thrust",), max(thrust, 1e-3))
    path = tmp_path / f"robot-{scale}-{mass}-{thrust}.urdf"
    ElementTree.ElementTree(root).write(path, encoding="utf-8")
    robot = load_robot(path)
    assert robot.mass == pytest.approx(mass * jet_hr1().mass)
    assert robot.leg_length == pytest.approx(scale * jet_hr1().leg_length)
    stand(robot)


def test_entities_that_multiply_are_refused(tmp_path: Path) -> None:
    """A billion laughs."""
    names = "abcdefghij"
    entities = "".join(f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in itertools.pairwise(names))
    text = f'<!DOCTYPE robot [<!ENTITY a "ha">{entities}]><robot name="r"><link name="&j;"/></robot>'
    (tmp_path / "robot.urdf").write_text(text, encoding="utf-8")
    with watched(), pytest.raises(RobotError):
        load_robot(tmp_path / "robot.urdf")


def test_a_robot_reads_no_other_file(tmp_path: Path) -> None:
    (tmp_path / "secret.txt").write_text("1.5", encoding="utf-8")
    text = (
        '<!DOCTYPE robot [<!ENTITY x SYSTEM "secret.txt">]><robot name="r"><link name="pelvis">&x;</link></robot>'
    )
    (tmp_path / "robot.urdf").write_text(text, encoding="utf-8")
    with watched(), pytest.raises(RobotError) as caught:
        load_robot(tmp_path / "robot.urdf")
    assert "1.5" not in str(caught.value)


COORDINATES = st.one_of(st.floats(-0.8, 0.8), st.floats(), st.sampled_from([0.0, 0.1125, -0.1125, 1e9, "0", None]))

POSITIONS = st.one_of(st.tuples(*[st.floats(-0.8, 0.8)] * 3), st.lists(COORDINATES, max_size=4))


@given(
    swing=st.sampled_from(["left", "right", "both", None, 3]),
    positions=st.tuples(POSITIONS, POSITIONS, POSITIONS),
    apex=st.one_of(st.floats(1e-4, 0.3), NUMBERS),
    points=st.one_of(st.integers(2, 60), NUMBERS),
    duration=st.one_of(st.floats(0.1, 20.0), NUMBERS),
)
@fuzz_settings(80)
def test_a_step_is_refused_or_has_a_path(
    swing: Any, positions: tuple[Any, Any, Any], apex: Any, points: Any, duration: Any
) -> None:
    start, landing, support = positions
    try:
        step = Step(swing, start, landing, support, apex, points, duration)
    except StepError as error:
        check_sentence(error)
        return
    assert step.swing_sole.shape == (step.points, 3)
    assert step.swing_sole[0] == pytest.approx(start, abs=1e-9)
    assert step.swing_sole[-1] == pytest.approx(landing, abs=1e-9)
    assert np.isfinite(step.swing_sole).all()
    if step.points <= 60:
        postures = evaluate_postures(
            step.robot, step.swing, step.swing_sole, step.support, np.tile(step.nominal_pelvis, (step.points, 1))
        )
        assert np.isfinite(postures.thrust[postures.violations == 0]).all()
