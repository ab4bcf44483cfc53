"""Make the meshes that the visuals of ``jet_hr1.urdf`` show: ``python urdf/make_meshes.py``.

For the eye only: no mesh takes part in collisions or inertias. What a mesh must agree with (lengths, the sole,
the fan, the gear ratio) is read from the URDF; the constants in ``mesh_parts`` are decorative, chosen to look
like the robot of the paper's Fig. 1. Units: m. Link meshes stand in the frame of their link; servos and gears
about their own centre. Run it again after a change of the URDF's lengths; the boxes and cylinders among the
visuals stand in the URDF itself.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from mesh_parts.dimensions import read_dimensions
from mesh_parts.feet import fan_duct, fan_rotor, foot_bracket, sole, sole_standoffs
from mesh_parts.plates import hip_yoke, pelvis_frame, shank_plates, thigh_plates
from mesh_parts.servos import roll_gear, roll_pinion, servo, servo_pair
from mesh_parts.solids import Mesh, mirrored

HERE = Path(__file__).parent

COMMON = (
    *(thigh_plates, shank_plates, pelvis_frame, hip_yoke),
    *(servo, servo_pair, roll_gear, roll_pinion),
    *(sole_standoffs, fan_duct),
)
SIDED = (sole, foot_bracket, fan_rotor)
"""Their left version is made, the right one mirrored."""


def write_obj(path: Path, mesh: Mesh) -> None:
    """Write a Wavefront file: corners to a tenth of a millimetre, colours left to the URDF."""
    corners = np.round(np.concatenate(mesh), 4) + 0.0
    vertices, index = np.unique(corners, axis=0, return_inverse=True)
    faces = np.split(index.ravel() + 1, np.cumsum([len(polygon) for polygon in mesh])[:-1])
    lines = [f"# {path.stem}: made by make_meshes.py, visual only, m", f"o {path.stem}"]
    lines += [f"v {x:.5g} {y:.5g} {z:.5g}" for x, y, z in vertices]
    lines += ["f " + " ".join(map(str, face)) for face in faces]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def main() -> None:
    """Write all meshes beside this file."""
    folder = HERE / "meshes"
    folder.mkdir(exist_ok=True)
    dimensions = read_dimensions(HERE / "jet_hr1.urdf")
    for make in COMMON:
        write_obj(folder / f"{make.__name__}.obj", make(dimensions))
    for make in SIDED:
        left = make(dimensions)
        write_obj(folder / f"{make.__name__}_left.obj", left)
        write_obj(folder / f"{make.__name__}_right.obj", mirrored(left))


if __name__ == "__main__":
    main()
