"""The example, light, for whatever runs it."""

from pathlib import Path

import pytest

from tests.support.example_trial import light_cross


@pytest.fixture(scope="session")
def thrown_cross() -> Path:
    """Return the folder of the light example, which nobody changes."""
    return light_cross()
