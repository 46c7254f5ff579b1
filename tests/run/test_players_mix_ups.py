"""Mix-ups of players' videos: which are exchanged and which are mirrored, at the first images."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.errors import MistakesError
from airborne.run import players_mix_ups
from airborne.run.check import check_trial
from airborne.run.mix_ups import MixUp
from airborne.run.players_mix_ups import players_mix_up_in
from airborne.run.track import track_trial
from airborne.trial.file import read_trial
from tests.support.jumping_scenes import CAMERAS, Hall, hop

NAMES = tuple(camera.name for camera in CAMERAS)
HALL = Hall({"anna": hop((0.5, 0.0)), "bea": hop((1.2, 0.0), 0.1)})


@pytest.fixture(scope="module")
def start():
    return HALL.starts(), HALL.frames(0)


@pytest.fixture(scope="module")
def alone():
    """One player's start, and the first images."""
    hall = Hall({"bea": HALL.motions["bea"]})
    return hall.starts(), hall.frames(0)


def only(frames, n):
    return replace(frames, views=frames.views[:n])


def exchange(frames, i, j):
    views = list(frames.views)
    a, b = views[i], views[j]
    views[i], views[j] = replace(a, image=b.rgb), replace(b, image=a.rgb)
    return replace(frames, views=tuple(views))


def mirror(frames, i):
    views = list(frames.views)
    views[i] = replace(views[i], image=np.ascontiguousarray(views[i].rgb[:, ::-1]))
    return replace(frames, views=tuple(views))


def found(starts, frames):
    finding = players_mix_up_in(starts, frames)
    return finding and (finding.kind, finding.cameras)


@pytest.fixture
def _looked_at_once(monkeypatch):
    """Find the mix-up in the same images once."""
    find, known = players_mix_ups.players_mix_up_in, {}

    def found(starts, first):
        key = tuple(view.rgb.tobytes() for view in first.views)
        if key not in known:
            known[key] = find(starts, first)
        return known[key]

    monkeypatch.setattr(players_mix_ups, "players_mix_up_in", found)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_videos_of_their_own_cameras_show_nothing(start, n):
    starts, first = start
    assert found(starts, only(first, n)) is None


@pytest.mark.parametrize(("n", "i", "j"), [(3, 0, 2), (3, 1, 2), (2, 0, 1)])
def test_two_exchanged_videos_are_named(alone, n, i, j):
    starts, first = alone
    frames = exchange(only(first, n), i, j)
    assert found(starts, frames) == ("swapped", (NAMES[i], NAMES[j]))


@pytest.mark.parametrize("cameras", [(0, 1, 2), (2, 1, 0)])
def test_three_videos_in_a_wrong_order_are_named(alone, cameras):
    starts, first = alone
    frames = MixUp(cameras[::-1]).undo(only(first, 3))
    assert found(starts, frames) == ("swapped", tuple(NAMES[i] for i in cameras))


@pytest.mark.parametrize(("n", "i"), [(3, 0), (3, 2), (2, 1)])
def test_a_mirrored_video_is_named(alone, n, i):
    starts, first = alone
    assert found(starts, mirror(only(first, n), i)) == ("mirrored", (NAMES[i],))


@pytest.mark.parametrize(("n", "i"), [(3, 1), (2, 0)])
def test_a_video_upside_down_is_named(alone, n, i):
    starts, first = alone
    frames = MixUp((i,), is_turned=True).undo(only(first, n))
    assert found(starts, frames) == ("turned", (NAMES[i],))


def test_a_camera_without_an_image_is_left_out(start):
    starts, first = start
    frames = exchange(first, 0, 1)
    assert found(starts, replace(frames, views=(*frames.views[:2], None))) == ("swapped", NAMES[:2])


def test_where_nobody_stands_nothing_is_said(alone):
    starts, first = alone
    empty = [replace(view, image=np.full_like(view.rgb, 128)) for view in first.views]
    assert found(starts, replace(first, views=tuple(empty))) is None


@pytest.mark.usefixtures("_looked_at_once")
def test_exchanged_files_are_refused_by_check_and_track(tmp_path):
    path = HALL.write_trial(tmp_path, 3, videos=(NAMES[1], NAMES[0], NAMES[2]))
    said = f"the videos of {NAMES[0]} and {NAMES[1]}, or their calibrations, are exchanged; exchange them back"
    (mistake,) = check_trial(path).mistakes
    assert mistake.startswith(
        f"the videos: with the images of {NAMES[0]} and {NAMES[1]} exchanged, the players at the start fit"
    )
    assert mistake.endswith(said)
    with pytest.raises(MistakesError, match=said):
        track_trial(read_trial(path), tmp_path / "run", pictures=False)


def test_files_of_their_own_cameras_are_tracked(tmp_path):
    path = HALL.write_trial(tmp_path, 3)
    assert not check_trial(path).mistakes
    assert track_trial(read_trial(path), tmp_path / "run", pictures=False).summary["n_frames"] == 3
