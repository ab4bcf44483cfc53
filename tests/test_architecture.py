"""Imports run one way, and the picture of them is of what is there."""

from __future__ import annotations

import importlib.util
import pkgutil
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import pytest

import agents
import jet_gym

pytest.importorskip("importlinter")
pytest.importorskip("sphinx")

ROOT = Path(__file__).resolve().parents[1]


def lint_imports(folder: Path) -> subprocess.CompletedProcess[str]:
    """Hold the imports of the packages in a folder, those in functions too, against its contracts."""
    code = "import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports(cache_dir=None))"
    return subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=False)


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    """A folder with a copy of the packages and their contracts, free to be edited."""
    for package in ("jet_gym", "agents"):
        shutil.copytree(
            ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__", "policies")
        )
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def layers_picture() -> ModuleType:
    spec = importlib.util.spec_from_file_location("layers_picture", ROOT / "docs/_extensions/layers_picture.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_imports_run_one_way() -> None:
    result = lint_imports(ROOT)
    assert result.returncode == 0, result.stdout


@pytest.mark.parametrize(
    ("module", "line", "broken"),
    [
        ("jet_gym/kinematics.py", "from jet_gym.balance import BalanceSettings", "Imports run one way BROKEN"),
        ("jet_gym/balance.py", "def late():\n    import agents.genetic", "Imports run one way BROKEN"),
        ("jet_gym/task/lanes.py", "from jet_gym.envs import jet_hr1_step", "Imports run one way BROKEN"),
        ("jet_gym/envs/physics.py", "import agents.planner", "Environments and simulation know no planner BROKEN"),
        (
            "agents/genetic.py",
            "def late():\n    import torch",
            "simulation nor learning nor pictures BROKEN",
        ),
    ],
)
def test_an_import_against_the_direction_is_noticed(copied: Path, module: str, line: str, broken: str) -> None:
    with (copied / module).open("a", encoding="utf-8") as file:
        file.write(f"\n{line}\n")
    result = lint_imports(copied)
    assert result.returncode == 1
    assert broken in result.stdout


def test_every_module_has_a_layer(layers_picture: ModuleType) -> None:
    layered = {module for modules in layers_picture.read_layers(ROOT / "pyproject.toml") for module in modules}
    there = {f"{p.__name__}.{found.name}" for p in (jet_gym, agents) for found in pkgutil.iter_modules(p.__path__)}
    assert layered == there


def test_the_readme_says_of_every_module_what_it_is_for() -> None:
    _, _, table = (ROOT / "README.md").read_text(encoding="utf-8").partition("## Where things are")
    for package in (jet_gym, agents):
        for found in pkgutil.iter_modules(package.__path__):
            name = f"`{found.name}.py`" if not found.ispkg else f"`{package.__name__}/{found.name}/`"
            assert name in table or f"`{package.__name__}/{found.name}.py`" in table, name


def test_picture_has_every_layer_and_no_import_that_leads_upward(layers_picture: ModuleType) -> None:
    svg = ElementTree.fromstring(layers_picture.picture())
    words = "".join(svg.itertext())
    assert all(title in words for title in layers_picture.TITLES.values())
    paths = [path.get("marker-end") for path in svg.iter("{http://www.w3.org/2000/svg}path")]
    assert paths.count("url(#up)") == 0
    assert paths.count("url(#down)") > 30
