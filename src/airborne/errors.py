"""Errors a user can cause. Each message says what was found, what was expected and what to do, in one line."""


class AirborneError(Exception):
    """Base of every error that Airborne raises on purpose; the command line prints it and exits with 2."""


class CalibrationError(AirborneError):
    """Cameras cannot be found from what was given."""


class VideoError(AirborneError):
    """A video cannot be read, or does not fit the others."""


class BodyError(AirborneError):
    """A body file or shape is unusable."""


class TrialError(AirborneError):
    """A trial file is unusable."""


class ResultError(AirborneError):
    """A run folder or truth file is unusable."""
