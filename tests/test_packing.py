"""The numbers of the task survive the way into compiled code."""

from __future__ import annotations

from jet_gym import jet_hr1
from jet_gym.balance import BalanceSettings
from jet_gym.fitness import FitnessSettings
from jet_gym.task.packing import TaskNumbers, pack, unpack
from jet_gym.task.settings import TaskSettings


def test_unpacking_gives_what_was_packed() -> None:
    robot = jet_hr1()
    for least, swing, support, side in (
        (True, robot.left, robot.right, 1.0),
        (False, robot.right, robot.left, -1.0),
    ):
        balance = BalanceSettings(thrust_model="least" if least else "assigned").parameters(robot)
        fitness, task = FitnessSettings().parameters(), TaskSettings(difficulty=0.5).parameters()
        numbers = TaskNumbers(swing, support, robot.trunk, side, balance, fitness, task)
        unpacked = unpack(pack(numbers))
        assert tuple(unpacked) == tuple(numbers)
        assert tuple(pack(unpacked)) == tuple(pack(numbers))
