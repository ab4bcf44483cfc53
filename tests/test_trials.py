"""Trials under disturbances: the same in one process or two, and on disk whole."""

from __future__ import annotations

import dataclasses

import pytest

from jet_gym.simulation import Disturbance, DisturbanceRanges
from jet_gym.simulation.results_file import ResultsFileError
from jet_gym.simulation.trials import Trial, load_trials, run_trials, save_trials

pytest.importorskip("pybullet")


@pytest.fixture(scope="module")
def trials(experiment) -> list[Trial]:
    return run_trials(experiment, 3, jobs=1)


class TestTrials:
    def test_two_processes_give_what_one_gives(self, experiment, trials):
        assert run_trials(experiment, 3, jobs=2) == trials

    def test_what_was_interrupted_is_taken_up_again(self, experiment, trials, tmp_path):
        path = tmp_path / "trials.json"

        def interrupt(done: int, _: int) -> None:
            if done == 3:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            run_trials(experiment, 3, 1, progress=interrupt, save=lambda kept: save_trials(path, experiment, kept))
        kept = load_trials(path, experiment)
        assert kept == trials[:3]
        pid_alone = dataclasses.replace(experiment, controls=("pid",))
        assert run_trials(pid_alone, 1, 1, kept) == [trial for trial in trials[:2] if trial.control == "pid"]
        ran: list[int] = []
        assert run_trials(experiment, 3, 1, kept, progress=lambda done, _: ran.append(done)) == trials
        assert ran == [4, 5, 6]

    def test_both_ways_to_control_the_thrust_meet_the_same_disturbances(self, trials):
        by_number = {}
        for trial in trials:
            by_number.setdefault(trial.number, []).append(trial.disturbance)
        assert all(one == other for one, other in by_number.values())
        assert len({disturbances[0] for disturbances in by_number.values()}) == 3

    def test_a_trial_depends_on_seed_and_number_alone(self, experiment):
        same = dataclasses.replace(experiment, controls=("pid",))
        assert same.disturbance(7) == experiment.disturbance(7)
        assert dataclasses.replace(experiment, seed=6).disturbance(7) != experiment.disturbance(7)

    def test_the_noise_of_the_imu_depends_on_seed_and_number(self, experiment):
        def peak(seed: int, number: int) -> float:
            return dataclasses.replace(experiment, seed=seed).run(number, "pid", Disturbance()).peak_thrust

        peaks = [peak(*which) for which in ((0, 0), (1, 0), (0, 1), (1, 1))]
        assert len(set(peaks)) == 4
        assert peak(1, 1) == peaks[-1]

    def test_files_of_other_experiments_are_refused(self, experiment, trials, tmp_path):
        path = tmp_path / "trials.json"
        save_trials(path, experiment, trials)
        with pytest.raises(ResultsFileError, match="another experiment: seed differ"):
            load_trials(path, dataclasses.replace(experiment, seed=6))
        with pytest.raises(ResultsFileError, match="ranges"):
            load_trials(path, dataclasses.replace(experiment, ranges=DisturbanceRanges()))

    @pytest.mark.parametrize(
        ("content", "message"),
        [
            ("{", "not JSON"),
            ('{"format": "other"}', "field 'format'"),
            ('{"format": "jet-gym-robustness/1", "trials": []}', "must be 'jet-gym-robustness/2'"),
            ('{"format": "jet-gym-robustness/2", "trials": [{}]}', "field 'trials' is damaged"),
            ('{"format": "jet-gym-robustness/2"}', "field 'trials'"),
        ],
    )
    def test_damaged_files_are_refused(self, content, message, tmp_path):
        path = tmp_path / "trials.json"
        path.write_text(content)
        with pytest.raises(ResultsFileError, match=message):
            load_trials(path)
