"""Light that fades over a clip is followed, and light that flickers or jumps loses no frame."""

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


@pytest.mark.parametrize("brightness", [lambda i: 1.3 if i % 2 else 0.8, lambda i: 1.0 if i < 5 else 0.6])
def test_light_that_flickers_or_jumps_leaves_the_body_tracked(brightness):
    scene = Scene(brightness=brightness)
    estimates = track(scene, range(FRAMES))
    assert statuses(estimates) == ["tracked"] * FRAMES
    position_mm, rotation_deg = worst(scene, estimates)
    assert position_mm < 4
    assert rotation_deg < 1.5
