"""Every command and code block of README and docs runs, in small; what takes too long is parsed by its program."""

from __future__ import annotations

import ast
import importlib
import inspect
import json
import os
import re
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("markdown_it")
pytest.importorskip("stable_baselines3")
pytest.importorskip("tomllib")

from documented import (
    PAGES,
    ROOT,
    Block,
    DocumentedCommandError,
    UnfinishedCommandError,
    blocks_of,
    check_command,
    inline_code_of,
    inline_commands,
    known_options,
    words_of,
)

from agents import make_planner
from agents.compare import CompareSettings, compare
from agents.policy import SHIPPED_POLICY
from jet_gym.cli import cli, run
from jet_gym.courses import PAPER

IN_SMALL = {  # what is added to a study, so that it ends soon; the last of two equal options counts
    "jet-gym claims": "--seeds 2",
    "jet-gym sweep": "--seeds 2",
    "jet-gym balance-space": "--resolution 0.1",
    "jet-gym compare": "--steps 2 --processes 1",
    "jet-gym dataset": "--steps 1",
    "jet-gym simulate paper": "--fps 0.5 --size 64 64",
}
ONLY_PARSED = {  # each has tests of its own
    "jet-gym studio": "serves a page until Ctrl-C",
    "jet-gym robustness": "hundreds of executions",
    "jet-gym reproduce": "minutes",
    "jet-gym train": "minutes",
}
done: set[str] = set()  # studies that have run already, on another page

SHELL = [page for page in PAGES if any(block.language == "sh" for block in blocks_of(page))]
PYTHON = [page for page in PAGES if any(block.language == "python" for block in blocks_of(page))]


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.fixture(params=SHELL, ids=name_of)
def shell_page(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return request.param


def test_commands_run(shell_page: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for block in blocks_of(shell_page):
        for command in block.commands if block.language == "sh" else ():
            _, words = words_of(command)
            check_command(words)
            if words[0] == "jet-gym" and not any(command_starts(words, name) for name in ONLY_PARSED):
                code = run_in_small(words)
                expected = int(block.notes.get("exit code", "0"))
                assert code == expected, f"{command}\n{capsys.readouterr().err}"


def command_starts(words: list[str], beginning: str) -> bool:
    return words[: len(beginning.split())] == beginning.split()


def run_in_small(words: list[str]) -> int:
    added = next((more for name, more in IN_SMALL.items() if command_starts(words, name)), None)
    command = " ".join(words)
    if added is not None and command in done:
        return 0
    done.add(command)
    return run([*words[1:], *(added or "").split()])


@pytest.mark.parametrize("page", PYTHON, ids=name_of)
def test_python_blocks_run(page: Path, tmp_path: Path) -> None:
    """One after the other in one program, as a reader would."""
    blocks = [block for block in blocks_of(page) if block.language == "python"]
    for block in blocks:
        if "not run" in block.notes:
            check_imports(block)
    scripts: dict[str, str] = {}
    for block in blocks:
        if "not run" not in block.notes:
            file = block.notes.get("file", "page.py")
            lines = scripts.get(file, "")
            scripts[file] = lines + "\n" * (block.line - lines.count("\n")) + block.code  # line numbers of the page
    for file, code in scripts.items():
        (tmp_path / file).write_text(code, encoding="utf-8")
        paths = os.pathsep.join((str(ROOT), os.environ.get("PYTHONPATH", "")))
        result = subprocess.run(
            [sys.executable, file],
            cwd=tmp_path, env=os.environ | {"PYTHONPATH": paths},
            capture_output=True, text=True, timeout=300, check=False,
        )  # fmt: skip
        assert result.returncode == 0, f"{name_of(page)}: {result.stderr}"


def check_imports(block: Block) -> None:
    """Look that what a block imports of this project is there."""
    for node in ast.walk(ast.parse(block.code)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(("jet_gym", "agents")):
            module = importlib.import_module(node.module or "")
            assert all(hasattr(module, alias.name) for alias in node.names), ast.unparse(node)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_commands_in_the_text_exist(page: Path) -> None:
    for command in inline_commands(page):
        with suppress(UnfinishedCommandError):  # the text names the command alone
            check_command(words_of(command)[1])


def test_options_in_the_text_exist() -> None:
    known = known_options()
    for page in PAGES:
        for text in inline_code_of(page):
            if text.startswith("--"):
                assert text.split()[0].split("=")[0] in known, f"{name_of(page)}: {text}"


@pytest.mark.parametrize("name", sorted(cli.commands))
def test_examples_in_the_help_are_parsed(name: str) -> None:
    for line in (cli.commands[name].help or "").splitlines():
        for command in line.split("&&"):
            if command.strip().startswith("jet-gym "):
                check_command(words_of(command.strip())[1])


def test_documented_commands_that_are_gone_are_noticed() -> None:
    for command in (
        "jet-gym fly",
        "jet-gym plan side --no-such",
        "jet-gym train --no-such",
        "python train.py --no-such",
        "python no_such.py",
        "python -m agents.training.ship --no-such",
        "make no-such",
        "pip install .[no-such]",
        "no-such",
    ):
        with pytest.raises(DocumentedCommandError):
            check_command(words_of(command)[1])


def test_recipes_of_the_makefile_are_parsed() -> None:
    """Those of pictures and studies, which no test runs as they are."""
    targets = ("demo", "claims", "sweep", "reproduce", "pictures", "learning-curves")
    recipes = subprocess.run(
        ["make", "--dry-run", "--old-file=.venv/full.installed", "--old-file=.venv/base.installed", *targets],
        cwd=ROOT, check=True, capture_output=True, text=True,
    ).stdout  # fmt: skip
    commands = re.findall(r"\.venv/bin/(?:jet-gym|python) [^;|&]*?(?= \|\||;|\n)", recipes)
    assert len(commands) > 12
    for command in commands:
        if not re.search("docs/_pictures| -c ", command):
            check_command(words_of(command.replace("$seed", "1"))[1])


def test_rows_of_the_environments_tables_are_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """The docstring breaks long cells; a page would show the rest of them as rows of their own."""
    pytest.importorskip("sphinx")
    monkeypatch.syspath_prepend(str(ROOT / "docs/_extensions"))
    extension = importlib.import_module("environment_page")
    page = extension._as_markdown(inspect.cleandoc(extension.JetHR1StepEnv.__doc__))
    rows = [line for line in page.splitlines() if line.startswith("|")]
    assert len(rows) > 60
    assert not [line for line in rows if line.startswith("| |")]
    assert "pushes; there is no IMU here to disturb |" in page


def test_fields_of_files_are_documented() -> None:
    text = (ROOT / "docs/files.md").read_text(encoding="utf-8")
    parts = {title.strip(): part for title, _, part in (p.partition("\n") for p in text.split("\n## "))}
    plan = json.loads(json.dumps(make_planner("gas").plan(replace(PAPER.side, points=4)).to_dict()))
    compared = compare(CompareSettings(("gas",), steps=2, processes=1)).to_dict()
    policy = dict(np.load(SHIPPED_POLICY, allow_pickle=False))
    for title, content in (("plan.json", plan), ("compare.json", compared)):
        assert names_in(parts[title]) >= set(content), title
        assert fields_in(parts[title]) == set(content), title
    assert {re.sub(r"_\d+$", "_K", name) for name in policy} == fields_in(parts["policy.npz"])
    assert names_in(parts["plan.json"]) >= set(plan["step"])


def names_in(part: str) -> set[str]:
    return set(re.findall(r"`(\w+)`", part))


def fields_in(part: str) -> set[str]:
    """Return the names in the first column of a table."""
    return {name for row in re.findall(r"^\| (`[^|]*) \|", part, re.MULTILINE) for name in names_in(row)}


def test_links_between_files_lead_somewhere() -> None:
    """Sphinx checks those of the docs; these are the ones that a reader of the repository follows."""
    for page in [*PAGES, ROOT / "CHANGELOG.md", *ROOT.glob("agents/policies/*/README.md")]:
        for target in re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8")):
            if not target.startswith(("http", "mailto")):
                assert (page.parent / target).exists(), f"{name_of(page)}: {target}"


def test_every_picture_is_drawn_by_a_command() -> None:
    """``make pictures`` draws all but the learning curves, which ``make learning-curves`` does."""
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    pictures = {path.name for path in (ROOT / "docs/images").iterdir()}
    for picture in pictures:
        name = re.sub(r"-(section|examples)\.", ".", picture)  # the commands put these into names
        assert re.search(rf"\s\S*{re.escape(name)}\s", makefile), f"no target of the Makefile draws {picture}"
    shown = {name for page in PAGES for name in re.findall(r"images/([\w.-]+)", page.read_text(encoding="utf-8"))}
    assert shown == pictures
