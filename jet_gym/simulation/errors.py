"""What can be wrong with the simulation, one class per kind of failure."""

from __future__ import annotations

from jet_gym.errors import JetGymError


class BulletMissingError(JetGymError):
    """PyBullet is not installed; planning and the quasi-static model work without it."""


class EncoderMissingError(JetGymError):
    """The library that encodes films is not installed; everything else works without it."""


class DisplayMissingError(JetGymError):
    """PyBullet has no display for its window, or cannot start."""


class WorldStateError(JetGymError, RuntimeError):
    """A world was used after it was closed, or moved before it was reset."""
