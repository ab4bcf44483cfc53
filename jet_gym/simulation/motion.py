"""From commands to what servos and fans are told at every simulation step."""

from __future__ import annotations

import math

import numpy as np

from jet_gym.fans_and_servos import Fan
from jet_gym.utils.arrays import Array


class CommandBlend:
    """Joins joint commands to a path with continuous position, velocity and acceleration.

    Straight lines in time lead from command to command, and a weighted mean over the last ``steps`` simulation
    steps, its weights a triangle, rounds their corners. So a change of speed by ``dv`` costs an acceleration of at
    most ``2 dv / blend_time``, whereas a blend that rests at every command accelerates by up to
    ``5.8 dq / duration**2`` each time, which on the paper's course moved the ZMP to the edge of the sole.
    The mean delays the path by half of its width.

    Args:
        steps: Width of the mean in simulation steps; 1 or less leaves the corners.
    """

    def __init__(self, steps: int) -> None:
        weights = np.bartlett(max(steps, 1) + 2)[1:-1]
        self._weights: Array = weights / weights.sum()
        self._past: Array = np.zeros((len(weights), 1))

    def reset(self, command: Array) -> None:
        """Rest at a command (D,)."""
        self._past = np.tile(command, (len(self._weights), 1))

    def advance(self, command: Array, steps: int) -> Array:
        """Go on to the next command.

        Args:
            command: Where the straight line ends (D,).
            steps: Simulation steps until then, at least 1.

        Returns:
            Targets (steps, D), one row a simulation step.
        """
        fraction = np.arange(1, steps + 1)[:, None] / steps
        path = np.concatenate([self._past, self._past[-1] + fraction * (command - self._past[-1])])
        path[-1] = command
        self._past = path[-len(self._weights) :].copy()
        windows = np.lib.stride_tricks.sliding_window_view(path, len(self._weights), axis=0)
        return np.asarray(windows[1:] @ self._weights)


class FanLag:
    """A ducted fan whose thrust follows its command with a first-order lag, exact in discrete time.

    Args:
        fan: Its largest thrust and its time constant.
        time_step: Simulation step [s].
        gain: Thrust over what the fan was told [1]; a weak fan's largest thrust is less by as much.
    """

    def __init__(self, fan: Fan, time_step: float, gain: float = 1.0) -> None:
        self.max_thrust = fan.max_thrust
        self.thrust = 0.0  # [N] delivered
        self._gain = gain
        self._share_kept = math.exp(-time_step / fan.time_constant) if fan.time_constant > 0.0 else 0.0

    def step(self, command: float) -> float:
        """Let a simulation step pass under a command [N], clipped to what the fan can do; return the thrust [N]."""
        possible = min(self._gain * min(max(command, 0.0), self.max_thrust), self.max_thrust)
        self.thrust = possible + (self.thrust - possible) * self._share_kept
        return self.thrust
