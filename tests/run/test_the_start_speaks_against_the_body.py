"""Landmarks of a start that say that the body is too small, or its sides exchanged: none of its frames is tracked."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.cameras import Rig
from airborne.motion import Motion
from airborne.run.self_check import check_run, look_unlike
from airborne.tracking import Status
from airborne.tracking.first_pose import FirstPose
from airborne.tracking.first_pose.body_size import WrongSize
from airborne.tracking.self_check.kept_frames import KeptFrames
from tests.support.scenes import CROSS, Scene, thrown, track

SMALL, CROSSED = WrongSize(0.12, 0.03), "start.joints_m: left and right look exchanged"


@pytest.fixture(scope="module")
def checked():
    scene, kept = Scene(motion=thrown), KeptFrames()
    indices = range(12)
    for index in indices:
        kept.add(scene.frames(index))
    run = Motion.collect(track(scene, indices))

    def check(n_doubtful=0, *, score=run.score, n_views=run.n_views, **said):
        status = np.where(np.arange(len(run)) < len(run) - n_doubtful, run.status, Status.UNCERTAIN.value)
        first = FirstPose(run.pose(0), **said)
        seen = replace(run, status=status, score=score, n_views=n_views)
        return check_run(seen, CROSS, Rig(scene.cameras), kept, is_preset=False, first=first)

    return check


def test_a_good_start_leaves_the_frames_tracked(checked):
    found = checked()
    assert found.motion.count(Status.TRACKED) > 9 and not found.is_start_wrong


def test_of_a_body_of_another_size_no_frame_is_tracked_and_the_size_is_the_landmarks_one(checked):
    found = checked(wrong_size=SMALL)
    assert found.is_start_wrong and found.motion.count(Status.TRACKED) == 0
    assert found.findings[0] == SMALL.to_dict()
    assert [each["subject"] for each in found.findings if each["kind"] == "scale"].count("body") == 1
    assert any("not as large as the landmarks" in each for each in found.doubts)


def test_of_exchanged_sides_no_frame_is_tracked(checked):
    found = checked(exchange=CROSSED)
    assert found.motion.count(Status.TRACKED) == 0
    assert any(CROSSED in each for each in found.doubts)


@pytest.mark.parametrize(("n_doubtful", "is_believed"), [(1, True), (6, False)])
def test_a_start_that_may_face_the_other_way_is_believed_until_tracking_doubts_frames(checked, n_doubtful, is_believed):
    found = checked(n_doubtful, ambiguity="start.points_px: fit as well")
    assert (found.motion.count(Status.TRACKED) > 0) is is_believed
    assert any("left and right may be exchanged" in each for each in found.doubts) is not is_believed


def test_first_frames_that_look_unlike_later_ones_and_such_of_fewer_cameras_are_uncertain(
    checked,
):
    scores = np.array([12.0, 11.0, *[5.0] * 5, 12.0, 12.0, *[5.0] * 3])
    found = checked(score=scores, n_views=np.r_[[3] * 8, 1, [3] * 3])
    assert np.flatnonzero(found.motion.status != Status.TRACKED.value).tolist() == [0, 1, 8]
    assert any("fewer cameras see the body there" in each for each in found.doubts)


def test_of_scores_that_are_not_known_nothing_is_said():
    assert not look_unlike(np.full(3, np.nan)).any()
