"""Training: the adapter, the warm start, the schedule, and ``train.py`` from its first line to its last."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import ConvertCallback
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.monitor import Monitor

import jet_gym  # noqa: F401
from agents import make_planner
from agents.policy import SHIPPED_POLICY, PolicyPlanner, load_policy
from agents.sb3_policy import ThrustPolicy, network_of
from agents.training.callbacks import Curriculum
from agents.training.imitation import Imitation, ImitationSettings, expert_path
from agents.training.scaling import observation_scale
from agents.training.ship import best_run
from agents.training.validation import TEST_SEED, VALIDATION_SEED, StepSet, drawn_steps
from agents.training.vec_env import StepVecEnv
from jet_gym.cli import cli
from jet_gym.envs.choices import ChooseThrust
from jet_gym.envs.jet_hr1_step import JetHR1StepEnv
from jet_gym.errors import SettingsError
from jet_gym.plan import Plan

ROOT = Path(__file__).resolve().parents[1]
TINY = [
    "--steps",
    "700",
    "--lanes",
    "4",
    "--rollout",
    "64",
    "--batch-size",
    "64",
    "--epochs",
    "2",
    "--imitation.rounds",
    "2",
    "--imitation.first-steps",
    "8",
    "--imitation.steps-per-round",
    "2",
    "--imitation.episodes",
    "8",
    "--critic-steps",
    "256",
    "--validate-every",
    "256",
    "--validation-steps",
    "4",
    "--test-steps",
    "3",
    "--hidden",
    "16",
    "16",
    "--threads",
    "1",
]


def train(*arguments: str) -> int:
    sys.path.insert(0, str(ROOT))
    try:
        import train as script
    finally:
        sys.path.pop(0)
    try:
        return script.main(list(arguments))
    except SystemExit as stopped:  # bad arguments
        return int(stopped.code or 0)


def test_the_adapter_shows_what_dummy_vec_env_shows() -> None:
    """Same seeds, same actions, over several episodes: the same numbers to the last bit."""
    ours = StepVecEnv(3, difficulty=0.7)
    theirs = make_vec_env(
        "JetHR1Step-v0", 3, env_kwargs={"physics": "quasistatic", "difficulty": 0.7}, wrapper_class=None
    )
    ours.seed(5), theirs.seed(5)
    assert np.array_equal(ours.reset(), theirs.reset())
    random, ended = np.random.default_rng(0), 0
    for _ in range(150):
        actions = random.uniform(-0.2, 0.2, (3, 3)).astype(np.float32)
        one, other = ours.step(actions), theirs.step(actions)
        for mine, its in zip(one[:3], other[:3], strict=True):
            assert np.array_equal(mine, its)
        for mine, its, over in zip(one[3], other[3], one[2], strict=True):
            if over:
                ended += 1
                assert np.array_equal(mine["terminal_observation"], its["terminal_observation"])
                assert mine["TimeLimit.truncated"] == its["TimeLimit.truncated"]
                assert mine["is_success"] == its["is_success"]
                assert mine["episode"]["r"] == pytest.approx(its["episode"]["r"], abs=1e-5)
                assert mine["episode"]["l"] == its["episode"]["l"]
    assert ended >= 6


def test_the_adapter_adds_up_the_terms_of_the_reward() -> None:
    envs = StepVecEnv(8)
    envs.reset()
    total = 0.0
    for _ in range(70):
        total += float(envs.step(np.zeros((8, 3), dtype=np.float32))[1].sum())
    noticed = envs.noticed()
    assert sum(noticed.values()) == pytest.approx(total / (70 * 8), rel=1e-5)
    assert envs.noticed() == {}


def test_the_adapter_takes_choices_of_the_thrust_as_the_wrapper_does() -> None:
    ours = StepVecEnv(2, chooses="thrust")
    theirs = make_vec_env("JetHR1Step-v0", 2, env_kwargs={"physics": "quasistatic"}, wrapper_class=ChooseThrust)
    ours.seed(5), theirs.seed(5)
    assert np.array_equal(ours.reset(), theirs.reset())
    random = np.random.default_rng(0)
    for _ in range(70):
        choices = random.uniform(-1.0, 0.2, (2, 3)).astype(np.float32)
        for mine, its in zip(ours.step(choices)[:3], theirs.step(choices)[:3], strict=True):
            assert np.array_equal(mine, its)


def test_care_is_less_where_a_step_takes_hardly_any_thrust() -> None:
    step = next(step for step in drawn_steps(30, 500) if np.hypot(*step.landing[:2]) < 0.28)
    careful, light = expert_path(step, 3.0, 0.01), expert_path(step, 3.0, 0.01, relative_mu=1e-4)
    assert careful is not None
    assert light is not None
    fitness = [Plan.from_pelvis_path(step, path, planner="expert").total_fitness for path in (careful, light)]
    assert fitness[1] < 0.9 * fitness[0]


def test_the_adapter_answers_what_stable_baselines_asks() -> None:
    envs = StepVecEnv(2)
    assert envs.get_attr("num_envs", 0) == [2]
    assert envs.env_is_wrapped(Monitor) == [True, True]
    with pytest.raises(SettingsError):
        envs.set_attr("step", None)
    with pytest.raises(SettingsError):
        envs.env_method("render")
    envs.close()


def test_the_scale_is_that_of_what_gas_meets() -> None:
    center, scale = observation_scale(8, 42)
    env = JetHR1StepEnv(physics="quasistatic")
    met = []
    for seed in range(42, 50):
        observation, _ = env.reset(seed=seed)
        plan = make_planner("gas").plan(env.current_step)
        for pelvis in plan.pelvis:
            met.append(observation)
            observation, *_ = env.step(np.clip(env.action_to(pelvis), -1.0, 1.0))
    assert center == pytest.approx(np.mean(met, axis=0), abs=1e-3)
    varies = scale != 1.0
    assert varies.sum() >= 28
    assert scale[varies] == pytest.approx(np.std(met, axis=0)[varies], rel=1e-3)


def test_the_curriculum_raises_the_cost_of_violations_and_narrows_exploration() -> None:
    envs = StepVecEnv(4)
    model = PPO("MlpPolicy", envs, n_steps=8, batch_size=32, n_epochs=1, policy_kwargs=_policy(envs), seed=0)
    curriculum, seen = Curriculum((0.1, 0.001), (0.25, 0.75), 2.0, 320), []

    def note(*_: Any) -> bool:
        seen.append((model.num_timesteps, envs.get_attr("violation_cost")[0], float(model.policy.log_std.exp()[0])))
        return True

    model.learn(320, [curriculum, ConvertCallback(note)])
    costs = {steps: cost for steps, cost, _ in seen}
    assert costs[64] == 0.0
    assert costs[192] == pytest.approx(0.5 * 2.0, abs=0.21)
    assert costs[320] == 2.0
    deviations = [deviation for *_, deviation in seen]
    assert deviations[0] == pytest.approx(0.1)
    assert deviations == sorted(deviations, reverse=True)
    assert deviations[-1] < 0.0016


def test_the_expert_keeps_room_to_every_constraint() -> None:
    checked = 0
    for step in drawn_steps(6, 500):
        path = expert_path(step, 6.0)
        if path is None:
            continue
        checked += 1
        careful = Plan.from_pelvis_path(step, path, planner="expert")
        assert not careful.violated_points
        wobbly = path + 1e-4 * np.random.default_rng(0).uniform(-1.0, 1.0, path.shape)
        assert not Plan.from_pelvis_path(step, wobbly, planner="expert").violated_points
    assert checked >= 4


@pytest.mark.parametrize("policy", ["MlpPolicy", ThrustPolicy])
def test_imitation_brings_the_policy_near_the_expert(policy: str | type[ThrustPolicy]) -> None:
    """On steps that it did not imitate, where it acts by itself."""
    envs = StepVecEnv(4)
    model = PPO(policy, envs, policy_kwargs=_policy(envs), seed=0)
    steps = [step for step in drawn_steps(12, 900) if expert_path(step, 6.0) is not None]
    care = (6.0,) if policy == "MlpPolicy" else (3.0, 0.01, 3e-4)
    experts = [expert_path(step, *care) for step in steps]

    def distance() -> float:
        """Return how far the pelvis is from the expert's [m]; where the thrust is chosen, the thrust [N]."""
        plans = PolicyPlanner(model=network_of(model.policy)).plan_many(steps)
        if policy == "MlpPolicy":
            pairs = zip(plans, experts, strict=True)
            return float(np.mean([np.abs(plan.pelvis - expert).mean() for plan, expert in pairs]))
        careful = Plan.from_pelvis_paths(steps, experts, planner="expert")
        pairs = zip(plans, careful, strict=True)
        return float(np.mean([np.abs(plan.thrust - expert.thrust).mean() for plan, expert in pairs]))

    before, told = distance(), []
    settings = ImitationSettings(rounds=12, first_steps=60, steps_per_round=0, episodes=60)
    Imitation(model.policy, settings, 0, 100).run(lambda number, error: told.append((number, error)))
    assert distance() < 0.4 * before
    assert [number for number, _ in told] == list(range(1, 13))


def _policy(envs: StepVecEnv) -> dict[str, Any]:
    from agents.sb3_policy import ScaledObservation

    width = envs.observation_space.shape[0]
    scale = {"center": np.zeros(width), "scale": np.ones(width)}
    return {"net_arch": [32, 32], "features_extractor_class": ScaledObservation, "features_extractor_kwargs": scale}


def test_the_plain_network_acts_like_the_trained_one() -> None:
    envs = StepVecEnv(4)
    model = PPO("MlpPolicy", envs, policy_kwargs=_policy(envs), seed=0)
    observations = envs.reset()
    expected, _ = model.predict(observations, deterministic=True)
    assert network_of(model.policy).act(observations) == pytest.approx(expected, abs=1e-6)
    other = PPO("MlpPolicy", envs, seed=0)
    with pytest.raises(TypeError, match="ScaledObservation"):
        network_of(other.policy)


def test_steps_of_training_validation_and_test_differ() -> None:
    sets = [drawn_steps(20, first) for first in (10_000_000, VALIDATION_SEED, TEST_SEED)]
    landings = {step.landing for steps in sets for step in steps}
    assert len(landings) == 60


def test_a_score_of_gas_against_itself_is_no_win() -> None:
    steps = StepSet.drawn(3, 77)
    score = steps.score_plans([make_planner("gas").plan(step) for step in steps.steps])
    assert score.wins == 0.0
    assert score.median_ratio == 1.0
    assert score.median_gap > 0.0


def test_train_from_nothing_to_a_judged_policy_and_on_again(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    assert train(*TINY, "--output", str(folder)) == 0
    run = json.loads((folder / "run.json").read_text())
    assert run["settings"]["seed"] == 0
    assert run["versions"]["torch"]
    assert "git_revision" in run
    test = json.loads((folder / "test.json").read_text())
    assert 0.0 <= test["policy"]["wins"] <= 1.0
    network = load_policy(folder / "best" / "policy.npz")
    assert network.about["validation"]["total_fitness"] > 0.0
    assert list((folder / "tensorboard").glob("events*"))
    progress = json.loads((folder / "progress.json").read_text())
    assert [row["round"] for row in progress["imitation"]] == [1, 2]
    assert 0 < progress["imitation"][0]["states"] < progress["imitation"][1]["states"]
    validations = progress["validations"]
    assert [row["steps"] for row in validations] == sorted({row["steps"] for row in validations})
    assert train(*TINY, "--output", str(folder)) == 2  # there is a run in it already
    assert train("--resume", str(folder)) == 0  # done, and judged again
    again = tmp_path / "again"
    assert train(*TINY, "--output", str(again)) == 0
    assert load_policy(again / "checkpoint" / "policy.npz").sha256 == (
        load_policy(folder / "checkpoint" / "policy.npz").sha256
    )


def test_a_model_holds_its_schedule_by_name_and_not_train_py_itself(tmp_path: Path) -> None:
    """What ``__main__`` defines is pickled whole, with the path of its file."""
    assert train(*TINY, "--output", str(tmp_path / "run")) == 0
    with zipfile.ZipFile(tmp_path / "run" / "best" / "model.zip") as archive:
        data = json.loads(archive.read("data"))
    pickled = [
        base64.b64decode(value[":serialized:"])
        for value in data.values()
        if isinstance(value, dict) and ":serialized:" in value
    ]
    assert any(b"agents.training.schedule" in found for found in pickled)
    assert not any(b"train.py" in found or b"_Falling" in found for found in pickled)


def test_the_best_of_several_runs_is_that_of_least_cost(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    worse, better = tmp_path / "worse", tmp_path / "better"
    assert train(*TINY, "--output", str(worse)) == 0
    (better / "best").mkdir(parents=True)
    shutil.copyfile(SHIPPED_POLICY, better / "best" / "policy.npz")
    assert best_run([worse, better], 10) == best_run([better, worse], 10) == better
    assert best_run([worse], 10) == worse
    assert "of points violated" in capsys.readouterr().out


def test_bullet_fine_tunes_from_a_model(tmp_path: Path) -> None:
    assert train(*TINY, "--output", str(tmp_path / "first")) == 0
    start = ["--start-from", str(tmp_path / "first" / "best" / "model.zip")]
    bullet = ["--physics", "bullet", "--steps", "40", "--lanes", "2", "--rollout", "20", "--batch-size", "20"]
    assert train(*TINY, *bullet, *start, "--output", str(tmp_path / "bullet")) == 0
    assert (tmp_path / "bullet" / "test.json").exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ["--steps", "0"],
        ["--gamma", "2"],
        ["--seed", "-1"],
        ["--batch-size", "100000"],
        ["--resume", "no/such/run"],
        ["--device", "cuda:7"],
        ["--learning-rates", "nan", "1e-5"],
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert train(*arguments) == 2
    told = capsys.readouterr()
    assert "Traceback" not in told.err + told.out
    assert arguments[0].lstrip("-").replace("-", "_") in told.err or "no/such/run" in told.err


def test_without_torch_it_says_in_one_sentence_what_to_install() -> None:
    program = "import runpy, sys; sys.modules['torch'] = None; runpy.run_path('train.py', run_name='__main__')"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == "training needs torch: pip install torch==2.13.0, and then 'jet-gym[train]'\n"


def test_ctrl_c_while_it_imitates_is_told_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Imitation, "_learn", interrupt)
    assert train(*TINY, "--output", str(tmp_path / "run")) == 130
    said = " ".join(capsys.readouterr().err.split())
    assert "stopped; begin imitation anew with: python train.py --resume" in said
    assert said.endswith("interrupted; what was written is whole")


def test_jet_gym_train_is_train_py() -> None:
    command = [sys.executable, "-c", "from jet_gym.cli import main; main()", "train", "--help"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert "--deviations" in done.stdout
    assert "train" in cli.commands
    assert CliRunner().invoke(cli, ["--help"]).output.count("Train a posture policy") == 1


def test_a_violation_costs_what_training_says() -> None:
    steps = [StepVecEnv(1, violation_cost=cost) for cost in (0.5, 5.5)]
    lowest = []
    for env in steps:
        env.seed(0)
        env.reset()
        _, rewards, _, _ = env.step(np.ones((1, 3), dtype=np.float32))
        lowest.append(float(rewards[0]))
    assert lowest[1] < lowest[0] - 4.0
