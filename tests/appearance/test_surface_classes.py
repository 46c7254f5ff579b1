"""Tables and maps of evidence, against the plain formulas in NumPy."""

import numpy as np
import pytest

from airborne.appearance.surface_classes import COLUMNS, evidence_maps, ratio_table, smooth
from airborne.tracking.capsules.spans import running_sums

UNSEEN, LIKE_THEM, CELLS = 1e-6, 0.8, 32**3


def some_colours(n, seed, n_seen=60):
    """Probabilities (n, 32, 32, 32) of a few colours each."""
    rng = np.random.default_rng(seed)
    found = np.zeros((n, CELLS))
    for each in found:
        each[rng.integers(0, CELLS, n_seen)] = rng.uniform(0.1, 1, n_seen)
    return (found / found.sum(axis=1, keepdims=True)).reshape(n, 32, 32, 32)


KINDS, BACKGROUND = some_colours(5, 0), some_colours(1, 1)[0]
HIDDEN = np.array([0.05, 0.2, 0.5, 0.7, 0.9])


def test_table_is_the_formula():
    table = ratio_table(KINDS, BACKGROUND, HIDDEN)
    flat, back = KINDS.reshape(5, -1), BACKGROUND.ravel()
    anyone = (1 - LIKE_THEM) / CELLS + LIKE_THEM * flat.mean(axis=0)
    o = HIDDEN[:, None]
    true = np.log((1 - o) * flat + o * anyone + UNSEEN) - np.log((1 - o) * back + o * anyone + UNSEEN)
    assert table.shape == (CELLS, COLUMNS) and table.dtype == np.float32
    np.testing.assert_allclose(table[:, :5], true.T, atol=2e-4)
    assert not table[:, 5:].any()


def test_a_kind_that_looks_like_the_background_says_nothing():
    table = ratio_table(np.repeat(BACKGROUND[None], 5, axis=0), BACKGROUND, HIDDEN)
    np.testing.assert_allclose(table, 0, atol=1e-5)


def test_the_more_a_kind_is_hidden_the_less_its_colours_say():
    seen = np.flatnonzero(KINDS[0])
    said = [np.abs(ratio_table(KINDS, BACKGROUND, np.full(5, o))[seen, 0]).mean() for o in (0.05, 0.3, 0.6, 0.9, 1.0)]
    assert np.all(np.diff(said) < 0)
    assert said[-1] == pytest.approx(0, abs=1e-5)


def test_a_kinds_own_colours_speak_for_it_and_the_backgrounds_against_it():
    table = ratio_table(KINDS, BACKGROUND, HIDDEN)
    for kind in range(5):
        own = (KINDS[kind] > 0) & (BACKGROUND == 0)
        other = (BACKGROUND > 0) & (KINDS.max(axis=0) == 0)
        assert table[own.ravel(), kind].min() > 0
        assert table[other.ravel(), kind].max() < 0


@pytest.mark.parametrize(("reduction", "shape"), [(1, (6, 9)), (2, (7, 9)), (3, (10, 13))])
def test_maps_are_the_means_of_the_table_over_blocks(reduction, shape):
    rng = np.random.default_rng(2)
    rgb = rng.integers(0, 256, (*shape, 3), np.uint8)
    table = rng.normal(size=(CELLS, COLUMNS)).astype(np.float32)
    h, w = shape[0] // reduction, shape[1] // reduction
    out = np.full((5, h, w), np.nan, np.float32)
    evidence_maps(rgb, table, reduction, out)
    r, g, b = np.moveaxis(rgb.astype(int) // 8, -1, 0)
    looked_up = np.moveaxis(table[(r * 32 + g) * 32 + b, :5], -1, 0)[:, : h * reduction, : w * reduction]
    true = looked_up.reshape(5, h, reduction, w, reduction).mean(axis=(2, 4))
    np.testing.assert_allclose(out, true, atol=1e-5)


def test_smooth_is_the_binomial_kernel_and_repeats_the_border():
    maps = np.random.default_rng(3).normal(size=(3, 6, 8)).astype(np.float32)
    out = np.empty_like(maps)
    smooth(maps, out)
    padded = np.pad(maps, ((0, 0), (1, 1), (1, 1)), mode="edge")
    rows = (padded[:, :-2] + 2 * padded[:, 1:-1] + padded[:, 2:]) / 4
    true = (rows[..., :-2] + 2 * rows[..., 1:-1] + rows[..., 2:]) / 4
    np.testing.assert_allclose(out, true, atol=1e-6)


def test_smooth_leaves_an_even_map_alone():
    maps, out = np.full((2, 4, 5), 1.5, np.float32), np.empty((2, 4, 5), np.float32)
    smooth(maps, out)
    np.testing.assert_array_equal(out, maps)


def test_running_sums_of_smoothed_maps_end_in_the_rows_sums():
    maps = np.random.default_rng(4).normal(size=(5, 6, 8)).astype(np.float32)
    sums = np.empty((5, 6, 9), np.float32)
    running_sums(maps, sums)
    np.testing.assert_allclose(sums[..., -1], maps.sum(axis=-1), atol=1e-5)
    np.testing.assert_allclose(np.diff(sums, axis=-1), maps, atol=1e-5)
