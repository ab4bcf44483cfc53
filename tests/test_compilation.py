"""Machine code on disk follows the source, and imports stay light."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import agents
import jet_gym
from jet_gym import constraints
from jet_gym.robot import urdf_directory
from jet_gym.utils.compilation import sources_behind

CALLER = """
from jet_gym.balance import assigned_thrust
from jet_gym.utils.compilation import entry_point

@entry_point
def quarter_of(weight):
    return assigned_thrust(weight, 0.0, 0.25, (0.0, 1.0), (0.0, 0.0))
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
    (copied_package / "jet_gym" / "caller.py").write_text(CALLER, encoding="utf-8")
    call = "from jet_gym.caller import quarter_of\nprint(quarter_of(60.0))"
    assert float(run(call, copied_package)) == 15.0
    compiled = machine_code(copied_package)
    assert any(name.startswith("caller.quarter_of") for name in compiled)

    assert float(run(call, copied_package)) == 15.0
    assert machine_code(copied_package) == compiled, "an unedited package was compiled again"

    edit(copied_package / "jet_gym" / "balance.py", "return weight * along /", "return 2.0 * weight * along /")
    assert float(run(call, copied_package)) == 30.0


def test_machine_code_belongs_to_the_sources_behind_it_and_to_no_others(copied_package: Path) -> None:
    call = (
        "from pathlib import Path\n"
        "from jet_gym.utils.compilation import source_fingerprint\n"
        "print(source_fingerprint(Path('agents/genetic.py').resolve()))"
    )
    before = run(call, copied_package)
    assert run(call, copied_package) == before

    for unrelated in ("jet_gym/cli/plan.py", "jet_gym/task/observation.py", "agents/exhaustive.py"):
        with (copied_package / unrelated).open("a", encoding="utf-8") as source:
            source.write("\n# edited\n")
    assert run(call, copied_package) == before

    # Imported by it, by what it imports, by what that imports; and its own.
    for behind in ("agents/planner.py", "jet_gym/step.py", "jet_gym/errors.py", "agents/genetic.py"):
        with (copied_package / behind).open("a", encoding="utf-8") as source:
            source.write("\n# edited\n")
        after = run(call, copied_package)
        assert after != before, behind
        before = after


@pytest.mark.parametrize(
    "statement",
    [
        "import jet_gym.constraints",
        "import math, jet_gym.constraints as flags",
        "from jet_gym import constraints",
        "from jet_gym import (\n    # (a module)\n    constraints,\n)",
        "from jet_gym.constraints import REACH",
        "if True:\n    from jet_gym.constraints import REACH",
    ],
)
def test_every_way_to_import_counts(tmp_path: Path, statement: str) -> None:
    source = tmp_path / "source.py"
    source.write_text(statement + "\n", encoding="utf-8")
    assert Path(constraints.__file__).resolve() in sources_behind(source)


def test_a_disk_without_room_for_machine_code_does_not_stop_the_work(copied_package: Path) -> None:
    pytest.importorskip("resource")
    (copied_package / "caller.py").write_text(CALLER, encoding="utf-8")
    full = """
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
import caller
print(caller.quarter_of(8.0))
"""
    assert run(full, copied_package) == run("import caller\nprint(caller.quarter_of(8.0))", copied_package)


def test_without_the_compiler_the_numbers_are_the_same(copied_package: Path) -> None:
    (copied_package / "caller.py").write_text(CALLER, encoding="utf-8")
    code = "import caller\nprint(caller.quarter_of(8.0))"
    plain = "import os\nos.environ['NUMBA_DISABLE_JIT'] = '1'\n" + code
    assert run(plain, copied_package) == run(code, copied_package)


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
