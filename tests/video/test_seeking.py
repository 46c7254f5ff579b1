"""Any image of a file in any order is the image that reading from the start gives at that place."""

from fractions import Fraction
from itertools import permutations

import numpy as np
import pytest

from airborne.errors import VideoError
from airborne.video import VideoSource, inspect, open_recording, seeking
from airborne.video.decoding import decode, rgb_from_decoded
from airborne.video.fields import fill_rows
from airborne.video.image_index import index_images, match_images
from airborne.video.seeking import ImageReader
from tests.support.clips import numbered, packets_of, plain_rig, textured, with_noise, write_clip
from tests.support.places import ROOT

CROSS = ROOT / "examples" / "thrown_cross"
IRREGULAR = [0, 3, 4, 9, 10, 11, 15, 17, 18, 30, 31, 32, 40, 44, 45, 46, 50, 58, 59, 60]


def h264(path, images, **options):
    settings = {"g": "6", "bf": "2", "crf": "10", **options.pop("options", {})}
    return write_clip(path, images, codec="libx264", pix_fmt="yuv420p", options=settings, **options)


def clips(folder):
    """Files of all the kinds that number their images differently."""
    yield VideoSource("intra", write_clip(folder / "intra.mkv", numbered(20)))
    yield VideoSource("b frames", h264(folder / "b.mp4", textured(40)))
    yield VideoSource("long groups", h264(folder / "long.mp4", textured(100), options={"g": "90", "bf": "3"}))
    yield VideoSource("open groups", h264(folder / "open.mp4", textured(40), options={"x264-params": "open-gop=1"}))
    yield VideoSource("no index", h264(folder / "b.ts", textured(40)))
    yield VideoSource("matroska", h264(folder / "b.mkv", textured(40)))
    yield VideoSource("packed", write_clip(folder / "b.avi", textured(20), codec="mpeg4", pix_fmt="yuv420p"))
    variable = {"stamps": IRREGULAR, "time_base": Fraction(1, 1000), "rate": Fraction(500)}
    yield VideoSource("variable rate", h264(folder / "variable.mp4", textured(20), **variable))
    yield VideoSource("fields", CROSS / "cam1.mp4", fields="top-first")
    yield VideoSource("rotated", h264(folder / "rotated.mp4", textured(20), rotation_deg=90))


def whole_image(image, facts):
    rgb = rgb_from_decoded(image, facts)
    return rgb if image.parity is None else fill_rows(rgb, image.parity, facts.size[1])


def times_s(index):
    numbers, unit = index.times()
    return [Fraction(int(number), unit) for number in numbers]


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    return list(clips(tmp_path_factory.mktemp("clips")))


def test_every_image_in_any_order_is_the_one_that_decoding_in_order_gives(sources, monkeypatch):
    rng = np.random.default_rng(0)
    monkeypatch.setattr(seeking, "_KEPT_BYTES", 0)  # two frames: these clips would be kept whole
    for source in sources:
        facts = inspect(source)
        images = [(image.time_s, whole_image(image, facts)) for image in decode(source, facts)]
        index = index_images(source)
        assert times_s(index) == [time_s for time_s, _ in images], source.name
        with ImageReader(source, index) as reader:
            for number in [*range(3), *rng.permutation(len(images)), len(images) - 1]:
                assert np.array_equal(reader.image(int(number)), images[number][1]), (source.name, number)


def test_steps_back_decode_nothing_again(sources):
    source = sources[0]
    index = index_images(source)
    with ImageReader(source, index) as reader:
        images = [reader.image(number) for number in range(len(index))]
        reader._step = lambda: pytest.fail("a frame is decoded again")
        for number in reversed(range(len(index))):
            assert np.array_equal(reader.image(number), images[number])


def test_an_image_that_nobody_waits_for_is_left_and_found_later(tmp_path):
    source = VideoSource("a", h264(tmp_path / "a.mp4", textured(24), options={"g": "30", "bf": "0"}))
    index = index_images(source)
    with ImageReader(source, index) as reader, ImageReader(source, index) as other:
        patience = iter([True, True, True])
        assert not reader.go_to(15, lambda: next(patience, False))
        assert reader._current is not None and 0 < reader._current[0] < index.ticks[15]
        assert np.array_equal(reader.image(15), other.image(15))


def test_a_jump_decodes_only_what_its_image_is_predicted_from(sources, monkeypatch):
    source = next(each for each in sources if each.name == "long groups")
    index = index_images(source)
    width, height = index.facts.size
    monkeypatch.setattr(seeking, "_KEPT_BYTES", 12 * width * height)  # eight frames
    with ImageReader(source, index) as reader, ImageReader(source, index) as other:
        whole = [other.image(number) for number in range(70)]
        steps = []
        step = reader._step
        reader._step = lambda: (steps.append(1), step())
        assert np.array_equal(reader.image(60), whole[60])
        assert len(steps) < 40
        patience = iter([True] * 8)
        assert not reader.go_to(40, lambda: next(patience, False))
        for number in (20, 30, 61, 62, 61, 59, 57):
            assert np.array_equal(reader.image(number), whole[number]), number
        n_steps = len(steps)
        assert np.array_equal(reader.image(55), whole[55])
        assert len(steps) == n_steps  # a step back has kept those before it


def test_the_key_frame_that_was_passed_on_the_way_is_there_without_decoding(sources):
    for source in sources[1:]:
        index = index_images(source)
        number = max(range(len(index)), key=lambda number: number - index.key_before(number))
        key = index.key_before(number)
        with ImageReader(source, index) as reader, ImageReader(source, index) as other:
            assert reader.key_image(key) is None
            reader.go_to(number)
            reader._step = lambda name=source.name: pytest.fail(f"{name}: a frame is decoded")
            assert np.array_equal(reader.key_image(key), other.image(key, is_exact=False)), source.name
            assert key == number or reader.key_image(number) is None
            reader.close()
            assert reader.key_image(key) is None


def test_a_number_that_is_not_there_is_refused(sources):
    reader = ImageReader(sources[0], index_images(sources[0]))
    with pytest.raises(VideoError, match="there is no image 20; the last is 19"):
        reader.image(20)


def test_frames_of_a_trial_with_gaps_are_those_of_a_recording(tmp_path):
    stamps = [0, 20, 40, 140, 160, 180, 200, 330, 350, 370]  # ms
    times = {"time_base": Fraction(1, 1000), "rate": Fraction(50)}
    clips = [
        write_clip(tmp_path / "a.mkv", numbered(10), stamps=stamps, **times),
        write_clip(tmp_path / "b.mkv", numbered(30, start=40), rate=Fraction(50)),
        write_clip(tmp_path / "c.mkv", numbered(1, start=80), rate=Fraction(50)),
    ]
    for order in permutations(range(3)):
        sources = [VideoSource("abc"[k], clips[k], offset_s=0.005 * k) for k in order]
        clock = match_images(sources, [index_images(source) for source in sources])
        frames = list(open_recording(sources, plain_rig(*("abc"[k] for k in order))))
        assert list(clock.times_s) == [float(each.time_s) for each in frames]
        assert (clock.images < 0).tolist() == [[view is None for view in each.views] for each in frames]


def test_frames_of_the_trial_show_the_images_that_a_recording_gives(tmp_path):
    sources = [
        VideoSource("a", write_clip(tmp_path / "a.mkv", numbered(20)), offset_s=0.02),
        VideoSource("b", write_clip(tmp_path / "b.mkv", numbered(30, start=40), rate=Fraction(60)), offset_s=-0.01),
        VideoSource("c", write_clip(tmp_path / "c.mkv", numbered(12, start=80), rate=Fraction(25)), drift_ppm=200),
    ]
    indexes = [index_images(source) for source in sources]
    clock = match_images(sources, indexes)
    frames = list(open_recording(sources, plain_rig("a", "b", "c")))
    assert list(clock.times_s) == [float(each.time_s) for each in frames]
    readers = [ImageReader(*each) for each in zip(sources, indexes, strict=True)]
    for numbers, each in zip(clock.images, frames, strict=True):
        shown = [None if n < 0 else reader.image(int(n)) for n, reader in zip(numbers, readers, strict=True)]
        for image, view in zip(shown, each.views, strict=True):
            assert (image is None) == (view is None)
            assert image is None or np.array_equal(image, view.rgb)
    for reader in readers:
        reader.close()


def test_a_damaged_image_is_none_and_its_neighbours_keep_their_numbers(tmp_path):
    whole = h264(tmp_path / "whole.mp4", textured(24), options={"bf": "0"})
    packets = packets_of(whole)
    source = VideoSource("a", with_noise(whole, tmp_path / "damaged.mp4", packets[8]))
    index = index_images(source)
    intact = {image.time_s: image for image in decode(source, index.facts)}
    with ImageReader(source, index) as reader:
        for number, time_s in enumerate(times_s(index)):
            image = reader.image(number)
            if time_s in intact and image is not None:
                assert np.array_equal(image, whole_image(intact[time_s], index.facts)), number
        assert reader.image(8) is None
        assert reader.image(20) is not None
