"""Pictures are kept within a number of bytes, whatever is looked at, and what is damaged is no picture."""

import os
import sys
import threading
from concurrent.futures import ThreadPoolExecutor, wait
from itertools import count
from time import monotonic, sleep

import cv2
import numpy as np
import pytest

from airborne.errors import VideoError
from airborne.studio import image_lists, prefetch
from airborne.studio.image_lists import read_or_list
from airborne.studio.jpeg_store import JpegStore, Key
from airborne.studio.pictures import Pictures
from airborne.trial.cameras import CameraTable
from airborne.video import VideoSource
from airborne.video.seeking import ImageReader
from tests.support.clips import numbered, write_clip


def test_the_store_forgets_what_was_written_longest_ago():
    store, jpegs = JpegStore(most_bytes=100), {}
    rng = np.random.default_rng(0)
    for number in range(200):
        key = Key(VideoSource("a", "unused"), int(rng.integers(9)), 1)
        jpegs[key] = None if number % 7 == 0 else rng.bytes(int(rng.integers(1, 45)))
        store.add(key, jpegs[key])
        assert store.find(key) == (True, jpegs[key])
        there = [each for each in jpegs if each in store]
        assert all(store.find(each) == (True, jpegs[each]) for each in there)
        assert sum(len(jpegs[each] or b"?") for each in there) <= 100
    assert store.is_full and 2 <= len(there) < 9
    store.add(key, bytes(101))
    assert store.find(key) == (False, None)


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


@pytest.fixture(autouse=True)
def _gives_way_to_nobody(monkeypatch):
    """Beside busy workers, threads of the least priority may stand still for minutes."""
    monkeypatch.setattr(prefetch, "_LEAST_PRIORITY", 0)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere threads have no priority of their own")
def test_what_is_made_beforehand_gives_way_to_everything_else(monkeypatch, tmp_path):
    monkeypatch.undo()
    seen = []
    monkeypatch.setattr(
        prefetch.Prefetch,
        "_wait",
        lambda self: seen.append(os.getpriority(os.PRIO_PROCESS, threading.get_native_id())) or False,
    )
    Pictures(tmp_path).prefetch.start()
    wait_until(lambda: seen)
    assert set(seen) == {19}


def wait_until(is_so):
    end = monotonic() + 60
    while not is_so() and monotonic() < end:
        sleep(0.01)
    assert is_so()


@pytest.mark.parametrize(("gop", "parities"), [(12, 1), (12, 2), (4, 1)])
def test_pictures_around_are_made_while_nobody_waits(tmp_path, gop, parities):
    coded = {"g": str(gop), "bf": "2", "sc_threshold": "0"}
    path = write_clip(tmp_path / "a.mp4", numbered(36), codec="libx264", pix_fmt="yuv420p", options=coded)
    source = VideoSource("a", path, fields="top-first" if parities == 2 else "progressive")
    pictures, plain = Pictures(tmp_path), Pictures(tmp_path)
    decoded, image_of = [], ImageReader.image
    pictures.jpeg(source, 5 * parities, 2)
    pictures.jpeg(source, 20 * parities, 1, is_passing=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ImageReader, "image", lambda *a, **k: decoded.append(a[1]) or image_of(*a, **k))
        pictures.prefetch.start()
        if gop > 8:
            wait_until(lambda: len(decoded) == 36 * parities - 1)
        sleep(0.3)
        pictures.prefetch.close()
        assert sorted(decoded) == ([n for n in range(36 * parities) if n != 5 * parities] if gop > 8 else [])
        decoded.clear()
        jpegs = [pictures.jpeg(source, number, 2) for number in range(36 * parities)]
        assert not (decoded and gop > 8)
    assert jpegs == [plain.jpeg(source, number, 2) for number in range(36 * parities)]


def test_nothing_is_made_beforehand_while_somebody_waits(tmp_path):
    path = write_clip(tmp_path / "a.mp4", numbered(30), codec="libx264", pix_fmt="yuv420p", options={"g": "30"})
    pictures, source = Pictures(tmp_path), VideoSource("a", path)
    pictures.jpeg(source, 3)
    with pictures.prefetch.waiting(Key(source, 0, 1), is_passing=False):
        pictures.prefetch.start()
        sleep(0.5)
        assert Key(source, 12, 1) not in pictures._store
    wait_until(lambda: Key(source, 29, 1) in pictures._store)
    pictures.prefetch.close()


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
