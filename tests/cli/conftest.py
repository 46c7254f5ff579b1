"""The bundled example, cut short, and a run of it."""

from pathlib import Path

import pytest

from tests.support.commands import in_process
from tests.support.example_trial import LONG, SHORT, copy_cross, edit_trial


@pytest.fixture(scope="module")
def trial(tmp_path_factory) -> Path:
    """A copy of the example that ends after a few fields."""
    folder = copy_cross(tmp_path_factory.mktemp("trial"))
    edit_trial(folder / "trial.toml", "trial.toml", ("[track]", f"[track]\nstop = {SHORT}"))
    edit_trial(folder / "trial.toml", "long.toml", (f"stop = {SHORT}", f"stop = {LONG}"))
    return folder / "trial.toml"


@pytest.fixture(scope="module")
def short_run(trial, tmp_path_factory) -> Path:
    """The folder of a run of the short trial, which nobody changes but by `evaluate`."""
    folder = tmp_path_factory.mktemp("runs") / "short"
    assert in_process("track", trial, "-o", folder, "--no-pictures") == 0
    return folder
