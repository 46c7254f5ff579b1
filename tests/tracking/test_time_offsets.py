from dataclasses import replace
from fractions import Fraction

import numpy as np

from airborne.tracking.time_offsets import compensate_offsets
from airborne.video import Frames
from tests.support.scenes import CAMERAS, Scene, thrown
from tests.support.tolerances import ROUNDTRIP

LATE_S = 0.006
PAST = tuple((Fraction(k, 50), thrown(Fraction(k, 50))) for k in range(1, 6))


def frames(late_s) -> Frames:
    frames_in_time = Scene().frames(5)
    views = [replace(view, delay_s=late) for view, late in zip(frames_in_time.views, late_s, strict=True)]
    return replace(frames_in_time, views=tuple(views))


def test_a_late_view_shows_the_body_where_a_compensated_camera_sees_it_in_time():
    compensated = compensate_offsets(frames((0, 0, LATE_S, 0)), PAST).views[2].camera
    local = np.array([[0.0, 0.4, 0], [0.25, 0.15, 0], [0, -0.4, 0.03]])
    now, then = (thrown(Fraction(t)).world_from_root for t in (Fraction(1, 10), Fraction(1, 10) + Fraction(LATE_S)))
    recorded = CAMERAS[2].px_from_world(then.apply(local))
    assert np.abs(compensated.px_from_world(now.apply(local)) - recorded).max() < 0.02
    assert np.abs(CAMERAS[2].px_from_world(now.apply(local)) - recorded).max() > 0.5


def test_views_in_time_are_left_alone():
    assert compensate_offsets(same := frames((0, 0, 0, 0)), PAST) is same
    some = compensate_offsets(frames((0, 0, LATE_S, 0)), PAST)
    is_same = [view.camera is camera for view, camera in zip(some.views, CAMERAS, strict=True)]
    assert is_same == [True, True, False, True]


def test_before_there_is_any_motion_late_views_are_left_out_unless_all_are():
    first = compensate_offsets(frames((0, 0.001, LATE_S, LATE_S)), PAST[:1])
    assert [view is not None for view in first.views] == [True, True, False, False]
    assert all(view is not None for view in compensate_offsets(frames((LATE_S,) * 4), ()).views)


def test_a_body_at_rest_moves_no_camera():
    still = tuple((Fraction(k, 50), thrown(Fraction(0))) for k in range(5))
    camera = compensate_offsets(frames((0, 0, LATE_S, 0)), still).views[2].camera
    assert np.allclose(camera.P, CAMERAS[2].P, atol=ROUNDTRIP)
