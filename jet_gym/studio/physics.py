"""Sends a plan to the physics engine in the background."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from jet_gym.errors import JetGymError
from jet_gym.studio.worker import StaleError

if TYPE_CHECKING:
    from jet_gym.plan import Plan
    from jet_gym.simulation.execution import ThrustControl
    from jet_gym.studio.simulated import Simulated


class Physics:
    """Executes one plan at a time in a thread of its own.

    Args:
        progress: Called with the share that is done, from 0 to 1.
        done: Called with the plan and what became of it, or with the plan and why it could not be executed.
    """

    def __init__(self, progress: Callable[[float], None], done: Callable[[Plan, Simulated | str], None]) -> None:
        self._progress = progress
        self._done = done
        self._lock = threading.Lock()
        self._wanted = 0  # number of the run whose result is wanted; others end as soon as they notice

    def send(self, plan: Plan, thrust: ThrustControl = "feedforward") -> threading.Thread:
        """Execute a plan, in place of the one before it if that is not done yet.

        Args:
            plan: The plan.
            thrust: ``"feedforward"`` or ``"pid"``.

        Returns:
            The thread that does it.
        """
        with self._lock:
            self._wanted += 1
            arguments = (self._wanted, plan, thrust)
        thread = threading.Thread(target=self._run, args=arguments, name="studio-physics", daemon=True)
        thread.start()
        return thread

    def drop(self) -> None:
        """Give up what is being executed."""
        with self._lock:
            self._wanted += 1

    def _run(self, number: int, plan: Plan, thrust: ThrustControl) -> None:
        from jet_gym.simulation.execution import ExecutionSettings, execute
        from jet_gym.studio.simulated import Simulated

        last = -1

        def report(done: int, total: int) -> None:
            nonlocal last
            if number != self._wanted:
                raise StaleError
            percent = 100 * done // max(total, 1)
            if percent != last:
                last = percent
                self._progress(0.01 * percent)

        try:
            result: Simulated | str = Simulated.of_execution(
                execute([plan], ExecutionSettings(thrust=thrust), progress=report)
            )
        except StaleError:
            return
        except (JetGymError, ValueError) as error:
            result = str(error)
        if number == self._wanted:
            self._done(plan, result)
