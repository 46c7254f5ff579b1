"""Landmarks of a start that say that the body is too small, or its sides exchanged: none of its frames is tracked."""

import pytest

from airborne.cameras import Rig
from airborne.motion import Motion
from airborne.run.self_check import check_run
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
    return lambda **said: check_run(
        run, CROSS, Rig(scene.cameras), kept, is_preset=False, first=FirstPose(run.pose(0), **said)
    )


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
