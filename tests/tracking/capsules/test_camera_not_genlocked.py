"""A player runs and hops at 3 m/s; two of three cameras expose 8 ms later and earlier, by known delays."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from airborne.video import Frames
from tests.support.jumping_scenes import FPS, Hall, errors_mm, statuses, tracked, walk

LATE_S = (0.0, 0.008, -0.008)
RUN = walk((-0.9, 0.0), (3.0, 0.0), heading=0.3)
FRAMES = range(24)


def _later(motion, late_s: float):
    return lambda time_s: motion(time_s + late_s)


class NotGenlocked(Hall):
    """Every camera exposes at its own time."""

    has_known_delays = True

    def frames(self, index: int) -> Frames:
        views = []
        for number, late_s in enumerate(LATE_S):
            later = Hall({name: _later(motion, late_s) for name, motion in self.motions.items()})
            views.append(replace(later.frames(index).views[number], delay_s=late_s if self.has_known_delays else 0.0))
        return Frames(index, Fraction(index, FPS), tuple(views))


class UnknownDelays(NotGenlocked):
    has_known_delays = False


@pytest.fixture(scope="module")
def results():
    """Errors (frames, joints) [mm] and statuses, by what is known of the cameras."""
    halls = {
        "in time": Hall({"anna": RUN}),
        "known": NotGenlocked({"anna": RUN}),
        "unknown": UnknownDelays({"anna": RUN}),
    }
    estimates = {name: tracked(hall, FRAMES, halls["in time"].starts())[0] for name, hall in halls.items()}
    return {name: (errors_mm(halls["in time"], each), statuses(each)) for name, each in estimates.items()}


def test_known_delays_cost_little(results):
    assert "lost" not in results["known"][1]
    assert results["known"][0][2:].mean() < 1.2 * results["in time"][0][2:].mean() + 1


def test_unknown_delays_cost_more(results):
    assert np.mean(results["unknown"][0][2:]) > results["known"][0][2:].mean() + 3
