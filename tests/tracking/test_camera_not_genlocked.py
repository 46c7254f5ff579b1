"""One camera takes its images 7 ms after the others, and its time offset is known."""

from dataclasses import replace
from fractions import Fraction

import pytest

from airborne.tracking.model_based.refined import RefinedTracker
from airborne.tracking.time_offsets import CompensatedTracker
from airborne.video import Frames
from tests.support.scenes import CAMERAS, CROSS, FPS, Scene, statuses, thrown, track, worst

LATE_S = Fraction(7, 1000)
THREE = Scene(cameras=CAMERAS[:3])
LATER = Scene(cameras=CAMERAS[:3], motion=lambda time_s: thrown(time_s + LATE_S))


class NotGenlocked(Scene):
    """The third camera's images come from a scene 7 ms on."""

    is_offset_known = True

    def frames(self, index: int) -> Frames:
        late = replace(LATER.frames(index).views[2], delay_s=float(LATE_S) if self.is_offset_known else 0.0)
        return Frames(index, Fraction(index, FPS), (*THREE.frames(index).views[:2], late))


class OffsetUnknown(NotGenlocked):
    is_offset_known = False


@pytest.fixture(scope="module")
def errors():
    """Worst errors (mm, deg) of each scene, and its statuses."""
    errors = {}
    for name, scene in (("in time", THREE), ("compensated", NotGenlocked()), ("unknown", OffsetUnknown())):
        estimates = track(scene, range(12), CompensatedTracker(RefinedTracker(CROSS, scene.start())))
        errors[name] = worst(THREE, estimates), statuses(estimates)
    return errors


def test_it_is_tracked_about_as_well_as_cameras_in_time(errors):
    (position_mm, rotation_deg), seen = errors["compensated"]
    assert "lost" not in seen
    assert position_mm < 2 * errors["in time"][0][0] + 1
    assert rotation_deg < 2 * errors["in time"][0][1] + 0.5


def test_not_knowing_it_costs_much_more(errors):
    assert errors["unknown"][0][0] > 1.5 * errors["compensated"][0][0]
