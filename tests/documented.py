"""What README and docs show: blocks of code and commands, and how a command is parsed without being run."""

from __future__ import annotations

import argparse
import functools
import io
import re
import runpy
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest.mock import patch

import click
import pytest
import tomllib
import tyro
from markdown_it import MarkdownIt
from packaging.requirements import Requirement

from jet_gym.cli import cli, train

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([ROOT / "README.md", *ROOT.glob("CONTRIBUTING.md"), *(ROOT / "docs").glob("*.md")])
_LINES_OF_A_SCRIPT = ("#", "if ", "then", "else", "fi", "run=")
_EXTERNAL = ("tensorboard", "git")  # commands of others; whether they are known is all that is asked


@dataclass(frozen=True)
class Block:
    """A block of code on a page.

    Attributes:
        language: What it is written in.
        code: Its text.
        line: Where it begins on the page, from 1.
        notes: What hidden comments above it say, such as ``{"not run": "dask is not installed"}``.
    """

    language: str
    code: str
    line: int
    notes: dict[str, str] = field(default_factory=dict)

    @property
    def commands(self) -> list[str]:
        """The commands of a shell block; those of a script without its control flow."""
        lines = (line.strip() for line in self.code.replace("\\\n", " ").splitlines())
        return [line for line in lines if line and not line.startswith(_LINES_OF_A_SCRIPT)]


def blocks_of(page: Path) -> list[Block]:
    """Return the blocks of code of a page, fences of Sphinx' directives left out."""
    blocks, notes = [], {}
    for token in MarkdownIt().parse(page.read_text(encoding="utf-8")):
        if token.type == "html_block" and (note := re.fullmatch(r"<!-- ([\w ]+): (.*) -->\s*", token.content)):
            notes[note[1]] = note[2]
        elif token.type == "fence":
            assert token.map is not None
            if not token.info.startswith("{"):
                blocks.append(Block(token.info, token.content, token.map[0] + 1, notes))
            notes = {}
    return blocks


def inline_code_of(page: Path) -> list[str]:
    """Return what stands between backticks in a page's text and tables."""
    tokens = MarkdownIt().enable("table").parse(page.read_text(encoding="utf-8"))
    children = (child for token in tokens for child in token.children or ())
    return [" ".join(child.content.split()) for child in children if child.type == "code_inline"]


def words_of(command: str) -> tuple[dict[str, str], list[str]]:
    """Return a command's environment variables, and its words from the program on."""
    words, environment = shlex.split(re.sub(r"\$\w+", "1", command), comments=True), {}
    while words and re.fullmatch(r"[A-Z_]+=.*", words[0]):
        name, _, value = words.pop(0).partition("=")
        environment[name] = value
    if words[:2] == ["taskset", "--cpu-list"]:
        words = words[3:]
    words[0] = words[0].removeprefix(".venv/bin/")
    return environment, words


class DocumentedCommandError(Exception):
    """A command that its program does not take."""


class UnfinishedCommandError(DocumentedCommandError):
    """A command that lacks an argument."""


def check_command(words: list[str]) -> None:
    """Parse a command as its program does, without running it.

    Raises:
        DocumentedCommandError: If there is no such program, argument or option.
    """
    try:
        _check(words)
    except (click.ClickException, OSError, subprocess.CalledProcessError) as error:
        raise _error(f"{' '.join(words)}: {error!s}") from error


def _error(message: str) -> DocumentedCommandError:
    unfinished = re.search("Missing argument|Missing parameter|are required|requires an argument", message)
    return (UnfinishedCommandError if unfinished else DocumentedCommandError)(message)


def _check(words: list[str]) -> None:
    """Parse a command."""
    program, *arguments = words
    if program == "python" and arguments[:3] == ["-m", "pip", "install"]:
        program, arguments = "pip", arguments[2:]
    if program == "jet-gym" and arguments[:1] == ["train"]:
        _check_python(["train.py", *arguments[1:]])
    elif program == "jet-gym":
        _check_jet_gym(arguments)
    elif program == "python":
        _check_python(arguments)
    elif program == "make":
        subprocess.run(["make", "--dry-run", *arguments], cwd=ROOT, check=True, capture_output=True)
    elif program == "pip":
        _check_pip(arguments)
    elif program not in _EXTERNAL:
        raise DocumentedCommandError(f"{program} is no command that the documentation may name")


def known_options() -> set[str]:
    """Return every option of ``jet-gym``'s commands and of ``train.py``."""
    options = {"--help"}
    for command in cli.commands.values():
        for parameter in command.params:
            options.update((*parameter.opts, *parameter.secondary_opts))
    with redirect_stdout(io.StringIO()) as text, pytest.raises(SystemExit):
        tyro.cli(_train_script().TrainSettings, args=["--help"])
    return options | set(re.findall(r"--[a-z][\w.-]*", text.getvalue()))


@functools.cache
def _train_script() -> Any:
    return train._load(ROOT / "train.py")


class _ParsedError(BaseException):
    """Raised in place of running a program whose arguments have been parsed."""


def _check_jet_gym(arguments: list[str]) -> None:
    try:
        with cli.make_context("jet-gym", list(arguments)) as context:
            _, command, rest = cli.resolve_command(context, [*context._protected_args, *context.args])
            assert command is not None
            command.make_context(command.name, rest, parent=context)
    except click.exceptions.Exit:
        pass  # --help, --version and --settings


def _run_module(name: str) -> None:
    """Run a module as ``python -m`` does, which begins without it; other tests may have imported it."""
    imported = sys.modules.pop(name, None)
    try:
        runpy.run_module(name, run_name="__main__", alter_sys=True)
    finally:
        if imported is not None:
            sys.modules[name] = imported


def _check_python(arguments: list[str]) -> None:
    """Start the script or module until it has parsed its arguments."""
    if arguments[0] == "-m":
        _, name, *rest = arguments
        start: Callable[[], Any] | None = functools.partial(_run_module, name)
    else:
        name, *rest = arguments
        if not (ROOT / name).is_file():
            raise DocumentedCommandError(f"there is no {name}")
        start = functools.partial(_train_script().main, rest) if name == "train.py" else None
    if name == "pytest":
        for file in rest:
            if not (ROOT / file).is_file():
                raise DocumentedCommandError(f"there is no {file}")
        return
    if name.startswith("examples/"):
        assert f'"{Path(name).name}"' in (ROOT / "tests/test_examples.py").read_text(encoding="utf-8")
        return
    if start is None:
        raise DocumentedCommandError(f"how {name} reads its arguments is not known here")
    with (
        patch.object(sys, "argv", [name, *rest]),
        patch.object(argparse.ArgumentParser, "parse_args", _stop_after(argparse.ArgumentParser.parse_args)),
        patch.object(argparse.ArgumentParser, "error", _refuse),
        patch.object(tyro, "cli", _stop_after(tyro.cli)),
    ):
        try:
            start()
        except _ParsedError:
            return
        except SystemExit as end:
            if end.code == 0:  # --help
                return
            raise DocumentedCommandError(f"python {' '.join(arguments)}: exit code {end.code}") from end
    raise DocumentedCommandError(f"{name} parsed no arguments")


def _stop_after(parse: Callable[..., Any]) -> Callable[..., Any]:
    def stop(*given: Any, **named: Any) -> Any:
        parse(*given, **named)
        raise _ParsedError

    return stop


def _refuse(_parser: argparse.ArgumentParser, message: str) -> None:
    raise _error(message)


def _check_pip(arguments: list[str]) -> None:
    """Look that constraint files and extras are there."""
    parser = argparse.ArgumentParser(exit_on_error=False)
    parser.add_argument("install")
    parser.add_argument("requirements", nargs="+")
    parser.add_argument(
        "--constraint", "--requirement", type=lambda name: (ROOT / name).read_text(encoding="utf-8")
    )
    parser.add_argument("--editable", action="store_true")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for wanted in parser.parse_args(arguments).requirements:
        requirement = Requirement(re.sub(r"^\.", "jet-gym", wanted))
        missing = requirement.extras - set(project["optional-dependencies"])
        if requirement.name == "jet-gym" and missing:
            raise DocumentedCommandError(f"there is no extra {', '.join(missing)}")


def inline_commands(page: Path) -> Iterator[str]:
    """Yield the commands in a page's text, whose placeholders are filled in."""
    for text in inline_code_of(page):
        if text.startswith(("jet-gym ", "python ", "make ")):
            filled = re.sub(r" --[a-z-]+ \.\.\.", "", text)
            yield re.sub(r"\b[NK]\b", "1", filled)
