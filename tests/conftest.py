"""What every test may use, the order in which test files start, and which tests are quick."""

import gc
import os
import subprocess
import sys
import warnings
from functools import cache
from pathlib import Path

import pytest

from airborne.io.environment import set_up_libraries

set_up_libraries()  # as the command line does

from airborne.calibration.from_points import Calibration, calibrate
from airborne.calibration.sources.control_points import ControlPoints, read_control_points
from tests.support.once import remember_foregrounds, remember_silhouettes
from tests.support.places import ROOT
from tests.support.plain_figures import leave_figures_plain

SKIPPED = "airborne/skipped"  # where pytest's cache keeps what the last run skipped
WARMING = pytest.StashKey[subprocess.Popen]()  # the process that compiles the kernels
SLOW_FILES = Path(__file__).with_name("slow_files.txt")  # CPU seconds and file, kernels not yet compiled


def pytest_addoption(parser):
    parser.addoption("--skipped", action="store_true", help="run what the last run skipped; another skip is a failure")


def pytest_sessionstart(session):
    """Begin to compile the kernels of a fresh clone once, before each worker does so."""
    config = session.config
    is_controller = config.getoption("numprocesses", None) and not hasattr(config, "workerinput")
    if is_controller and not any((ROOT / "src").rglob("*.nbc")) and "NUMBA_CACHE_DIR" not in os.environ:
        words = "from airborne.run.warm import warm_kernels; warm_kernels()"
        config.stash[WARMING] = subprocess.Popen([sys.executable, "-c", words])


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_node_collection_finished(node):
    """Wait for the kernels: a worker has listed the tests meanwhile, and gets the first of them next."""
    warming = node.config.stash.get(WARMING, None)
    assert warming is None or warming.wait() == 0, "the kernels were not compiled"


def pytest_configure(config):
    config.option.loadscopereorder = False  # workers take the files in the order below, not those of most tests first


@cache
def skipped_before(config):
    """Return what the last run skipped."""
    return frozenset(config.cache.get(SKIPPED, []))


def pytest_ignore_collect(collection_path, config):
    """Read no file of which nothing was skipped, where only that is run."""
    if config.getoption("skipped") and collection_path.suffix == ".py":
        file = collection_path.relative_to(config.rootpath).as_posix()
        if not any(node.startswith(f"{file}::") for node in skipped_before(config)):
            return True
    return None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Start with the slowest files, so that no worker ends long before another; what is in no slow file is quick."""
    lines = SLOW_FILES.read_text(encoding="utf-8").splitlines()
    seconds = {file: float(each) for each, file in map(str.split, lines)}
    items.sort(key=lambda item: -seconds.get(item.location[0], 0))
    for item in items:
        if item.location[0] not in seconds:
            item.add_marker("quick")
    if config.getoption("skipped"):
        skipped = skipped_before(config)
        config.hook.pytest_deselected(items=[item for item in items if item.nodeid not in skipped])
        items[:] = [item for item in items if item.nodeid in skipped]


def pytest_collection_finish():
    """Let no later look for garbage go through all tests and what they have imported, which stay."""
    gc.freeze()


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item):
    report = (yield).get_result()
    if report.skipped and item.config.getoption("skipped"):
        report.outcome, report.longrepr = "failed", f"skipped again: {report.longrepr[2]}"


def pytest_sessionfinish(session, exitstatus):
    if session.config.getoption("skipped") and exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED:
        session.exitstatus = pytest.ExitCode.OK  # the last run skipped nothing


def pytest_terminal_summary(terminalreporter, config):
    """Remember what was skipped."""
    if config.pluginmanager.hasplugin("cacheprovider"):
        config.cache.set(SKIPPED, [report.nodeid for report in terminalreporter.stats.get("skipped", [])])


@pytest.fixture(scope="session", autouse=True)
def _known():
    """What is the same for all tests is found once; files need not outlast a power cut."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda _: None)
        remember_foregrounds(patch)
        remember_silhouettes(patch)
        yield


@pytest.fixture(scope="module")
def _plain_figures():
    """Write figures without laying them out, which takes half of their time, where no test looks at them."""
    with pytest.MonkeyPatch.context() as patch:
        leave_figures_plain(patch)
        yield


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
