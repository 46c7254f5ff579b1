"""Which pixels look like the body."""

import numpy as np
import pytest
from scipy.ndimage import correlate1d

from airborne.appearance.background import START_SD
from airborne.appearance.foreground import BINS_PER_CHANNEL, EVIDENCE_LIMIT, count_colours, posterior, posterior_sums

SINGLE = 1e-5  # float32
SHAPE = (30, 40)
BODY_RGB, OTHER_RGB = (220, 190, 40), (90, 100, 110)


def flat_image(rgb):
    return np.full((*SHAPE, 3), rgb, np.uint8)


def histogram(*probabilities):
    """A histogram from (colour, probability) pairs."""
    table = np.zeros((BINS_PER_CHANNEL, BINS_PER_CHANNEL, BINS_PER_CHANNEL), np.float32)
    for rgb, probability in probabilities:
        table[tuple(np.array(rgb) >> 3)] = probability
    return table


def probability(image, body, background, mean=None, sd=START_SD):
    """The posterior where every pixel's background has this mean, or was never observed."""
    out = np.empty(SHAPE, np.float32)
    n_observations = np.full(SHAPE, 0 if mean is None else 9, np.uint8)
    means = np.broadcast_to(0 if mean is None else mean, (*SHAPE, 3)).astype(np.float32)
    posterior(image, body, background, means, np.full(SHAPE, sd, np.float32), n_observations, out)
    return out


def test_colour_that_was_never_observed_is_even():
    nothing = histogram()
    np.testing.assert_array_equal(probability(flat_image(BODY_RGB), nothing, nothing), 0.5)


def test_posterior_is_the_share_of_the_bodys_probability():
    table = probability(flat_image(BODY_RGB), histogram((BODY_RGB, 0.3)), histogram((BODY_RGB, 0.1)))
    np.testing.assert_allclose(table, 0.75, atol=1e-4)


def test_posterior_rises_with_the_bodys_probability_and_falls_with_the_backgrounds():
    shares = np.linspace(0, 0.5, 11)
    image, half = flat_image(BODY_RGB), histogram((BODY_RGB, 0.2))
    rising = [probability(image, histogram((BODY_RGB, share)), half)[0, 0] for share in shares]
    falling = [probability(image, half, histogram((BODY_RGB, share)))[0, 0] for share in shares]
    assert np.all(np.diff(rising) > 0)
    assert np.all(np.diff(falling) < 0)


def test_body_coloured_pixel_that_agrees_with_the_background_model_is_background():
    image = flat_image(BODY_RGB)
    body, background = histogram((BODY_RGB, 0.125)), histogram((OTHER_RGB, 0.125))
    assert probability(image, body, background).min() > 0.99
    assert probability(image, body, background, mean=BODY_RGB, sd=2.0).max() < 0.25


def test_pixel_far_from_the_background_model_is_judged_by_its_colour_alone():
    image = flat_image(BODY_RGB)
    body, background = histogram((BODY_RGB, 0.125)), histogram((OTHER_RGB, 0.125))
    assert probability(image, body, background, mean=OTHER_RGB, sd=2.0).min() > 0.99


def test_nearer_the_background_model_is_more_background():
    image, body, background = flat_image(BODY_RGB), histogram((BODY_RGB, 0.125)), histogram((BODY_RGB, 0.01))
    away = [
        probability(image, body, background, mean=np.add(BODY_RGB, [d, 0, 0]), sd=3.0)[0, 0] for d in range(0, 30, 3)
    ]
    assert np.all(np.diff(away) > 0)


@pytest.mark.parametrize("stride", [1, 3])
def test_counting_is_a_histogram_blurred_over_neighbouring_bins(stride):
    rng = np.random.default_rng(1)
    rgb = rng.integers(0, 256, (*SHAPE, 3), dtype=np.uint8)
    rgb[:3] = rng.choice([0, 255], (3, SHAPE[1], 3))  # colours at the edges stay inside
    chosen = rng.random(SHAPE) < 0.6
    counts = np.zeros((BINS_PER_CHANNEL, BINS_PER_CHANNEL, BINS_PER_CHANNEL), np.float32)
    taken = count_colours(rgb, chosen, stride, counts)
    colours = rgb[chosen][stride - 1 :: stride]
    expected, _ = np.histogramdd(colours, bins=[np.arange(0, 257, 8)] * 3)
    for axis in range(3):
        expected = correlate1d(expected, [0.25, 0.5, 0.25], axis=axis, mode="nearest")
    assert taken == len(colours)
    np.testing.assert_allclose(counts, expected, atol=SINGLE)
    np.testing.assert_allclose(counts.sum(), taken, rtol=SINGLE)


def test_counting_adds_to_what_was_counted_and_nothing_where_nothing_is_chosen():
    counts = np.ones((BINS_PER_CHANNEL, BINS_PER_CHANNEL, BINS_PER_CHANNEL), np.float32)
    assert count_colours(flat_image(BODY_RGB), np.zeros(SHAPE, bool), 1, counts) == 0
    np.testing.assert_array_equal(counts, 1)


def box_mask(x0, y0, x1, y1):
    part = np.full(SHAPE, -1, np.int16)
    part[y0:y1, x0:x1] = 0
    return part


def test_posterior_is_summed_over_the_mask_and_its_surroundings_and_evidence_over_the_mask():
    probabilities = np.random.default_rng(2).uniform(0, 1, SHAPE).astype(np.float32)
    part = box_mask(10, 8, 20, 16)
    pixels, inside, near, nats = posterior_sums(probabilities, part, 5, 3)
    own = probabilities[8:16, 10:20].astype(float)
    assert pixels == 80
    np.testing.assert_allclose(inside, own.sum(), rtol=SINGLE)
    np.testing.assert_allclose(near, probabilities[5:19, 5:25].sum(dtype=float), rtol=SINGLE)
    expected = np.clip(np.log(own / (1 - own)), -EVIDENCE_LIMIT, EVIDENCE_LIMIT).sum()
    np.testing.assert_allclose(nats, expected, rtol=1e-3)


def test_sums_stop_at_the_images_edge_and_each_pixels_evidence_at_the_limit():
    probabilities = np.ones(SHAPE, np.float32)
    pixels, inside, near, nats = posterior_sums(probabilities, box_mask(0, 0, 40, 30), 12, 12)
    np.testing.assert_allclose([pixels, inside, near], SHAPE[0] * SHAPE[1], rtol=SINGLE)
    np.testing.assert_allclose(nats, EVIDENCE_LIMIT * pixels, rtol=SINGLE)


def test_sums_over_an_empty_mask_are_zero():
    assert posterior_sums(np.ones(SHAPE, np.float32), box_mask(0, 0, 0, 0), 0, 0) == (0, 0, 0, 0)
