"""A camera may have no image for a while."""

from tests.support.scenes import Scene, statuses, track, worst

DARK = (2, 3, 4)


def test_others_carry_on_while_a_camera_is_dark():
    scene = Scene(is_dark=lambda index, name: name == "cam1" and index in DARK)
    estimates = track(scene, range(7))
    assert statuses(estimates) == ["tracked"] * 7
    assert [estimate.n_views for estimate in estimates] == [4, 4, 3, 3, 3, 4, 4]
    position_mm, rotation_deg = worst(scene, estimates)
    assert position_mm < 3
    assert rotation_deg < 1


def test_camera_that_is_dark_at_first_joins_later():
    scene = Scene(is_dark=lambda index, name: name == "cam0" and index < 3)
    estimates = track(scene, range(6))
    assert statuses(estimates) == ["tracked"] * 6
    assert [estimate.n_views for estimate in estimates][:3] == [3, 3, 3]
    assert estimates[-1].n_views == 4
    assert worst(scene, estimates)[0] < 3


def test_body_is_lost_while_every_camera_is_dark_and_found_afterwards():
    scene = Scene(is_dark=lambda index, name: index in DARK)
    estimates = track(scene, range(7))
    assert statuses(estimates) == ["lost" if index in DARK else "tracked" for index in range(7)]
    assert worst(scene, estimates)[0] < 3
