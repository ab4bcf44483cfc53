"""Errors that a caller may want to catch, one class per kind of failure."""

import math
import numbers


class JetGymError(Exception):
    """Base class of every error that this package raises on purpose."""


class RobotError(JetGymError, ValueError):
    """A robot description that cannot be read or does not fit the biped's leg topology."""


class StepError(JetGymError, ValueError):
    """A step that makes no sense, such as feet that overlap."""


class SettingsError(JetGymError, ValueError):
    """A setting outside of what is allowed."""


def require_number(name: str, value: object) -> float:
    """Return a setting, and refuse one that is no number.

    Raises:
        SettingsError: If it is not a number, or a truth value.
    """
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise SettingsError(f"{name} must be a number, not {value!r}")
    return float(value)


def require_within(
    name: str, value: object, least: float = 0.0, most: float = math.inf, *, above: bool = False
) -> None:
    """Refuse a setting that is not a finite number within a range.

    Args:
        name: Of the setting.
        value: What it was given.
        least: The lower end of the range.
        most: The upper end; every finite number above the lower end where it is infinite.
        above: Whether the lower end itself is refused.

    Raises:
        SettingsError: With a sentence that names the setting and what it may be.
    """
    number = require_number(name, value)
    within = least < number <= most if above else least <= number <= most
    if within and math.isfinite(number):
        return
    if most == math.inf:
        allowed = f"be a finite number of {f'more than {least:g}' if above else f'{least:g} or more'}"
    elif above:
        allowed = f"be more than {least:g} and at most {most:g}"
    else:
        allowed = f"lie between {least:g} and {most:g}"
    raise SettingsError(f"{name} must {allowed}, not {value}")


def require_whole(name: str, value: object, least: int, most: int | None = None) -> None:
    """Refuse a setting that is not a whole number within a range.

    Args:
        name: Of the setting.
        value: What it was given.
        least: The lower end of the range.
        most: The upper end; none where omitted.

    Raises:
        SettingsError: With a sentence that names the setting and what it may be.
    """
    highest = math.inf if most is None else most
    if isinstance(value, int) and not isinstance(value, bool) and least <= value <= highest:
        return
    allowed = f"of {least} or more" if most is None else f"from {least} to {most}"
    raise SettingsError(f"{name} must be a whole number {allowed}, not {value!r}")


def require_seed(seed: object) -> None:
    """Refuse a seed that is none; NumPy's integers are.

    Raises:
        SettingsError: If the seed is not a whole number of 0 or more.
    """
    if isinstance(seed, bool) or not isinstance(seed, numbers.Integral) or seed < 0:
        raise SettingsError(f"seed must be a whole number of 0 or more, not {seed!r}")


class PlanFileError(JetGymError, ValueError):
    """A plan file that is damaged, of another format or not finite."""


class PolicyFileError(JetGymError, ValueError):
    """A policy file that is damaged, not trusted, or made for another environment."""


class InfeasibleStepError(JetGymError):
    """A step with a swing point for which no posture satisfies the constraints."""
