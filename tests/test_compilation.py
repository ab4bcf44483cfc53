"""Machine code on disk follows the source, and imports stay light."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import agents
import jet_gym
from jet_gym.robot import urdf_directory

EVALUATE = """
import json
from jet_gym import jet_hr1
from jet_gym.posture import evaluate_postures
posture = evaluate_postures(jet_hr1(), "left", (0.0, 0.3, 0.0), (0.0, -0.1125, 0.0), (0.0, -0.02, 0.4))
print(json.dumps(float(posture.thrust)))
"""


@pytest.fixture
def copied_package(tmp_path: Path) -> Path:
    """Return a folder with a copy of the packages and the robot, free to be edited."""
    for package in (jet_gym, agents):
        source = Path(package.__file__).parent
        shutil.copytree(source, tmp_path / source.name, ignore=shutil.ignore_patterns("__pycache__", "urdf"))
    shutil.copytree(urdf_directory(), tmp_path / "urdf")
    return tmp_path


def run(code: str, folder: Path) -> str:
    """Run code in another process that finds the packages of a folder, and return what it prints."""
    path = os.pathsep.join([str(folder), *filter(None, sys.path)])
    environment = os.environ | {"PYTHONPATH": path, "NUMBA_CACHE_DIR": str(folder / "cache")}
    environment["NUMBA_OPT"] = "1"  # quicker to compile; 0 is not cached
    answer = subprocess.run(
        [sys.executable, "-c", code], env=environment, cwd=folder, capture_output=True, text=True, check=False
    )
    assert answer.returncode == 0, answer.stderr
    return answer.stdout


def machine_code(folder: Path) -> dict[str, int]:
    """Return when each file of compiled code was written."""
    return {path.name: path.stat().st_mtime_ns for path in (folder / "cache").rglob("*.nbc")}


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1, f"{old!r} is no longer in {path.name}"
    path.write_text(text.replace(old, new), encoding="utf-8")


def test_editing_a_building_block_recompiles_what_calls_it_in_another_file(copied_package: Path) -> None:
    before = json.loads(run(EVALUATE, copied_package))
    compiled = machine_code(copied_package)
    assert any(name.startswith("posture._evaluate") for name in compiled)

    assert json.loads(run(EVALUATE, copied_package)) == before
    assert machine_code(copied_package) == compiled, "an unedited package was compiled again"

    edit(copied_package / "jet_gym" / "balance.py", "return weight * along /", "return 2.0 * weight * along /")
    assert json.loads(run(EVALUATE, copied_package)) == pytest.approx(2.0 * before, rel=1e-12)


# ---------------------------------------------------------------------- imports

CORE = (
    "agents.exhaustive",
    "agents.genetic",
    "jet_gym.balance",
    "jet_gym.courses",
    "jet_gym.feasibility",
    "jet_gym.fitness",
    "jet_gym.kinematics",
    "jet_gym.plan",
    "jet_gym.posture",
)


@pytest.mark.parametrize("blocked", ["pybullet", "torch", "gymnasium", "matplotlib"])
def test_planning_imports_without(copied_package: Path, blocked: str) -> None:
    code = f"import sys\nsys.modules[{blocked!r}] = None\n" + "".join(f"import {module}\n" for module in CORE)
    run(code + "from agents import make_planner\nmake_planner('gas')", copied_package)


def test_importing_the_package_is_light(copied_package: Path) -> None:
    code = "import sys, jet_gym\nprint(sorted({name.partition('.')[0] for name in sys.modules}))"
    loaded = run(code, copied_package)
    assert "'numpy'" in loaded
    for heavy in ("numba", "matplotlib", "pybullet", "torch"):
        assert f"'{heavy}'" not in loaded, heavy
