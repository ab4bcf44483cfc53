"""Damaged, foreign and hostile files: a typed error of one line or a sound object; nothing is run, nothing hangs.

``make fuzz`` tries many more examples than the suite does.
"""

from __future__ import annotations

import contextlib
import io
import itertools
import json
import math
import pickle
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import fuzz_settings
from hypothesis import given
from hypothesis import strategies as st
from watching import watched

from agents.network import PolicyNetwork
from agents.policy import SHIPPED_POLICY, PolicyPlanner
from jet_gym import Robot, Step, jet_hr1, load_robot
from jet_gym.balance_space import BalanceSpace, compute_balance_space
from jet_gym.courses import PAPER
from jet_gym.errors import JetGymError, PlanFileError, PolicyFileError, RobotError, StepError
from jet_gym.plan import Plan
from jet_gym.posture import evaluate_postures
from jet_gym.simulation.trials import Experiment, TrialsFileError, load_trials, save_trials
from jet_gym.task.observation import HIGH, LOW

NUMBERS = st.one_of(
    st.floats(),
    st.integers(),
    st.sampled_from([0, -1, 2, 10**9, 10**30, 10**400, -0.0, 1e308, math.nan, math.inf, True, "1", "nan"]),
)
JSON = st.recursive(
    st.one_of(st.none(), st.booleans(), NUMBERS, st.text(max_size=8)),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=5), inner, max_size=3)),
    max_leaves=8,
)


class Bomb:
    """Writes a file when it is unpickled."""

    def __init__(self, target: Path) -> None:
        self.target = target

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.target,)


def check_sentence(error: BaseException) -> None:
    """An error's message is one line that says something."""
    assert len(str(error)) > 10
    assert "\n" not in str(error)


# ---------------------------------------------------------------------- damage


@st.composite
def damaged_bytes(draw: st.DrawFn, content: bytes) -> bytes:
    """Flip, cut out, repeat or put in some bytes."""
    damaged = bytearray(content)
    for _ in range(draw(st.integers(1, 4))):
        place = draw(st.integers(0, max(len(damaged) - 1, 0)))
        length = draw(st.integers(1, 40))
        kind = draw(st.sampled_from(["flip", "cut", "end", "repeat", "insert"]))
        if kind == "flip" and damaged:
            damaged[place] ^= 1 << draw(st.integers(0, 7))
        elif kind == "cut":
            del damaged[place : place + length]
        elif kind == "end":
            del damaged[place:]
        elif kind == "repeat":
            damaged[place:place] = damaged[place : place + length]
        else:
            damaged[place:place] = draw(st.binary(max_size=8))
    return bytes(damaged)


@st.composite
def damaged_json(draw: st.DrawFn, content: str) -> str:
    """Replace, delete or add values somewhere in a document."""
    data = json.loads(content)
    for _ in range(draw(st.integers(1, 3))):
        node = data
        while isinstance(node, dict | list) and node:
            keys = list(node) if isinstance(node, dict) else list(range(len(node)))
            key = draw(st.sampled_from(keys))
            child = node[key]
            if isinstance(child, dict | list) and child and draw(st.integers(0, 3)):
                node = child
                continue
            kind = draw(st.sampled_from(["replace", "replace", "number", "delete", "add"]))
            if kind == "replace":
                node[key] = draw(JSON)
            elif kind == "number":
                node[key] = draw(NUMBERS)
            elif kind == "delete":
                del node[key]
            elif isinstance(node, dict):
                node[draw(st.text(max_size=5))] = draw(JSON)
            else:
                node.append(draw(JSON))
            break
    return json.dumps(data)


# ---------------------------------------------------------------------- plans


@pytest.fixture(scope="module")
def plan_text(tmp_path_factory: pytest.TempPathFactory) -> str:
    step = replace(PAPER.side, points=4)
    plan = Plan.from_pelvis_path(step, np.tile(step.nominal_pelvis, (4, 1)), planner="mine")
    path = tmp_path_factory.mktemp("plan") / "plan.json"
    plan.save(path)
    return path.read_text()


@given(data=st.data())
@fuzz_settings(60)
def test_a_damaged_plan_is_refused_or_sound(data: st.DataObject, plan_text: str, tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    kind = data.draw(st.sampled_from(["json", "json", "bytes", "other"]))
    if kind == "json":
        path.write_text(data.draw(damaged_json(plan_text)), encoding="utf-8", errors="surrogatepass")
    elif kind == "bytes":
        path.write_bytes(data.draw(damaged_bytes(plan_text.encode())))
    else:
        path.write_text(json.dumps(data.draw(JSON)), encoding="utf-8")
    with watched() as deeds:
        try:
            plan = Plan.load(path)
        except PlanFileError as error:
            check_sentence(error)
        else:
            assert all(np.isfinite(getattr(plan, name)).all() for name in ("pelvis", "thrust", "time"))
            plan.save(tmp_path / "again.json")
            assert Plan.load(tmp_path / "again.json").to_dict() == plan.to_dict()
    assert deeds.elsewhere(tmp_path) == []
    assert deeds.unpickled == deeds.run == []


@pytest.mark.parametrize("text", ["[" * 200_000, '{"format":' * 100_000, "9" * 100_000, "\ufeff{}", "\x00", "NaN"])
def test_a_plan_of_a_strange_text_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "plan.json").write_text(text, encoding="utf-8")
    with watched(), pytest.raises(PlanFileError) as caught:
        Plan.load(tmp_path / "plan.json")
    check_sentence(caught.value)


# ---------------------------------------------------------------------- policies

DTYPES = st.sampled_from(["f4", "f8", "f2", "i8", "u1", "c16", "?", "U3", "S3", "M8[s]"])
SHAPES = st.lists(st.integers(0, 4), max_size=3).map(tuple)


def policy_arrays() -> dict[str, Any]:
    """Return what is in the policy that ships."""
    with np.load(SHIPPED_POLICY, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def refused_or_acts(path: Path, tmp_path: Path) -> None:
    """Load a policy; whatever loads must act on everything that is observed, and plan."""
    PolicyNetwork.load(SHIPPED_POLICY)  # acting loads machine code from numba's cache, which is pickled
    with watched() as deeds:
        try:
            network = PolicyNetwork.load(path)
        except PolicyFileError as error:
            check_sentence(error)
        else:
            actions = network.act(np.array([LOW, HIGH], dtype=np.float32))
            assert actions.shape == (2, 3)
            assert np.isfinite(actions).all()
    assert deeds.elsewhere(tmp_path) == []
    assert deeds.unpickled == deeds.run == []


@given(data=st.data())
@fuzz_settings(40)
def test_damaged_bytes_of_a_policy_are_refused_or_do_no_harm(data: st.DataObject, tmp_path: Path) -> None:
    path = tmp_path / "policy.npz"
    path.write_bytes(data.draw(damaged_bytes(SHIPPED_POLICY.read_bytes())))
    refused_or_acts(path, tmp_path)


@given(data=st.data())
@fuzz_settings(60)
def test_other_arrays_in_a_policy_are_refused_or_act(data: st.DataObject, tmp_path: Path) -> None:
    """With a hash that fits, as somebody makes who means it."""
    arrays = policy_arrays()
    about = str(arrays["about"])
    for _ in range(data.draw(st.integers(1, 3))):
        name = data.draw(st.sampled_from([*sorted(arrays), "weights_9", "other", "weights_x"]))
        kind = data.draw(st.sampled_from(["shape", "delete", "value", "slice", "about"]))
        if kind == "delete":
            arrays.pop(name, None)
        elif kind == "shape":
            with contextlib.suppress(ValueError):
                arrays[name] = np.ones(data.draw(SHAPES)).astype(data.draw(DTYPES))
        elif kind == "slice" and name in arrays and arrays[name].ndim:
            arrays[name] = arrays[name][1:]
        elif kind == "value" and name in arrays and arrays[name].dtype.kind == "f" and arrays[name].size:
            array = arrays[name].copy()
            array.flat[data.draw(st.integers(0, array.size - 1))] = data.draw(
                st.sampled_from([math.nan, math.inf, 3e38, 0.0, -1.0])
            )
            arrays[name] = array
        elif kind == "about" and "about" in arrays:
            arrays["about"] = np.array(data.draw(damaged_json(about)))
    if data.draw(st.booleans()) and "about" in arrays:
        with contextlib.suppress(Exception):  # what cannot be hashed stays as it is
            said = json.loads(str(arrays["about"]))
            content = {name: array for name, array in arrays.items() if name != "about"}
            said["sha256"] = PolicyNetwork._from_arrays(content, said).sha256
            arrays["about"] = np.array(json.dumps(said))
    path = tmp_path / "policy.npz"
    np.savez(path, **arrays)
    refused_or_acts(path, tmp_path)


@pytest.mark.parametrize("kind", ["object array", "bare pickle", "pickle in the zip", "pickled about"])
def test_a_pickle_in_a_policy_is_never_unpickled(kind: str, tmp_path: Path) -> None:
    target, path = tmp_path / "boom", tmp_path / "policy.npz"
    bomb = np.array([Bomb(target)], dtype=object)
    if kind == "object array":
        np.savez(path, **(policy_arrays() | {"center": bomb}))
    elif kind == "pickled about":
        np.savez(path, **(policy_arrays() | {"about": bomb}))
    elif kind == "bare pickle":
        path.write_bytes(pickle.dumps(Bomb(target)))
    else:
        np.savez(path, **policy_arrays())
        with zipfile.ZipFile(path, "a") as archive:
            archive.writestr("data.pkl", pickle.dumps(Bomb(target)))
    with watched() as deeds, contextlib.suppress(PolicyFileError):
        PolicyNetwork.load(path)
    with watched() as also, pytest.raises(JetGymError):
        PolicyPlanner(model=path.rename(tmp_path / "policy.zip"))
    assert deeds.unpickled == also.unpickled == []
    assert not target.exists()


def test_a_policy_that_claims_to_be_huge_is_refused(tmp_path: Path) -> None:
    """Its header says a petabyte; there are eight bytes."""
    path = tmp_path / "policy.npz"
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f4", "fortran_order": False, "shape": (1 << 48,)})
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("center.npy", header.getvalue() + bytes(8))
    with watched(), pytest.raises(PolicyFileError):
        PolicyNetwork.load(path)


# ---------------------------------------------------------------------- robots


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
]
ATTRIBUTES += [
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


# ---------------------------------------------------------------------- steps

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


# ---------------------------------------------------------------------- results of studies


@pytest.fixture(scope="module")
def trials_text(tmp_path_factory: pytest.TempPathFactory, plan_text: str) -> str:
    from jet_gym.simulation.disturbances import Push
    from jet_gym.simulation.trials import Trial

    experiment = Experiment((Plan.from_dict(json.loads(plan_text)),))
    disturbance = replace(experiment.disturbance(0), pushes=(Push(1.0, 0.1, (1.0, 0.0, 0.0)),))
    trial = Trial(0, "pid", disturbance, True, "", "stands", 1.0, 0.01, 0.01, 3.0)
    path = tmp_path_factory.mktemp("trials") / "robustness.json"
    save_trials(path, experiment, [trial, replace(trial, number=1, success=False, cause="slip")])
    assert load_trials(path, experiment)[0] == trial
    return path.read_text()


@given(data=st.data())
@fuzz_settings(40)
def test_damaged_trials_are_refused_or_can_be_told(data: st.DataObject, trials_text: str, tmp_path: Path) -> None:
    from jet_gym.simulation.robustness import associations, causes, success_rate

    path = tmp_path / "robustness.json"
    if data.draw(st.booleans()):
        path.write_text(data.draw(damaged_json(trials_text)), encoding="utf-8")
    else:
        path.write_bytes(data.draw(damaged_bytes(trials_text.encode())))
    with watched() as deeds:
        try:
            trials = load_trials(path)
        except TrialsFileError as error:
            check_sentence(error)
        else:
            if any(trial.control == "pid" for trial in trials):
                success_rate(trials, "pid"), causes(trials, "pid"), associations(trials, "pid")
    assert deeds.written == [] or deeds.elsewhere(tmp_path) == []
    assert deeds.unpickled == deeds.run == []


@pytest.fixture(scope="module")
def space_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("space") / "space.npz"
    compute_balance_space(0.1).save(path)
    return path


@given(data=st.data())
@fuzz_settings(40)
def test_a_damaged_balance_space_is_refused_or_sound(data: st.DataObject, space_file: Path, tmp_path: Path) -> None:
    path = tmp_path / "space.npz"
    if data.draw(st.booleans()):
        path.write_bytes(data.draw(damaged_bytes(space_file.read_bytes())))
    else:
        with np.load(space_file) as file:
            arrays = {name: file[name] for name in file.files}
        name = data.draw(st.sampled_from(sorted(arrays)))
        kind = data.draw(st.sampled_from(["delete", "shape", "object"]))
        if kind == "delete":
            del arrays[name]
        elif kind == "shape":
            with contextlib.suppress(ValueError):
                arrays[name] = np.ones(data.draw(SHAPES)).astype(data.draw(DTYPES))
        else:
            arrays[name] = np.array([Bomb(tmp_path / "boom")], dtype=object)
        np.savez(path, **arrays)
    with watched() as deeds:
        try:
            BalanceSpace.load(path).volume(with_thrust=True, within_torque=True)
        except ValueError as error:
            check_sentence(error)
    assert deeds.unpickled == deeds.run == []
    assert not (tmp_path / "boom").exists()
