"""What drives a biped besides its joints' own limits: its fans and servos, read from its URDF.

They stand there in elements of the project's own, ``<fan frame max_thrust time_constant>`` and
``<servo joint count torque gear_ratio>``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from jet_gym.errors import RobotError
from jet_gym.urdf import Urdf


@dataclass(frozen=True)
class Fan:
    """A ducted fan.

    Attributes:
        frame: URDF frame where its thrust acts, along z.
        max_thrust: Largest thrust [N].
        time_constant: Time constant of its first-order lag [s].
    """

    frame: str
    max_thrust: float
    time_constant: float


@dataclass(frozen=True)
class Servo:
    """The servos that drive one joint.

    Attributes:
        joint: URDF joint.
        count: How many servos share the joint.
        torque: Largest torque of one servo [N m].
        gear_ratio: Reduction between servo and joint.
    """

    joint: str
    count: int
    torque: float
    gear_ratio: float


def read_fan(urdf: Urdf, frame: str) -> Fan:
    """Return the fan of a frame, or refuse a file that has none there."""
    for tag, attributes in urdf.extensions:
        if tag == "fan" and attributes.get("frame") == frame:
            max_thrust, time_constant = (
                _extension_number(tag, frame, attributes, key) for key in ("max_thrust", "time_constant")
            )
            if max_thrust <= 0.0 or time_constant < 0.0:
                raise RobotError(f"fan {frame}: max_thrust must be positive and time_constant not negative")
            return Fan(frame, max_thrust, time_constant)
    raise RobotError(f'frame {frame}: the file needs <fan frame="{frame}" max_thrust="..." time_constant="..."/>')


def read_servos(urdf: Urdf, joint_names: Sequence[str]) -> list[Servo]:
    """Return the servos that the file tells of."""
    servos = []
    for tag, attributes in urdf.extensions:
        if tag == "servo":
            joint = attributes.get("joint", "")
            if joint not in joint_names:
                raise RobotError(f"servo: there is no leg joint {joint!r}")
            count, torque, ratio = (
                _extension_number(tag, joint, attributes, key) for key in ("count", "torque", "gear_ratio")
            )
            if count != int(count) or count < 1:
                raise RobotError(f"servo {joint}: its count must be a whole number of 1 or more, not {count:g}")
            servos.append(Servo(joint, int(count), torque, ratio))
    return servos


def _extension_number(tag: str, name: str, attributes: dict[str, str], key: str) -> float:
    try:
        value = float(attributes[key])
    except (KeyError, ValueError):
        value = math.nan
    if not math.isfinite(value):
        raise RobotError(f"{tag} {name}: its {key} must be a number, not {attributes.get(key)!r}")
    return value
