"""The readers of other programs, where they are installed."""

import os
import warnings

import pytest


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
