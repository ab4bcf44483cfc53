"""Trials that nobody ran."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import pytest

from jet_gym.simulation import Disturbance
from jet_gym.simulation.trials import Experiment, Trial


def made_up(number: int, success: bool, **disturbance: Any) -> Trial:
    """A trial that nobody ran."""
    chosen = dataclasses.replace(
        Disturbance(friction=0.8, contact_stiffness=3e5, imu_delay=0.01, fan_lag=0.15), **disturbance
    )
    cause = "" if success else "left foot"
    return Trial(number, "pid", chosen, success, cause, cause, 20.0, 0.01, 0.01, 20.0)


def without_simulation(
    monkeypatch: pytest.MonkeyPatch, succeeds: Callable[[Disturbance], bool], ran: list[Disturbance]
) -> None:
    """Let trials end as a rule says, instead of simulating them."""

    def made(self: Experiment, number: int, control: Any, disturbance: Disturbance) -> Trial:
        ran.append(disturbance)
        trial = made_up(number, succeeds(disturbance))
        return dataclasses.replace(trial, control=control, disturbance=disturbance)

    monkeypatch.setattr(Experiment, "run", made)
