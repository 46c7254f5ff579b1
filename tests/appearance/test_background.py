"""The empty scene is learned from what the body does not cover."""

import numpy as np
import pytest

from airborne.appearance.background import START_SD, TILE_PX, BackgroundModel, FirstImage, inpaint
from tests.support.tolerances import sampled

SINGLE = 1e-4  # float32, of grey levels in the hundreds
SHAPE = (40, 60)
NOWHERE = np.zeros(SHAPE, bool)


def images(n, sd, mean=120.0, seed=0):
    rng = np.random.default_rng(seed)
    return np.clip(np.rint(rng.normal(mean, sd, (n, *SHAPE, 3))), 0, 255).astype(np.uint8)


def learn(observed, covered=NOWHERE):
    """What is known of the background after some images."""
    model = BackgroundModel()
    for rgb in observed:
        model = model.learn(rgb, covered, (0, 0))
    return model.crop((0, 0), SHAPE)


@pytest.mark.parametrize("n", [1, 2, 7, 20])
def test_mean_is_the_mean_of_the_images(n):
    observed = images(n, 12.0)
    model = learn(observed)
    np.testing.assert_allclose(model.mean, observed.mean(axis=0), atol=SINGLE)
    np.testing.assert_array_equal(model.n_observations, n)


def test_first_observation_leaves_the_sd_at_its_start():
    np.testing.assert_array_equal(learn(images(1, 12.0)).sd, START_SD)


def test_sd_is_that_of_each_image_about_the_mean_before_it():
    observed = images(15, 12.0).astype(float)
    squares = [np.square(observed[i] - observed[:i].mean(axis=0)).mean(axis=-1) for i in range(1, 15)]
    expected = np.sqrt((START_SD**2 + np.sum(squares, axis=0)) / 15)
    np.testing.assert_allclose(learn(observed.astype(np.uint8)).sd, expected, rtol=SINGLE)


def test_sd_of_many_images_is_that_of_their_noise():
    sd, rate = 9.0, 0.05
    model = learn(images(120, sd))
    of_the_mean = rate / (2 - rate)  # the mean follows the last images, so it fluctuates
    expected = (sd**2 + 1 / 12) * (1 + of_the_mean)  # pixels are whole numbers
    np.testing.assert_allclose(np.mean(model.sd.astype(float) ** 2) / expected, 1, atol=sampled(SHAPE[0] * SHAPE[1]))


def test_sd_of_a_still_image_stops_at_two_grey_levels():
    np.testing.assert_allclose(learn(images(1, 0.0).repeat(200, axis=0)).sd, 2.0, rtol=SINGLE)


def test_slow_change_of_light_is_followed():
    levels = np.linspace(100, 160, 300)
    model = learn(np.broadcast_to(levels[:, None, None, None], (300, *SHAPE, 3)).astype(np.uint8))
    assert np.all(np.abs(model.mean - levels[-1]) < 6)


def test_covered_pixels_are_not_learned():
    covered = NOWHERE.copy()
    covered[10:20, 15:30] = True
    model = learn(images(3, 12.0), covered)
    assert np.all(model.n_observations[covered] == 0)
    assert np.all(model.mean[covered] == 0)
    assert np.all(model.n_observations[~covered] == 3)


def test_number_of_observations_does_not_overflow():
    model = learn(images(1, 0.0).repeat(260, axis=0))
    np.testing.assert_array_equal(model.n_observations, 250)


def test_a_region_is_learned_where_it_lies_and_nowhere_else():
    rng, corner, size = np.random.default_rng(2), (100, 117), (150, 161)  # over six tiles
    image = rng.integers(0, 256, (*size, 3)).astype(np.uint8)
    model = BackgroundModel().learn(image, np.zeros(size, bool), corner)
    np.testing.assert_array_equal(model.crop(corner, size).mean, image)
    around = model.crop((corner[0] - 40, corner[1] - 30), (size[0] + 60, size[1] + 80))
    np.testing.assert_array_equal(around.mean[30:180, 40:201], image)
    assert np.count_nonzero(around.n_observations) == size[0] * size[1]
    assert np.all(around.sd == START_SD)
    np.testing.assert_array_equal(model.crop((110, 130), (20, 30)).mean, image[13:33, 10:40])


def test_learning_leaves_the_model_as_it_was_and_shares_what_it_did_not_touch():
    whole = np.full((300, 400, 3), 90, np.uint8)
    first = BackgroundModel().learn(whole, np.zeros((300, 400), bool), (0, 0))
    later = first.learn(whole[:40, :50] + 20, np.zeros((40, 50), bool), (10, 20))
    assert np.all(first.crop((0, 0), (300, 400)).mean == 90)
    assert np.all(first.crop((0, 0), (300, 400)).n_observations == 1)
    assert np.all(later.crop((10, 20), (40, 50)).mean == 100)
    assert np.all(later.crop((10, 20), (40, 50)).n_observations == 2)
    assert {at for at in first.tiles if later.tiles[at] is not first.tiles[at]} == {(0, 0)}


def test_inpainting_keeps_observed_pixels_and_grows_them_into_the_rest():
    rng = np.random.default_rng(3)
    mean = rng.uniform(50, 200, (*SHAPE, 3)).astype(np.float32)
    n_observations = np.ones(SHAPE, np.uint8)
    n_observations[10:25, 20:45] = 0
    out = np.full((*SHAPE, 3), np.nan, np.float32)
    assert inpaint(np.where(n_observations[..., None] > 0, mean, -1000).astype(np.float32), n_observations, out)
    np.testing.assert_array_equal(out[n_observations > 0], mean[n_observations > 0])
    assert np.isfinite(out).all()
    assert out.min() >= mean.min()
    assert out.max() <= mean.max()


def test_inpainted_pixel_is_the_mean_of_its_observed_neighbours():
    mean = np.zeros((*SHAPE, 3), np.float32)
    n_observations = np.ones(SHAPE, np.uint8)
    n_observations[5:8, 5:8] = 0
    mean[4, 4:9] = 90.0
    out = np.empty_like(mean)
    inpaint(mean, n_observations, out)
    np.testing.assert_allclose(out[5, 6], 90.0, atol=SINGLE)  # three observed pixels above it, and no other
    np.testing.assert_allclose(out[5, 5], 90.0 * 3 / 5, atol=SINGLE)
    np.testing.assert_allclose(out[7, 6], 0.0, atol=SINGLE)
    np.testing.assert_allclose(out[6, 6], (2 * 54 + 90) / 8, atol=SINGLE)  # the second ring


def test_one_observed_pixel_fills_the_image():
    mean, n_observations = np.zeros((*SHAPE, 3), np.float32), np.zeros(SHAPE, np.uint8)
    mean[39, 59], n_observations[39, 59] = (10, 20, 30), 1
    out = np.empty_like(mean)
    assert inpaint(mean, n_observations, out)
    np.testing.assert_allclose(out, np.broadcast_to([10, 20, 30], out.shape), atol=SINGLE)


def test_inpainting_from_no_observation_returns_false():
    mean = np.zeros((*SHAPE, 3), np.float32)
    assert not inpaint(mean, np.zeros(SHAPE, np.uint8), np.empty_like(mean))
    assert inpaint(mean, np.ones(SHAPE, np.uint8), np.empty_like(mean))


def test_a_whole_first_image_is_learned_where_it_is_asked_for_and_says_the_same():
    rng = np.random.default_rng(4)
    whole, covered = rng.integers(0, 255, (300, 400, 3)).astype(np.uint8), rng.random((300, 400)) < 0.2
    at_once, lazy = BackgroundModel().learn(whole, covered, (0, 0)), BackgroundModel(first=FirstImage(whole, covered))
    region, corner = rng.integers(0, 255, (40, 50, 3)).astype(np.uint8), (230, 240)
    nothing = np.zeros(region.shape[:2], bool)
    for model in (lazy.learn(region, nothing, corner), lazy):
        eager = at_once if model is lazy else at_once.learn(region, nothing, corner)
        for own, other in zip(model.crop((200, 200), (100, 200)), eager.crop((200, 200), (100, 200)), strict=True):
            np.testing.assert_array_equal(own, other)
    assert lazy.first is not None and set(lazy.first.tiles) == {(1, 1), (1, 2), (1, 3), (2, 1), (2, 2), (2, 3)}
    assert lazy.first.tile((2, 3))[300 - 2 * TILE_PX :, :, 4].max() == 0  # below the image nothing is known
