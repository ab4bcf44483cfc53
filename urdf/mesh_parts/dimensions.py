"""What the meshes must agree with, read from the URDF."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from mesh_parts.solids import Array


@dataclass(frozen=True)
class Dimensions:
    """What the meshes must agree with, as it stands in the URDF.

    Attributes:
        pelvis: Edges (3,) of the pelvis box, which stands on the hip axes [m].
        hip_y: Distance of a hip yaw axis from the pelvis origin [m].
        thigh: Length of the thigh [m].
        shank: Length of the shank [m].
        leg_half_width: Half width of thigh and shank [m].
        sole_low: Lower corner (3,) of the sole box in the foot frame [m].
        sole_high: Upper corner (3,) of it [m].
        fan: Centre (3,) of the left fan in the foot frame [m].
        fan_radius: Outer radius of the duct [m].
        fan_height: Height of the duct [m].
        gear_ratio: Of the roll joints.
    """

    pelvis: Array
    hip_y: float
    thigh: float
    shank: float
    leg_half_width: float
    sole_low: Array
    sole_high: Array
    fan: Array
    fan_radius: float
    fan_height: float
    gear_ratio: float


def read_dimensions(urdf: Path) -> Dimensions:
    """Read the left leg, the pelvis and the gear ratio from the URDF's collision shapes, joints and servos."""
    robot = ElementTree.parse(urdf).getroot()

    def numbers(path: str, attribute: str) -> Array:
        element = robot.find(path)
        if element is None:
            raise ValueError(f"{urdf.name} has no {path}: the meshes take {attribute!r} from it")
        return np.array(element.get(attribute, "").split(), dtype=float)

    def collision_box(link: str) -> Array:
        return numbers(f"link[@name='{link}']/collision/geometry/box", "size")

    def joint_origin(joint: str) -> Array:
        return numbers(f"joint[@name='{joint}']/origin", "xyz")

    sole_size, sole_centre = collision_box("left_foot"), numbers("link[@name='left_foot']/collision/origin", "xyz")
    duct = "link[@name='left_fan']/collision/geometry/cylinder"
    return Dimensions(
        pelvis=collision_box("pelvis"),
        hip_y=joint_origin("left_hip_yaw")[1],
        thigh=-joint_origin("left_knee_pitch")[2],
        shank=-joint_origin("left_ankle_pitch")[2],
        leg_half_width=collision_box("left_thigh")[1] / 2,
        sole_low=sole_centre - sole_size / 2,
        sole_high=sole_centre + sole_size / 2,
        fan=joint_origin("left_fan_mount"),
        fan_radius=numbers(duct, "radius")[0],
        fan_height=numbers(duct, "length")[0],
        gear_ratio=numbers("servo[@joint='left_hip_roll']", "gear_ratio")[0],
    )
