"""A disk that fills up, a folder that cannot be written: the old file stays, no half of a new one, one sentence."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from jet_gym.cli import run

pytest.importorskip("resource")

LIMIT = 300  # bytes that a file may have, fewer than each of them has
SCRIPT = f"""
import resource, signal, sys
from dataclasses import replace
from pathlib import Path
import numpy as np
from agents import make_planner
from agents.network import PolicyNetwork
from agents.policy import SHIPPED_POLICY
from jet_gym.balance_space import compute_balance_space
from jet_gym.courses import PAPER
from jet_gym.figures import plot_trajectories, save_figure
from jet_gym.simulation.pictures.encoding import write_mp4
from jet_gym.utils.files import write_whole_with
from jet_gym.simulation.trials import Experiment, save_trials

step = replace(PAPER.side, points=12)
plan = make_planner("gas").plan(step)
space, network = compute_balance_space(0.1), PolicyNetwork.load(SHIPPED_POLICY)
noise = [np.random.default_rng(k).integers(0, 256, (64, 64, 3), dtype=np.uint8) for k in range(8)]
writers = {{
    "plan.json": plan.save,
    "policy.npz": network.save,
    "space.npz": space.save,
    "picture.png": lambda path: save_figure(plot_trajectories([plan]), path),
    "robustness.json": lambda path: save_trials(path, Experiment((plan,)), []),
    "film.mp4": lambda path: write_whole_with(path, lambda temporary: write_mp4(temporary, noise, (64, 64), 8.0)),
}}
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # so that writing fails as it does on a full disk
resource.setrlimit(resource.RLIMIT_FSIZE, ({LIMIT}, {LIMIT}))
for name, write in writers.items():
    path = Path(name)
    path.write_bytes(b"old")
    try:
        write(path)
    except OSError as error:
        assert error.filename == str(path.resolve()), (name, error)
        print(name, error.strerror)
    assert path.read_bytes() == b"old", name
assert sorted(path.name for path in Path().iterdir()) == sorted(writers)
from jet_gym.cli import run
sys.exit(run(["plan", "side", "--points", "30", "--output", "plan.json"]))
"""


def test_on_a_full_disk_every_writer_fails_and_leaves_the_old_file(tmp_path: Path) -> None:
    pytest.importorskip("imageio_ffmpeg")
    source = Path(__file__).resolve().parents[1]
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(source)},
        capture_output=True,
        text=True,
        check=False,
    )
    names = ["plan.json", "policy.npz", "space.npz", "picture.png", "robustness.json", "film.mp4"]
    told = [line.split() for line in done.stdout.splitlines()]
    assert [line[0] for line in told if line and line[0] in names] == names, done.stdout + done.stderr
    assert done.returncode == 2, done.stdout + done.stderr
    assert done.stderr == f"jet-gym: {tmp_path / 'plan.json'}: File too large\n"
    assert (tmp_path / "plan.json").read_bytes() == b"old"


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_cannot_be_written_is_told_before_the_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tmp_path.chmod(0o500)
    try:
        assert run(["plan", "side", "--output", str(tmp_path / "plan.json")]) == 2
        assert run(["robustness", "--output", str(tmp_path / "robustness.json")]) == 2
    finally:
        tmp_path.chmod(0o700)
    assert capsys.readouterr().err.count("Permission denied") == 2


def test_a_file_system_that_turned_read_only_is_told_before_the_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("pybullet")
    monkeypatch.setattr(os, "access", lambda path, mode: mode != os.W_OK)
    for command in (["plan", "side"], ["robustness"], ["compare", "--json"], ["simulate", "paper", "--log"]):
        option = [] if command[-1].startswith("--") else ["--output"]
        assert run([*command, *option, str(tmp_path / "out.json")]) == 2
        told = capsys.readouterr()
        assert told.out == ""
        assert told.err == f"jet-gym: {tmp_path / 'out.json'}: Permission denied\n"
    assert list(tmp_path.iterdir()) == []
