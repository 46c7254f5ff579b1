from fractions import Fraction

import numpy as np
import pytest

from airborne.errors import VideoError
from airborne.sync import offsets_by_flash
from airborne.sync.flash import brightness_of, flashes_of, pair_times
from airborne.video import VideoSource
from tests.support.clips import write_clip
from tests.support.tolerances import EXACT

MOMENTS_S = np.array([0.61, 1.47, 3.02])


def film(path, late_s, *, rate=50, seed=0, n_s=4.0, moments=MOMENTS_S, slow=0.0):
    """Film flashes of 30 ms in a room whose light wavers; the camera starts late_s after time 0."""
    rng = np.random.default_rng(seed)
    times = late_s + np.arange(round(n_s * rate)) / rate * (1 + slow)
    lit = np.any((times[:, None] >= moments) & (times[:, None] < moments + 0.03), axis=1)
    levels = 90 + 3 * np.sin(2 * times) + rng.normal(0, 0.3, len(times)) + 80 * lit
    return VideoSource(
        path.stem, write_clip(path, [np.full((48, 64, 3), v, np.uint8) for v in levels], rate=Fraction(rate))
    )


def test_flashes_bring_cameras_together_within_an_image(tmp_path):
    sources = [film(tmp_path / "a.mkv", 0.0), film(tmp_path / "b.mkv", 0.213, seed=1)]
    found = offsets_by_flash(sources)
    assert found.names == ("a", "b")
    assert (found.offset_s[0], found.offset_sd_s[0]) == (0, 0)
    assert abs(found.offset_s[1] - 0.213) < 0.02
    assert 0.002 < found.offset_sd_s[1] < 0.02


def test_the_stated_sd_holds_over_many_starts(tmp_path):
    first, misses = film(tmp_path / "a.mkv", 0.0, n_s=2), []
    for seed in range(12):
        late_s = float(np.random.default_rng(seed).uniform(-0.3, 0.3))
        found = offsets_by_flash([first, film(tmp_path / "b.mkv", late_s, n_s=2)])
        misses.append((found.offset_s[1] - late_s) / found.offset_sd_s[1])
    assert np.sqrt(np.mean(np.square(misses))) < 1.6
    assert np.max(np.abs(misses)) < 3


def test_cameras_of_other_rates_are_brought_together_too(tmp_path):
    sources = [film(tmp_path / "a.mkv", 0.0, rate=50), film(tmp_path / "b.mkv", -0.1, rate=120)]
    assert abs(offsets_by_flash(sources).offset_s[1] + 0.1) < 0.015


def test_a_slow_clock_shows_as_drift(tmp_path):
    moments = np.cumsum(np.random.default_rng(0).uniform(0.5, 2.5, 12))
    sources = [
        film(tmp_path / "a.mkv", 0.0, n_s=20, moments=moments),
        film(tmp_path / "b.mkv", 0.1, n_s=20, moments=moments, slow=1e-3),
    ]
    found = offsets_by_flash(sources, with_drift=True)
    assert abs(found.drift[1] - 1e-3) < 3 * found.drift_sd[1] < 2e-3
    assert abs(found.offset_s[1] - 0.1) < 3 * found.offset_sd_s[1]


def test_a_camera_that_saw_no_flash_is_named(tmp_path):
    dark = film(tmp_path / "dark.mkv", 0.0, moments=np.zeros(0))
    with pytest.raises(VideoError, match="no flash seen by dark"):
        offsets_by_flash([film(tmp_path / "a.mkv", 0.0), dark])


def test_a_wavering_light_is_no_flash(tmp_path):
    assert len(flashes_of(brightness_of(film(tmp_path / "a.mkv", 0.0, moments=np.zeros(0))))[0]) == 0


def test_a_flash_that_one_camera_missed_does_not_spoil_the_pairs():
    pairs = pair_times(np.array([1.0, 2.2, 5.0]), np.array([0.9, 4.9]), 0.02)
    assert pairs.tolist() == [[0, 0], [2, 1]]
    assert pair_times(np.array([1.0]), np.array([4.0]), 0.02).tolist() == [[0, 0]]


def test_without_drift_one_flash_says_as_much_as_its_two_images(tmp_path):
    sources = [film(tmp_path / f"{n}.mkv", 0.0, moments=MOMENTS_S[:1], n_s=1.5) for n in "ab"]
    found = offsets_by_flash(sources)
    assert found.offset_s[1] == 0
    assert abs(found.offset_sd_s[1] - 0.02 / np.sqrt(12) * np.sqrt(2)) < EXACT
