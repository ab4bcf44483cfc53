"""Planners for the steps of :mod:`jet_gym`, by name: ``make_planner("gas").plan(step, seed=0)``."""

from agents.planner import PLANNERS, Planner, make_planner
from jet_gym.plan import Plan

__all__ = ["PLANNERS", "Plan", "Planner", "make_planner"]
