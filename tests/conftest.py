"""What every test may use."""

import os
import warnings
from pathlib import Path

for threads in ("OPENBLAS_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"):  # else libraries fight with the workers for cores
    os.environ.setdefault(threads, "1")

import cv2
import pytest

from airborne.calibration.from_points import Calibration, calibrate
from airborne.calibration.sources.control_points import ControlPoints, read_control_points
from tests.support.places import ROOT


@pytest.fixture(scope="session")
def shared_data():
    """Find a folder of the shared recordings, `shared/data/<name>` beside the project; skip where it is missing."""

    def find(name: str) -> Path:
        folder = ROOT.parent / "shared" / "data" / name
        if not folder.is_dir():
            pytest.skip(f"the recordings of shared/data/{name} are not beside the project")
        return folder

    return find


@pytest.fixture(scope="session")
def thrown_cross() -> Path:
    """Return the folder of the bundled example trial."""
    return ROOT / "examples" / "thrown_cross"


@pytest.fixture(scope="session")
def points(thrown_cross) -> ControlPoints:
    return read_control_points(thrown_cross / "control_points.csv")


@pytest.fixture(scope="session")
def sizes(points) -> dict[str, tuple[int, int]]:
    return dict.fromkeys(points.cameras, (768, 576))


@pytest.fixture(scope="session")
def calibration(points, sizes) -> Calibration:
    return calibrate(points, sizes)


def imported(name):
    """Import a reader whose own warnings are not ours."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip(name)


@pytest.fixture(scope="session")
def opensim(tmp_path_factory):
    """OpenSim, which leaves a log where it is loaded."""
    here = os.getcwd()
    os.chdir(tmp_path_factory.mktemp("opensim"))
    try:
        module = imported("opensim")
        module.Logger.removeFileSink()
        module.Logger.setLevelString("Off")
    finally:
        os.chdir(here)
    return module


@pytest.fixture(scope="session")
def ezc3d():
    return imported("ezc3d")


@pytest.fixture(scope="session")
def plain_c3d():
    """The reader of the package `c3d`."""
    return imported("c3d")
