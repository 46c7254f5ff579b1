"""Tables and maps of evidence, against the plain formulas in NumPy."""

import numpy as np
import pytest

from airborne.appearance.surface_classes import TABLE_COLUMNS, blur_maps, class_evidence, log_ratio_table
from airborne.tracking.capsules.spans import cumulative_sums

FLOOR, SHARED, CELLS = 1e-6, 0.8, 32**3


def some_colours(n, seed, n_bins=60):
    """Probabilities (n, 32, 32, 32) of a few colours each."""
    rng = np.random.default_rng(seed)
    probabilities = np.zeros((n, CELLS))
    for each in probabilities:
        each[rng.integers(0, CELLS, n_bins)] = rng.uniform(0.1, 1, n_bins)
    return (probabilities / probabilities.sum(axis=1, keepdims=True)).reshape(n, 32, 32, 32)


CLASSES, BACKGROUND = some_colours(5, 0), some_colours(1, 1)[0]
OCCLUSION = np.array([0.05, 0.2, 0.5, 0.7, 0.9])


def test_table_is_the_formula():
    table = log_ratio_table(CLASSES, BACKGROUND, OCCLUSION)
    flat, back = CLASSES.reshape(5, -1), BACKGROUND.ravel()
    anyone = (1 - SHARED) / CELLS + SHARED * flat.mean(axis=0)
    o = OCCLUSION[:, None]
    true = np.log((1 - o) * flat + o * anyone + FLOOR) - np.log((1 - o) * back + o * anyone + FLOOR)
    assert table.shape == (CELLS, TABLE_COLUMNS) and table.dtype == np.float32
    np.testing.assert_allclose(table[:, :5], true.T, atol=2e-4)
    assert not table[:, 5:].any()


def test_a_class_that_looks_like_the_background_has_no_evidence():
    table = log_ratio_table(np.repeat(BACKGROUND[None], 5, axis=0), BACKGROUND, OCCLUSION)
    np.testing.assert_allclose(table, 0, atol=1e-5)


def test_evidence_falls_with_the_probability_of_occlusion():
    own = np.flatnonzero(CLASSES[0])
    mean_evidence = [
        np.abs(log_ratio_table(CLASSES, BACKGROUND, np.full(5, o))[own, 0]).mean() for o in (0.05, 0.3, 0.6, 0.9, 1.0)
    ]
    assert np.all(np.diff(mean_evidence) < 0)
    assert mean_evidence[-1] == pytest.approx(0, abs=1e-5)


def test_a_classs_own_colours_are_evidence_for_it_and_the_backgrounds_against_it():
    table = log_ratio_table(CLASSES, BACKGROUND, OCCLUSION)
    for number in range(5):
        own = (CLASSES[number] > 0) & (BACKGROUND == 0)
        other = (BACKGROUND > 0) & (CLASSES.max(axis=0) == 0)
        assert table[own.ravel(), number].min() > 0
        assert table[other.ravel(), number].max() < 0


@pytest.mark.parametrize(("reduction", "shape"), [(1, (6, 9)), (2, (7, 9)), (3, (10, 13))])
def test_maps_are_the_means_of_the_table_over_blocks(reduction, shape):
    rng = np.random.default_rng(2)
    rgb = rng.integers(0, 256, (*shape, 3), np.uint8)
    table = rng.normal(size=(CELLS, TABLE_COLUMNS)).astype(np.float32)
    h, w = shape[0] // reduction, shape[1] // reduction
    out = np.full((5, h, w), np.nan, np.float32)
    class_evidence(rgb, table, reduction, out)
    r, g, b = np.moveaxis(rgb.astype(int) // 8, -1, 0)
    looked_up = np.moveaxis(table[(r * 32 + g) * 32 + b, :5], -1, 0)[:, : h * reduction, : w * reduction]
    true = looked_up.reshape(5, h, reduction, w, reduction).mean(axis=(2, 4))
    np.testing.assert_allclose(out, true, atol=1e-5)


def test_blur_is_the_binomial_kernel_and_repeats_the_border():
    maps = np.random.default_rng(3).normal(size=(3, 6, 8)).astype(np.float32)
    out = np.empty_like(maps)
    blur_maps(maps, out)
    padded = np.pad(maps, ((0, 0), (1, 1), (1, 1)), mode="edge")
    rows = (padded[:, :-2] + 2 * padded[:, 1:-1] + padded[:, 2:]) / 4
    true = (rows[..., :-2] + 2 * rows[..., 1:-1] + rows[..., 2:]) / 4
    np.testing.assert_allclose(out, true, atol=1e-6)


def test_blur_leaves_an_even_map_alone():
    maps, out = np.full((2, 4, 5), 1.5, np.float32), np.empty((2, 4, 5), np.float32)
    blur_maps(maps, out)
    np.testing.assert_array_equal(out, maps)


def test_cumulative_sums_of_blurred_maps_end_in_the_rows_sums():
    maps = np.random.default_rng(4).normal(size=(5, 6, 8)).astype(np.float32)
    sums = np.empty((5, 6, 9), np.float32)
    cumulative_sums(maps, sums)
    np.testing.assert_allclose(sums[..., -1], maps.sum(axis=-1), atol=1e-5)
    np.testing.assert_allclose(np.diff(sums, axis=-1), maps, atol=1e-5)
