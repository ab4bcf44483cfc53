"""The reproduction of the paper: its files, its numbers, its page in a real browser, and Ctrl-C."""

from __future__ import annotations

import csv
import io
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from agents.studies import estimates
from jet_gym.balance_space import compute_balance_space
from jet_gym.cli import INTERRUPTED, run
from jet_gym.errors import SettingsError
from jet_gym.reproduction import run as reproduction_run
from jet_gym.reproduction.model import Claim, Interval, Settings, listed, share_of, with_interval
from jet_gym.reproduction.page import render_page
from jet_gym.reproduction.run import PARTS, check_output

SMALLEST = {
    "plans": 2,
    "space_resolution": 100.0,
    "study_plans": 1,
    "thrust_resolution": 30.0,
    "trials": 1,
    "draws": 1,
    "rounds": 1,
}
FIGURES = ("05", "06", "07", "08", "09", "10", "11")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What ``jet-gym reproduce --quick`` writes, made smaller yet."""
    output = tmp_path_factory.mktemp("reproduction") / "of the paper"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Settings, "quick", lambda self: Settings(seed=self.seed, **SMALLEST))
        patch.setattr(estimates, "PELVIS_MASSES", (2.8,))
        patch.setattr(estimates, "FOOT_LENGTHS", (0.13, 0.17))
        patch.setattr(estimates, "FAN_OFFSETS", (0.0, 0.06))
        patch.setattr(estimates, "ZMP_MARGINS", (0.02,))
        assert run(["reproduce", "--quick", "--seed", "3", "--output", str(output)]) == 0
    return output


@pytest.fixture(scope="module")
def results(folder: Path) -> dict[str, Any]:
    """Its numbers."""
    content: dict[str, Any] = json.loads((folder / "results.json").read_text())
    return content


def test_figures_5_to_11_and_the_tables_are_there(folder: Path, results: dict[str, Any]) -> None:
    pytest.importorskip("pybullet")
    names = {path.name for path in (folder / "figures").iterdir()}
    for number in FIGURES:
        assert any(name.startswith(f"fig-{number}-") for name in names), number
    for path in (folder / "figures").iterdir():
        with Image.open(path) as picture:
            assert np.asarray(picture.convert("L")).std() > 8.0, path.name
    assert {path.stem for path in (folder / "tables").iterdir()} == set(results["tables"])
    for name, table in results["tables"].items():
        rows = list(csv.reader(io.StringIO((folder / "tables" / f"{name}.csv").read_text())))
        assert rows == [table["headings"], *table["rows"]]
        assert all(len(row) == len(rows[0]) for row in rows)


def test_settings_and_seeds_are_told(results: dict[str, Any]) -> None:
    assert results["format"] == "jet-gym-reproduction/1"
    assert results["settings"] == {"seed": 3, **SMALLEST}
    assert results["machine"]["command"] == "jet-gym reproduce --quick --seed 3"


def test_claims_of_each_section_have_a_measurement_and_a_verdict(results: dict[str, Any]) -> None:
    claims = [Claim(**claim) for claim in results["claims"]]
    assert len(claims) >= 14
    for section in ("abstract", "II", "IV-A", "IV-C", "V", "Fig. 5", "Fig. 10"):
        assert any(section in claim.where for claim in claims), section
    for claim in claims:
        assert claim.verdict in ("holds", "differs", "not tested")
        assert claim.verdict == "not tested" or re.search(r"\d", claim.measured), claim


def test_numbers_are_those_of_the_modules(results: dict[str, Any]) -> None:
    pytest.importorskip("pybullet")
    space = compute_balance_space(1e-3 * SMALLEST["space_resolution"])
    assert results["tables"]["balance-space"]["rows"][1][3] == f"{1e3 * space.volume(with_thrust=True):.1f}"
    main = dict((row[0], row[1:]) for row in results["tables"]["table-1-robot"]["rows"])  # noqa: C402
    assert all(paper == here for paper, here in main.values())
    taken = {row[0]: row[2:] for row in results["tables"]["estimates"]["rows"] if "(taken)" in row[1]}
    assert len(taken) == 4
    assert len({tuple(cells) for cells in taken.values()}) == 1  # the same robot each time
    assert results["tables"]["experiment"]["rows"][-1][0].startswith("fans off")
    assert results["tables"]["experiment"]["rows"][-1][1].startswith("fell")


def test_page_needs_nothing_from_elsewhere(folder: Path, results: dict[str, Any]) -> None:
    page = (folder / "index.html").read_text()
    sources = re.findall(r"""(?:src|href)\s*=\s*["']([^"']*)""", page)
    assert {source.partition(":")[0] if source[0] != "#" else "#" for source in sources} == {"data", "#"}
    assert "url(" not in page
    assert "<script" not in page
    anchors = {source[1:] for source in sources if source[0] == "#"}
    assert anchors <= set(re.findall(r'id="([^"]+)"', page))
    assert page.count("<img ") == len(list((folder / "figures").iterdir()))
    assert page.count('class="badge') == len(results["claims"])


@pytest.mark.parametrize(("width", "height"), [(1280, 900), (390, 844)], ids=["desktop", "phone"])
def test_page_looks_right_in_a_browser(folder: Path, browser: Any, width: int, height: int) -> None:
    page = browser.new_page(viewport={"width": width, "height": height})
    page.set_default_timeout(180_000)  # [ms] a page of some metres takes its time on a busy machine
    requests: list[str] = []
    page.on("request", lambda request: requests.append(request.url))
    page.goto((folder / "index.html").as_uri())
    page.wait_for_load_state()
    images = page.evaluate("[...document.images].map(image => [image.complete, image.naturalWidth, image.width])")
    assert len(images) == len(list((folder / "figures").iterdir()))
    for complete, natural_width, shown_width in images:
        assert complete
        assert natural_width > 400
        assert 0 < shown_width <= width
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert [url for url in requests if not url.startswith(("file:", "data:"))] == []
    assert page.locator("h1").inner_text().startswith("Jet-HR1")
    for full in (False, True):
        with Image.open(io.BytesIO(page.screenshot(full_page=full))) as picture:
            pixels = np.asarray(picture.convert("L"))
        assert pixels.shape[1] == width
        assert pixels.std() > 10.0
        assert (pixels < 128).mean() > 0.005  # ink
    page.close()


def test_text_is_escaped_and_missing_parts_are_told() -> None:
    claim = Claim("V", "1 < 2 & <b>", "<script>", "not tested")
    chapter = reproduction_run.Chapter("x", "A & B", claims=(claim,))
    page = render_page([chapter], Settings(), {"version": "0"})
    assert "1 &lt; 2 &amp; &lt;b&gt;" in page
    assert "<script>" not in page
    assert "not tested" in page


def test_ctrl_c_leaves_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: Any) -> None:
    def interrupted(*_: Any) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr(reproduction_run, "PARTS", (PARTS[0], reproduction_run.Part("more", interrupted)))
    assert run(["reproduce", "--output", str(tmp_path / "out")]) == INTERRUPTED
    assert capsys.readouterr().err.strip().startswith("jet-gym: interrupted")
    assert list(tmp_path.iterdir()) == []


def test_without_pybullet_the_experiment_is_left_out_and_told(monkeypatch: Any) -> None:
    from jet_gym.reproduction import experiment

    monkeypatch.setattr(experiment, "find_spec", lambda name: None)
    chapter = experiment.experiment_chapter(Settings(), lambda done, total: None)
    assert [claim.verdict for claim in chapter.claims] == ["not tested"]
    assert "PyBullet is not installed" in chapter.text[0]
    assert not chapter.pictures


def test_bad_output_is_refused_before_the_work(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "figures").write_text("")
    for name in ("file", "nowhere/out", "folder"):
        assert run(["reproduce", "--output", str(tmp_path / name)]) == 2
        assert capsys.readouterr().err.count("\n") == 1
    check_output(tmp_path / "new")


@pytest.mark.parametrize("wrong", [{"plans": 1}, {"seed": -1}, {"space_resolution": 1.0}, {"trials": True}])
def test_senseless_settings_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(SettingsError):
        Settings(**wrong)


def test_words_and_shares() -> None:
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "c"]) == "a, b and c"
    assert with_interval(Interval(1.0, 0.5, 2.0), 1) == "1.0 ± 1.0"
    assert with_interval(Interval(1.0, 1.0, 1.0), 2) == "1.00"
    seen: list[tuple[int, int]] = []
    share_of(lambda done, total: seen.append((done, total)), 1, 3)(2, 4)
    assert seen == [(6, 12)]
