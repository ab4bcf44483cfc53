"""Quasi-static balance on one foot with the swing foot's fan blowing: eqs (1) to (4) and (9) to (11).

Weight ``Mg`` acts at the centre of mass, a vertical thrust ``F`` at the fan of the swing foot, and the ground
answers at the zero-moment point (ZMP) under the support foot. As ``F`` grows from zero, the ZMP leaves the
centre of mass along the line away from the fan.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

from jet_gym.errors import SettingsError
from jet_gym.leg import Leg, Vector
from jet_gym.robot import Robot
from jet_gym.utils.compilation import inlined
from jet_gym.utils.settings import require_number

GRAVITY = 9.81  # [m/s^2]

ThrustModel = Literal["assigned", "least"]
Point = tuple[float, float]  # [m] x, y in the world
Rectangle = tuple[float, float, float, float]  # [m] x_min, x_max, y_min, y_max in the world

_TINY = 1e-300
_FAR = 1e300  # in place of infinity, which compiled code may assume away
_COINCIDENT = 1e-9  # [m] centre of mass and assigned ZMP count as one point below this distance
_EDGE = 1e-9  # [m] a ZMP on the very edge of the sole counts as inside


@dataclass(frozen=True)
class BalanceSettings:
    """What counts as balanced.

    Attributes:
        thrust_model: ``"assigned"``, the paper's: the thrust that puts the ZMP at an assigned point, as far
            as one force can; or ``"least"``: the smallest thrust that brings the ZMP into the support
            rectangle shrunk by the margin.
        zmp_margin: Distance [m] that planning keeps between ZMP and the sole's edge. The paper does not
            state one.
        edge_tolerance: rho [rad] of eq. (10), the edge polygon's half angle.
        max_thrust: Largest thrust [N], eq. (9); the robot's own where ``None``.
    """

    thrust_model: ThrustModel = "assigned"
    zmp_margin: float = 0.02
    edge_tolerance: float = math.radians(5.0)
    max_thrust: float | None = None

    def __post_init__(self) -> None:
        """Refuse settings outside of what is allowed."""
        if self.thrust_model not in ("assigned", "least"):
            raise SettingsError(f"thrust_model must be 'assigned' or 'least', not {self.thrust_model!r}")
        for name in ("zmp_margin", "edge_tolerance"):
            require_number(name, getattr(self, name))
        if self.max_thrust is not None:
            require_number("max_thrust", self.max_thrust)
        if not 0.0 <= self.zmp_margin < math.inf:
            raise SettingsError(f"zmp_margin must be a distance of 0 m or more, not {self.zmp_margin}")
        if not 0.0 < self.edge_tolerance < math.pi / 2.0:
            raise SettingsError(f"edge_tolerance must lie between 0 and pi/2 rad, not {self.edge_tolerance}")
        if self.max_thrust is not None and not 0.0 <= self.max_thrust < math.inf:
            raise SettingsError(f"max_thrust must be 0 N or more, not {self.max_thrust}")

    def parameters(self, robot: Robot) -> BalanceParameters:
        """Return the numbers for compiled code.

        Raises:
            SettingsError: If the margin leaves nothing of a sole around its ankle.
        """
        for leg in (robot.left, robot.right):
            ankle_x, ankle_y = -leg.sole[0], -leg.sole[1]
            x_min, x_max, y_min, y_max = leg.sole_rectangle
            room = min(ankle_x - x_min, x_max - ankle_x, ankle_y - y_min, y_max - ankle_y)
            if not self.zmp_margin < room:
                raise SettingsError(
                    f"zmp_margin of {self.zmp_margin} m leaves no support around the ankle, "
                    f"which is {room:.3g} m from the edge of the sole"
                )
        return BalanceParameters(
            least_thrust=self.thrust_model == "least",
            zmp_margin=self.zmp_margin,
            edge_slope=math.tan(self.edge_tolerance),
            max_thrust=robot.max_thrust if self.max_thrust is None else self.max_thrust,
            weight=robot.mass * GRAVITY,
        )


class BalanceParameters(NamedTuple):
    """Balance settings in numbers that compiled code takes by value."""

    least_thrust: bool
    zmp_margin: float  # [m]
    edge_slope: float  # tan(rho)
    max_thrust: float  # [N]
    weight: float  # [N] Mg


class Stance(NamedTuple):
    """One swing point: everything about it that does not depend on where the pelvis is. World frame."""

    cos_yaw: float  # of the pelvis, eq. (4)
    sin_yaw: float
    swing_ankle: Vector  # [m]
    support_ankle: Vector  # [m]
    fan: Point  # [m] P_T
    assigned_zmp: Point  # [m] Z
    support: Rectangle  # [m] the support sole


@inlined
def stance_of(
    swing_leg: Leg, support_leg: Leg, side: float, zmp_margin: float, swing_sole: Vector, support_sole: Vector
) -> Stance:
    r"""Describe a swing point; ``side`` is +1 where the left leg swings and -1 where the right one does.

    The assigned ZMP :math:`Z` lies where the ray from the support ankle's projection towards the fan's,
    :math:`P_T`, leaves the support rectangle shrunk by the margin. The pelvis' yaw, eq. (4), turns the hip line
    along the line from there to the fan,

    .. math:: \gamma = \mathrm{atan2}(P_{T,y} - Z_y, P_{T,x} - Z_x)

    less a right angle, so that zero is the hip line along y.
    """
    swing_ankle = (
        swing_sole[0] - swing_leg.sole[0],
        swing_sole[1] - swing_leg.sole[1],
        swing_sole[2] - swing_leg.sole[2],
    )
    support_ankle = (
        support_sole[0] - support_leg.sole[0],
        support_sole[1] - support_leg.sole[1],
        support_sole[2] - support_leg.sole[2],
    )
    fan = (swing_ankle[0] + swing_leg.fan[0], swing_ankle[1] + swing_leg.fan[1])
    x_min, x_max, y_min, y_max = support_leg.sole_rectangle
    support = (
        support_sole[0] + x_min,
        support_sole[0] + x_max,
        support_sole[1] + y_min,
        support_sole[1] + y_max,
    )

    dx, dy = fan[0] - support_ankle[0], fan[1] - support_ankle[1]
    reach_x = (support[1] - zmp_margin if dx > 0.0 else support[0] + zmp_margin) - support_ankle[0]
    reach_y = (support[3] - zmp_margin if dy > 0.0 else support[2] + zmp_margin) - support_ankle[1]
    along_x = reach_x / dx if abs(dx) > _TINY else _FAR
    along_y = reach_y / dy if abs(dy) > _TINY else _FAR
    along = min(along_x, along_y)
    assigned_zmp = (support_ankle[0] + along * dx, support_ankle[1] + along * dy)

    ux, uy = fan[0] - assigned_zmp[0], fan[1] - assigned_zmp[1]
    scale = side / max(math.sqrt(ux * ux + uy * uy), _TINY)
    return Stance(uy * scale, -ux * scale, swing_ankle, support_ankle, fan, assigned_zmp, support)


@inlined
def assigned_thrust(weight: float, com_x: float, com_y: float, fan: Point, zmp: Point) -> float:
    r"""Return the thrust [N] that puts the ZMP at ``zmp``, as far as one force can.

    Eqs (1) and (2) are two equations for one unknown; this is their projection on the line from the ZMP
    :math:`Z` to the fan :math:`P_T`, exact if the centre of mass :math:`C` lies on that line:

    .. math:: F = M g \frac{(C - Z) \cdot (P_T - Z)}{|P_T - Z|^2}

    Negative if the centre of mass lies on the far side.
    """
    ux, uy = fan[0] - zmp[0], fan[1] - zmp[1]
    along = (com_x - zmp[0]) * ux + (com_y - zmp[1]) * uy
    return weight * along / max(ux * ux + uy * uy, _TINY)


@inlined
def least_thrust(weight: float, com_x: float, com_y: float, fan: Point, support: Rectangle, margin: float) -> float:
    r"""Return the smallest thrust [N] that brings the ZMP into the support rectangle shrunk by the margin.

    As the thrust grows, the ZMP leaves the centre of mass :math:`C` along the line away from the fan
    :math:`P_T`:

    .. math:: Z = C + s (C - P_T), \qquad s = \frac{F}{M g - F}

    This ray is clipped against the rectangle, and the thrust is that of its entry. Where it never enters, the
    thrust is that of its last entry into one of the two strips whose crossing the rectangle is, ``Mg`` if there is
    none, and the ZMP stays outside, which eq. (11) then tells.
    """
    entry_x = _strip_entry(com_x, com_x - fan[0], support[0] + margin, support[1] - margin)
    entry_y = _strip_entry(com_y, com_y - fan[1], support[2] + margin, support[3] - margin)
    return weight - weight / (1.0 + max(entry_x, entry_y))


@inlined
def _strip_entry(start: float, direction: float, low: float, high: float) -> float:
    """Return how many ``direction`` lengths after ``start`` a ray enters the strip from low to high."""
    nearest = min(max(start, low), high)
    missing = nearest - start
    towards = missing * direction > 0.0
    return missing / (direction if towards else 1.0) if towards else (0.0 if missing == 0.0 else _FAR)


@inlined
def zmp_of(weight: float, com_x: float, com_y: float, fan: Point, thrust: float) -> Point:
    r"""Return the zero-moment point [m] under a thrust [N], eqs (1) and (2).

    About it weight, at the centre of mass :math:`C`, and thrust, at the fan :math:`P_T`, have no moment:

    .. math:: Z = \frac{M g C - F P_T}{M g - F}
    """
    ground_force = weight - thrust
    ground_force = ground_force if abs(ground_force) > 1e-9 * weight else 1e-9 * weight
    return (weight * com_x - thrust * fan[0]) / ground_force, (weight * com_y - thrust * fan[1]) / ground_force


@inlined
def edge_vectors(stance: Stance, com_x: float, com_y: float) -> tuple[float, float, float]:
    """Compare the lines of eq. (10): assigned ZMP to centre of mass, and centre of mass to swing ankle.

    Returns:
        The sine and the cosine of the angle theta_ZC - theta_CA between them, each times both lengths [m^2], and
        the length of the first squared [m^2].
    """
    ux, uy = com_x - stance.assigned_zmp[0], com_y - stance.assigned_zmp[1]
    vx, vy = stance.swing_ankle[0] - com_x, stance.swing_ankle[1] - com_y
    return vx * uy - vy * ux, ux * vx + uy * vy, ux * ux + uy * uy


@inlined
def within_edge_polygon(edge_slope: float, sine: float, cosine: float, length_squared: float) -> bool:
    r"""Tell whether the centre of mass is in the edge polygon, eq. (10).

    .. math:: |\theta_{ZC} - \theta_{CA}| \leq \rho

    in sines and cosines, as :func:`edge_vectors` returns them. Where the centre of mass is at the assigned ZMP
    there is no angle, and it is.
    """
    inside = (cosine >= 0.0) & (abs(sine) <= edge_slope * cosine)
    return inside | edge_undefined(length_squared)


@inlined
def outside_edge_polygon(stance: Stance, edge_slope: float, sine: float, cosine: float) -> float:
    """Return about how far the centre of mass is outside of the edge polygon [m]; 0 or less inside.

    Args:
        stance: The swing point.
        edge_slope: Tangent of rho.
        sine: Of the angle of eq. (10), as :func:`edge_vectors` returns it.
        cosine: Likewise.
    """
    dx, dy = stance.swing_ankle[0] - stance.assigned_zmp[0], stance.swing_ankle[1] - stance.assigned_zmp[1]
    aside = abs(sine) - edge_slope * max(cosine, 0.0) + max(-cosine, 0.0)
    return aside / max(math.sqrt(dx * dx + dy * dy), 1e-3)


@inlined
def edge_undefined(length_squared: float) -> bool:
    """Tell whether the centre of mass is at the assigned ZMP, so that eq. (10) has no angle to bound."""
    return length_squared <= _COINCIDENT * _COINCIDENT


@inlined
def within_support(zmp: Point, support: Rectangle) -> bool:
    """Tell whether the ZMP lies in the support foot, eq. (11)."""
    inside_x = (zmp[0] >= support[0] - _EDGE) & (zmp[0] <= support[1] + _EDGE)
    inside_y = (zmp[1] >= support[2] - _EDGE) & (zmp[1] <= support[3] + _EDGE)
    return inside_x & inside_y
