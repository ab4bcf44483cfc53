"""Errors that a caller may want to catch, one class per kind of failure, and how a command tells them."""


class JetGymError(Exception):
    """Base class of every error that this package raises on purpose."""


class RobotError(JetGymError, ValueError):
    """A robot description that cannot be read or does not fit the biped's leg topology."""


class StepError(JetGymError, ValueError):
    """A step that makes no sense, such as feet that overlap."""


class SettingsError(JetGymError, ValueError):
    """A setting outside of what is allowed."""


class PlanFileError(JetGymError, ValueError):
    """A plan file that is damaged, of another format or not finite."""


class BalanceSpaceFileError(JetGymError, ValueError):
    """A file of a balance space that is damaged or of another format."""


class PolicyFileError(JetGymError, ValueError):
    """A policy file that is damaged, not trusted, or made for another environment."""


class InfeasibleStepError(JetGymError):
    """A step with a swing point for which no posture satisfies the constraints."""


TOLD = (JetGymError, ValueError, OSError)
"""What a command tells in a sentence: bad input, and files that cannot be read or written."""


def sentence_of(error: Exception) -> str:
    """Return in one line what an error says; of a file, which one and what is wrong with it."""
    if isinstance(error, OSError):
        return in_one_line(f"{error.filename or 'file'}: {error.strerror or error}")
    return in_one_line(str(error))


def in_one_line(sentence: str) -> str:
    """Return a sentence without the line breaks that are in it where the user gave some."""
    return " ".join(line.strip() for line in sentence.splitlines())
