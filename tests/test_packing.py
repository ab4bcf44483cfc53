"""The numbers of the task survive the way into compiled code."""

from __future__ import annotations

from jet_gym import jet_hr1
from jet_gym.balance import BalanceSettings
from jet_gym.fitness import FitnessSettings
from jet_gym.single_support import single_support
from jet_gym.task.packing import TaskNumbers, pack, unpack
from jet_gym.task.settings import TaskSettings


def test_unpacking_gives_what_was_packed() -> None:
    robot = jet_hr1()
    for thrust_model, swing in (("least", "left"), ("assigned", "right")):
        numbers = TaskNumbers(
            single_support(robot, swing, BalanceSettings(thrust_model=thrust_model)),
            FitnessSettings().parameters(),
            TaskSettings(difficulty=0.5).parameters(),
        )
        unpacked = unpack(pack(numbers))
        assert tuple(unpacked) == tuple(numbers)
        assert tuple(pack(unpacked)) == tuple(pack(numbers))
