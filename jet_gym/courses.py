"""Steps that belong together; the paper's course of two motions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from jet_gym.step import Step


@dataclass(frozen=True)
class PaperCourse:
    """The paper's section IV-B: a step to the side, then a long step forward across the ditch.

    The paper gives the support foot of Fig. 5, the span of 450 mm and the cartons of 210 mm. Ours are the landing
    points, which leave that gap between two cartons; the number of swing points, about 5 mm apart, because
    GAEx's cube of 12 mm cannot follow a swing foot that moves much faster; and the times, which with a transition
    of 4 s fill the paper's 24 s.

    Attributes:
        side: Motion 1, the left foot to the side.
        forward: Motion 2, the right foot forward across the ditch.
    """

    side: Step
    forward: Step

    def __iter__(self) -> Iterator[Step]:
        """Go through the steps in order."""
        return iter((self.side, self.forward))

    def __len__(self) -> int:
        """Return the number of steps."""
        return 2

    def __getitem__(self, name: str) -> Step:
        """Return a step by its name, ``"side"`` or ``"forward"``."""
        return {"side": self.side, "forward": self.forward}[name]


CARTON_LENGTH, CARTON_WIDTH, CARTON_HEIGHT = 0.210, 0.110, 0.140  # [m] along x, y, z
DITCH_SPAN = 0.450  # [m] between the cartons, along x

PAPER = PaperCourse(
    side=Step(
        swing="left",
        start=(0.0, 0.1125, 0.0),
        landing=(0.0, 0.34, 0.0),
        support=(0.0, -0.1125, 0.0),
        points=60,
        duration=7.0,
    ),
    forward=Step(
        swing="right",
        start=(0.0, -0.1125, 0.0),
        landing=(DITCH_SPAN + CARTON_LENGTH, 0.1275, 0.0),
        support=(0.0, 0.34, 0.0),
        points=180,
        duration=13.0,
    ),
)
