"""Where the bundled example trials are: in the installed package, or in a checkout."""

from __future__ import annotations

from pathlib import Path

from airborne.errors import TrialError

_PACKAGE = Path(__file__).parents[1]
_FOLDERS = (_PACKAGE / "example_trials", _PACKAGE.parents[1] / "examples")


def example_trial(name: str) -> Path:
    """Return the trial file of a bundled example; raises TrialError where it was not installed."""
    for folder in _FOLDERS:
        if (folder / name / "trial.toml").is_file():
            return folder / name / "trial.toml"
    raise TrialError(f"the example '{name}' is not installed; install Airborne from its repository or its wheel")
