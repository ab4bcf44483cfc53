"""The batch: lane by lane equal to single environments, and what Gymnasium asks of a vector environment."""

from __future__ import annotations

import threading
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv

import jet_gym  # noqa: F401  (registers the environment)
from agents import make_planner
from jet_gym.courses import PAPER

ID = "JetHR1Step-v0"


def _batch(num_envs: int, **options: Any) -> VectorEnv[Any, Any, Any]:
    return gym.make_vec(ID, num_envs=num_envs, vectorization_mode="vector_entry_point", **options)


def _singles(num_envs: int, mode: AutoresetMode, **options: Any) -> SyncVectorEnv:
    makers = [lambda: gym.make(ID, physics="quasistatic", **options)] * num_envs
    return SyncVectorEnv(makers, autoreset_mode=mode)


@pytest.mark.parametrize("mode", [AutoresetMode.SAME_STEP, AutoresetMode.NEXT_STEP])
@pytest.mark.parametrize("options", [{}, {"reward": "fitness", "thrust_model": "least", "difficulty": 0.4}])
def test_lanes_equal_single_environments_exactly(mode: AutoresetMode, options: dict[str, Any]) -> None:
    batch, singles = _batch(5, autoreset_mode=mode, **options), _singles(5, mode, **options)
    generator = np.random.default_rng(0)
    (ours, our_info), (theirs, their_info) = batch.reset(seed=11), singles.reset(seed=11)
    assert np.array_equal(ours, theirs)
    assert data_equivalence(our_info, their_info, exact=True)
    ended = 0
    for _ in range(150):
        actions = generator.uniform(-1.2, 1.2, (5, 3)).astype(np.float32)
        our, their = batch.step(actions), singles.step(actions)
        for name, mine, reference in zip(("obs", "reward", "end", "cut"), our, their, strict=False):
            assert mine.dtype == reference.dtype, name
            assert np.array_equal(mine, reference), name
        assert data_equivalence(our[4], their[4], exact=True)
        ended += int(our[2].sum())
    assert ended >= 10


def test_lanes_truncate_by_themselves_as_single_environments_do() -> None:
    def singles() -> gym.Env[Any, Any]:
        return gym.make(ID, physics="quasistatic", max_episode_steps=7)

    batch = _batch(3, max_episode_steps=7)
    reference = SyncVectorEnv([singles] * 3, autoreset_mode=AutoresetMode.SAME_STEP)
    batch.reset(seed=1), reference.reset(seed=1)
    for k in range(20):
        ours, theirs = batch.step(np.zeros((3, 3))), reference.step(np.zeros((3, 3), dtype=np.float32))
        assert np.array_equal(ours[3], theirs[3])
        assert ours[3].all() == (k % 7 == 6)
        assert np.array_equal(ours[0], theirs[0])
        assert data_equivalence(ours[4], theirs[4], exact=True)


def test_disabled_autoreset_waits_for_the_reset_mask() -> None:
    batch = _batch(4, autoreset_mode="Disabled", max_episode_steps=3)
    batch.reset(seed=0)
    for _ in range(3):
        last = batch.step(np.zeros((4, 3)))
    assert last[3].all()
    with pytest.raises(ResetNeeded):
        batch.step(np.zeros((4, 3)))
    batch.reset(options={"reset_mask": np.array([True, True, False, True])})
    with pytest.raises(ResetNeeded):
        batch.step(np.zeros((4, 3)))
    batch.reset(options={"reset_mask": np.array([False, False, True, False])})
    batch.step(np.zeros((4, 3)))


def test_threads_do_not_change_a_bit() -> None:
    one, three = _batch(700, threads=1), _batch(700, threads=3)
    assert np.array_equal(one.reset(seed=5)[0], three.reset(seed=5)[0])
    generator = np.random.default_rng(0)
    for _ in range(70):
        actions = generator.uniform(-1.0, 1.0, (700, 3))
        ours, theirs = one.step(actions), three.step(actions)
        assert np.array_equal(ours[0], theirs[0])
        assert np.array_equal(ours[1], theirs[1])
    three.close()
    three.close()


def test_ctrl_c_while_the_first_step_compiles_waits_for_no_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    batch, began = _batch(700, threads=3), []
    batch.reset(seed=0)

    def interrupted(*_: object) -> None:
        began.append(threading.current_thread())
        raise KeyboardInterrupt

    monkeypatch.setattr(batch._model, "advance", interrupted)
    with pytest.raises(KeyboardInterrupt):
        batch.step(np.zeros((700, 3)))
    assert began == [threading.main_thread()]


def test_same_seed_same_episodes_and_a_lane_has_its_own() -> None:
    first, second = _batch(6), _batch(6)
    a, b = first.reset(seed=3)[0], second.reset(seed=[3, 4, 5, 6, 7, 8])[0]
    assert np.array_equal(a, b)
    assert len(np.unique(a, axis=0)) == 6
    again = first.reset(seed=3)[0]
    assert np.array_equal(a, again)
    assert not np.array_equal(first.reset()[0], again)


def test_returned_arrays_are_not_written_again() -> None:
    batch = _batch(8)
    batch.reset(seed=0)
    first = batch.step(np.full((8, 3), 0.5))
    copies = [np.array(part) for part in first[:4]]
    pelvis = first[4]["pelvis"].copy()
    batch.step(np.full((8, 3), -0.5))
    assert all(np.array_equal(part, copy) for part, copy in zip(first[:4], copies, strict=True))
    assert np.array_equal(first[4]["pelvis"], pelvis)


def test_a_step_in_the_options_is_for_all_lanes_of_this_episode() -> None:
    batch = _batch(3)
    observations, _ = batch.reset(seed=0, options={"step": PAPER.side})
    assert np.array_equal(observations[0], observations[1])
    plan = make_planner("gas").plan(PAPER.side)
    assert observations[0, 14:17] == pytest.approx([0.0, 0.4525, 0.0], abs=1e-6)
    assert plan.step.points == 60


@pytest.mark.parametrize(
    ("actions", "words"),
    [(np.zeros((2, 3)), "shape"), (np.zeros(3), "shape"), (np.full((3, 3), np.nan), "finite")],
)
def test_wrong_actions_are_refused_and_change_nothing(actions: Any, words: str) -> None:
    batch = _batch(3)
    batch.reset(seed=0)
    with pytest.raises(ValueError, match=words):
        batch.step(actions)
    reference = _batch(3)
    reference.reset(seed=0)
    assert np.array_equal(batch.step(np.zeros((3, 3)))[0], reference.step(np.zeros((3, 3)))[0])


@pytest.mark.parametrize(
    "call",
    [
        lambda: _batch(0),
        lambda: _batch(2, physics="bullet"),
        lambda: _batch(2, render_mode="rgb_array"),
        lambda: _batch(2, reward="sparse"),
        lambda: _batch(2, difficulty=2.0),
        lambda: _batch(2, threads=0),
        lambda: _batch(2).reset(seed=1.5),
        lambda: _batch(2).reset(options=5),
        lambda: _batch(2).reset(seed=[1]),
        lambda: _batch(2).reset(options={"height": 3}),
        lambda: _batch(2).reset(options={"step": "forward"}),
        lambda: _batch(2).reset(options={"reset_mask": np.zeros(2, dtype=bool)}),
        lambda: _batch(2).reset(options={"reset_mask": [True, False]}),
    ],
)
def test_wrong_arguments_are_refused(call: Any) -> None:
    with pytest.raises(ValueError, match=r"."):
        call()


def test_step_before_reset_is_refused() -> None:
    with pytest.raises(ResetNeeded):
        _batch(2).step(np.zeros((2, 3)))
    with pytest.raises(ResetNeeded, match="all lanes"):
        _batch(2).reset(options={"reset_mask": np.array([True, False])})
