from fractions import Fraction

import av
import cv2
import numpy as np
import pytest

from airborne.video import VideoSource, VideoWriter, inspect
from airborne.video.decoding import decode, rgb_from_decoded
from tests.support.clips import SIZE, numbered, packets_of, textured, with_noise, write_clip

NTSC = Fraction(60000, 1001)


def read(path, fields="progressive"):
    source = VideoSource("cam1", path, fields)
    facts = inspect(source)
    return facts, list(decode(source, facts))


def half(packet):
    place, n_bytes, *rest = packet
    return (place + n_bytes // 2, n_bytes - n_bytes // 2, *rest)


@pytest.mark.parametrize("name", ["a.mp4", "a.mkv", "a.avi"])
def test_5994_images_a_second_stay_60000_over_1001(tmp_path, name):
    codec, pix_fmt = ("ffv1", "bgr0") if name != "a.mp4" else ("libx264", "yuv420p")
    path = write_clip(tmp_path / name, numbered(40), rate=NTSC, codec=codec, pix_fmt=pix_fmt)
    facts, seen = read(path)
    assert facts.frame_rate == NTSC
    assert [picture.time_s for picture in seen] == [k / NTSC for k in range(40)]
    assert round(facts.duration_s * NTSC) == 40


def test_a_file_of_varying_rate_keeps_its_own_stamps(tmp_path):
    stamps = [0, 3000, 6100, 9500, 12900, 15000]
    path = write_clip(
        tmp_path / "a.mp4",
        numbered(6),
        rate=Fraction(30),
        codec="libx264",
        pix_fmt="yuv420p",
        stamps=stamps,
        time_base=Fraction(1, 90000),
    )
    assert [picture.time_s * 90000 for picture in read(path)[1]] == stamps


@pytest.mark.parametrize(("step", "rate"), [(1, 600), (12, 50)])
def test_an_avi_that_counts_time_finely_has_the_rate_of_its_pictures(tmp_path, step, rate):
    path = write_clip(
        tmp_path / "a.avi",
        numbered(8),
        rate=Fraction(600),
        codec="mjpeg",
        pix_fmt="yuvj420p",
        stamps=range(0, 8 * step, step),
        time_base=Fraction(1, 600),
    )
    facts, seen = read(path)
    assert facts.frame_rate == rate
    assert [picture.time_s for picture in seen] == [Fraction(k, rate) for k in range(8)]


@pytest.mark.parametrize("missing", [(5, 9), (2,), (3, 4, 5, 6)])
@pytest.mark.parametrize("rate", [Fraction(25), Fraction(30000, 1001)])
def test_pictures_that_are_missing_change_neither_the_rate_nor_the_times_of_fields(tmp_path, missing, rate):
    shown = [k for k in range(17) if k not in missing]
    path = write_clip(
        *(tmp_path / "a.mp4", numbered(len(shown))),
        **{"rate": rate, "codec": "libx264", "pix_fmt": "yuv420p", "stamps": shown, "time_base": 1 / rate},
    )
    source = VideoSource("cam1", path, "top-first")
    facts = inspect(source)
    assert facts.frame_rate == rate
    assert [field.time_s for field in decode(source, facts)] == [
        (k + j / Fraction(2)) / rate for k in shown for j in (0, 1)
    ]


def test_pictures_at_uneven_steps_have_their_mean_rate(tmp_path):
    stamps = [0, 3000, 6100, 9000, 15200, 18000]
    path = write_clip(
        *(tmp_path / "a.mp4", numbered(6)),
        **{"rate": Fraction(30), "codec": "libx264", "pix_fmt": "yuv420p", "stamps": stamps},
        time_base=Fraction(1, 90000),
    )
    assert read(path)[0].frame_rate == pytest.approx(6 * 90000 / 21000, rel=0.2)
    assert read(path)[0].frame_rate != 30


@pytest.mark.parametrize("name", ["a.mkv", "a.ts"])
def test_times_start_at_the_first_image(tmp_path, name):
    codec = "libx264" if name.endswith("ts") else "ffv1"
    path = write_clip(
        tmp_path / name,
        numbered(5),
        rate=Fraction(25),
        codec=codec,
        pix_fmt="bgr0" if codec == "ffv1" else "yuv420p",
        stamps=range(50, 55),
    )
    with av.open(path) as container:
        assert container.streams.video[0].start_time > 0
    facts, seen = read(path)
    assert [picture.time_s for picture in seen] == [Fraction(k, 25) for k in range(5)]
    assert facts.duration_s is not None and abs(facts.duration_s - Fraction(5, 25)) <= Fraction(1, 25)


def test_images_stored_out_of_order_come_in_order(tmp_path):
    path = write_clip(
        tmp_path / "a.mp4", numbered(30), codec="libx264", pix_fmt="yuv444p", options={"bf": "3", "b-adapt": "0"}
    )
    stamps = [stamp for *_, stamp, _ in packets_of(path)]
    assert stamps != sorted(stamps)
    facts, seen = read(path)
    levels = [rgb_from_decoded(picture, facts)[5, 5, 0] for picture in seen]
    assert np.allclose(levels, 2 * np.arange(30), atol=1)


@pytest.mark.parametrize(("fields", "parities"), [("top-first", [0, 1]), ("bottom-first", [1, 0])])
def test_flags_tell_the_field_order_and_fields_have_their_own_times(tmp_path, fields, parities):
    with VideoWriter(tmp_path / "a.mp4", size=SIZE, rate=Fraction(25), fields=fields) as writer:
        for image in numbered(4):
            writer.write(image)
    facts, seen = read(tmp_path / "a.mp4", "auto")
    assert facts.flagged_order == facts.fields == fields
    assert facts.image_rate == 50
    assert [picture.time_s for picture in seen] == [Fraction(j, 50) for j in range(8)]
    assert [picture.parity for picture in seen] == parities * 4


@pytest.mark.parametrize("rotation_deg", [90, 180, -90])
def test_a_phones_rotation_is_applied_as_other_readers_do(tmp_path, rotation_deg):
    picture = np.zeros((48, 64, 3), np.uint8)
    picture[:12, :20] = [200, 60, 30]
    path = write_clip(tmp_path / "a.mp4", [picture] * 3, codec="libx264", pix_fmt="yuv444p", rotation_deg=rotation_deg)
    facts, seen = read(path)
    ours = rgb_from_decoded(seen[0], facts)
    reader = cv2.VideoCapture(str(path))
    theirs = reader.read()[1][..., ::-1]
    reader.release()
    assert ours.shape == theirs.shape == (*facts.size[::-1], 3)
    assert np.abs(ours.astype(int) - theirs).max() <= 4


def test_after_a_damaged_key_frame_nothing_is_shown_up_to_the_next(tmp_path):
    clean = write_clip(
        tmp_path / "a.mp4",
        textured(40),
        codec="libx264",
        pix_fmt="yuv420p",
        options={"g": "10", "keyint_min": "10", "sc_threshold": "0", "bf": "0"},
    )
    packets = packets_of(clean)
    assert [k for k, packet in enumerate(packets) if packet[3]] == [0, 10, 20, 30]
    damaged = with_noise(clean, tmp_path / "b.mp4", half(packets[20]))
    shown = [round(picture.time_s * 50) for picture in read(damaged)[1]]
    assert shown == [*range(20), *range(30, 40)]


def test_a_damaged_beginning_does_not_move_the_clock(tmp_path):
    clean = write_clip(
        tmp_path / "a.mp4",
        textured(20),
        codec="libx264",
        pix_fmt="yuv420p",
        options={"g": "5", "keyint_min": "5", "sc_threshold": "0", "bf": "0"},
    )
    damaged = with_noise(clean, tmp_path / "b.mp4", half(packets_of(clean)[0]))
    assert [round(picture.time_s * 50) for picture in read(damaged)[1]] == [*range(5, 20)]
