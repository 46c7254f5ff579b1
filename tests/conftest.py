"""What every test may use."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


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
