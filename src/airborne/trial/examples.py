"""Where the bundled example trials are: in the installed package, or in a checkout."""

from __future__ import annotations

from pathlib import Path

from airborne.errors import TrialError

_PACKAGE = Path(__file__).parents[1]
_FOLDERS = (_PACKAGE / "example_trials", _PACKAGE.parents[1] / "examples")


def example_trial(name: str) -> Path:
    """Return the trial file of a bundled example; raises TrialError for another name, or where it was not installed."""
    name = str(name)
    for folder in _FOLDERS:
        if (folder / name / "trial.toml").is_file():
            return folder / name / "trial.toml"
    names = sorted({path.parent.name for folder in _FOLDERS for path in folder.glob("*/trial.toml")})
    if names:
        raise TrialError(f"there is no example '{name}'; there are: {', '.join(names)}")
    raise TrialError("the examples are not installed; install Airborne from its repository or its wheel")
