"""Pictures are kept within a number of bytes, whatever is looked at, and what is damaged is no picture."""

from concurrent.futures import ThreadPoolExecutor, wait
from itertools import count

import cv2
import numpy as np
import pytest

from airborne.errors import VideoError
from airborne.studio import image_lists
from airborne.studio.image_lists import read_or_list
from airborne.studio.pictures import Pictures, _Store
from airborne.trial.cameras import CameraTable
from airborne.video import VideoSource
from tests.support.clips import numbered, write_clip


def test_the_store_forgets_what_was_asked_for_longest_ago():
    store = _Store(most_bytes=100)
    source = VideoSource("a", "unused")
    for number in range(4):
        store.add((source, number, 1), bytes(40))
        store.find((source, 0, 1))
    assert [store.find((source, number, 1))[0] for number in range(4)] == [True, False, False, True]
    store.add((source, 0, 1), None)  # damaged: known, and no bytes
    assert store.find((source, 0, 1)) == (True, None)


@pytest.fixture
def source(tmp_path):
    return VideoSource("a", write_clip(tmp_path / "a.mkv", numbered(30)))


def test_pictures_of_any_number_come_as_jpeg(source, tmp_path):
    pictures = Pictures(tmp_path)
    for number in (0, 29, 3, 4, 5, 0):
        image = cv2.imdecode(np.frombuffer(pictures.jpeg(source, number), np.uint8), cv2.IMREAD_COLOR)
        assert image[5, 5].tolist() == pytest.approx([2 * number] * 3, abs=2)


def test_a_picture_may_be_smaller_and_shows_the_same(source, tmp_path):
    pictures = Pictures(tmp_path)
    for shrink in (1, 2, 4):
        image = cv2.imdecode(np.frombuffer(pictures.jpeg(source, 7, shrink), np.uint8), cv2.IMREAD_COLOR)
        assert image.shape == (48 // shrink, 64 // shrink, 3)
        assert image[5, 5].tolist() == pytest.approx([14] * 3, abs=2)


def test_a_picture_that_nobody_waits_for_is_not_decoded(source, tmp_path):
    with pytest.raises(VideoError, match="nobody waits for image 20"):
        Pictures(tmp_path).jpeg(source, 20, is_wanted=lambda: False)


def test_a_key_frame_comes_while_another_image_is_decoded_from_it(tmp_path):
    path = write_clip(
        tmp_path / "a.mp4",
        numbered(30),
        codec="libx264",
        pix_fmt="yuv420p",
        options={"g": "30", "bf": "0", "sc_threshold": "0"},
    )
    pictures, source, asked, jpegs = Pictures(tmp_path), VideoSource("a", path), count(), []

    def is_wanted():
        n = next(asked)
        if n in (0, 5):  # before anything is decoded, and on the way: the file is held by this thread
            jpegs.append(others.submit(pictures.jpeg, source, 0, {0: 2, 5: 4}[n]))
        if n == 5:
            wait(jpegs, timeout=20)
        return True

    with ThreadPoolExecutor(2) as others:
        pictures.jpeg(source, 20, is_wanted=is_wanted)
        assert [each.done() for each in jpegs] == [True, True] and all(each.result() for each in jpegs)


def test_a_trial_is_shown_with_its_sizes_and_clock(source, tmp_path):
    tables = (CameraTable(name="a", video="a.mkv"), CameraTable(name="b", video="a.mkv", offset_s=0.1))
    shown = Pictures(tmp_path).show(
        tables, lambda table: VideoSource(table.name, tmp_path / table.video, offset_s=table.offset_s)
    )
    assert shown.sizes == {"a": (64, 48), "b": (64, 48)}
    assert len(shown.clock) == 35
    assert shown.clock.images[7].tolist() == [7, 2]
    assert shown.clock.images[34].tolist() == [-1, 29]


def test_a_list_of_images_is_read_off_a_file_once_and_anew_when_the_file_is_another(source, tmp_path, monkeypatch):
    first = read_or_list(tmp_path, source)
    monkeypatch.setattr(image_lists, "index_images", lambda source: pytest.fail("listed again"))
    again = read_or_list(tmp_path, source)
    assert np.array_equal(first.ticks, again.ticks) and np.array_equal(first.keys, again.keys)
    assert (first.first, first.tick_s, first.facts) == (again.first, again.tick_s, again.facts)
    monkeypatch.undo()
    kept = next((tmp_path / image_lists.LISTS).glob("*.npz"))
    kept.write_bytes(kept.read_bytes()[:200])
    assert len(read_or_list(tmp_path, source)) == 30  # what was torn is listed again
    write_clip(source.path, numbered(12))
    assert len(read_or_list(tmp_path, source)) == 12
