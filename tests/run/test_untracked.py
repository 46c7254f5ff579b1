"""A run of a body of which no frame is tracked: the mix-up that would explain it is named, and nothing else is."""

from contextlib import nullcontext
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
import pytest

from airborne.body.shaping import with_size
from airborne.cameras import Rig
from airborne.run import untracked
from airborne.run.mix_ups import MixUp, _silhouette, find_undecided_mix_ups, possible_mix_ups
from airborne.run.moving_mix_ups import MovingSilhouettes
from airborne.run.untracked import explain_by_silhouettes, explain_untracked
from airborne.tracking.methods import Settings
from airborne.video import VideoFacts
from tests.support.scenes import CAMERAS, CROSS, Scene

SCENE = Scene(cameras=CAMERAS[:3])
RIG = Rig(tuple(SCENE.cameras))
NAMES = RIG.names


@pytest.fixture(autouse=True)
def nothing_stands_out(monkeypatch):
    """At the start of these recordings, of which nothing else is read."""
    monkeypatch.setattr(untracked, "start_foregrounds", lambda recording: nullcontext([None] * len(recording.rig)))


@dataclass
class Played:
    """A recording of the scene's first frames, some of its videos mixed up."""

    mix_up: MixUp | None
    rig: Rig = RIG
    facts: tuple[VideoFacts, ...] = ()

    def __iter__(self):
        frames = (SCENE.frames(index) for index in range(6))
        return (frames if self.mix_up is None else (self.mix_up.undo(each) for each in frames)).__iter__()


def explained(mix_up, start=None):
    return explain_untracked(Settings(), CROSS, start or SCENE.start(), Played(mix_up)).sentence


@pytest.mark.parametrize("mix_up", [MixUp((0, 1)), MixUp((2,))])
def test_a_mix_up_is_named(mix_up):
    said = explained(mix_up)
    assert said == mix_up.finding(NAMES, f"with {mix_up.describe(NAMES)}, 5 of the first 5 frames are tracked").sentence


def test_of_a_wrong_start_it_is_said_what_was_tried():
    said = explained(None, SCENE.start().move([0.8, 0.5, 0.0], [0.0, 0.0, 2.0]))
    assert said.endswith(
        "with videos exchanged or mirrored, nor with one camera left out, nor with another size of the body: are "
        "[start], the body and the calibration right, and does nothing stand between the cameras and the body?"
    )


@dataclass
class OfFields:
    """A recording of the scene by fields, the upper ones of which are first."""

    facts: tuple[VideoFacts, ...]
    events: list[str]
    rig: Rig = RIG

    def __iter__(self):
        is_wrong = self.facts[0].fields == "bottom-first"
        for index in range(16):
            yield replace(SCENE.frames(index), views=SCENE.frames(index ^ 1 if is_wrong else index).views)


@pytest.mark.parametrize("fields", ["top-first", "bottom-first"])
def test_fields_in_the_wrong_order_are_named(fields):
    facts = VideoFacts((160, 120), Fraction(25), None, "progressive", fields, 0)
    why = explain_untracked(Settings(), CROSS, SCENE.start(), OfFields((facts,) * 3, []))
    assert ("fields of each picture in the other order" in why.sentence) == (fields == "bottom-first")
    assert why.is_mix_up == (fields == "bottom-first")


def test_a_camera_that_was_moved_is_named():
    class Moved(Played):
        def __iter__(self):
            for frames in super().__iter__():
                views = [replace(view, image=np.roll(view.rgb, 25, axis=1)) for view in frames.views[1:2]]
                yield replace(frames, views=(frames.views[0], *views, frames.views[2]))

    why = explain_untracked(Settings(), CROSS, SCENE.start(), Moved(None))
    assert why.sentence.startswith(f"without {NAMES[1]}, 5 of the first 5 frames are tracked") and not why.is_mix_up


def test_a_body_that_is_too_large_is_named():
    why = explain_untracked(Settings(), with_size(CROSS, 1.2), SCENE.start(), Played(None))
    assert why.sentence.startswith("with a body 10% smaller") and not why.is_mix_up


def test_of_frames_that_are_tracked_as_they_are_no_camera_is_named():
    why = explain_untracked(Settings(), CROSS, SCENE.start(), Played(None))
    assert why.sentence.startswith("5 of the first 5 frames are tracked when nothing but them") and not why.is_mix_up


def test_cameras_of_which_either_may_be_left_out_are_named_together():
    names, changes = ("a", "b", "c", "d"), [untracked._Change(CROSS, camera=name) for name in ("b", "d")]
    why = untracked._explain(changes, names, "4 of the first 5 frames are tracked", has_tried_mix_ups=False)
    assert why.sentence.startswith("without b or without d, 4 of the first 5 frames are tracked: was one of them moved")


def test_mix_ups_that_what_stands_out_speaks_against_are_not_tried():
    seen = [_silhouette(CROSS, SCENE.start(), camera) for camera in RIG]
    assert find_undecided_mix_ups(RIG, seen, CROSS, SCENE.start()) == []
    unseen = find_undecided_mix_ups(RIG, [None] * 3, CROSS, SCENE.start())
    assert unseen == [mix_up for mix_up in possible_mix_ups(3) if not mix_up.is_turned]
    upside_down = [seen[0], seen[1][::-1, ::-1], seen[2]]
    assert MixUp((1,), is_turned=True) in find_undecided_mix_ups(RIG, upside_down, CROSS, SCENE.start())
    exchanged = [seen[1], seen[0], seen[2]]
    assert MixUp((0, 1)) in find_undecided_mix_ups(RIG, exchanged, CROSS, SCENE.start())


def test_an_exchange_is_tried_where_each_image_agrees_with_both_silhouettes():
    seen = [_silhouette(CROSS, SCENE.start(), camera) for camera in RIG]
    is_in = np.indices(seen[0].shape).sum(axis=0) % 4 > 0  # three of four pixels
    alike = [seen[0] & is_in | seen[1], seen[1] & is_in | seen[0], seen[2]]
    assert find_undecided_mix_ups(RIG, alike, CROSS, SCENE.start()) == [MixUp((0, 1))]
    right = [seen[0] | seen[1] & is_in, seen[1] | seen[0] & is_in, seen[2]]
    assert find_undecided_mix_ups(RIG, right, CROSS, SCENE.start()) == []


def test_what_is_undone_both_ways_round_is_as_before():
    for mix_up in possible_mix_ups(len(NAMES)):
        once = mix_up.undo(SCENE.frames(0))
        twice = replace(mix_up, cameras=mix_up.cameras[::-1]).undo(once)
        for before, between, after in zip(SCENE.frames(0).views, once.views, twice.views, strict=True):
            assert (before.rgb == after.rgb).all() and before.camera is between.camera is after.camera
        changed = [i for i, view in enumerate(once.views) if (view.rgb != SCENE.frames(0).views[i].rgb).any()]
        assert tuple(changed) == tuple(sorted(mix_up.cameras))


def test_a_mix_up_with_a_camera_without_an_image_is_not_undone():
    dark = Scene(cameras=CAMERAS[:3], is_dark=lambda index, name: name == NAMES[0]).frames(0)
    undone = [mix_up.undo(dark) is not None for mix_up in possible_mix_ups(len(NAMES))]
    assert undone == [0 not in mix_up.cameras for mix_up in possible_mix_ups(len(NAMES))]


def test_what_moves_explains_it_before_anything_is_tracked_anew():
    mix_up = explain_by_silhouettes(MovingSilhouettes(0.5, ("those without cam2 can",), "cam1 is mirrored"))
    assert mix_up == ("cam1 is mirrored", True, True)
    assert explain_by_silhouettes(MovingSilhouettes(0.5, ("those without cam2 can",))) == (
        "those without cam2 can",
        False,
        True,
    )
    assert explain_by_silhouettes(MovingSilhouettes(0.05)) is None
