"""``JetHR1Step-v0``: Gymnasium's contract, the task it states, and physics that counts."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env, data_equivalence

import jet_gym  # noqa: F401  (registers the environment)
from agents import Plan, make_planner
from jet_gym import Step
from jet_gym.courses import PAPER
from jet_gym.leg import opposite
from jet_gym.posture import evaluate_postures
from jet_gym.simulation.errors import BulletMissingError
from jet_gym.task.observation import COMPONENTS
from jet_gym.task.settings import REWARD_TERMS

ID = "JetHR1Step-v0"
SIDE = replace(PAPER.side, points=30)
FORWARD = replace(PAPER.forward, points=60)
PHYSICS = ("quasistatic", "bullet")


@pytest.fixture
def make() -> Iterator[Any]:
    """Make environments that are closed after the test."""
    made: list[gym.Env[Any, Any]] = []

    def make_one(**options: Any) -> gym.Env[Any, Any]:
        made.append(gym.make(ID, **options))
        return made[-1]

    yield make_one
    for env in made:
        env.close()


def _replay(env: gym.Env[Any, Any], plan: Plan) -> list[tuple[Any, float, bool, bool, dict[str, Any]]]:
    """Take the plan's postures as actions."""
    env.reset(seed=0, options={"step": plan.step})
    results = []
    for pelvis in plan.pelvis:
        results.append(env.step(env.unwrapped.action_to(pelvis)))  # type: ignore[attr-defined]
        if results[-1][2]:
            break
    return results


@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize("reward", ["graded", "fitness"])
@pytest.mark.parametrize("options", [{}, {"thrust_model": "least", "step": SIDE}, {"render_mode": "rgb_array"}])
def test_gymnasiums_checker_has_nothing_to_say(
    make: Any, physics: str, reward: str, options: dict[str, Any]
) -> None:
    env = make(physics=physics, reward=reward, **options)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)  # it would open a window


@pytest.mark.parametrize("physics", PHYSICS)
def test_stable_baselines_checker_has_nothing_to_say(make: Any, physics: str) -> None:
    from stable_baselines3.common.env_checker import check_env as check_env_of_stable_baselines

    check_env_of_stable_baselines(make(physics=physics).unwrapped)


@pytest.mark.parametrize("physics", PHYSICS)
def test_same_seed_gives_the_same_episode_to_the_last_bit(make: Any, physics: str) -> None:
    first, second = make(physics=physics), make(physics=physics)
    first.reset(seed=99), first.step(np.ones(3, dtype=np.float32))  # a reset in mid-episode must leave no trace
    assert data_equivalence(first.reset(seed=5), second.reset(seed=5), exact=True)
    generator = np.random.default_rng(0)
    for _ in range(60):
        action = generator.uniform(-0.3, 0.3, 3).astype(np.float32)
        ours, theirs = first.step(action), second.step(action)
        assert data_equivalence(ours, theirs, exact=True)
        if ours[2]:
            break
    assert ours[2]


@pytest.mark.parametrize("physics", PHYSICS)
def test_seeded_and_unseeded_resets_repeat_in_order(make: Any, physics: str) -> None:
    env = make(physics=physics)
    seen = [env.reset(seed=seed)[0] for seed in (7, None, 7, None)]
    assert np.array_equal(seen[0], seen[2])
    assert np.array_equal(seen[1], seen[3])
    assert not np.array_equal(seen[0], seen[1])


@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize("step", [SIDE, FORWARD], ids=["side", "forward"])
def test_replaying_a_gas_plan_gives_its_fitness_point_for_point(make: Any, physics: str, step: Step) -> None:
    plan = make_planner("gas").plan(step)
    env = make(physics=physics, reward="fitness")
    results = _replay(env, plan)
    infos = [result[4] for result in results]
    assert np.allclose([info["fitness"] for info in infos], plan.fitness, atol=1e-9, rtol=0.0)
    assert np.allclose([info["thrust"] for info in infos], plan.thrust, atol=1e-9, rtol=0.0)
    assert np.allclose([info["joint_positions"] for info in infos], plan.joint_positions, atol=1e-9)
    assert [info["violations"] for info in infos] == list(plan.violations)
    assert len(results) == step.points
    assert infos[-1]["is_success"] is (plan.violated_points == ())
    if physics == "quasistatic":
        scale = env.unwrapped.model.fitness_scale
        assert sum(result[1] for result in results) == pytest.approx(-plan.total_fitness / scale)


@pytest.mark.parametrize("reward", ["graded", "fitness"])
def test_the_two_physics_agree_while_nothing_slips_or_tips(make: Any, reward: str) -> None:
    """To 0.15 of a point at full thrust, to 0.3 at the first, the term `zmp` aside: on drawn steps too."""
    drawing = make(physics="quasistatic")
    steps = [SIDE, FORWARD]
    for seed in range(10):
        drawing.reset(seed=seed)
        steps.append(drawing.unwrapped.current_step)
    compared = 0
    for step in steps:
        plan = make_planner("gas").plan(step, seed=4)
        if plan.violated_points:
            continue
        rewards = []
        for physics in PHYSICS:
            results = _replay(make(physics=physics, reward=reward), plan)
            assert results[-1][4]["is_success"]
            rewards.append(np.array([result[1] - result[4]["reward_terms"].get("zmp", 0.0) for result in results]))
        difference = np.abs(rewards[0] - rewards[1])
        assert difference[0] <= 0.3
        assert difference[1:].max() <= 0.15
        compared += 1
    assert compared >= 10


@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize("reward", ["graded", "fitness"])
def test_the_reward_is_the_sum_of_its_named_terms(make: Any, physics: str, reward: str) -> None:
    env = make(physics=physics, reward=reward)
    env.reset(seed=3)
    for _ in range(5):
        _, total, terminated, _, info = env.step(env.action_space.sample())
        assert total == pytest.approx(sum(info["reward_terms"].values()))
        assert all(term <= 0.0 for term in info["reward_terms"].values())
        if reward == "graded":
            assert set(info["reward_terms"]) == set(REWARD_TERMS)
        if terminated:
            break


def test_graded_reward_ranks_plans_as_the_fitness_does_where_it_matters(make: Any) -> None:
    """The plan that is best under one form is best under the other, with and without violating plans among them."""
    plans = [make_planner(name).plan(FORWARD, seed=seed) for name in ("gas", "ga", "gaex") for seed in range(3)]
    returns = []
    for reward in ("graded", "fitness"):
        env = make(physics="quasistatic", reward=reward)
        returns.append([sum(result[1] for result in _replay(env, plan)) for plan in plans])
    clean = [i for i, plan in enumerate(plans) if not plan.violated_points]
    assert 0 < len(clean) < len(plans)
    assert np.argmax(returns[0]) == np.argmax(returns[1])
    assert np.argmax(returns[0]) in clean
    assert np.allclose(np.array(returns[0])[clean], np.array(returns[1])[clean])


def test_graded_penalties_grow_with_what_is_violated(make: Any) -> None:
    env = make(physics="quasistatic")
    costs = []
    for depth in (0.05, 0.5, 0.75, 1.0):
        env.reset(seed=0, options={"step": SIDE})
        costs.append(env.step(np.array([0.0, 0.0, depth]))[4]["reward_terms"]["reach"])
    assert costs[0] == 0.0
    assert 0.0 > costs[1] > costs[2] > costs[3] >= -6.0


@pytest.mark.parametrize("physics", PHYSICS)
def test_observations_are_within_bounds_for_wild_actions(make: Any, physics: str) -> None:
    env = make(physics=physics)
    env.action_space.seed(0)
    for seed in range(6 if physics == "bullet" else 40):
        observation, _ = env.reset(seed=seed)
        terminated = False
        while not terminated:
            assert env.observation_space.contains(observation)
            assert np.isfinite(observation).all()
            observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
            assert isinstance(reward, float)
            assert isinstance(terminated, bool)
            assert truncated is False
            assert np.isfinite(reward)
        assert isinstance(info["is_success"], bool)


def test_a_right_step_is_seen_and_done_as_its_mirror_image(make: Any) -> None:
    def mirrored(point: tuple[float, float, float]) -> tuple[float, float, float]:
        return point[0], -point[1], point[2]

    left = Step("left", (0.05, 0.12, 0.0), (0.3, 0.25, 0.03), (0.0, -0.1125, 0.0), points=12)
    right = Step("right", *(mirrored(p) for p in (left.start, left.landing, left.support)), points=12)
    ours, theirs = make(physics="quasistatic", step=left), make(physics="quasistatic", step=right)
    assert np.allclose(ours.reset(seed=0)[0], theirs.reset(seed=0)[0], atol=1e-6)
    generator = np.random.default_rng(0)
    for _ in range(12):
        action = generator.uniform(-0.5, 0.5, 3)
        mine, other = ours.step(action), theirs.step(action)
        assert np.allclose(mine[0], other[0], atol=1e-5)
        assert mine[1] == pytest.approx(other[1], abs=1e-9)
        assert mine[4]["pelvis"] == pytest.approx(other[4]["pelvis"] * [1.0, -1.0, 1.0])


def test_observations_are_what_their_table_says(make: Any) -> None:
    """Row by row, from the posture that the pelvis has if it stays, mirrored for a right step."""
    for step in (SIDE, FORWARD):
        side = 1.0 if step.swing == "left" else -1.0
        mirror, support = np.array([1.0, side, 1.0]), np.array(step.support)
        path, last = step.swing_sole, step.points - 1
        env = make(physics="quasistatic", step=step)
        observation, _ = env.reset(seed=0)
        pelvis, thrust = step.nominal_pelvis, 0.0
        for k in range(5):
            staying = evaluate_postures(step.robot, step.swing, path[k], step.support, pelvis)
            expected = np.concatenate(
                [
                    [k / last, 1.0 if k == 0 else 0.0],
                    (pelvis - support) * mirror,
                    (path[k] - support) * mirror,
                    (path[k + 1] - path[k]) * mirror / 0.1,
                    (path[k + 3] - path[k]) * mirror / 0.1,
                    (path[-1] - support) * mirror,
                    (staying.center_of_mass[:2] - support[:2]) * mirror[:2],
                    [staying.thrust / 23.0, side * staying.edge_angle / np.radians(5.0)],
                ]
            )
            assert np.allclose(observation[:21], expected, atol=2e-6)
            knees = staying.joint_positions[[3, 9] if step.swing == "left" else [9, 3]]
            if staying.out_of_reach == 0.0:
                assert np.allclose(observation[21:23], np.cos(knees / 2.0), atol=1e-6)  # thigh as long as shank
            assert np.allclose(observation[23:25], [(last - k) / 30.0, np.clip(thrust / 23.0, 0.0, 1.0)])
            from_zmp = staying.center_of_mass[:2] - staying.assigned_zmp
            line = path[k][:2] - staying.assigned_zmp
            to_line = line * (from_zmp @ line) / (line @ line) - from_zmp
            expected = np.concatenate([from_zmp, to_line]) * np.tile(mirror[:2], 2) / 0.01
            assert np.allclose(observation[25:29], np.clip(expected, -20.0, 20.0), atol=1e-4)
            assert np.array_equal(observation[29:], [0.0, 0.0])
            observation, _, _, _, info = env.step(np.array([0.1, -0.2, -0.3]))
            pelvis, thrust = info["pelvis"], info["thrust"]


def test_every_component_is_documented_in_the_class(make: Any) -> None:
    from jet_gym.envs.jet_hr1_step import JetHR1StepEnv

    text = JetHR1StepEnv.__doc__ or ""
    for section in (
        "Description", "Action Space", "Observation Space", "Rewards", "Starting State", "Episode Termination",
        "Arguments", "Info", "Version History",
    ):  # fmt: skip
        assert f"## {section}" in text
    assert f"`Box(float32, ({len(COMPONENTS)},))`" in text
    assert all(f"`{term}`" in text for term in REWARD_TERMS)
    env = make(physics="bullet")
    env.reset(seed=0)
    info = env.step(np.zeros(3, dtype=np.float32))[4]
    assert all(f"`{key}`" in text for key in info)


@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize("action", [np.full(3, np.nan), np.array([np.inf, 0, 0]), np.zeros(2), 0.5, "left", None])
def test_a_wrong_action_is_refused(make: Any, physics: str, action: Any) -> None:
    env = make(physics=physics).unwrapped
    env.reset(seed=0)
    with pytest.raises((ValueError, TypeError)):
        env.step(action)


def test_actions_beyond_the_box_are_clipped(make: Any) -> None:
    ours, theirs = make(physics="quasistatic").unwrapped, make(physics="quasistatic").unwrapped
    ours.reset(seed=0), theirs.reset(seed=0)
    assert data_equivalence(
        ours.step(np.array([5.0, -7.0, 0.5])), theirs.step(np.array([1.0, -1.0, 0.5])), exact=True
    )


def test_a_step_before_the_beginning_or_after_the_end_is_refused(make: Any) -> None:
    env = make(physics="quasistatic", step=replace(SIDE, points=2)).unwrapped
    with pytest.raises(ResetNeeded):
        env.step(np.zeros(3))
    env.reset(seed=0)
    env.step(np.zeros(3))
    assert env.step(np.zeros(3))[2]
    with pytest.raises(ResetNeeded):
        env.step(np.zeros(3))


@pytest.mark.parametrize(
    "options",
    [{"physics": "newton"}, {"reward": "sparse"}, {"thrust_model": "most"}, {"smoothness_weight": -1.0},
     {"smoothness_weight": "a"}, {"difficulty": None}, {"time_per_point": "x"},
     {"step": "side"}, {"difficulty": float("nan")}, {"time_per_point": 0.0}, {"render_mode": "ascii"}],
)  # fmt: skip
def test_wrong_arguments_are_refused(options: dict[str, Any]) -> None:
    from jet_gym.envs.jet_hr1_step import JetHR1StepEnv

    with pytest.raises(ValueError, match=next(iter(options))):
        JetHR1StepEnv(**options)


@pytest.mark.parametrize("options", [{"step": PAPER}, {"steps": SIDE}, {"step": {"swing": "left"}}])
def test_wrong_reset_options_are_refused(make: Any, options: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="step"):
        make(physics="quasistatic").reset(options=options)


def test_two_live_environments_of_different_physics_do_not_disturb_each_other(make: Any) -> None:
    alone = make(physics="bullet")
    expected = [alone.reset(seed=1), *(alone.step(np.zeros(3)) for _ in range(4))]
    bullet, model, other = make(physics="bullet"), make(physics="quasistatic"), make(physics="bullet")
    results = [bullet.reset(seed=1)]
    model.reset(seed=2), other.reset(seed=3)
    for k in range(4):
        results.append(bullet.step(np.zeros(3)))
        model.step(np.zeros(3))
        if k < 2:
            other.step(np.full(3, 0.2))
        if k == 2:
            other.close()
    assert data_equivalence(expected, results, exact=True)


@pytest.mark.parametrize("physics", PHYSICS)
def test_close_twice_and_pickle(make: Any, physics: str) -> None:
    env = make(physics=physics, reward="fitness", step=SIDE).unwrapped
    first = env.reset(seed=0)
    twin = pickle.loads(pickle.dumps(env))
    assert data_equivalence(twin.reset(seed=0), first, exact=True)
    assert data_equivalence(copy.deepcopy(env).reset(seed=0), first, exact=True)
    twin.close()
    env.close()
    env.close()


def test_spec_survives_json_and_plugs_in_by_module_name() -> None:
    env = gym.make(f"jet_gym:{ID}", physics="quasistatic")
    again = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))  # type: ignore[union-attr]
    assert np.array_equal(env.reset(seed=0)[0], again.reset(seed=0)[0])
    assert env.spec is not None
    assert env.spec.max_episode_steps == 500
    assert env.spec.reward_threshold == -11.3


def test_the_reward_threshold_is_what_gas_reaches(make: Any) -> None:
    """On the seeds that its comment names, a quarter of them here."""
    env = make(physics="quasistatic")
    returns = []
    for seed in range(50):
        env.reset(seed=seed)
        plan = make_planner("gas").plan(env.unwrapped.current_step)
        returns.append(sum(env.step(env.unwrapped.action_to(pelvis))[1] for pelvis in plan.pelvis))
    spread = np.std(returns) / np.sqrt(len(returns))
    assert abs(np.mean(returns) - env.spec.reward_threshold) < 3.0 * spread


def test_asynchronous_workers_that_are_spawned_find_the_environment(tmp_path: Path) -> None:
    code = f"""
import gymnasium as gym, numpy as np
if __name__ == "__main__":
    envs = gym.make_vec("jet_gym:{ID}", num_envs=2, vectorization_mode="async", physics="quasistatic",
                        vector_kwargs=dict(context="spawn"))
    observations, _ = envs.reset(seed=3)
    envs.step(np.zeros((2, 3), dtype=np.float32))
    single = gym.make("jet_gym:{ID}", physics="quasistatic")
    assert np.array_equal(observations[1], single.reset(seed=4)[0])
    envs.close()
    print("done")
"""
    script = tmp_path / "workers.py"
    script.write_text(code)
    command = [sys.executable, str(script)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert result.stdout.strip() == "done", result.stderr


@pytest.mark.parametrize("physics", PHYSICS)
def test_memory_stays_flat_over_resets(make: Any, physics: str) -> None:
    env = make(physics=physics)
    resets = 500 if physics == "bullet" else 5000

    def used() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * 4  # kB resident now

    for seed in range(resets // 5):
        env.reset(seed=seed)
    before = used()
    for seed in range(resets):
        env.reset(seed=seed)
        env.step(np.zeros(3)) if seed % 50 == 0 else None
    assert used() - before < 20_000  # kB


@pytest.mark.parametrize("physics", PHYSICS)
def test_frames_show_what_happens_and_change_nothing(make: Any, physics: str) -> None:
    seen, unseen = make(physics=physics, render_mode="rgb_array", step=SIDE), make(physics=physics, step=SIDE)
    seen.reset(seed=0), unseen.reset(seed=0)
    frames = [seen.render()]
    for action in (np.array([0.0, -0.5, -0.3]), np.array([0.3, 0.2, -0.2])):
        assert data_equivalence(seen.step(action), unseen.step(action), exact=True)
        frames.append(seen.render())
    for frame in frames:
        assert frame.shape == (480, 640, 3)
        assert frame.dtype == np.uint8
    assert (frames[0] != frames[1]).mean() > 0.01
    with pytest.warns(UserWarning, match="render_mode"):
        unseen.unwrapped.render()


def test_a_window_without_a_display_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    from jet_gym.errors import JetGymError

    monkeypatch.delenv("DISPLAY", raising=False)
    env = gym.make(ID, render_mode="human")
    with pytest.raises(JetGymError, match=r"[Dd]isplay"):
        env.reset(seed=0)
    env.close()


def test_the_paper_motions_stand_in_physics_with_the_zmp_in_the_foot(make: Any) -> None:
    for step in (PAPER.side, PAPER.forward):
        env = make(physics="bullet")
        results = _replay(env, make_planner("gas").plan(step))
        infos = [result[4] for result in results]
        assert infos[-1]["is_success"] is True
        leg = step.robot.leg(opposite(step.swing))
        x_min, x_max, y_min, y_max = leg.sole_rectangle
        zmp = np.array([info["measured_zmp"] for info in infos]) - np.array(step.support[:2])
        assert (zmp >= [x_min, y_min]).all()
        assert (zmp <= [x_max, y_max]).all()
        assert max(info["tilt"] for info in infos) < np.radians(3.0)
        torques = np.abs([info["joint_torques"] for info in infos]).max(axis=0)
        assert (torques <= 0.95 * step.robot.effort).all()  # the servos are not at their limit
        assert max(info["measured_thrust"] for info in infos) < 22.0


@pytest.mark.parametrize("seed", [8, 35])
def test_a_foot_that_lifts_off_costs_nothing(make: Any, seed: int) -> None:
    """The swing foot carries up to 10 N until it leaves the ground; that is no fault of the posture."""
    env, quasistatic = make(), make(physics="quasistatic")
    quasistatic.reset(seed=seed)
    step = quasistatic.unwrapped.current_step
    plan = make_planner("gas").plan(step)
    assert plan.violated_points == ()
    env.reset(options={"step": step})
    for pelvis in plan.pelvis[:3]:
        _, _, _, _, info = env.step(env.unwrapped.action_to(pelvis))
        assert info["reward_terms"]["zmp"] == 0.0


def test_a_pelvis_that_is_thrown_about_costs(make: Any) -> None:
    """Jerks take the measured ZMP to the sole's edge where that of the model stays inside."""
    env, quasistatic = make(step=PAPER.side, time_per_point=0.05), make(step=PAPER.side, physics="quasistatic")
    plan = make_planner("gas").plan(PAPER.side)
    terms = []
    for each in (env, quasistatic):
        each.reset(seed=0)
        jerks = [[0.0] * 3] * 10 + [[1.0, 0.0, 0.0]] * 3 + [[-1.0, 0.0, 0.0]] * 6 + [[1.0, 0.0, 0.0]] * 6
        actions = [each.unwrapped.action_to(plan.pelvis[0]), *np.array(jerks)]
        terms.append([each.step(action)[4]["reward_terms"]["zmp"] for action in actions])
    measured, modelled = np.array(terms)
    assert measured[modelled == 0.0].min() < -0.5


def test_a_fall_ends_the_episode_and_costs_what_was_left(make: Any) -> None:
    """Pelvis far beyond the support foot: no thrust of the fan can hold that."""
    env = make(physics="bullet", step=FORWARD)
    env.reset(seed=0)
    total, terminated, points = 0.0, False, 0
    while not terminated:
        _, reward, terminated, _, info = env.step(np.array([1.0, -1.0, 0.0]))
        total, points = total + reward, points + 1
    assert info["fall"]
    assert info["is_success"] is False
    assert points < FORWARD.points
    assert info["reward_terms"]["fall"] == pytest.approx(
        env.unwrapped.model.worst_reward * (FORWARD.points - points + 1)
    )
    assert env.unwrapped.model.worst_reward == pytest.approx(-41.1, abs=0.05)
    with pytest.raises(ResetNeeded):
        env.unwrapped.step(np.zeros(3))


def test_without_pybullet_making_it_says_in_a_sentence_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pybullet", None)
    with pytest.raises(
        BulletMissingError, match=r"pip install 'jet-gym\[bullet\]'.*physics='quasistatic'"
    ) as caught:
        gym.make(ID)
    assert "\n" not in str(caught.value)
    env = gym.make(ID, physics="quasistatic")
    env.reset(seed=0)
    assert np.isfinite(env.step(np.zeros(3, dtype=np.float32))[1])
