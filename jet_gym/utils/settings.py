"""What a setting may be, said in one sentence where it is something else."""

import math
import numbers

from jet_gym.errors import SettingsError


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
