"""A policy of the user's own in the studio: planned with as it is, or refused by its name."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
from page_inputs import SIDE, never

from agents.policy import SHIPPED_POLICY
from jet_gym.errors import PolicyFileError
from jet_gym.studio import planning
from jet_gym.studio.own_models import read_model
from jet_gym.studio.page.table import comparison_table


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
