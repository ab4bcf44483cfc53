"""The paper's balance space, Fig. 5: where the swing foot can be while some posture balances the robot.

By exhaustion: for every place of the swing sole on a grid, every place of the pelvis on a grid of the same
resolution. A posture balances *with* thrust if it meets the constraints (8) to (11) under the thrust model, and
*without* if it meets (8) with the fan off and the centre of mass above the support sole, the margin away from its
edge; eq. (10), which bounds how the thrust's line may tilt, says nothing then. The space with thrust contains that
without. Places where the swing sole would stand on the support sole, seen from above, are left out where
:class:`~jet_gym.step.Step` would refuse them; whether the legs collide is not looked at.

The same search also asks whether the servos can hold the posture: static joint torques from gravity, thrust and
the ground's force against the joints' limits of effort, which no paper shows.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from jet_gym.balance import BalanceSettings, ThrustModel
from jet_gym.balance_exhaustion import NEVER, Exploration, explore_columns
from jet_gym.errors import BalanceSpaceFileError
from jet_gym.leg import Side, Six, Vector, six
from jet_gym.robot import Robot, jet_hr1
from jet_gym.single_support import single_support
from jet_gym.step import LARGEST_OVERLAP, Step
from jet_gym.swing_path import feet_apart
from jet_gym.utils.arrays import Array
from jet_gym.utils.files import read_arrays, write_whole_with
from jet_gym.utils.progress import Progress
from jet_gym.utils.settings import require_within
from jet_gym.utils.threads import for_each

FORMAT = "jet-gym-balance-space/1"
FINEST, COARSEST = 0.005, 0.2  # [m]; the finest takes days
DIRECTIONS = ("forward", "sideward", "diagonal")
_SHARE = 16 / 0.02**4  # columns [1/m^4]: a share takes about a tenth of a second


@dataclass(frozen=True, eq=False)
class BalanceSpace:
    """Where some posture balances, and with how little thrust; world frame, the support foot below its hip.

    Attributes:
        robot: Name of the robot.
        swing: The swing leg.
        support: The support sole [m].
        resolution: Spacing of both grids [m].
        settings: What counts as balanced.
        x: Places of the swing sole forward (X,) [m].
        y: Places to the left (Y,) [m].
        z: Heights (Z,) [m].
        thrust: The least thrust (X, Y, Z) [N] with which some posture balances: 0 where it does with the fan off,
            NaN where none does.
        thrust_within_torque: The same among the postures whose static torques the servos can hold.
        torque_share: The least share (X, Y, Z) of the servos' torque with which some posture balances; NaN where
            none does, above 1 where the servos are too weak for each.
    """

    robot: str
    swing: Side
    support: Vector
    resolution: float
    settings: BalanceSettings
    x: Array
    y: Array
    z: Array
    thrust: Array
    thrust_within_torque: Array
    torque_share: Array

    def reachable(self, *, with_thrust: bool, within_torque: bool = False) -> NDArray[np.bool_]:
        """Return where (X, Y, Z) some posture balances."""
        thrust = self.thrust_within_torque if within_torque else self.thrust
        return np.isfinite(thrust) if with_thrust else thrust == 0.0

    def volume(self, *, with_thrust: bool, within_torque: bool = False) -> float:
        """Return the volume of the balance space [m^3]: a cell of the grid for every place."""
        reachable = self.reachable(with_thrust=with_thrust, within_torque=within_torque)
        return float(np.count_nonzero(reachable)) * self.resolution**3

    def reach(self, direction: str, *, with_thrust: bool, within_torque: bool = False) -> float:
        """Return how far from the support sole the swing sole gets on level ground [m], along a direction.

        Args:
            direction: ``"forward"``, ``"sideward"`` (to the swing leg's side) or ``"diagonal"`` (between them).
            with_thrust: With the fan, or without.
            within_torque: Only with postures that the servos can hold.

        Returns:
            The farthest along that direction among all places at the support sole's height; NaN if there is none.

        Raises:
            ValueError: If there is no such direction, or the grid has no place at the support sole's height.
        """
        if direction not in DIRECTIONS:
            raise ValueError(f"direction must be one of {', '.join(DIRECTIONS)}, not {direction!r}")
        level = np.flatnonzero(np.abs(self.z - self.support[2]) < 1e-9)
        if len(level) == 0:
            raise ValueError("the grid has no place at the height of the support sole")
        reachable = self.reachable(with_thrust=with_thrust, within_torque=within_torque)[:, :, level[0]]
        if not reachable.any():
            return math.nan
        outward = 1.0 if self.swing == "left" else -1.0
        ahead, aside = self.x - self.support[0], outward * (self.y - self.support[1])
        along: Array = {
            "forward": ahead[:, None] + 0.0 * aside,
            "sideward": 0.0 * ahead[:, None] + aside,
            "diagonal": (ahead[:, None] + aside) / math.sqrt(2.0),
        }[direction]
        return float(along[reachable].max())

    def save(self, path: str | Path) -> None:
        """Write the space to an npz file, whole or not at all.

        Raises:
            OSError: If the file cannot be written.
        """
        content: dict[str, Any] = {
            "format": FORMAT,
            "robot": self.robot,
            "swing": self.swing,
            "support": np.array(self.support),
            "resolution": self.resolution,
            **{name: value for name, value in asdict(self.settings).items() if value is not None},
            **{name: getattr(self, name) for name in _ARRAYS},
        }
        write_whole_with(path, lambda temporary: np.savez_compressed(temporary, **content))

    @classmethod
    def load(cls, path: str | Path) -> BalanceSpace:
        """Read a space from the npz file that :meth:`save` wrote.

        Raises:
            BalanceSpaceFileError: If the file is of another format or damaged.
            OSError: If it cannot be read.
        """
        try:
            data = read_arrays(path)
        except ValueError as error:
            raise BalanceSpaceFileError(f"{path}: it is not an npz file, or damaged ({error})") from error
        if str(data.get("format")) != FORMAT:
            raise BalanceSpaceFileError(f"{path}: its format must be {FORMAT!r}, not {str(data.get('format'))!r}")
        try:
            return cls._from_arrays(data)
        except KeyError as error:
            raise BalanceSpaceFileError(f"{path}: its part {error} is missing") from error
        except (TypeError, ValueError) as error:
            raise BalanceSpaceFileError(f"{path}: it is damaged ({error})") from error

    @classmethod
    def _from_arrays(cls, data: dict[str, NDArray[Any]]) -> BalanceSpace:
        for name in ("support", "resolution", "zmp_margin", "edge_tolerance", "max_thrust"):
            if data[name].dtype.kind not in "iuf":
                raise ValueError(f"its part {name!r} must be numbers")
        x, y, z = (float(value) for value in data["support"])
        swing = str(data["swing"])
        if swing not in ("left", "right"):
            raise ValueError(f"its part 'swing' must be 'left' or 'right', not {swing!r}")
        settings = BalanceSettings(
            thrust_model=cast(ThrustModel, str(data["thrust_model"])),
            zmp_margin=float(data["zmp_margin"]),
            edge_tolerance=float(data["edge_tolerance"]),
            max_thrust=float(data["max_thrust"]),
        )
        shape = tuple(len(data[axis]) for axis in "xyz")
        for name in _ARRAYS:
            wanted = (shape["xyz".index(name)],) if name in "xyz" else shape
            if data[name].shape != wanted or data[name].dtype != np.float64:
                raise ValueError(f"its part {name!r} must be numbers of shape {wanted}")
        return cls(
            robot=str(data["robot"]),
            swing=cast(Side, swing),
            support=(x, y, z),
            resolution=float(data["resolution"]),
            settings=settings,
            **{name: data[name] for name in _ARRAYS},
        )


_ARRAYS = ("x", "y", "z", "thrust", "thrust_within_torque", "torque_share")


def compute_balance_space(
    resolution: float = 0.02,
    settings: BalanceSettings | None = None,
    *,
    robot: Robot | None = None,
    swing: Side = "left",
    lowest: float = 0.0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> BalanceSpace:
    """Find the balance space by exhaustion; the work grows with the sixth power of 1/resolution.

    Both grids are multiples of the resolution from the support sole, and the pelvis is nowhere below either sole.

    Args:
        resolution: Spacing of the swing sole's places and of the pelvis' [m].
        settings: What counts as balanced; the defaults where omitted.
        robot: The robot; Jet-HR1 where omitted.
        swing: The swing leg.
        lowest: Lowest height of the swing sole above the support sole [m].
        threads: Number of threads; as many as there are cores where omitted.
        progress: Called with how many of how many shares of the work are done.

    Raises:
        SettingsError: A ``ValueError``, if a number is outside of what is allowed.
    """
    _check_resolution(resolution)
    require_within("lowest", lowest, -2.0, 2.0)
    robot = robot or jet_hr1()
    settings = settings or BalanceSettings()
    numbers = single_support(robot, swing, settings)
    hip_x, hip_y, _ = numbers.support_leg.hip
    support: Vector = (hip_x, hip_y, 0.0)
    exploration = Exploration(numbers, *_efforts(robot, swing), support, resolution, fan_off_counts=True)
    x, y, z = _places(robot, support, resolution, lowest)
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    soles = numbers.swing_leg.sole_rectangle, numbers.support_leg.sole_rectangle
    apart = np.flatnonzero(feet_apart(*soles, *(places - support[:2]).T) >= -LARGEST_OVERLAP)
    thrust, held, share = (np.full((len(places), len(z)), NEVER) for _ in range(3))

    def explore(rows: NDArray[np.int64]) -> None:
        found, found_held, found_share = (np.empty((len(rows), len(z))) for _ in range(3))
        explore_columns(exploration, np.ascontiguousarray(places[rows]), z, found, found_held, found_share)
        thrust[rows], held[rows], share[rows] = found, found_held, found_share

    size = max(1, round(_SHARE * resolution**4))
    shares = [apart[first : first + size] for first in range(0, len(apart), size)]
    for_each(explore, shares, threads, progress)
    shape = (len(x), len(y), len(z))
    return BalanceSpace(
        robot.name, swing, support, resolution, replace(settings, max_thrust=numbers.balance.max_thrust), x, y, z,
        *(np.where(values < NEVER, values, math.nan).reshape(shape) for values in (thrust, held, share)),
    )  # fmt: skip


def least_thrust_of_step(
    step: Step,
    settings: BalanceSettings | None = None,
    *,
    resolution: float = 0.01,
    threads: int | None = None,
) -> Array:
    """Return the least thrust (points,) [N] of any posture at each swing point, by exhaustion over the pelvis.

    No planner's plan is below it by more than the resolution accounts for. As for a plan, a posture counts that
    meets the constraints (8) to (11).

    Args:
        step: The step.
        settings: What counts as balanced; the defaults where omitted.
        resolution: Spacing of the pelvis' places [m].
        threads: Number of threads; as many as there are cores where omitted.

    Returns:
        The thrusts; NaN where no posture balances.

    Raises:
        SettingsError: A ``ValueError``, if the resolution is outside of what is allowed.
    """
    _check_resolution(resolution)
    robot, efforts = single_support(step.robot, step.swing, settings), _efforts(step.robot, step.swing)
    exploration = Exploration(robot, *efforts, step.support, resolution, fan_off_counts=False)
    soles, thrust = step.swing_sole, np.empty(step.points)

    def explore(point: int) -> None:
        found = np.empty((3, 1, 1))
        column = np.ascontiguousarray(soles[point : point + 1, :2])
        explore_columns(exploration, column, soles[point, 2:].copy(), *found)
        thrust[point] = found[0, 0, 0]

    for_each(explore, range(step.points), threads)
    return np.where(thrust < NEVER, thrust, math.nan)


def _check_resolution(resolution: float) -> None:
    require_within("resolution", resolution, FINEST, COARSEST)


def _efforts(robot: Robot, swing: Side) -> tuple[Six, Six]:
    """Return the largest torques of the swing and of the support leg [N m]."""
    left, right = six(robot.effort[:6].tolist()), six(robot.effort[6:].tolist())
    return (left, right) if swing == "left" else (right, left)


def _places(robot: Robot, support: Vector, resolution: float, lowest: float) -> tuple[Array, Array, Array]:
    """Return the grid of the swing sole: all that two stretched legs can span from the support sole."""
    span = sum(math.hypot(*leg.thigh) + math.hypot(*leg.shank) for leg in (robot.left, robot.right))
    hips = math.dist(robot.left.hip, robot.right.hip)
    feet = sum(math.hypot(*leg.sole) for leg in (robot.left, robot.right))
    beyond = math.ceil((span + hips) / resolution)
    line = np.array(range(-beyond, beyond + 1)) * resolution
    heights = resolution * np.array(
        range(math.ceil(lowest / resolution - 1e-9), math.ceil((span + feet) / resolution) + 1)
    )
    return support[0] + line, support[1] + line, support[2] + heights
