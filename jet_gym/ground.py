"""What a step stands on, as plain geometry: the soles, a carton under each of them, and the ditch between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jet_gym.courses import CARTON_HEIGHT, CARTON_LENGTH, CARTON_WIDTH
from jet_gym.leg import Leg, opposite
from jet_gym.step import Step
from jet_gym.utils.arrays import Array


@dataclass(frozen=True)
class Carton:
    """A carton under a foot.

    Attributes:
        foot: What stands on it: ``"start"``, ``"landing"`` or ``"support"``.
        x: Its extent along x [m].
        y: Its extent along y [m].
        z: Its extent along z [m]: the ground and the sole.
    """

    foot: str
    x: tuple[float, float]
    y: tuple[float, float]
    z: tuple[float, float]

    @property
    def corners(self) -> Array:
        """Corners (8, 3) [m]: four below, in order around, then the four above them."""
        (x_min, x_max), (y_min, y_max) = self.x, self.y
        around = ((x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max))
        return np.array([(x, y, z) for z in self.z for x, y in around])


@dataclass(frozen=True)
class Ditch:
    """The clear gap between two cartons.

    Attributes:
        axis: 0 if it separates them along x, 1 if along y.
        edges: Where it begins and ends on that axis [m].
        across: Middle of the cartons on the other axis [m].
    """

    axis: int
    edges: tuple[float, float]
    across: float

    @property
    def span(self) -> float:
        """Clear width [m]."""
        return self.edges[1] - self.edges[0]

    @property
    def label(self) -> str:
        """Clear width in mm, with its unit."""
        return f"{1e3 * self.span:.4g} mm"


def sole_corners(leg: Leg, margin: float = 0.0) -> Array:
    """Return the corners of a sole (4, 3) [m] in its own frame, in order around; less a margin [m] at each edge."""
    x_min, x_max, y_min, y_max = np.array(leg.sole_rectangle) + margin * np.array([1.0, -1.0, 1.0, -1.0])
    return np.array([[x_min, y_min, 0.0], [x_max, y_min, 0.0], [x_max, y_max, 0.0], [x_min, y_max, 0.0]])


def edge_distances(leg: Leg, points: Array) -> Array:
    """Return how far points (..., 2) of a sole's frame are from its rear, front, right and left edge (4, ...) [m].

    Negative outside.
    """
    x_min, x_max, y_min, y_max = leg.sole_rectangle
    x, y = points[..., 0], points[..., 1]
    return np.array([x - x_min, x_max - x, y - y_min, y_max - y])


def rectangle_margin(leg: Leg, points: Array) -> Array:
    """Return how far points (..., 2) of a sole's frame are from its nearest edge (...) [m], negative outside.

    Outside of a corner it is the distance from the farther of the two edges' lines.
    """
    margin: Array = edge_distances(leg, points).min(axis=0)
    return margin


def cartons_of(step: Step) -> tuple[Carton, ...]:
    """Return the cartons under start, support and landing, each centred under the sole that stands on it.

    Where the soles differ in height, so do the cartons; the lowest one has the paper's height. Cartons of
    feet that stand close overlap.
    """
    ground = min(step.start[2], step.landing[2], step.support[2]) - CARTON_HEIGHT
    other = step.robot.leg(opposite(step.swing))
    swing = step.robot.leg(step.swing)
    feet = (("start", step.start, swing), ("support", step.support, other), ("landing", step.landing, swing))
    cartons = []
    for foot, (x, y, z), leg in feet:
        x_min, x_max, y_min, y_max = leg.sole_rectangle
        middle_x, middle_y = x + 0.5 * (x_min + x_max), y + 0.5 * (y_min + y_max)
        cartons.append(
            Carton(
                foot,
                (middle_x - CARTON_LENGTH / 2.0, middle_x + CARTON_LENGTH / 2.0),
                (middle_y - CARTON_WIDTH / 2.0, middle_y + CARTON_WIDTH / 2.0),
                (ground, z),
            )
        )
    return tuple(cartons)


def ditch_of(step: Step) -> Ditch | None:
    """Return the clear gap that the swing foot crosses, the wider one of x and y; ``None`` if there is none."""
    start, _, landing = cartons_of(step)
    ditches = []
    for axis, (a, b) in enumerate(((start.x, landing.x), (start.y, landing.y))):
        others = (start.y, landing.y) if axis == 0 else (start.x, landing.x)
        ditches.append(Ditch(axis, (min(a[1], b[1]), max(a[0], b[0])), float(np.mean(others))))
    widest = max(ditches, key=lambda ditch: (ditch.span, ditch.axis))
    return widest if widest.span > 0.0 else None
