"""A clip that several tests share."""

import pytest

from tests.support.jumping_scenes import N_FRAMES, Hall, hop, tracked


@pytest.fixture(scope="session")
def hall():
    """One player, three cameras."""
    return Hall({"anna": hop()})


@pytest.fixture(scope="session")
def plain(hall):
    """What the tracker finds of a player who squats and hops, every camera looking."""
    return tracked(hall, range(N_FRAMES))[0]
