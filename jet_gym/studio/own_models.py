"""A policy of the user's own: read from what the browser sends, and named so that the planner menu can offer it."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from jet_gym.errors import PolicyFileError

if TYPE_CHECKING:
    from agents.network import PolicyNetwork

_REFINED = "+refine"
_LONGEST_NAME = 24  # characters that the menu and the table have room for


@dataclass(frozen=True, eq=False)
class OwnModel:
    """A policy that a user loaded.

    Attributes:
        name: The file's name, which with its suffix cannot be a planner's of the package.
        network: The policy.
    """

    name: str
    network: PolicyNetwork

    @property
    def planners(self) -> tuple[str, str]:
        """The planners that it makes: the network alone, and with its path refined."""
        return self.name, self.name + _REFINED


def read_model(name: str, content: bytes, *, trust: bool) -> OwnModel:
    """Read a policy file.

    Args:
        name: The file's name.
        content: What is in it.
        trust: Whether it may be a ``.zip``, whose loading can run any code that is in it.

    Raises:
        PolicyFileError: If it is not trusted, not a policy or one for another environment.
    """
    from agents.policy import load_policy

    suffix = PurePosixPath(name).suffix.lower()
    if suffix not in (".npz", ".zip"):
        raise PolicyFileError(f"{name} is not a policy: its name must end in .npz or .zip")
    if suffix == ".zip" and not trust:
        raise PolicyFileError(
            f"{name} is not loaded: loading a .zip can run code that is in it; load the policy.npz beside it, "
            "or tick that you trust it"
        )
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"policy{suffix}"
        file.write_bytes(content)
        try:
            network = load_policy(file, trust=trust)
        except PolicyFileError as error:
            raise PolicyFileError(str(error).replace(str(file), name)) from error
    network.require_actions(name)
    stem = PurePosixPath(name).stem
    return OwnModel(stem[: _LONGEST_NAME - len(suffix)] + suffix, network)
