from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.cameras import Rig, camera_looking_at, read_rig
from airborne.errors import VideoError
from airborne.sync import offsets_by_motion
from airborne.sync.silhouettes import Silhouettes, refuse_lost_images, silhouettes_of, smooth_at, solve_shifts
from airborne.video import VideoSource
from tests.support.clips import numbered, plain_rig, write_clip
from tests.support.places import THROWN_CROSS
from tests.support.tolerances import ROUNDTRIP

PLACES = ((-3.0, -5.0, 1.5), (3.0, -4.5, 2.0), (0.3, -1.0, 6.0))
RIG = Rig(
    tuple(
        camera_looking_at(f"cam{i}", place, (0, 0, 1.4), focal_px=700.0, size=(640, 480))
        for i, place in enumerate(PLACES)
    )
)
CORNERS = np.random.default_rng(2).uniform(-0.3, 0.3, (12, 3))
PERIOD_S = 0.02
THROWN = THROWN_CROSS


def silhouettes_at(camera, late_s, n=40, noise=0.0, seed=0):
    """Silhouettes of a tumbling thing of 12 corners; image k is taken at late_s + k periods, and says k periods."""
    rng = np.random.default_rng(seed)
    times = late_s + np.arange(n) * PERIOD_S
    hulls = []
    for t in times:
        place = np.array([0.9 * t - 0.4, 0.2 * t, 1 + 3.6 * t - 4.9 * t**2]) + rng.normal(0, noise, 3)
        points = Rotation.from_rotvec(np.array([5, 2, 1.0]) * t).apply(CORNERS) + place
        rays = points - camera.centre
        hulls.append(rays / np.linalg.norm(rays, axis=1, keepdims=True))
    return Silhouettes(camera, np.arange(n) * PERIOD_S, tuple(hulls), PERIOD_S)


@pytest.mark.parametrize("late_s", [(0, 0, 0), (0, 0.06, -0.04), (0, 0.0133, 0.0071), (0, -0.251, 0.18)])
def test_shifts_are_found_to_a_fraction_of_a_millisecond(late_s):
    offset_s, sd_s = solve_shifts([silhouettes_at(camera, late) for camera, late in zip(RIG, late_s, strict=True)], 0.5)
    assert np.allclose(offset_s, late_s, atol=3e-4)
    assert sd_s[0] == 0
    assert np.all(sd_s[1:] < 1e-3)


def test_errors_lie_within_the_stated_sds():
    late_s, misses = (0, 0.013, -0.027), []
    for seed in range(16):
        views = [
            silhouettes_at(c, late, noise=0.004, seed=10 * seed + i)
            for i, (c, late) in enumerate(zip(RIG, late_s, strict=True))
        ]
        offset_s, sd_s = solve_shifts(views, 0.1)
        misses += list((offset_s - late_s)[1:] / sd_s[1:])
    assert 0.5 < np.sqrt(np.mean(np.square(misses))) < 1.7


@pytest.mark.parametrize("n_lost", [0, 1, 3])
def test_a_video_that_lacks_images_in_the_middle_is_named(n_lost):
    views = [silhouettes_at(camera, 0.0, noise=0.002, seed=i) for i, camera in enumerate(RIG)]
    kept = [k for k in range(40) if not 14 <= k < 14 + n_lost]
    times, hulls = views[1].time_s[: len(kept)], tuple(views[1].hulls[k] for k in kept)
    views[1] = replace(views[1], time_s=times, hulls=hulls)
    offset_s, _ = solve_shifts(views, 0.3)
    if n_lost < 2:
        refuse_lost_images(views, offset_s)
        return
    with pytest.raises(VideoError, match=rf"cam1: before 0\.\d+ s or so, .* {n_lost} images earlier than after it"):
        refuse_lost_images(views, offset_s)


@pytest.fixture(scope="module")
def thrown():
    """The example's cross as its three cameras see it move."""
    rig = read_rig(THROWN / "calib_true.toml")
    return [
        silhouettes_of(VideoSource(camera.name, THROWN / f"{camera.name}.mp4", "top-first"), camera) for camera in rig
    ]


def starting(each: Silhouettes, first: int) -> Silhouettes:
    """The same camera, started `first` images later."""
    return replace(each, time_s=each.time_s[first:] - each.time_s[first], hulls=each.hulls[first:])


def test_cameras_in_time_are_found_to_be(thrown):
    offset_s, sd_s = solve_shifts(thrown, 0.3)
    assert np.all(np.abs(offset_s) < 1e-3)
    assert np.all(sd_s < 1e-3)


@pytest.mark.parametrize("fields", [(0, 3, 0), (0, 0, 5), (0, 2, 7), (4, 0, 1)])
def test_two_cameras_started_whole_fields_late_are_found_exactly(thrown, fields):
    offset_s, _ = solve_shifts([starting(each, n) for each, n in zip(thrown, fields, strict=True)], 0.3)
    assert (np.round(offset_s / PERIOD_S)).tolist() == [n - fields[0] for n in fields]
    assert np.all(np.abs(offset_s / PERIOD_S - np.round(offset_s / PERIOD_S)) < 0.1)


def test_smoothing_keeps_parabolas_whatever_the_moment():
    t = np.arange(20) * 0.02
    values = np.stack([1 + 2 * t - 3 * t**2, t], axis=1)
    wanted = np.linspace(0.05, 0.33, 17)
    expected = np.stack([1 + 2 * wanted - 3 * wanted**2, wanted], axis=1)
    assert np.allclose(smooth_at(t, values, wanted, 0.02), expected, atol=ROUNDTRIP)
    assert np.isnan(smooth_at(t, values, np.array([-0.1, 0.5]), 0.02)).all()


def test_a_camera_before_which_nothing_moves_is_named(tmp_path):
    sources = [VideoSource(name, write_clip(tmp_path / f"{name}.mkv", numbered(1) * 12)) for name in ("a", "b")]
    with pytest.raises(VideoError, match="nothing is seen to move in a, b"):
        offsets_by_motion(sources, plain_rig("a", "b"))


def test_cameras_that_never_saw_the_same_are_not_given_an_offset():
    first, second = silhouettes_at(RIG.cameras[0], 0, n=12), silhouettes_at(RIG.cameras[1], 0, n=12)
    gone = replace(second, time_s=second.time_s + 100.0)
    _, sd_s = solve_shifts([first, gone], 0.2)
    assert np.isinf(sd_s[1])
