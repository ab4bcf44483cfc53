"""Jet-HR1 in PyBullet: the world it moves in, what is measured there, and pictures of it.

PyBullet itself is imported when a :class:`World` is made, so that everything else works without it.
"""

from jet_gym.simulation.course import CourseSettings, make_course
from jet_gym.simulation.diagnosis import Summary
from jet_gym.simulation.disturbances import Disturbance, DisturbanceRanges
from jet_gym.simulation.errors import BulletMissingError, DisplayMissingError, EncoderMissingError, WorldStateError
from jet_gym.simulation.execution import ExecutionSettings, execute
from jet_gym.simulation.history import Execution
from jet_gym.simulation.imu import ImuSettings
from jet_gym.simulation.measurement import Measurement
from jet_gym.simulation.pictures.camera import CameraSettings
from jet_gym.simulation.pictures.film import FilmSettings, film
from jet_gym.simulation.pictures.overlay import Overlay
from jet_gym.simulation.pictures.renderer import Renderer
from jet_gym.simulation.settings import SimulationSettings
from jet_gym.simulation.thrust_control import PidSettings
from jet_gym.simulation.world import World

__all__ = [
    "BulletMissingError",
    "CameraSettings",
    "CourseSettings",
    "DisplayMissingError",
    "Disturbance",
    "DisturbanceRanges",
    "EncoderMissingError",
    "Execution",
    "ExecutionSettings",
    "FilmSettings",
    "ImuSettings",
    "Measurement",
    "Overlay",
    "PidSettings",
    "Renderer",
    "SimulationSettings",
    "Summary",
    "World",
    "WorldStateError",
    "execute",
    "film",
    "make_course",
]
