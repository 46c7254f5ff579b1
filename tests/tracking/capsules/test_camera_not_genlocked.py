"""A player runs and hops at 3 m/s; two of three cameras take their pictures 8 ms later and earlier, and say so."""

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
    """Every camera sees the player at its own time."""

    told = True

    def frames(self, index: int) -> Frames:
        views = []
        for number, late_s in enumerate(LATE_S):
            later = Hall({name: _later(motion, late_s) for name, motion in self.motions.items()})
            views.append(replace(later.frames(index).views[number], late_s=late_s if self.told else 0.0))
        return Frames(index, Fraction(index, FPS), tuple(views))


class Untold(NotGenlocked):
    told = False


@pytest.fixture(scope="module")
def found():
    """Errors (frames, joints) [mm] and statuses, by what is said of the cameras."""
    halls = {"in time": Hall({"anna": RUN}), "told": NotGenlocked({"anna": RUN}), "untold": Untold({"anna": RUN})}
    estimates = {name: tracked(hall, FRAMES, halls["in time"].starts())[0] for name, hall in halls.items()}
    return {name: (errors_mm(halls["in time"], each), statuses(each)) for name, each in estimates.items()}


def test_the_player_is_followed_about_as_well_as_by_cameras_in_time(found):
    assert "lost" not in found["told"][1]
    assert found["told"][0][2:].mean() < 1.2 * found["in time"][0][2:].mean() + 1


def test_not_knowing_it_costs_more(found):
    assert np.mean(found["untold"][0][2:]) > found["told"][0][2:].mean() + 3
