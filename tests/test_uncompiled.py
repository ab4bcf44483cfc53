"""Plain Python gives what machine code gives: what is compiled can be debugged, and its coverage counted, without.

Without re-association and fused multiply-adds both do the same arithmetic in the same order, and so far agree to
the last bit. Functions of the mathematical libraries may differ by rounding on another machine.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import both_ways
import numpy as np
import pytest
from numpy.typing import NDArray

PROJECT = Path(__file__).resolve().parents[1] / "pyproject.toml"
ROUNDING = 1e-12  # relative, and absolute in metres, newtons and radians

Numbers = dict[str, NDArray]


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory, pytestconfig: pytest.Config) -> Numbers:
    """All cases computed by plain Python, in a process whose coverage is counted if that of the tests is."""
    counted = pytestconfig.pluginmanager.hasplugin("_cov")
    coverage = ["-m", "coverage", "run", "--parallel-mode", f"--rcfile={PROJECT}"] if counted else []
    path = tmp_path_factory.mktemp("plain") / "numbers.npz"
    answer = subprocess.run(
        [sys.executable, *coverage, both_ways.__file__, str(path)],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (answer.returncode, answer.stderr) == (0, "")
    with np.load(path) as numbers:
        return dict(numbers)


@pytest.mark.parametrize("case", both_ways.CASES)
def test_plain_python_gives_what_machine_code_gives(case: str, plain: Numbers) -> None:
    compiled = {f"{case}/{name}": np.asarray(value) for name, value in both_ways.CASES[case]().items()}
    assert compiled.keys() == {name for name in plain if name.startswith(f"{case}/")}
    for name, values in compiled.items():
        assert values.dtype == plain[name].dtype, name
        tolerance = ROUNDING if values.dtype.kind == "f" else 0
        np.testing.assert_allclose(plain[name], values, tolerance, tolerance, err_msg=name)


def test_the_cases_are_worth_comparing(plain: Numbers) -> None:
    """Some postures violate something and some nothing, paths are moved and polished, and shadows are soft."""
    for swing, model in (("left", "assigned"), ("left", "least"), ("right", "assigned"), ("right", "least")):
        violations = plain[f"postures/{swing} {model} violations"]
        assert (violations == 0).any()
        assert len(np.unique(violations)) > 3
        assert plain[f"refinements/{swing} {model} steps"] > 10
    assert plain["refinements/left assigned moved inside"] > 0
    assert plain["refinements/left assigned violates at first"]
    assert not plain["refinements/left assigned violates"]
    assert np.isfinite(plain["balance_space/thrust"]).any()
    assert all(len(np.unique(values)) > 50 for name, values in plain.items() if name.startswith("shading/"))
