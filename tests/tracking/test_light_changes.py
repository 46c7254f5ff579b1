"""Light that fades over a clip is followed."""

import pytest

from tests.support.scenes import Scene, statuses, track, worst

FRAMES = 12


@pytest.mark.parametrize("ends_at", [0.5, 1.5])
def test_light_that_halves_or_grows_by_half_leaves_the_body_tracked(ends_at):
    scene = Scene(brightness=lambda index: 1 + (ends_at - 1) * index / (FRAMES - 1))
    estimates = track(scene, range(FRAMES))
    assert statuses(estimates) == ["tracked"] * FRAMES
    position_mm, rotation_deg = worst(scene, estimates)
    assert position_mm < 4
    assert rotation_deg < 1.5
