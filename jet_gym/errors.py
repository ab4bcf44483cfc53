"""Errors that a caller may want to catch, one class per kind of failure."""

import numbers


class JetGymError(Exception):
    """Base class of every error that this package raises on purpose."""


class RobotError(JetGymError, ValueError):
    """A robot description that cannot be read or does not fit the biped's leg topology."""


class StepError(JetGymError, ValueError):
    """A step that makes no sense, such as feet that overlap."""


class SettingsError(JetGymError, ValueError):
    """A setting outside of what is allowed."""


def require_number(name: str, value: object) -> None:
    """Refuse a setting that is no number.

    Raises:
        SettingsError: If it is not a number, or a truth value.
    """
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise SettingsError(f"{name} must be a number, not {value!r}")


class PlanFileError(JetGymError, ValueError):
    """A plan file that is damaged, of another format or not finite."""


class PolicyFileError(JetGymError, ValueError):
    """A policy file that is damaged, not trusted, or made for another environment."""


class InfeasibleStepError(JetGymError):
    """A step with a swing point for which no posture satisfies the constraints."""
