"""What can keep the page from being served."""

from __future__ import annotations

from jet_gym.errors import JetGymError


class StudioError(JetGymError):
    """The page cannot be served."""


class ViserMissingError(StudioError):
    """The library that serves the page is not installed."""


class PortInUseError(StudioError):
    """Something else already listens where the page was to be."""
