"""A body with another person's colours is named; its own in another light are not."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.motion import Motion
from airborne.run.wrong_colours import find_wrong_colours
from airborne.tracking import Estimate, Status
from tests.support.people import HUMAN, person
from tests.support.scenes import CROSS, Scene

SCENE = person()
COLOURS = np.array([part.colour for part in HUMAN.parts])
FRAMES = [SCENE.frames(index) for index in (0, 2)]


def run_of(status=Status.TRACKED):
    posed = {"covariance": np.eye(HUMAN.n_dofs) * 1e-5, "score": 5.0, "n_views": 3}
    return Motion.collect(
        [
            Estimate(index=each.index, time_s=each.time_s, status=status, pose=SCENE.motion(each.time_s), **posed)
            for each in FRAMES
        ],
        tuple(segment.name for segment in HUMAN.segments[1:]),
    )


@pytest.mark.parametrize("brightness", [0.8, 1.0])
def test_a_persons_own_colours_are_taken_without_a_word(brightness):
    assert find_wrong_colours(HUMAN.with_colours(brightness * COLOURS), run_of(), FRAMES) == []


@pytest.mark.parametrize("colours", [255 - COLOURS, COLOURS[::-1]])
def test_other_colours_are_named_where_frames_are_tracked(colours):
    other = HUMAN.with_colours(colours)
    (sentence,) = find_wrong_colours(other, run_of(), FRAMES)
    assert sentence.startswith("the body's colours lie") and "airborne fit-body" in sentence
    assert find_wrong_colours(other, run_of(Status.UNCERTAIN), FRAMES) == find_wrong_colours(other, run_of(), []) == []


def test_colours_that_are_not_known_yet_say_nothing():
    first = replace(HUMAN.segments[0], parts=tuple(replace(part, colour=None) for part in HUMAN.segments[0].parts))
    assert find_wrong_colours(replace(HUMAN, segments=(first, *HUMAN.segments[1:])), run_of(), FRAMES) == []


def thrown_cross():
    scene = Scene()
    frames = [scene.frames(index) for index in (0, 4)]
    posed = {"status": Status.TRACKED, "covariance": np.eye(6) * 1e-5, "score": 5.0, "n_views": 4}
    seen = [Estimate(index=f.index, time_s=f.time_s, pose=scene.start(f.index), **posed) for f in frames]
    return Motion.collect(seen), frames


def test_a_thing_with_the_colours_of_another_is_named():
    motion, frames = thrown_cross()
    own = np.array([part.colour for part in CROSS.parts])
    assert find_wrong_colours(CROSS, motion, frames) == []
    (sentence,) = find_wrong_colours(CROSS.with_colours(own[:, ::-1]), motion, frames)
    assert "red and blue exchanged" in sentence and "fit-body" not in sentence


def test_a_part_in_the_shade_is_not_taken_for_another_colour():
    motion, frames = thrown_cross()
    own = np.array([part.colour for part in CROSS.parts])
    lit = own * np.array([[0.6], [1.15], [1.15]])
    assert find_wrong_colours(CROSS.with_colours(np.clip(lit, 0, 255)), motion, frames) == []
