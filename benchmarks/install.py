"""What an install costs and whether it works: the wheel in an empty environment, outside of the repository.

    python -m benchmarks.install                                          # with the Python that runs this
    python -m benchmarks.install --python python3.10 --python python3.13  # with others

Builds the wheel, installs it into a new virtual environment with pip's own choice of versions, and measures how
long that takes, with the download and without, and what lies on the disk. Then plans, compares, loads the
policy that ships and makes the environment there, in an empty folder; see ``tests/installed_package.py``.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

from benchmarks.report import Report, show, write
from jet_gym.utils.files import check_writable

_ROOT = Path(__file__).resolve().parents[1]
_HEAVIEST = 5  # packages that are listed
_NEVER_SHIPPED = {"pip", "setuptools", "wheel", "pkg_resources"}


class InstallError(Exception):
    """A command that failed, with what it printed."""


def measure(python: str) -> Report:
    """Install the package for one interpreter, and use it.

    Raises:
        InstallError: If the wheel cannot be built or installed, or what is installed does not work.
    """
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        wheel = _built(folder / "dist")
        version = _run([python, "-c", "import platform; print(platform.python_version())"]).strip()
        report = Report(f"The wheel on Python {version}, in an empty environment")
        report.add("wheel", wheel.stat().st_size, "B")
        # The first install fills pip's cache, which begins empty: what it takes longer is the download.
        variables = {"PIP_CACHE_DIR": str(folder / "cache")}
        _, first, _ = _installed(python, folder / "first", wheel, variables)
        interpreter, again, busy = _installed(python, folder / "again", wheel, variables)
        report.add("pip install, with the download", first, "s")
        report.add("the same with all that it needs in pip's cache", again, "s")
        report.add("of it processor time", busy, "s")
        site = Path(
            _run([str(interpreter), "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]).strip()
        )
        sizes = _sizes(site)
        report.add("on disk", sum(sizes.values()), "B")
        for name in sorted(sizes, key=lambda name: -sizes[name])[:_HEAVIEST]:
            report.add(f"of it {name}", sizes[name], "B")
        report.notes += _used(interpreter, site, folder / "elsewhere", version)
        return report


def _built(folder: Path) -> Path:
    """Build sdist and wheel; return the wheel."""
    _run([sys.executable, "-m", "build", "--outdir", str(folder), str(_ROOT)])
    (wheel,) = folder.glob("*.whl")
    return wheel


def _installed(python: str, folder: Path, wheel: Path, variables: dict[str, str]) -> tuple[Path, float, float]:
    """Install the wheel into a new environment; return its interpreter, how long pip and its processor took [s]."""
    _run([python, "-m", "venv", str(folder)])
    interpreter = folder / ("Scripts" if os.name == "nt" else "bin") / "python"
    started, busy = perf_counter(), _processor_time_of_children()
    _run([str(interpreter), "-m", "pip", "install", "--quiet", str(wheel)], **variables)
    return interpreter, perf_counter() - started, _processor_time_of_children() - busy


def _processor_time_of_children() -> float:
    """Return what the commands that have ended took of the processor [s]."""
    times = os.times()
    return times.children_user + times.children_system


def _sizes(site: Path) -> dict[str, int]:
    """Return the bytes of each package in a folder of packages; what accompanies it counts as its own."""
    sizes: dict[str, int] = {}
    for top in site.iterdir():
        name = top.name.partition(".")[0].split("-")[0]
        if name not in _NEVER_SHIPPED:
            files = [top] if top.is_file() else [path for path in top.rglob("*") if path.is_file()]
            sizes[name] = sizes.get(name, 0) + sum(path.stat().st_size for path in files)
    return sizes


def _used(interpreter: Path, site: Path, folder: Path, version: str) -> list[str]:
    """Use the package in an empty folder; return what worked."""
    folder.mkdir()
    script = str(_ROOT / "tests" / "installed_package.py")
    output = _run([str(interpreter), script, str(site)], folder, MPLBACKEND="agg")
    kept = ("robot", "policy:", "without PyBullet", "JetHR1Step-v0")
    worked = [line for line in output.splitlines() if line.startswith(kept)]
    return [f"Python {version}: jet-gym plan, jet-gym compare; {'; '.join(worked)}"]


def _run(command: Sequence[str], folder: Path | None = None, **variables: str) -> str:
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"} | variables
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise InstallError(f"{' '.join(command)} failed:\n{done.stdout}{done.stderr}")
    return done.stdout


def main() -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--python", action="append", metavar="COMMAND", help="an interpreter; may be given many times"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the numbers to this file too")
    arguments = parser.parse_args()
    reports = []
    try:
        if arguments.json is not None:
            check_writable(arguments.json)
        for python in arguments.python or [sys.executable]:
            reports.append(measure(python))
            show(reports[-1:])
        write(reports, arguments.json, None)
    except InstallError as error:
        print(error, file=sys.stderr)
        return 1
    except OSError as error:
        parser.error(f"{error.filename}: {error.strerror}")
    except KeyboardInterrupt:
        parser.exit(130, "interrupted\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
