import os
import signal
import subprocess
import sys
import textwrap
from fractions import Fraction

import av
import numpy as np
import pytest

from airborne.errors import VideoError
from airborne.video import VideoSource, VideoWriter, inspect, open_recording
from tests.support.clips import plain_rig


def ramp(width, height):
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    return np.stack([60 + x, 200 - y, 90 + 0 * x], -1).astype(np.uint8)


def read(path, size):
    return list(open_recording([VideoSource("cam1", path, "auto")], plain_rig("cam1", size=size)))


def test_images_and_rate_survive_writing(tmp_path):
    with VideoWriter(tmp_path / "a.mp4", size=(64, 48), rate=Fraction(60000, 1001), crf=4) as writer:
        for k in range(20):
            writer.write(np.roll(ramp(64, 48), k, axis=0))
    frames = read(tmp_path / "a.mp4", (64, 48))
    assert [f.time_s for f in frames] == [k * Fraction(1001, 60000) for k in range(20)]
    error = frames[7].views[0].rgb.astype(float) - np.roll(ramp(64, 48), 7, axis=0)
    assert np.abs(error).mean() < 2


def test_odd_sizes_are_made_even_by_repeating_the_edge(tmp_path):
    with VideoWriter(tmp_path / "a.mp4", size=(63, 47), rate=Fraction(25), crf=4) as writer:
        writer.write(ramp(63, 47))
    rgb = read(tmp_path / "a.mp4", (64, 48))[0].views[0].rgb
    assert np.abs(rgb[:47, :63].astype(float) - ramp(63, 47)).mean() < 2
    assert np.abs(rgb[47].astype(int) - rgb[46]).mean() < 3


@pytest.mark.parametrize(("fields", "tag"), [("progressive", False), ("top-first", True), ("bottom-first", True)])
def test_the_file_is_flagged_as_written(tmp_path, fields, tag):
    path = tmp_path / "a.mp4"
    with VideoWriter(path, size=(64, 48), rate=Fraction(25), fields=fields) as writer:
        writer.write(ramp(64, 48))
    assert inspect(VideoSource("cam1", path, "auto")).flagged_order == fields
    with av.open(path) as container:
        frame = next(container.decode(video=0))
        assert frame.interlaced_frame is tag
        assert (frame.colorspace, frame.color_range) == (6, 1)  # BT.601, limited


def test_an_image_of_another_size_is_refused_with_both_sizes(tmp_path):
    with (
        VideoWriter(tmp_path / "a.mp4", size=(64, 48), rate=Fraction(25)) as writer,
        pytest.raises(VideoError, match="24×64×3 was given, expected 48×64×3"),
    ):
        writer.write(ramp(64, 24))


def test_heights_that_cannot_hold_two_fields_are_refused(tmp_path):
    with pytest.raises(VideoError, match="multiple of 4, found 46"):
        VideoWriter(tmp_path / "a.mp4", size=(64, 46), rate=Fraction(25), fields="top-first")


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(VideoError, match="cannot be written"):
        VideoWriter(tmp_path / "no" / "a.mp4", size=(64, 48), rate=Fraction(25))


def test_after_an_error_the_file_holds_what_was_written(tmp_path):
    with pytest.raises(ZeroDivisionError), VideoWriter(tmp_path / "a.mp4", size=(64, 48), rate=Fraction(25)) as writer:
        for _ in range(7):
            writer.write(ramp(64, 48))
        raise ZeroDivisionError
    assert len(read(tmp_path / "a.mp4", (64, 48))) == 7


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="this system kills in another way")
def test_what_a_killed_run_left_can_be_played(tmp_path):
    script = f"""
        import os, signal
        from fractions import Fraction
        import numpy as np
        from airborne.video import VideoWriter
        with VideoWriter({str(tmp_path / "a.mp4")!r}, size=(64, 48), rate=Fraction(25)) as writer:
            for k in range(150):
                writer.write(np.full((48, 64, 3), k, np.uint8))
            os.kill(os.getpid(), signal.SIGKILL)
    """
    run = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], env=os.environ, check=False)
    assert run.returncode == -signal.SIGKILL
    frames = [f.views[0].rgb.mean() for f in read(tmp_path / "a.mp4", (64, 48)) if f.views[0]]
    assert len(frames) >= 50
    assert np.allclose(frames, np.arange(len(frames)), atol=2)


@pytest.mark.parametrize("fields", ["progressive", "top-first"])
def test_colours_stay_where_they_are(tmp_path, fields):
    """A red spot as bright as what surrounds it, which only the chroma planes show."""
    y, x = np.mgrid[:240, :320]
    spot = np.exp(-((x - 150.3) ** 2 + (y - 120.0) ** 2) / 72)
    image = np.rint(90 + spot[..., None] * [90, -46, 0]).astype(np.uint8)
    with VideoWriter(tmp_path / "spot.mp4", size=(320, 240), rate=Fraction(25), fields=fields, crf=5) as writer:
        writer.write(image)
    for frames in read(tmp_path / "spot.mp4", (320, 240)):
        rgb = frames.views[0].rgb
        red = np.maximum(rgb[..., 0].astype(float) - rgb[..., 1] - 8, 0)
        assert abs(np.average(np.broadcast_to(np.arange(320), red.shape), weights=red) - 150.3) < 0.1
