"""A body that nobody can have is refused, an unusual one is warned of, and what to check is named."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from airborne.body import Pose, human18, with_segment_lengths
from airborne.body.shaping import with_joint_widths
from airborne.body_fitting.checks import (
    check_joints,
    check_lengths,
    height_ratio,
    length_ratios,
    person_of_shares,
    points_of_lengths,
)
from airborne.errors import BodyError
from airborne.run.body_clicks import Clicks

BODY = human18(1.7, 65.0)
POINTS = points_of_lengths(BODY)
STANDING = Pose(world_from_root=RigidTransform.identity())


def in_cam2(points):
    return f", first in cam2 ({' '.join(points)})"


def check(lengths, look=in_cam2):
    return check_body(with_segment_lengths(BODY, lengths), BODY, look)


def check_body(own, shares, look=in_cam2):
    return check_lengths(length_ratios(own, shares), POINTS, look, height_ratio(own, shares))


def test_lengths_are_measured_by_the_points_at_their_ends():
    assert POINTS["foot"] == ["ankle", "foot"]
    assert POINTS["shank"] == ["knee", "ankle"]
    assert POINTS["chest"] == ["hip", "shoulder"]
    assert POINTS["head"] == ["head"]


def test_lengths_near_the_statures_shares_are_taken_without_a_word():
    assert check({"thigh": 1.14, "forearm": 0.86}) == []


def test_the_width_of_the_hips_is_checked_too():
    wide = with_joint_widths(BODY, {"pelvis": 1.2})
    (warning,) = check_lengths(length_ratios(wide, BODY), POINTS, in_cam2, 1.0)
    assert warning.startswith("hip width 1.20 of the length that the stature gives; check the clicks of hip")


def test_an_unusual_length_is_warned_of_with_the_clicks_to_check():
    (warning,) = check({"thigh": 1.2})
    assert warning == (
        "thigh 1.20 of the length that the stature gives; check the clicks of hip, knee, first in cam2 (hip knee)"
    )


def test_impossible_lengths_are_refused_and_named():
    with pytest.raises(
        BodyError, match=r"^shank 0.65, foot 1.68 of .*expected 0.70 to 1.30; check the clicks of"
    ) as error:
        check({"foot": 1.68, "shank": 0.65, "thigh": 1.2})
    assert "knee, ankle, foot" in str(error.value)
    assert "thigh" not in str(error.value)


def test_lengths_that_are_all_off_alike_question_the_stature_and_the_scale():
    with pytest.raises(
        BodyError, match=r"of the person is about 1\.39 times as tall .*: check the stature, and the cal"
    ):
        check({stem: 1.4 for stem in POINTS if "width" not in stem})


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_wrong_stature_is_named_before_the_clicks(share):
    (warning,) = check_body(human18(1.7, 65.0), human18(1.7 * share, 65.0))
    assert warning.startswith(
        f"all of the person is about {1 / share:.2f} times as tall as the stature says: check the"
    )


def test_lengths_that_a_wrong_stature_does_not_explain_are_named_with_their_clicks():
    long_arms = with_segment_lengths(human18(1.7, 65.0), {"upper_arm": 1.16})
    (warning,) = check_body(long_arms, human18(1.7 * 0.9, 65.0))
    assert "about 1.11 times as tall" in warning and "check the clicks" not in warning
    assert warning.endswith("then the clicks of shoulder, elbow, first in cam2 (shoulder elbow)")


def test_a_stature_that_is_a_little_off_is_taken_without_a_word():
    assert check_body(human18(1.7, 65.0), human18(1.7 * 1.04, 65.0)) == []


def test_widths_alone_that_are_off_question_the_mass():
    (warning,) = check_body(human18(1.7, 65.0), human18(1.7, 65.0 * 1.6))
    assert "widths go with the mass, of which about 0.63 would fit: check the mass, then the clicks of" in warning
    with pytest.raises(
        BodyError, match=r"of which about 0\.45 would fit, as if it were given in pounds: check the mass"
    ):
        check_body(human18(1.7, 65.0), human18(1.7, 65.0 * 2.2046))
    ratios = {"shoulder": 0.69, "shoulder width": 0.71, "upper_arm": 0.82}  # the one that is refused is a width
    with pytest.raises(BodyError, match=r"^shoulder 0\.69 of .* of which about 0\.50 would fit"):
        check_lengths(ratios, POINTS, in_cam2, 1.0)


def test_a_body_is_compared_with_the_person_of_its_own_height():
    shares = person_of_shares(human18(1.62, 80.0))
    ratios = length_ratios(human18(1.62, 80.0), shares)
    np.testing.assert_allclose(list(ratios.values()), 1, atol=1e-6)


def seen(moved_m, joint="ankle_left"):
    marks = BODY.with_pose(STANDING).landmarks
    found = [{mark.name: at.copy() for mark, at in zip(BODY.landmarks, marks, strict=True)} for _ in moved_m]
    for each, offset in zip(found, moved_m, strict=True):
        each[joint] += [0, offset, 0]
    return found


def check_seen(found):
    frames = range(10, 10 + len(found))
    return check_joints(BODY, [STANDING] * len(found), found, weights={"head": 0.1}, frames=frames, look=in_cam2)


def test_a_joint_far_from_its_clicks_is_refused_with_its_worst_frame():
    with pytest.raises(
        BodyError, match=r"ankle_left 8\d mm .*clicks of ankle_left, above all in frame 12, first in cam2"
    ):
        check_seen(seen([0.08, 0.08, 0.1, 0.08, 0.08]))


def test_one_bad_click_is_warned_of_and_points_near_a_landmark_are_not_checked():
    assert check_seen(seen([0, 0, 0, 0.125, 0])) == [
        "ankle_left lies 125 mm from the fitted body's in frame 13; check its click, first in cam2 (ankle)"
    ]
    assert check_seen(seen([0.2] * 5, joint="head")) == []


def test_unknown_joints_are_not_checked():
    assert check_seen([{}, *seen([0.0])]) == []


def test_the_camera_that_stands_out_is_named():
    distance_px = np.full((3, 2, 3), 4.0)
    distance_px[:, 1, 2] = 12
    clicks = Clicks(("a", "b", "c"), ("hip_left", "heel_left"), distance_px, ())
    assert clicks.camera_to_check(["foot"]) == (
        ", first in c, where they lie 12 px from where the cameras agree (in the others 4 px)"
    )
    assert clicks.camera_to_check(["hip"]) == clicks.camera_to_check(["wrist"]) == ""
