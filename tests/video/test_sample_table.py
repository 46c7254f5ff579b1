"""A file's own table says when each frame is shown as its packets do; where it may not, the packets are read."""

from fractions import Fraction

import av
import pytest

from airborne.video.sample_table import frames_of_packets, frames_of_table
from tests.support.clips import textured, write_clip

VARIABLE = {"stamps": [0, 3, 4, 9, 10, 30, 31, 44, 50, 60], "time_base": Fraction(1, 1000), "rate": Fraction(500)}


def read_both(path):
    """What the table and the packets of a file say."""
    with av.open(str(path)) as table, av.open(str(path)) as packets:
        by_table = frames_of_table(path, table, table.streams.video[0])
        return by_table, frames_of_packets(packets.demux(video=0))


def h264(path, n, bf, **options):
    return write_clip(path, textured(n), codec="libx264", pix_fmt="yuv420p", options={"g": "8", "bf": bf}, **options)


def remux(path, source, options):
    """Copy packets into another container."""
    with av.open(str(source)) as file, av.open(str(path), "w", options=options) as target:
        stream = target.add_stream_from_template(file.streams.video[0])
        for packet in file.demux(video=0):
            if packet.size:
                packet.stream = stream
                target.mux(packet)
    return path


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    return h264(tmp_path_factory.mktemp("clips") / "b.mp4", 200, "3")


@pytest.mark.parametrize(("name", "more"), [("b.mp4", {}), ("p.mov", {"bf": "0"}), ("variable.mp4", VARIABLE)])
def test_the_table_says_what_the_packets_do(tmp_path, name, more):
    n = len(more.get("stamps", range(200)))
    by_table, by_packets = read_both(h264(tmp_path / name, n, **{"bf": "3", **more}))
    assert by_table.tolist() == by_packets.tolist()
    assert len(by_table) == n
    assert 1 < by_table[:, 1].sum() < n


@pytest.mark.parametrize(
    ("name", "options"),
    [("b.mkv", {}), ("b.ts", {}), ("fragmented.mp4", {"movflags": "frag_keyframe+empty_moov"})],
)
def test_files_without_one_table_of_all_frames_are_left_to_their_packets(tmp_path, clip, name, options):
    by_table, by_packets = read_both(remux(tmp_path / name, clip, options))
    assert by_table is None
    assert len(by_packets) == 200


def test_a_table_of_frames_that_the_file_has_lost_is_not_believed(tmp_path, clip):
    whole = remux(tmp_path / "whole.mp4", clip, {"movflags": "faststart"})
    assert read_both(whole)[0] is not None
    (tmp_path / "torn.mp4").write_bytes(whole.read_bytes()[: -whole.stat().st_size // 4])
    assert read_both(tmp_path / "torn.mp4")[0] is None


@pytest.mark.parametrize("old", [b"stts", b"tkhd", b"stbl", b"moov"])
def test_a_damaged_table_is_left_to_the_packets(tmp_path, clip, old):
    data = clip.read_bytes()
    at = data.index(old)
    for damage in (old + b"\xff" * 12, b"free", b"\x00\x00\x00\x01"):
        (tmp_path / "damaged.mp4").write_bytes(data[:at] + damage + data[at + len(damage) :])
        try:
            by_table, by_packets = read_both(tmp_path / "damaged.mp4")
        except (av.FFmpegError, IndexError, ValueError):
            continue  # no video at all
        assert by_table is None or by_table.tolist() == by_packets.tolist()
