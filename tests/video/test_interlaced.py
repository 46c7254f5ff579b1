"""Interlaced video, from scenes seen at the fields' times through weaving, files and separation."""

from fractions import Fraction

import av
import numpy as np
import pytest
from av.error import BlockingIOError as NothingYet
from av.error import EOFError as Ended
from av.filter import Graph

from airborne.video import VideoSource, VideoWriter, inspect, open_recording, weave
from airborne.video.decoding import decode
from airborne.video.pixels import field_frame, frame_from_rgb, rgb_from_frame, weave_frame
from tests.support.clips import SIZE, plain_rig, write_clip

PARITIES = {"top-first": (0, 1), "bottom-first": (1, 0)}


def moving_edge(time_s: float) -> np.ndarray:
    """A coloured gradient with an edge that moves 60 px/s to the right."""
    width, height = SIZE
    image = np.zeros((height, width, 3), np.uint8)
    image[..., 0] = np.arange(height)[:, None] * 4
    image[..., 1] = np.where(np.arange(width) < 10 + 60 * time_s, 200, 40)
    image[..., 2] = np.arange(width) * 3
    return image


def still_spot(row: float) -> np.ndarray:
    width, height = SIZE
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    spot = 220 * np.exp(-((x - 30) ** 2 + (y - row) ** 2) / (2 * 4**2))
    return np.repeat(spot.astype(np.uint8)[..., None], 3, axis=2)


def interlaced(scene, order, n_frames):
    """Weave a scene, seen at 50 fields a second, in the given order."""
    for k in range(n_frames):
        seen = {parity: scene((2 * k + j) / 50)[parity::2] for j, parity in enumerate(PARITIES[order])}
        yield weave(seen[0], seen[1])


def read(path, order, fields_as):
    return list(open_recording([VideoSource("cam1", path, order)], plain_rig("cam1"), fields_as=fields_as))


@pytest.mark.parametrize("order", PARITIES)
def test_fields_are_the_scene_at_their_own_times_and_rows(tmp_path, order):
    path = write_clip(tmp_path / "a.mkv", interlaced(moving_edge, order, 6), rate=Fraction(25))
    rows = read(path, order, "rows")
    filled = read(path, order, "interpolated")
    assert len(rows) == len(filled) == 12
    for j, (field, full) in enumerate(zip(rows, filled, strict=True)):
        parity = PARITIES[order][j % 2]
        truth = moving_edge(j / 50)
        assert field.time_s == full.time_s == Fraction(j, 50)
        assert np.array_equal(field.views[0].rgb, truth[parity::2])
        assert np.array_equal(full.views[0].rgb[parity::2], truth[parity::2])
        inside = slice(1, -1)  # the gradient down the rows is linear, so filling is exact but at the edge
        assert np.array_equal(full.views[0].rgb[inside], truth[inside])


@pytest.mark.parametrize("pix_fmt", ["yuv420p", "yuv422p", "yuv444p"])
def test_stored_rows_come_back_unchanged_whatever_the_chroma(tmp_path, pix_fmt):
    fields = [
        [frame_from_rgb(moving_edge((2 * k + p) / 50)[p::2], short_side=48, pix_fmt=pix_fmt) for p in (0, 1)]
        for k in range(4)
    ]
    path = write_clip(tmp_path / "a.mkv", [weave_frame(*pair) for pair in fields], rate=Fraction(25), pix_fmt=pix_fmt)
    seen = read(path, "top-first", "rows")
    for frames, pair in zip(zip(seen[0::2], seen[1::2], strict=True), fields, strict=True):
        for frame, field in zip(frames, pair, strict=True):
            assert np.array_equal(frame.views[0].rgb, rgb_from_frame(field, short_side=48))


@pytest.mark.parametrize("fields_as", ["rows", "interpolated"])
@pytest.mark.parametrize("row", [20.0, 23.4])
def test_a_still_scene_does_not_wobble_by_half_a_row(tmp_path, fields_as, row):
    path = write_clip(tmp_path / "a.mkv", [still_spot(row)] * 4, rate=Fraction(25))
    heights = []
    for frame in read(path, "top-first", fields_as):
        view = frame.views[0]
        weight = view.rgb[..., 0].astype(float).sum(axis=1)
        centre = (weight * np.arange(len(weight))).sum() / weight.sum()
        K = view.camera.K
        heights.append((centre - K[1, 2]) / K[1, 1])  # the slope of the ray, the same for every image
    one_row = 1 / plain_rig("cam1")["cam1"].K[1, 1]
    assert np.ptp(heights) < 0.02 * one_row
    assert abs(np.mean(heights) - (row - 23.5) * one_row) < 0.05 * one_row


def bwdif_fields(path):
    """Yield (time [s], frame) of FFmpeg's deinterlacer, one full image per field."""
    with av.open(path) as container:
        stream = container.streams.video[0]
        graph = Graph()
        deinterlace = graph.add("bwdif", mode="send_field", parity="auto")
        graph.link_nodes(graph.add_buffer(template=stream), deinterlace, graph.add("buffersink")).configure()
        for frame in [*container.decode(stream), None]:
            graph.vpush(frame)
            while True:
                try:
                    out = graph.vpull()
                except (NothingYet, Ended):
                    break
                yield out.pts * out.time_base, out


def luma(frame):
    plane = frame.planes[0]
    return np.frombuffer(plane, np.uint8).reshape(plane.height, -1)[:, : plane.width].copy()


def assert_agrees_with_bwdif(path, fields, n_fields):
    source = VideoSource("cam1", path, "auto")
    facts = inspect(source)
    assert facts.fields == fields
    ours = [(p.time_s, p.parity, luma(field_frame(p.frame, p.parity))) for p in decode(source, facts)]
    theirs = [(time_s, luma(frame)) for time_s, frame in bwdif_fields(path)]
    assert len(ours) == len(theirs) == n_fields
    for (time_s, parity, rows), (their_time_s, full) in zip(ours, theirs, strict=True):
        assert time_s == their_time_s - theirs[0][0]
        assert np.array_equal(rows, full[parity::2])


def test_times_order_and_rows_agree_with_ffmpegs_deinterlacer(thrown_cross):
    assert_agrees_with_bwdif(thrown_cross / "cam1.mp4", "top-first", 34)


@pytest.mark.parametrize("fields", PARITIES)
def test_written_fields_agree_with_ffmpegs_deinterlacer(tmp_path, fields):
    path = tmp_path / "a.mp4"
    with VideoWriter(path, size=SIZE, rate=Fraction(25), fields=fields) as writer:
        for image in interlaced(moving_edge, fields, 5):
            writer.write(image)
    assert_agrees_with_bwdif(path, fields, 10)


def test_filled_rows_are_near_the_deinterlacers_on_a_still_scene(tmp_path):
    path = tmp_path / "a.mp4"
    with VideoWriter(path, size=SIZE, rate=Fraction(25), fields="top-first", crf=1) as writer:
        for _ in range(5):
            writer.write(still_spot(20))
    filled = [frame.views[0].rgb.astype(float) for frame in read(path, "top-first", "interpolated")]
    theirs = [rgb_from_frame(frame, short_side=48).astype(float) for _, frame in bwdif_fields(path)]
    for ours, their in zip(filled[2:-2], theirs[2:-2], strict=True):
        assert np.abs(ours - their)[2:-2].max() <= 9  # half the spot's curvature, 220 / 4² / 2 levels, and coding
