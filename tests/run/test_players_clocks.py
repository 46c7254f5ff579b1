"""Cameras of players whose times are wrong: named at the end of a run, with the direction, and right ones are not."""

from dataclasses import replace

import pytest

from airborne.run.players_clocks import ClockCheck
from airborne.tracking.capsules import Blocker
from airborne.tracking.players import StepTracker
from tests.support.jumping_scenes import Hall, hop

HALL, NAMES, N = Hall({"anna": hop()}), ("cam0", "cam1", "cam2"), 46


def described(ahead, cameras=3, names=NAMES, n=N):
    """What is said of a run whose cameras' images come from so many frames ahead of their times."""
    tracker, check = StepTracker(Blocker(HALL.starts())), ClockCheck()
    state = tracker.init()
    for index in range(2, n):
        views = tuple(HALL.frames(index + ahead[i]).views[i] for i in range(cameras))
        frames = replace(HALL.frames(index), views=views)
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
    assert said.startswith(f"self-check: {camera} shows the players ")
    assert said.endswith(f" ms or more {direction} than its times say; `airborne sync` finds by how much")


def test_of_one_camera_or_of_few_frames_nothing_is_said():
    assert described((1, 0, 0), cameras=1) == []
    assert described((0, 1, 0), n=10) == []
