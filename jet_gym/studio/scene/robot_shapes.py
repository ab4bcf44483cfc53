"""What a robot looks like: the visual shapes of its URDF as triangles, gathered by link and colour."""

from __future__ import annotations

import functools
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from jet_gym.urdf import Urdf, read_pose, read_urdf
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from trimesh import Trimesh

Color = tuple[int, int, int]

_PLAIN: Color = (150, 155, 165)  # where the file names no colour
_ROUND = 24  # edges of a cylinder's rim


@dataclass(frozen=True, eq=False)
class Shape:
    """Triangles of one colour on one moving link.

    Attributes:
        vertices: Corners (V, 3) [m], in the frame of the moving link.
        faces: Triangles (F, 3) as indices of corners.
        color: Red, green and blue from 0 to 255.
    """

    vertices: Array
    faces: NDArray[np.int64]
    color: Color


@dataclass(frozen=True, eq=False)
class Tree:
    """A robot's moving links and what they look like.

    Attributes:
        urdf: The file.
        shapes: Shapes by moving link, fixed links counted to the one that carries them.
    """

    urdf: Urdf
    shapes: dict[str, tuple[Shape, ...]]


def robot_tree(urdf_path: Path) -> Tree:
    """Read what a robot looks like; the same object each time while the file is unchanged.

    A mesh file that is missing or cannot be read is left out.

    Raises:
        RobotError: If the URDF cannot be read.
    """
    return _robot_tree(urdf_path, urdf_path.stat().st_mtime_ns)


@functools.lru_cache(maxsize=8)
def _robot_tree(urdf_path: Path, _modified: int) -> Tree:
    from trimesh.util import concatenate

    urdf = read_urdf(urdf_path)
    document = ElementTree.parse(urdf_path).getroot()
    colors = {material.get("name"): color for material in document.iter("material") if (color := _color(material))}
    parts: dict[str, dict[Color, list[Trimesh]]] = defaultdict(lambda: defaultdict(list))
    for link in document.iter("link"):
        name = link.get("name", "")
        carrier = urdf.moving_link(name)
        into_carrier = np.linalg.inv(urdf.zero_poses[carrier]) @ urdf.zero_poses[name]
        for mesh, color in _visuals(link, urdf_path.parent, colors):
            parts[carrier][color].append(mesh.apply_transform(into_carrier))
    shapes = {
        carrier: tuple(_shape(concatenate(meshes), color) for color, meshes in by_color.items())
        for carrier, by_color in parts.items()
    }
    return Tree(urdf, shapes)


def _shape(mesh: Any, color: Color) -> Shape:
    return Shape(np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64), color)


def _visuals(
    link: ElementTree.Element, folder: Path, colors: dict[str | None, Color]
) -> Iterator[tuple[Trimesh, Color]]:
    """Yield a link's visual shapes in the link's frame."""
    for visual in link.findall("visual"):
        geometry, material = visual.find("geometry"), visual.find("material")
        mesh = None if geometry is None or len(geometry) == 0 else _mesh(geometry[0], folder)
        if mesh is None:
            continue
        color = _PLAIN
        if material is not None:
            color = _color(material) or colors.get(material.get("name"), _PLAIN)
        yield mesh.apply_transform(read_pose(visual.find("origin"), f"link {link.get('name')}")), color


def _mesh(shape: ElementTree.Element, folder: Path) -> Trimesh | None:
    """Return one shape of a URDF as triangles; ``None`` where there is no such thing."""
    import trimesh

    if shape.tag == "box":
        return trimesh.creation.box(extents=_numbers(shape.get("size", "1 1 1")))
    if shape.tag == "cylinder":
        radius, length = float(shape.get("radius", 1.0)), float(shape.get("length", 1.0))
        return trimesh.creation.cylinder(radius=radius, height=length, sections=_ROUND)
    if shape.tag == "sphere":
        return trimesh.creation.icosphere(subdivisions=2, radius=float(shape.get("radius", 1.0)))
    file = folder / shape.get("filename", "").removeprefix("package://").removeprefix("file://")
    if not file.is_file():
        return None
    try:
        loaded = trimesh.load(file, force="mesh", process=False)
    except Exception:  # its readers raise whatever a damaged file, or one that needs another library, leads them to
        return None
    mesh = trimesh.Trimesh(vertices=loaded.vertices, faces=loaded.faces, process=False)
    mesh.apply_scale(_numbers(shape.get("scale", "1 1 1")))
    return mesh


def _color(material: ElementTree.Element) -> Color | None:
    color = material.find("color")
    if color is None:
        return None
    red, green, blue = (round(255 * value) for value in _numbers(color.get("rgba", "0.6 0.6 0.6 1"))[:3])
    return red, green, blue


def _numbers(text: str) -> list[float]:
    return [float(value) for value in text.split()]
