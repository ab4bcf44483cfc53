"""Errors that a caller may want to catch, one class per kind of failure."""


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
