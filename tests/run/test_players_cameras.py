"""Cameras of players that are wrong, in their times or their place: named at the end of a run; right ones are not."""

import re
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.run.players_cameras import CameraCheck
from airborne.tracking.capsules import Blocker
from airborne.tracking.players import StepTracker
from tests.support.jumping_scenes import CAMERAS, Hall, hop

HALL, NAMES, N = Hall({"anna": hop()}), ("cam0", "cam1", "cam2"), 46


drawn = lru_cache(4)(HALL.frames)  # a frame is asked for by each camera


def turned(camera, angle_deg):
    turn = RigidTransform.from_rotation(Rotation.from_rotvec([0, np.radians(angle_deg), 0]))
    return replace(camera, camera_from_world=turn * camera.camera_from_world)


def described(ahead, cameras=3, names=NAMES, n=N, turn_deg=(0, 0, 0)):
    """What is said of a run whose cameras' images come from so many frames ahead of their times."""
    tracker, check = StepTracker(Blocker(HALL.starts())), CameraCheck()
    state, believed = tracker.init(), [turned(CAMERAS[i], turn_deg[i]) for i in range(cameras)]
    for index in range(2, n):
        views = [replace(drawn(index + ahead[i]).views[i], camera=each) for i, each in enumerate(believed)]
        frames = replace(drawn(index), views=tuple(views))
        step = tracker.search(state, frames)
        check.add(frames, step)
        state = tracker.learn(state, frames, step)
    return check.describe(names[:cameras])


def test_right_times_are_not_accused():
    assert described((0, 0, 0)) == []


@pytest.mark.parametrize(
    ("ahead", "camera", "direction"),
    [((0, 1, 0), "cam1", "later"), ((0, 0, -1), "cam2", "earlier"), ((1, 0, 0), "cam0", "later")],
)
def test_the_camera_that_is_a_frame_off_is_named(ahead, camera, direction):
    (said,) = described(ahead)
    assert said.startswith(f"self-check: {camera} shows the players {direction} than its times say")
    assert "`airborne sync`" in said and " ms" not in said  # tracking hides most of it, so no size is named


@pytest.mark.parametrize("i", [0, 2])
def test_a_camera_that_was_turned_is_named(i):
    said = described((0, 0, 0), turn_deg=[2 if k == i else 0 for k in range(3)])
    [(camera, px)] = [
        re.findall(r"self-check: (\w+) shows the players (\d+) px left of where", each)[0] for each in said
    ]
    assert camera == NAMES[i] and float(px) == pytest.approx(600 * np.tan(np.radians(2)), abs=4)


def test_of_one_camera_or_of_few_frames_nothing_is_said():
    assert described((1, 0, 0), cameras=1) == []
    assert described((0, 1, 0), n=10) == []
