"""Jet-HR1: posture planning and reinforcement learning for a biped whose feet carry ducted fans.

Importing this package registers its environments with Gymnasium, if that is installed; planning needs neither
Gymnasium nor PyBullet.
"""

import importlib.util as _importlib_util

from jet_gym import courses
from jet_gym.errors import JetGymError
from jet_gym.robot import Robot, jet_hr1, load_robot
from jet_gym.step import Step

__version__ = "0.1.0"

__all__ = ["JetGymError", "Robot", "Step", "__version__", "courses", "jet_hr1", "load_robot"]

if _importlib_util.find_spec("gymnasium") is not None:
    from jet_gym.envs.registration import register_environments

    register_environments()
