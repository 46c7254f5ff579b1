"""Which pixels look like the body."""

import numpy as np
import pytest
from scipy.ndimage import correlate1d

from airborne.appearance.background import START_SD
from airborne.appearance.foreground import BINS, EVIDENCE_LIMIT, agreement, count_colours, posterior

SINGLE = 1e-5  # float32
SHAPE = (30, 40)
BODY_RGB, OTHER_RGB = (220, 190, 40), (90, 100, 110)


def flat_picture(rgb):
    return np.full((*SHAPE, 3), rgb, np.uint8)


def histogram(*chances):
    """A histogram from (colour, chance) pairs."""
    table = np.zeros((BINS, BINS, BINS), np.float32)
    for rgb, chance in chances:
        table[tuple(np.array(rgb) >> 3)] = chance
    return table


def chance(picture, body, background, plate=None, sd=START_SD):
    """The posterior where every pixel's empty scene is `plate`, or unknown."""
    out = np.empty(SHAPE, np.float32)
    mean = (
        np.zeros((*SHAPE, 3), np.float32) if plate is None else np.broadcast_to(plate, (*SHAPE, 3)).astype(np.float32)
    )
    known = np.full(SHAPE, 0 if plate is None else 9, np.uint8)
    posterior(picture, body, background, mean, np.full(SHAPE, sd, np.float32), known, out)
    return out


def test_colour_that_was_never_seen_is_even():
    nothing = histogram()
    np.testing.assert_array_equal(chance(flat_picture(BODY_RGB), nothing, nothing), 0.5)


def test_posterior_is_the_share_of_the_bodys_chance():
    table = chance(flat_picture(BODY_RGB), histogram((BODY_RGB, 0.3)), histogram((BODY_RGB, 0.1)))
    np.testing.assert_allclose(table, 0.75, atol=1e-4)


def test_posterior_rises_with_the_bodys_chance_and_falls_with_the_backgrounds():
    shares = np.linspace(0, 0.5, 11)
    picture, half = flat_picture(BODY_RGB), histogram((BODY_RGB, 0.2))
    rising = [chance(picture, histogram((BODY_RGB, share)), half)[0, 0] for share in shares]
    falling = [chance(picture, half, histogram((BODY_RGB, share)))[0, 0] for share in shares]
    assert np.all(np.diff(rising) > 0)
    assert np.all(np.diff(falling) < 0)


def test_body_coloured_pixel_that_looks_like_the_empty_scene_is_background():
    picture = flat_picture(BODY_RGB)
    body, background = histogram((BODY_RGB, 0.125)), histogram((OTHER_RGB, 0.125))
    assert chance(picture, body, background).min() > 0.99
    assert chance(picture, body, background, plate=BODY_RGB, sd=2.0).max() < 0.25


def test_pixel_far_from_the_empty_scene_is_judged_by_its_colour_alone():
    picture = flat_picture(BODY_RGB)
    body, background = histogram((BODY_RGB, 0.125)), histogram((OTHER_RGB, 0.125))
    assert chance(picture, body, background, plate=OTHER_RGB, sd=2.0).min() > 0.99


def test_nearer_the_empty_scene_is_more_background():
    picture, body, background = flat_picture(BODY_RGB), histogram((BODY_RGB, 0.125)), histogram((BODY_RGB, 0.01))
    away = [chance(picture, body, background, plate=np.add(BODY_RGB, [d, 0, 0]), sd=3.0)[0, 0] for d in range(0, 30, 3)]
    assert np.all(np.diff(away) > 0)


@pytest.mark.parametrize("stride", [1, 3])
def test_counting_is_a_histogram_smeared_over_neighbouring_bins(stride):
    rng = np.random.default_rng(1)
    rgb = rng.integers(0, 256, (*SHAPE, 3), dtype=np.uint8)
    rgb[:3] = rng.choice([0, 255], (3, SHAPE[1], 3))  # colours at the edges stay inside
    chosen = rng.random(SHAPE) < 0.6
    counts = np.zeros((BINS, BINS, BINS), np.float32)
    taken = count_colours(rgb, chosen, stride, counts)
    colours = rgb[chosen][stride - 1 :: stride]
    expected, _ = np.histogramdd(colours, bins=[np.arange(0, 257, 8)] * 3)
    for axis in range(3):
        expected = correlate1d(expected, [0.25, 0.5, 0.25], axis=axis, mode="nearest")
    assert taken == len(colours)
    np.testing.assert_allclose(counts, expected, atol=SINGLE)
    np.testing.assert_allclose(counts.sum(), taken, rtol=SINGLE)


def test_counting_adds_to_what_was_counted_and_nothing_where_nothing_is_chosen():
    counts = np.ones((BINS, BINS, BINS), np.float32)
    assert count_colours(flat_picture(BODY_RGB), np.zeros(SHAPE, bool), 1, counts) == 0
    np.testing.assert_array_equal(counts, 1)


def masked(x0, y0, x1, y1):
    part = np.full(SHAPE, -1, np.int16)
    part[y0:y1, x0:x1] = 0
    return part


def test_agreement_sums_the_mask_its_surroundings_and_the_evidence():
    chances = np.random.default_rng(2).uniform(0, 1, SHAPE).astype(np.float32)
    part = masked(10, 8, 20, 16)
    pixels, inside, near, nats = agreement(chances, part, 5, 3)
    own = chances[8:16, 10:20].astype(float)
    assert pixels == 80
    np.testing.assert_allclose(inside, own.sum(), rtol=SINGLE)
    np.testing.assert_allclose(near, chances[5:19, 5:25].sum(dtype=float), rtol=SINGLE)
    expected = np.clip(np.log(own / (1 - own)), -EVIDENCE_LIMIT, EVIDENCE_LIMIT).sum()
    np.testing.assert_allclose(nats, expected, rtol=1e-3)


def test_agreement_stops_at_the_pictures_edge_and_one_pixel_shouts_no_louder_than_the_limit():
    chances = np.ones(SHAPE, np.float32)
    pixels, inside, near, nats = agreement(chances, masked(0, 0, 40, 30), 12, 12)
    np.testing.assert_allclose([pixels, inside, near], SHAPE[0] * SHAPE[1], rtol=SINGLE)
    np.testing.assert_allclose(nats, EVIDENCE_LIMIT * pixels, rtol=SINGLE)


def test_agreement_of_an_empty_mask_is_nothing():
    assert agreement(np.ones(SHAPE, np.float32), masked(0, 0, 0, 0), 0, 0) == (0, 0, 0, 0)
