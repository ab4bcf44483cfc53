"""What the robot stands on: the cartons that can be dragged, the floor, and the ditch between them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from jet_gym.ground import Carton, Ditch, cartons_of, ditch_of
from jet_gym.leg import Vector
from jet_gym.simulation.cartons import CARTON_COLOR, TAPE_COLOR, TAPE_WIDTH
from jet_gym.step import Step
from jet_gym.studio.inputs import FEET, Inputs
from jet_gym.studio.scene.colors import rgb
from jet_gym.utils.arrays import Array

if TYPE_CHECKING:
    from viser import BoxHandle, LabelHandle, SceneApi

Dragged = Callable[[str, Vector], None]
"""Called with a foot and where its sole has been dragged to [m]."""

_BAD_COLOR = (205, 40, 45)
_DITCH_COLOR = (120, 152, 178)
_PROUD = 0.0006  # [m] by which tape stands out
_SPAN_ASIDE = 0.45  # [m] from the middle of the step to where the ditch's width is written
_DITCH_REACH = 0.75  # [m] to either side of the step
_FARTHEST = 3.0  # [m] from the middle of the world to where a block can be dragged
_HIGHEST, _LOWEST = 0.6, -0.6  # [m] to where a block can be lifted or lowered
_FLOOR_COLOR = (222, 226, 232)
_FLOOR_HALF = 6.0  # [m]


class GroundView:
    """Cartons under the three soles, which tell when they are dragged.

    A block follows the pointer in the horizontal plane of its top; with shift it moves up and down.

    Args:
        scene: Where it is drawn.
        camera_position: Returns where the camera is (3,) [m].
        dragged: Called while a block is dragged.
    """

    def __init__(self, scene: SceneApi, camera_position: Callable[[], Array], dragged: Dragged) -> None:
        self._camera_position = camera_position
        self._dragged = dragged
        self._soles: dict[str, Array] = {foot: np.zeros(3) for foot in FEET}
        # Where a drag began: the sole, and the point under the pointer.
        self._grab: tuple[Array, Array] | None = None
        self._boxes: dict[str, BoxHandle] = {}
        self._tapes: dict[str, BoxHandle] = {}
        self._labels: dict[str, LabelHandle] = {}
        self.bad_foot: str | None = None
        for foot in FEET:
            scene.add_frame(f"/{foot}", show_axes=False)
            self._boxes[foot] = scene.add_box(f"/{foot}/box", color=rgb(CARTON_COLOR), dimensions=(0.2, 0.1, 0.1))
            self._tapes[foot] = scene.add_box(f"/{foot}/tape", color=rgb(TAPE_COLOR), dimensions=(0.2, 0.1, 0.1))
            self._labels[foot] = scene.add_label(
                f"/{foot}/label", foot, font_screen_scale=0.75, anchor="top-center", depth_test=False
            )
            for handle in (self._boxes[foot], self._tapes[foot]):
                handle.on_drag("left")(self._follow(foot, upwards=False))
                handle.on_drag("left", modifier="shift")(self._follow(foot, upwards=True))
        self._floor = scene.add_box(
            "/floor", dimensions=(2 * _FLOOR_HALF, 2 * _FLOOR_HALF, 0.02), color=_FLOOR_COLOR, cast_shadow=False
        )
        self._ditch = scene.add_box(
            "/ditch", dimensions=(0.1, 0.1, 0.001), color=_DITCH_COLOR, cast_shadow=False, visible=False
        )
        self._span = scene.add_line_segments(
            "/span", np.zeros((1, 2, 3)), (70, 90, 105), thickness=2.0, thickness_units="screen", visible=False
        )
        self._span_label = scene.add_label(
            "/span_label", "", font_screen_scale=0.85, visible=False, depth_test=False
        )

    def show(self, inputs: Inputs, step: Step | None) -> None:
        """Put the blocks under the soles.

        Args:
            inputs: Where the soles are.
            step: The step; ``None`` if it makes no sense, and then what stood around it stays.
        """
        for foot in FEET:
            self._soles[foot] = np.array(inputs.position(foot))
        if step is None:
            return
        cartons = {carton.foot: carton for carton in cartons_of(step)}
        for foot, carton in cartons.items():
            self._place(foot, carton)
        floor = cartons["start"].z[0]
        middle = 0.5 * (np.array(step.start) + np.array(step.landing))
        self._floor.position = (middle[0], middle[1], floor - 0.0105)
        self._show_ditch(ditch_of(step), floor)

    def mark(self, foot: str | None) -> None:
        """Show one block in red, or none."""
        self.bad_foot = foot
        for name, box in self._boxes.items():
            box.color = _BAD_COLOR if name == foot else rgb(CARTON_COLOR)

    def show_names(self, visible: bool) -> None:
        """Write beside each block what stands on it, or not."""
        for label in self._labels.values():
            label.visible = visible

    def _place(self, foot: str, carton: Carton) -> None:
        low, high = (np.array([pair[k] for pair in (carton.x, carton.y, carton.z)]) for k in (0, 1))
        size, middle = high - low, 0.5 * (low + high)
        self._boxes[foot].dimensions = (size[0], size[1], size[2])
        self._boxes[foot].position = middle
        self._tapes[foot].dimensions = (size[0] + 2 * _PROUD, TAPE_WIDTH, size[2] + 2 * _PROUD)
        self._tapes[foot].position = middle
        self._labels[foot].position = (middle[0], middle[1], low[2] + 0.35 * size[2])

    def _show_ditch(self, ditch: Ditch | None, floor: float) -> None:
        for handle in (self._ditch, self._span, self._span_label):
            handle.visible = ditch is not None
        if ditch is None:
            return
        middle = 0.5 * sum(ditch.edges)
        long, wide = (ditch.axis, 1 - ditch.axis)
        center, size = np.zeros(3), np.zeros(3)
        center[[long, wide, 2]] = middle, ditch.across, floor
        size[[long, wide, 2]] = ditch.span, 2.0 * _DITCH_REACH, 0.004
        self._ditch.position = center
        self._ditch.dimensions = (size[0], size[1], size[2])
        ends = np.repeat(center[None], 2, axis=0)
        ends[:, long] = ditch.edges
        ends[:, wide] += _SPAN_ASIDE
        ends[:, 2] += 0.004
        self._span.points = ends[None]
        self._span_label.position = ends.mean(axis=0)
        self._span_label.text = ditch.label

    def _follow(self, foot: str, upwards: bool) -> Callable[[Any], Any]:
        """Return a callback that lets a block follow the pointer.

        It is a coroutine, because viser runs those in the order of the pointer's events.
        """

        async def follow(event: Any) -> None:
            if event.phase == "start":
                self._grab = self._soles[foot].copy(), np.array(event.start_position)
            if self._grab is None:
                return
            sole, grabbed = self._grab
            pointer = np.array(event.end_position)
            moved = sole.copy()
            if upwards:
                moved[2] = np.clip(sole[2] + pointer[2] - grabbed[2], _LOWEST, _HIGHEST)
            else:
                on_plane = meet_horizontal_plane(self._camera_position(), pointer, float(grabbed[2]))
                if on_plane is None:
                    return
                moved[:2] += on_plane[:2] - grabbed[:2]
                moved[:2] = np.clip(moved[:2], -_FARTHEST, _FARTHEST)
            if event.phase == "end":
                self._grab = None
            x, y, z = (round(float(value), 4) for value in moved)
            self._dragged(foot, (x, y, z))

        return follow


def meet_horizontal_plane(eye: Array, through: Array, height: float) -> Array | None:
    """Return where the ray from the eye through a point meets a horizontal plane; ``None`` if it does not.

    Args:
        eye: Where the ray begins (3,) [m].
        through: A point on it (3,) [m].
        height: Height of the plane [m].
    """
    direction = through - eye
    if abs(direction[2]) < 1e-6:
        return None
    along = (height - eye[2]) / direction[2]
    return None if along <= 0.0 else np.asarray(eye + along * direction)
