"""Training that is killed while it writes: every file on disk is whole, and ``--resume`` goes on."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3")

from tiny_training import TINY, train

from agents.policy import load_policy


class KilledError(BaseException):
    """Stands for SIGKILL: nothing in the program may handle it."""


def check_whole(folder: Path) -> None:
    """Every file of a run can be read."""
    for path in folder.rglob("*.json"):
        json.loads(path.read_text())
    for path in folder.rglob("policy.npz"):
        load_policy(path)
    for path in folder.rglob("model.zip"):
        with zipfile.ZipFile(path) as archive:
            assert archive.testzip() is None


def test_a_run_killed_at_any_file_of_its_first_checkpoint_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The files are put in their places one by one; it dies before each in turn, and is resumed each time."""
    run, replace = tmp_path / "run", Path.replace
    killed: list[str] = []

    def die_at(place: int) -> None:
        seen: list[Path] = []

        def replace_or_die(self: Path, target: Path) -> Path:
            if Path(target).parent.name == "checkpoint":
                seen.append(target)
                if len(seen) == place:
                    killed.append(Path(target).name)
                    raise KilledError
            return replace(self, target)

        monkeypatch.setattr(Path, "replace", replace_or_die)

    arguments = [*TINY, "--output", str(run)]
    for place in (1, 2, 3):
        die_at(place)
        with pytest.raises(KilledError):
            train(*arguments)
        check_whole(run)
        arguments = ["--resume", str(run)]
    monkeypatch.setattr(Path, "replace", replace)
    assert sorted(killed) == ["about.json", "model.zip", "policy.npz"]
    assert train("--resume", str(run)) == 0
    check_whole(run)
    assert (run / "test.json").exists()
    validations = json.loads((run / "progress.json").read_text())["validations"]
    assert [row["steps"] for row in validations] == sorted({row["steps"] for row in validations})
