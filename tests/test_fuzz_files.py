"""Damaged, foreign and hostile plans, policies and results: a typed error of one line or a sound object.

Nothing is run, nothing hangs. ``make fuzz`` tries many more examples than the suite does.
"""

from __future__ import annotations

import contextlib
import io
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
from damage import DTYPES, JSON, SHAPES, Bomb, check_sentence, damaged_bytes, damaged_json
from hypothesis import given
from hypothesis import strategies as st
from watching import watched

from agents.network import PolicyNetwork
from agents.policy import SHIPPED_POLICY, PolicyPlanner
from jet_gym.balance_space import BalanceSpace, compute_balance_space
from jet_gym.courses import PAPER
from jet_gym.errors import JetGymError, PlanFileError, PolicyFileError
from jet_gym.plan import Plan
from jet_gym.simulation.results_file import ResultsFileError
from jet_gym.simulation.trials import Experiment, load_trials, save_trials
from jet_gym.task.observation import HIGH, LOW


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
        except ResultsFileError as error:
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
