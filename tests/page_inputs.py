"""What tests of the studio ask for."""

from __future__ import annotations

from jet_gym.studio.inputs import Inputs

SIDE = Inputs.of_motion("side")


def never() -> bool:
    """Tell that what is asked for is never stale."""
    return False
