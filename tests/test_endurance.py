"""The long run in small: what it counts, and that it notices what it is there to notice."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.endurance import LEAK, Endurance, endure, main


def test_all_episodes_are_run_and_nothing_is_wrong() -> None:
    found = endure(6, processes=1, environments=2, physics="quasistatic")
    assert found.episodes.total() == 6
    assert found.problems() == []
    assert found.steps >= 6 * 30
    assert found.memory[0][-1][0] == 6
    assert "6 of 6 episodes" in found.sentence()


def test_a_leak_a_nan_and_a_death_are_told() -> None:
    found = Endurance(100)
    found.episodes["success"] = 100
    found.memory[0] = [(k, 500_000 + int(3.0 * LEAK * k)) for k in range(101)]
    found.memory[1] = [(k, 500_000 + (k % 3)) for k in range(101)]
    found.not_finite["reward"] = 2
    found.failures.append("process 1 died with exit code -11")
    told = found.problems()
    assert told[0] == "process 1 died with exit code -11"
    assert told[1] == "2 times reward was not finite"
    assert told[2].startswith("process 0 gains at least 6")
    assert len(told) == 3


def test_a_process_that_cannot_work_fails_the_run() -> None:
    found = endure(2, processes=1, environments=1, physics="magnetic")
    assert "physics must be" in found.problems()[0]


@pytest.mark.parametrize("arguments", [["--episodes", "0"], ["--processes", "-1"], ["--json", "none/x.json"]])
def test_bad_arguments_are_refused(
    arguments: list[str], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    assert stopped.value.code == 2
    assert "Traceback" not in capsys.readouterr().err
