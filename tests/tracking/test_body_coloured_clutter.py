"""Things behind the body that have its colours are distinguished from it, because they stay."""

from tests.support.scenes import BLUE, RED, YELLOW, Scene, clutter, statuses, track, worst

CLUTTERED = Scene(backgrounds=tuple(clutter(seed, YELLOW, BLUE, YELLOW, RED) for seed in range(4)))


def test_boxes_in_the_bodys_colours_do_not_draw_it_away():
    estimates = track(CLUTTERED, range(8))
    assert statuses(estimates) == ["tracked"] * 8
    position_mm, rotation_deg = worst(CLUTTERED, estimates)
    assert position_mm < 4
    assert rotation_deg < 1.5
