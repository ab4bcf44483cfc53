"""The cartons that the feet stand on, and the floor below them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal

from jet_gym.courses import CARTON_HEIGHT, CARTON_LENGTH, CARTON_WIDTH
from jet_gym.errors import StepError
from jet_gym.leg import Vector
from jet_gym.step import Step

Role = Literal["start", "support", "landing"]
ROLES: tuple[Role, Role, Role] = ("start", "support", "landing")

CARTON_COLOR = (0.78, 0.60, 0.37, 1.0)
TAPE_COLOR = (0.90, 0.79, 0.58, 1.0)
PLINTH_COLOR = (0.52, 0.40, 0.26, 1.0)
FLOOR_COLOR = (0.80, 0.82, 0.85, 1.0)
TAPE_WIDTH = 0.036  # [m]

_FLOOR_SIZE, _FLOOR_DEPTH = 12.0, 0.1  # [m]
_PLINTH_HEIGHT = 2.0  # [m] it stands through the floor
_TAPE_THICKNESS = 0.0004  # [m]
_PARKED = -50.0  # [m] height of what is out of the way
_SAME_HEIGHT = 1e-4  # [m]
_OVERHANG = 0.05  # [m] by how much a foot with its fan, or the carton under it, is wider than half a carton
_STANDING = 0.03  # [m] a sole this close to where its carton expects it stands on that carton


class Cartons:
    """Three static cartons, each centred below a sole, on a floor 140 mm below the lowest of their tops.

    A carton that is higher than the lowest one stands on a plinth. Cartons of feet close together overlap. Where
    they differ in height (:meth:`conflict`), only one of them could be there: a leg then touches only the one that
    its foot stands on, for the swing leg the start's until :meth:`clear_start` has taken that away.

    Attributes:
        bodies: PyBullet bodies of the cartons, by what stands on them.
        floor: PyBullet body of the floor.
        soles: Where the soles stand on them [m], likewise; their heights are those of the cartons' tops.

    Args:
        client: The physics server.
        restitution: Share of its speed that a landing foot keeps.
        visible: Whether to load plinths, which only serve to be seen.
    """

    def __init__(self, client: Any, restitution: float = 0.0, *, visible: bool = False) -> None:
        self._client = client
        self.floor = self._add_floor()
        self._loaded: dict[Role, int] = {role: self._add_carton() for role in ROLES}
        self.bodies = dict(self._loaded)
        self._plinths = {body: self._add_plinth() for body in self._loaded.values()} if visible else {}
        self.soles: dict[Role, Vector] = {}
        for number, body in enumerate((self.floor, *self.bodies.values())):
            # PyBullet multiplies the friction of the two bodies in contact: the foot's alone shall count.
            client.changeDynamics(body, -1, lateralFriction=1.0, restitution=restitution)
            self._move(body, (5.0 * number, 0.0, _PARKED))
        self._start_cleared = False

    def place(self, step: Step, rise: float = 0.0) -> None:
        """Put the cartons under the soles of a step and the floor below them; the same ones each time.

        Args:
            step: The step.
            rise: By how much the landing's carton is higher than the step says [m].
        """
        self.bodies = dict(self._loaded)
        self.soles = {"start": step.start, "support": step.support, "landing": _raised(step.landing, rise)}
        self._start_cleared = False
        for role in ROLES:
            self._put_under_sole(step, role)
        self._lower_floor()

    def continue_with(self, step: Step, rise: float = 0.0) -> None:
        """Keep the cartons under the two feet where they are and move the third one under the next landing.

        Args:
            step: The step.
            rise: By how much the landing's carton is higher than the step says [m].

        Raises:
            StepError: If the step begins elsewhere than the last one ended.
        """
        free, bodies = dict(self.soles), dict(self.bodies)
        soles: dict[Role, Vector] = {"landing": _raised(step.landing, rise)}
        feet: tuple[tuple[Role, Vector], ...] = (("start", step.start), ("support", step.support))
        for role, sole in feet:
            nearest = min(free, key=lambda other: math.dist(free[other], sole))
            if math.dist(free[nearest], sole) > _STANDING:
                raise StepError(f"the {role} of the next step, {sole} m, is not where a foot of this step ends")
            soles[role] = free.pop(nearest)
            bodies[role] = self.bodies[nearest]
        (spare,) = free
        bodies["landing"] = self.bodies[spare]
        self.bodies = bodies
        self.soles = soles
        self._start_cleared = False
        self._put_under_sole(step, "landing")
        self._lower_floor()

    def conflict(self, one: Role, other: Role) -> bool:
        """Tell whether a foot on one carton reaches into the other, which is close by and of another height."""
        if self._start_cleared and "start" in (one, other):
            return False
        dx, dy, dz = (abs(a - b) for a, b in zip(self.soles[one], self.soles[other], strict=True))
        return dx < CARTON_LENGTH + _OVERHANG and dy < CARTON_WIDTH + _OVERHANG and dz > _SAME_HEIGHT

    def clear_start(self) -> None:
        """Take the start's carton out of the way."""
        self._start_cleared = True
        self._move(self.bodies["start"], (0.0, 0.0, _PARKED))
        self._prop_up(self._lowest())

    def set_collisions(self, robot: int, swing_links: Sequence[int], support_links: Sequence[int]) -> None:
        """Let the legs touch every carton but those in conflict with one that they stand on.

        Args:
            robot: PyBullet body of the robot.
            swing_links: Links of its swing leg.
            support_links: Links of its support leg.
        """
        support_free = {role: role == "support" or not self.conflict(role, "support") for role in ROLES}
        swing_free = {
            "start": True,
            "landing": not self.conflict("start", "landing"),
            "support": support_free["start"] and support_free["landing"],
        }
        for role, carton in self.bodies.items():
            for links, free in ((swing_links, swing_free[role]), (support_links, support_free[role])):
                for link in links:
                    self._client.setCollisionFilterPair(robot, carton, link, -1, int(free))

    def _put_under_sole(self, step: Step, role: Role) -> None:
        swings = role != "support"
        leg = step.robot.leg("left" if (step.swing == "left") == swings else "right")
        x_min, x_max, y_min, y_max = leg.sole_rectangle
        x, y, z = self.soles[role]
        self._move(self.bodies[role], (x + 0.5 * (x_min + x_max), y + 0.5 * (y_min + y_max), z))

    def _lower_floor(self) -> None:
        self._move(self.floor, (0.0, 0.0, self._lowest() - CARTON_HEIGHT))
        self._prop_up(self._lowest())

    def copy(self, other: Cartons) -> None:
        """Put cartons where those of another physics server are."""
        for role, body in self.bodies.items():
            place, _ = other._client.getBasePositionAndOrientation(other.bodies[role])
            self._move(body, place)
        self._prop_up(other._lowest())

    def _lowest(self) -> float:
        """Return the lowest height of a top [m], be its carton cleared or not: the floor stays where it is."""
        return min(z for _, _, z in self.soles.values())

    def _prop_up(self, lowest: float) -> None:
        """Put plinths under the cartons that are higher than the lowest one; none under a cleared one."""
        for body in self._plinths:
            x, y, z = self._client.getBasePositionAndOrientation(body)[0]
            high = z > lowest + _SAME_HEIGHT
            self._move(self._plinths[body], (x, y, z - CARTON_HEIGHT if high else _PARKED))

    def _move(self, body: int, top: Vector) -> None:
        """Move a body; its position is that of its top's middle."""
        self._client.resetBasePositionAndOrientation(body, top, (0.0, 0.0, 0.0, 1.0))

    def _add_floor(self) -> int:
        half = (0.5 * _FLOOR_SIZE, 0.5 * _FLOOR_SIZE, 0.5 * _FLOOR_DEPTH)
        below = (0.0, 0.0, -0.5 * _FLOOR_DEPTH)
        return self._add_body(half, below, [half], [below], [FLOOR_COLOR])

    def _add_carton(self) -> int:
        carton = (0.5 * CARTON_LENGTH, 0.5 * CARTON_WIDTH, 0.5 * CARTON_HEIGHT)
        tape = (carton[0] + _TAPE_THICKNESS, 0.5 * TAPE_WIDTH, carton[2] + _TAPE_THICKNESS)
        middle = (0.0, 0.0, -0.5 * CARTON_HEIGHT)
        return self._add_body(carton, middle, [carton, tape], [middle, middle], [CARTON_COLOR, TAPE_COLOR])

    def _add_plinth(self) -> int:
        client = self._client
        visual = client.createVisualShape(
            client.GEOM_BOX,
            halfExtents=(0.48 * CARTON_LENGTH, 0.47 * CARTON_WIDTH, 0.5 * _PLINTH_HEIGHT),
            rgbaColor=PLINTH_COLOR,
            visualFramePosition=(0.0, 0.0, -0.5 * _PLINTH_HEIGHT),
        )
        plinth: int = client.createMultiBody(0.0, -1, visual, (0.0, 0.0, _PARKED))
        return plinth

    def _add_body(
        self,
        half: Vector,
        middle: Vector,
        visible: list[Vector],
        places: list[Vector],
        colors: list[tuple[float, float, float, float]],
    ) -> int:
        client = self._client
        collision = client.createCollisionShape(client.GEOM_BOX, halfExtents=half, collisionFramePosition=middle)
        visual = client.createVisualShapeArray(
            [client.GEOM_BOX] * len(visible),
            halfExtents=visible,
            rgbaColors=colors,
            visualFramePositions=places,
        )
        body: int = client.createMultiBody(0.0, collision, visual)
        return body


def _raised(sole: Vector, rise: float) -> Vector:
    return sole[0], sole[1], sole[2] + rise
