"""The bundled example, cut short, and a run of it."""

import shutil
from pathlib import Path

import pytest

from tests.support.commands import in_process
from tests.support.example_trial import CALIBRATED, LONG, SHORT, edit_trial
from tests.support.places import THROWN_CROSS


@pytest.fixture(scope="module")
def trial(tmp_path_factory) -> Path:
    """A copy of the example that ends after a few fields."""
    folder = tmp_path_factory.mktemp("trial")
    example = THROWN_CROSS
    for path in example.iterdir():
        if path.suffix == ".mp4":
            (folder / path.name).symlink_to(path)
        else:
            shutil.copyfile(path, folder / path.name)
    exact = ('control_points = "control_points.csv"', CALIBRATED)  # saves each run the fit of the cameras
    edit_trial(folder / "trial.toml", "trial.toml", ("[track]", f"[track]\nstop = {SHORT}"), exact)
    edit_trial(folder / "trial.toml", "long.toml", (f"stop = {SHORT}", f"stop = {LONG}"))
    return folder / "trial.toml"


@pytest.fixture(scope="module")
def short_run(trial, tmp_path_factory) -> Path:
    """The folder of a run of the short trial, which nobody changes but by `evaluate`."""
    folder = tmp_path_factory.mktemp("runs") / "short"
    assert in_process("track", trial, "-o", folder, "--no-pictures") == 0
    return folder
