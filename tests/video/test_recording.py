import threading
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from airborne.cameras import Rig
from airborne.video import Recording, VideoSource, open_recording
from airborne.video import recording as recording_module
from airborne.video.checks import describe_fields
from airborne.video.undistortion import undistortion_of
from tests.support.clips import SIZE, numbered, numbers_of, packets_of, plain_rig, textured, with_noise, write_clip


def clip(path: Path, n: int, rate: int = 50) -> Path:
    return write_clip(path, numbered(n), rate=Fraction(rate))


def recording(*paths: Path, offsets=(0, 0, 0), **options) -> Recording:
    names = [f"cam{i + 1}" for i in range(len(paths))]
    sources = [VideoSource(*each) for each in zip(names, paths, ["progressive"] * 3, offsets, strict=False)]
    return open_recording(sources, plain_rig(*names), **options)


def test_cameras_run_side_by_side_with_exact_times(tmp_path):
    trial = recording(clip(tmp_path / "a.mkv", 12), clip(tmp_path / "b.mkv", 12))
    frames = list(trial)
    assert [numbers_of(f.views) for f in frames] == [[k, k] for k in range(12)]
    assert [f.index for f in frames] == list(range(12))
    assert [f.time_s for f in frames] == [Fraction(k, 50) for k in range(12)]
    assert (trial.rate, trial.n_frames, trial.events) == (50, 12, [])
    assert all(view.camera.name == name for view, name in zip(frames[0].views, ["cam1", "cam2"], strict=True))


def test_views_are_in_the_rigs_order_whatever_the_order_of_the_sources(tmp_path):
    short, long = clip(tmp_path / "a.mkv", 3), clip(tmp_path / "b.mkv", 5)
    trial = open_recording([VideoSource("cam2", long), VideoSource("cam1", short)], plain_rig("cam1", "cam2"))
    assert [source.name for source in trial.sources] == ["cam1", "cam2"]
    assert numbers_of(list(trial)[-1].views) == [None, 4]


def test_a_shift_of_whole_images_pairs_other_numbers(tmp_path):
    paths = clip(tmp_path / "a.mkv", 8), clip(tmp_path / "b.mkv", 8)
    later = [numbers_of(f.views) for f in recording(*paths, offsets=(0, 0.04))]
    assert later == [[0, None], [1, None], *([k, k - 2] for k in range(2, 8)), [None, 6], [None, 7]]
    earlier = [numbers_of(f.views) for f in recording(*paths, offsets=(0, -0.04))]
    assert earlier == [*([k, k + 2] for k in range(6)), [6, None], [7, None]]


@pytest.mark.parametrize("offset_s", [0.009, -0.009, 0.01, Fraction(-1, 100)])
def test_within_half_a_period_each_image_is_used_once(tmp_path, offset_s):
    frames = recording(clip(tmp_path / "a.mkv", 6), clip(tmp_path / "b.mkv", 6), offsets=(0, offset_s))
    seconds = [numbers_of(f.views)[1] for f in frames]
    seen = [number for number in seconds if number is not None]
    assert seen == sorted(set(seen))
    assert len(seen) >= 5
    assert None not in seconds[1:5]


def test_the_clocks_own_offset_moves_the_trials_times(tmp_path):
    frames = list(recording(clip(tmp_path / "a.mkv", 3), clip(tmp_path / "b.mkv", 3), offsets=(0.5, 0.5)))
    assert [f.time_s for f in frames] == [Fraction(k, 50) + Fraction(1, 2) for k in range(3)]
    assert [numbers_of(f.views) for f in frames] == [[k, k] for k in range(3)]


def test_a_slower_camera_is_empty_in_between(tmp_path):
    frames = recording(clip(tmp_path / "a.mkv", 6, 50), clip(tmp_path / "b.mkv", 3, 25))
    assert [numbers_of(f.views)[1] for f in frames] == [0, None, 1, None, 2, None]


def test_a_faster_camera_gives_the_images_at_the_clocks_times(tmp_path):
    frames = recording(clip(tmp_path / "a.mkv", 3, 25), clip(tmp_path / "b.mkv", 6, 50))
    assert [numbers_of(f.views) for f in frames] == [[0, 0], [1, 2], [2, 4]]


def test_when_one_camera_ends_early_the_others_go_on(tmp_path):
    for first, second in ((4, 7), (7, 4)):
        frames = recording(clip(tmp_path / "a.mkv", first), clip(tmp_path / "b.mkv", second))
        whole = list(range(7)), [0, 1, 2, 3, None, None, None]
        expected = whole if first == 7 else whole[::-1]
        assert [numbers_of(f.views) for f in frames] == [list(pair) for pair in zip(*expected, strict=True)]
        assert frames.n_frames == 7


def test_start_stop_and_every_choose_among_the_same_frames(tmp_path):
    paths = clip(tmp_path / "a.mkv", 20), clip(tmp_path / "b.mkv", 20)
    every = list(recording(*paths))
    trial = recording(*paths, start=3, stop=16, every=4)
    chosen = list(trial)
    assert [f.index for f in chosen] == [3, 7, 11, 15]
    assert (trial.n_frames, trial.rate) == (4, Fraction(50, 4))
    for f in chosen:
        assert f.time_s == every[f.index].time_s
        assert np.array_equal(f.views[1].rgb, every[f.index].views[1].rgb)


def test_a_recording_can_be_read_twice(tmp_path):
    trial = recording(clip(tmp_path / "a.mkv", 4), clip(tmp_path / "b.mkv", 4))
    assert [numbers_of(f.views) for f in trial] == [numbers_of(f.views) for f in trial]


def test_lenses_are_straightened_once_for_all_readings_and_anew_for_other_cameras(tmp_path, monkeypatch):
    trial, made = recording(clip(tmp_path / "a.mkv", 4), clip(tmp_path / "b.mkv", 4)), []
    monkeypatch.setattr(
        recording_module, "undistortion_of", lambda camera: made.append(camera) or undistortion_of(camera)
    )
    list(trial)
    list(replace(trial, start=2))
    assert len(made) == 2
    moved = replace(trial.rig["cam1"], K=trial.rig["cam1"].K * [[2], [2], [1]])
    other = replace(trial, rig=Rig((moved, trial.rig["cam2"])))
    assert next(iter(other)).views[0].camera.K[0, 0] == moved.K[0, 0]
    assert len(made) == 3


@pytest.fixture
def noisy(tmp_path):
    """A clip whose images are all different and never repeat each other."""
    return write_clip(
        tmp_path / "clean.mp4",
        textured(30),
        codec="libx264",
        pix_fmt="yuv420p",
        options={"g": "15", "keyint_min": "15", "sc_threshold": "0", "bf": "0"},
    )


@pytest.mark.parametrize("damaged_first", [True, False])
def test_a_broken_image_is_an_empty_view_and_an_event(noisy, tmp_path, damaged_first):
    broken = with_noise(noisy, tmp_path / "broken.mp4", packets_of(noisy)[12])
    trial = recording(*((broken, noisy) if damaged_first else (noisy, broken)))
    frames = list(trial)
    views = list(zip(*(f.views for f in frames), strict=True))
    damaged, whole = views if damaged_first else views[::-1]
    assert [k for k, view in enumerate(damaged) if view is None] == [12]
    assert None not in whole
    assert [f.time_s for f in frames] == [Fraction(k, 50) for k in range(30)]
    name = "cam1" if damaged_first else "cam2"
    assert len(trial.events) == 1
    assert trial.events[0].startswith(f"{name}: no image from 0.240 s to 0.260 s")


def test_many_gaps_of_a_camera_are_one_event_that_asks_for_the_frame_rate(noisy, tmp_path):
    packets = packets_of(noisy)
    broken = noisy
    for number, name in zip((5, 12, 20), "abc", strict=True):
        broken = with_noise(broken, tmp_path / f"{name}.mp4", packets[number])
    trial = recording(broken, noisy)
    assert len(list(trial)) == len(list(trial)) == 30
    (event,) = trial.events
    assert event.startswith("cam1: no image at 3 times, first from 0.100 s to 0.120 s, for 0.020 s at most")
    assert "the frame rate varies" in event


@pytest.mark.parametrize("damaged_first", [True, False])
def test_images_left_out_of_a_file_are_empty_views(tmp_path, damaged_first):
    kept = [k for k in range(12) if k not in (4, 5, 9)]
    gaps = write_clip(tmp_path / "gaps.mkv", [numbered(12)[k] for k in kept], stamps=kept)
    whole = clip(tmp_path / "whole.mkv", 12)
    trial = recording(*((gaps, whole) if damaged_first else (whole, gaps)))
    seen = [numbers_of(f.views)[0 if damaged_first else 1] for f in trial]
    assert seen == [k if k in kept else None for k in range(12)]
    (event,) = trial.events
    assert "from 0.080 s to 0.120 s and from 0.180 s to 0.200 s" in event


def test_a_file_cut_off_in_the_middle_gives_what_it_holds_and_an_event(noisy, tmp_path):
    cut = tmp_path / "cut.mp4"
    place = packets_of(noisy)[20][0]
    cut.write_bytes(noisy.read_bytes()[:place])
    trial = recording(noisy, cut)
    frames = list(trial)
    assert [k for k, f in enumerate(frames) if f.views[1] is None] == list(range(20, 30))
    assert trial.events == ["cam2: the images end at 0.400 s; the file promises 0.600 s"]


def test_other_field_orders_than_the_files_flags_are_an_event_not_an_error(tmp_path):
    path = clip(tmp_path / "a.mkv", 4, 25)
    trial = open_recording([VideoSource("cam1", path, "top-first")], plain_rig("cam1"))
    assert trial.events == ["cam1: read as top-first, though the file's flags say progressive"]
    assert len(list(trial)) == 8
    combs = (
        "read as progressive, though the file's flags say bottom-first; if moving edges look like combs, write fields ="
    )
    order = replace(trial.facts[0], fields="progressive", flagged_order="bottom-first")
    assert f'cam1: {combs} "bottom-first"' in list(describe_fields(trial.sources, (order,)))
    assert open_recording([VideoSource("cam1", path, "auto")], plain_rig("cam1")).events == [
        "cam1: the file's flags say progressive"
    ]


def test_leaving_early_ends_the_threads(tmp_path):
    n_before = threading.active_count()
    frames = iter(recording(clip(tmp_path / "a.mkv", 40), clip(tmp_path / "b.mkv", 40)))
    next(frames)
    assert threading.active_count() > n_before
    frames.close()
    assert threading.active_count() == n_before


def test_each_frame_is_decoded_once(tmp_path, monkeypatch):
    import airborne.video.decoding as decoding

    decoded = []
    intact_frames = decoding.intact_frames

    def counting(*args, **options):
        for stamp, frame in intact_frames(*args, **options):
            decoded.append(stamp)
            yield stamp, frame

    trial = recording(clip(tmp_path / "a.mkv", 25))
    monkeypatch.setattr(decoding, "intact_frames", counting)
    assert len(list(trial)) == 25
    assert decoded == sorted(set(decoded))
    assert len(decoded) == 25


def test_memory_stays_flat_over_a_long_recording(tmp_path):
    def resident_mb() -> float:
        return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 1e6

    if not Path("/proc/self/statm").exists():
        pytest.skip("this system does not tell a process's memory")
    size = (640, 480)
    path = write_clip(tmp_path / "a.mp4", numbered(100, size) * 2, codec="mpeg4", pix_fmt="yuv420p")
    trial = open_recording([VideoSource("cam1", path)], plain_rig("cam1", size=size))
    at = {}
    for f in trial:
        if f.index in (40, 190):
            at[f.index] = resident_mb()
    one_image_mb = 640 * 480 * 3 / 1e6
    assert at[190] - at[40] < 30 * one_image_mb  # 150 images lie between


def test_a_real_interlaced_recording_gives_fields_at_their_own_times(thrown_cross):
    names = ("cam1", "cam2", "cam3")
    sources = [VideoSource(name, thrown_cross / f"{name}.mp4", "auto") for name in names]
    trial = open_recording(sources, plain_rig(*names, size=(768, 576)), stop=5)
    frames = list(trial)
    assert [f.time_s for f in frames] == [Fraction(k, 50) for k in range(5)]
    assert all(view.rgb.shape == (288, 768, 3) for f in frames for view in f.views)
    assert frames[0].views[0].camera.size == (768, 288)
    assert trial.n_frames == 5
    assert open_recording(sources, plain_rig(*names, size=(768, 576))).n_frames == 34


def test_the_size_of_clips_is_the_plain_cameras():
    assert plain_rig("cam1")["cam1"].size == SIZE
