"""What is shipped: an sdist with all that its tests need, and a wheel made of it that runs by itself."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

pytest.importorskip("build")
pytest.importorskip("hatchling")

ROOT = Path(__file__).resolve().parents[1]
NOT_SHIPPED = (".ci/", ".github/")


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the sdist and the wheel that is built of it, as installers do."""
    folder = tmp_path_factory.mktemp("shipped")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.fixture(scope="module")
def sdist_names(shipped: Path) -> set[str]:
    """Return the names of the files in the sdist."""
    with tarfile.open(next(shipped.glob("*.tar.gz"))) as archive:
        return {name.partition("/")[2] for name in archive.getnames()}


@pytest.fixture(scope="module")
def wheel_names(shipped: Path) -> set[str]:
    """Return the names of the files in the wheel."""
    with zipfile.ZipFile(next(shipped.glob("*.whl"))) as archive:
        return set(archive.namelist())


def test_the_sdist_has_every_file_of_the_repository(sdist_names: set[str]) -> None:
    """Its tests read documentation, examples and hyperparameters, and its wheel needs the robot and train.py."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode != 0:
        pytest.skip("this is no clone of the repository")
    wanted = {name for name in listed.stdout.splitlines() if not name.startswith(NOT_SHIPPED)}
    wanted = {name for name in wanted if (ROOT / name).exists()}
    assert wanted - sdist_names == set()
    assert not [name for name in sdist_names if name.startswith(NOT_SHIPPED) or "__pycache__" in name]


def test_the_wheel_has_all_that_runs_and_nothing_else(wheel_names: set[str]) -> None:
    sources = {str(path.relative_to(ROOT)) for top in ("jet_gym", "agents") for path in (ROOT / top).rglob("*.py")}
    robot = {f"jet_gym/data/{path.relative_to(ROOT)}" for path in (ROOT / "urdf" / "meshes").iterdir()}
    others = {
        "agents/policies/jet_hr1_step_v0/policy.npz",
        "agents/py.typed",
        "jet_gym/data/train.py",
        "jet_gym/data/urdf/jet_hr1.urdf",
        "jet_gym/py.typed",
        "jet_gym/reproduction/page.html.jinja",
        "jet_gym_command.py",
    }
    assert sources | robot | others <= wheel_names
    tops = {name.partition("/")[0] for name in wheel_names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"agents", "jet_gym", "jet_gym_command.py"}
    assert not [name for name in wheel_names if "__pycache__" in name or name.endswith((".nbi", ".nbc"))]


def test_the_wheel_says_what_the_package_is(shipped: Path) -> None:
    from jet_gym import __version__

    with zipfile.ZipFile(next(shipped.glob("*.whl"))) as archive:
        folder = f"jet_gym-{__version__}.dist-info"
        metadata = archive.read(f"{folder}/METADATA").decode()
        assert "jet-gym = jet_gym_command:main" in archive.read(f"{folder}/entry_points.txt").decode()
        assert f"{folder}/licenses/LICENSE" in archive.namelist()
    assert "Requires-Python: >=3.10" in metadata
    assert "License-Expression: MIT" in metadata


def test_an_unpacked_wheel_runs_outside_of_the_repository(shipped: Path, tmp_path: Path) -> None:
    """Planning, the policy and the environment, with the robot and the policy that are in the wheel."""
    site, elsewhere = tmp_path / "site", tmp_path / "elsewhere"
    elsewhere.mkdir()
    with zipfile.ZipFile(next(shipped.glob("*.whl"))) as archive:
        archive.extractall(site)
    command = [sys.executable, str(ROOT / "tests" / "installed_package.py"), str(site), "--quick"]
    variables = os.environ | {"PYTHONPATH": str(site), "MPLBACKEND": "agg"}
    done = subprocess.run(command, cwd=elsewhere, env=variables, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "policy: total fitness" in done.stdout
    assert "JetHR1Step-v0: quasistatic" in done.stdout
    assert {path.name for path in elsewhere.iterdir()} >= {"plan.json", "plan.png"}


def test_the_version_is_the_same_wherever_it_stands() -> None:
    from jet_gym import __version__

    assert f'\nversion = "{__version__}"\n' in (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert f"\nversion: {__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## [{__version__}]" in changes or "## [Unreleased]" in changes


def test_the_changelog_keeps_to_its_form() -> None:
    """Keep a Changelog: versions as second headings, the kinds of change as third ones."""
    headings = [
        line for line in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").splitlines() if line.startswith("#")
    ]
    kinds = {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}
    assert headings[:2] == ["# Changelog", "## [Unreleased]"]
    for heading in headings[2:]:
        version = re.fullmatch(r"## \[\d+\.\d+\.\d+\] - \d{4}-\d\d-\d\d", heading)
        assert version or heading.removeprefix("### ") in kinds, heading
