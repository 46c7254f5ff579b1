"""The empty scene is learned from what the body does not cover."""

import numpy as np
import pytest

from airborne.appearance.background import START_SD, Plate, fill, look
from tests.support.tolerances import sampled

SINGLE = 1e-4  # float32, of grey levels in the hundreds
SHAPE = (40, 60)
NOWHERE = np.zeros(SHAPE, bool)


def pictures(n, sd, mean=120.0, seed=0):
    rng = np.random.default_rng(seed)
    return np.clip(np.rint(rng.normal(mean, sd, (n, *SHAPE, 3))), 0, 255).astype(np.uint8)


def learned(seen, covered=NOWHERE):
    plate = Plate(*SHAPE)
    for rgb in seen:
        look(rgb, covered, plate.mean, plate.sd, plate.looks)
    return plate


@pytest.mark.parametrize("n", [1, 2, 7, 20])
def test_mean_is_the_mean_of_the_pictures(n):
    seen = pictures(n, 12.0)
    plate = learned(seen)
    np.testing.assert_allclose(plate.mean, seen.mean(axis=0), atol=SINGLE)
    np.testing.assert_array_equal(plate.looks, n)


def test_first_look_leaves_the_spread_it_starts_with():
    np.testing.assert_array_equal(learned(pictures(1, 12.0)).sd, START_SD)


def test_spread_is_that_of_each_picture_about_the_mean_before_it():
    seen = pictures(15, 12.0).astype(float)
    squares = [np.square(seen[i] - seen[:i].mean(axis=0)).mean(axis=-1) for i in range(1, 15)]
    expected = np.sqrt((START_SD**2 + np.sum(squares, axis=0)) / 15)
    np.testing.assert_allclose(learned(seen.astype(np.uint8)).sd, expected, rtol=SINGLE)


def test_spread_of_many_pictures_is_that_of_their_noise():
    sd, rate = 9.0, 0.05
    plate = learned(pictures(120, sd))
    of_the_mean = rate / (2 - rate)  # the mean follows the last pictures, so it wanders
    expected = (sd**2 + 1 / 12) * (1 + of_the_mean)  # pixels are whole numbers
    np.testing.assert_allclose(np.mean(plate.sd.astype(float) ** 2) / expected, 1, atol=sampled(SHAPE[0] * SHAPE[1]))


def test_still_picture_never_gets_certain_beyond_two_grey_levels():
    np.testing.assert_allclose(learned(pictures(1, 0.0).repeat(200, axis=0)).sd, 2.0, rtol=SINGLE)


def test_slow_change_of_light_is_followed():
    levels = np.linspace(100, 160, 300)
    plate = learned(np.broadcast_to(levels[:, None, None, None], (300, *SHAPE, 3)).astype(np.uint8))
    assert np.all(np.abs(plate.mean - levels[-1]) < 6)


def test_covered_pixels_are_not_learned():
    covered = NOWHERE.copy()
    covered[10:20, 15:30] = True
    plate = learned(pictures(3, 12.0), covered)
    assert np.all(plate.looks[covered] == 0)
    assert np.all(plate.mean[covered] == 0)
    assert np.all(plate.looks[~covered] == 3)


def test_looks_do_not_run_over():
    plate = learned(pictures(1, 0.0).repeat(260, axis=0))
    np.testing.assert_array_equal(plate.looks, 250)


def test_filling_keeps_what_is_known_and_grows_it_into_the_rest():
    rng = np.random.default_rng(3)
    mean = rng.uniform(50, 200, (*SHAPE, 3)).astype(np.float32)
    looks = np.ones(SHAPE, np.uint8)
    looks[10:25, 20:45] = 0
    out = np.full((*SHAPE, 3), np.nan, np.float32)
    assert fill(np.where(looks[..., None] > 0, mean, -1000).astype(np.float32), looks, out)
    np.testing.assert_array_equal(out[looks > 0], mean[looks > 0])
    assert np.isfinite(out).all()
    assert out.min() >= mean.min()
    assert out.max() <= mean.max()


def test_filled_pixel_is_the_mean_of_its_known_neighbours():
    mean = np.zeros((*SHAPE, 3), np.float32)
    looks = np.ones(SHAPE, np.uint8)
    looks[5:8, 5:8] = 0
    mean[4, 4:9] = 90.0
    out = np.empty_like(mean)
    fill(mean, looks, out)
    np.testing.assert_allclose(out[5, 6], 90.0, atol=SINGLE)  # above it three known pixels, and no other
    np.testing.assert_allclose(out[5, 5], 90.0 * 3 / 5, atol=SINGLE)
    np.testing.assert_allclose(out[7, 6], 0.0, atol=SINGLE)
    np.testing.assert_allclose(out[6, 6], (2 * 54 + 90) / 8, atol=SINGLE)  # the second ring


def test_one_known_pixel_fills_the_picture():
    mean, looks = np.zeros((*SHAPE, 3), np.float32), np.zeros(SHAPE, np.uint8)
    mean[39, 59], looks[39, 59] = (10, 20, 30), 1
    out = np.empty_like(mean)
    assert fill(mean, looks, out)
    np.testing.assert_allclose(out, np.broadcast_to([10, 20, 30], out.shape), atol=SINGLE)


def test_filling_from_nothing_says_so():
    mean = np.zeros((*SHAPE, 3), np.float32)
    assert not fill(mean, np.zeros(SHAPE, np.uint8), np.empty_like(mean))
    assert fill(mean, np.ones(SHAPE, np.uint8), np.empty_like(mean))
