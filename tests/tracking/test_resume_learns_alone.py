"""A run that was broken off goes on from its estimates to the same result, bit for bit."""

import pytest

from airborne.tracking.methods import Settings, tracker_of
from tests.support.scenes import FIGURE, FPS, Scene, clutter, standing, thrown, track
from tests.support.states import assert_same, leaves

FRAMES, ABSENT = 6, 2
SCENE = Scene(
    motion=lambda time_s: None if time_s * FPS == ABSENT else thrown(time_s),
    backgrounds=tuple(clutter(seed, (220.0, 190.0, 40.0)) for seed in range(4)),
)
JOINTED = Scene(FIGURE, lambda time_s: None if time_s * FPS == ABSENT else standing(time_s))
METHODS = {
    "refined": Settings(),
    "union": Settings(method="stepping", colour="union", loops=((0.01, 0.02), (0.005, 0.01))),
    "simplex": Settings(method="simplex"),
    "joints": Settings(),
    "joints, outward": Settings(method="hierarchical"),
}


def scene(name):
    return JOINTED if name.startswith("joints") else SCENE


def tracker(name):
    return tracker_of(METHODS[name], scene(name).model, scene(name).start())


@pytest.mark.parametrize("name", METHODS)
def test_learning_the_first_frames_and_searching_on_is_searching_all(name):
    searched = track(scene(name), range(FRAMES), tracker(name))
    resumed = tracker(name)
    state = resumed.init()
    for estimate in searched[:4]:
        state = resumed.learn(state, scene(name).frames(estimate.index), estimate)
    for before in searched[4:]:
        frames = scene(name).frames(before.index)
        estimate = resumed.search(state, frames)
        assert_same(leaves(estimate), leaves(before))
        state = resumed.learn(state, frames, estimate)


@pytest.mark.parametrize("name", METHODS)
def test_searching_teaches_nothing(name):
    seeker = tracker(name)
    state = seeker.init()
    for index in range(2):
        frames = scene(name).frames(index)
        first = seeker.search(state, frames)
        assert_same(leaves(seeker.search(state, frames)), leaves(first))
        state = seeker.learn(state, frames, first)


@pytest.mark.parametrize("name", METHODS)
def test_learning_twice_from_one_state_is_learning_the_same_and_leaves_it_as_it_was(name):
    learner, known = tracker(name), scene(name)
    state = learner.init()
    for index in (0, 1, 3):
        frames = known.frames(index)
        before, estimate = leaves(state), learner.search(state, frames)
        later = learner.learn(state, frames, estimate)
        assert_same(leaves(learner.learn(state, frames, estimate)), leaves(later))
        assert_same(leaves(state), before)
        state = later
