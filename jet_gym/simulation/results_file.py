"""The results of an experiment on disk: JSON that knows of what experiment it is, written whole or not at all."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from jet_gym.errors import JetGymError
from jet_gym.simulation.plain_data import from_plain
from jet_gym.utils.files import read_whole, write_whole

Result = TypeVar("Result")


class ResultsFileError(JetGymError, ValueError):
    """A file of results that is damaged, of another format or of another experiment."""


class Described(Protocol):
    """What can be told from others."""

    def description(self) -> dict[str, Any]:
        """Return what tells it from others, as plain data."""


@dataclasses.dataclass(frozen=True)
class ResultsFile(Generic[Result]):
    """A kind of file.

    Attributes:
        format: What its field ``format`` is.
        name: Of the field that holds the results.
        kind: What an entry of that field is, a dataclass of numbers and text.
    """

    format: str
    name: str
    kind: type[Result]

    def save(self, path: str | Path, experiment: Described, results: Sequence[Result]) -> None:
        """Write the results of an experiment, whole or not at all.

        Raises:
            OSError: If the file cannot be written.
        """
        entries = [dataclasses.asdict(result) for result in results]  # type: ignore[call-overload]
        data = {"format": self.format, "experiment": experiment.description(), self.name: entries}
        write_whole(path, json.dumps(data, indent=1).encode())

    def load(self, path: str | Path, experiment: Described | None = None) -> list[Result]:
        """Read results.

        Args:
            path: The file.
            experiment: What they must be of; anything where omitted.

        Raises:
            ResultsFileError: If the file cannot be read, is damaged or of another experiment.
        """
        data = self._read(Path(path))
        if experiment is not None:
            self._refuse_others(path, experiment, data.get("experiment"))
        entries = data.get(self.name)
        if not isinstance(entries, list):
            raise ResultsFileError(f"{path}: field {self.name!r} must be a list")
        try:
            return [from_plain(self.kind, entry) for entry in entries]
        except (ValueError, OverflowError) as error:
            raise ResultsFileError(f"{path}: field {self.name!r} is damaged ({error})") from error

    def _read(self, path: Path) -> dict[str, Any]:
        try:
            data = json.loads(read_whole(path).decode())
        except OSError as error:
            raise ResultsFileError(f"cannot read the {self.name} {path}: {error.strerror}") from error
        except (ValueError, RecursionError) as error:
            raise ResultsFileError(f"{path} holds no {self.name}: it is not JSON") from error
        if not isinstance(data, dict) or data.get("format") != self.format:
            raise ResultsFileError(f"{path} holds no {self.name}: field 'format' must be {self.format!r}")
        return data

    def _refuse_others(self, path: str | Path, experiment: Described, theirs: Any) -> None:
        ours = json.loads(json.dumps(experiment.description()))
        if ours != theirs:
            different = [
                field for field in ours if not isinstance(theirs, dict) or ours[field] != theirs.get(field)
            ]
            raise ResultsFileError(
                f"{path} holds {self.name} of another experiment: {', '.join(different)} differ; name another file"
            )
