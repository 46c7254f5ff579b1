"""The kernel that compares rods agrees with plain NumPy."""

import numpy as np
import pytest

from airborne.appearance.hue_saturation import HSV_BINS, OUTSIDE, root_histograms
from airborne.tracking.particle.rods import (
    CLASS_SHIFT,
    N_ACROSS,
    N_ALONG,
    N_SAMPLES,
    compare_rods,
    count_rods,
    rod_corners,
)

FOCAL_PX = 500.0
PROJECTION = np.array([[FOCAL_PX, 0, 60, 0], [0, FOCAL_PX, 40, 0], [0, 0, 1, 0.0]])
CORNER = np.array([20.0, 10.0])
WIDTHS_M = np.array([0.15, 0.1])
CLASSES = np.array([1, 6])
SINGLE = 2e-5  # float32


def px_of(point):
    u, v, w = PROJECTION @ np.append(point, 1)
    return np.array([u, v]) / w


def plain_samples(codes, ends, width_m):
    """The codes on the grid of one rod, by the definition."""
    a, b = px_of(ends[0]), px_of(ends[1])
    along = (b - a) / np.linalg.norm(b - a)
    across = np.array([-along[1], along[0]]) * FOCAL_PX * width_m / ends[:, 2].mean()
    samples = []
    for i in range(N_ALONG):
        for j in range(N_ACROSS):
            at = a + (b - a) * (i + 0.5) / N_ALONG + across * ((j + 0.5) / N_ACROSS - 0.5) - CORNER
            x, y = np.floor(at + 0.5).astype(int)
            inside = 0 <= x < codes.shape[1] and 0 <= y < codes.shape[0]
            samples.append(int(codes[y, x]) if inside else OUTSIDE)
    return np.array(samples)


def plain(codes, ends, roots):
    overlap, share = np.zeros((2, *ends.shape[:2]))
    for i, rods in enumerate(ends):
        for r, rod in enumerate(rods):
            if (rod[:, 2] <= 0).any():
                continue
            samples = plain_samples(codes, rod, WIDTHS_M[r])
            counts = np.bincount(samples & 255, minlength=HSV_BINS + 1)
            overlap[i, r] = np.sum(np.sqrt(counts / N_SAMPLES) * roots[r])
            share[i, r] = np.mean(((samples >> CLASS_SHIFT) & CLASSES[r]) != 0)
    return overlap, share


def scene(seed=0, n=60):
    rng = np.random.default_rng(seed)
    bins, bits = rng.integers(0, 8, (2, 80, 100))
    codes = (12 * bins + (bits << CLASS_SHIFT)).astype(np.uint16)
    ends = rng.normal([0.1, 0.1, 5], [0.4, 0.4, 0.5], (n, 2, 2, 3))
    return codes, ends, root_histograms(rng.random((2, HSV_BINS + 1)))


def kernel(codes, ends, roots, widths_m=WIDTHS_M):
    overlap, share = np.full((2, *ends.shape[:2]), np.nan, np.float32)
    compare_rods(codes, CORNER, PROJECTION, FOCAL_PX, ends, widths_m, roots, CLASSES, overlap, share)
    return overlap, share


def test_the_kernel_agrees_with_plain_numpy():
    codes, ends, roots = scene()
    overlap, share = kernel(codes, ends, roots)
    expected_overlap, expected_share = plain(codes, ends, roots)
    same = np.abs(overlap - expected_overlap) < SINGLE
    assert same.mean() > 0.97, "a sample may fall on the edge of two pixels"
    assert np.allclose(overlap, expected_overlap, atol=0.05)
    assert np.allclose(share, expected_share, atol=2 / N_SAMPLES + 1e-6)


def test_a_rod_overlaps_fully_with_its_own_histogram():
    codes, ends, _ = scene()
    rods = ends[0]
    counts = np.zeros((2, HSV_BINS + 1))
    count_rods(codes, CORNER, PROJECTION, FOCAL_PX, rods, WIDTHS_M, counts)
    assert np.array_equal(counts.sum(axis=1), [N_SAMPLES, N_SAMPLES])
    overlap, _ = kernel(codes, ends[:1], root_histograms(counts))
    assert overlap == pytest.approx(1, abs=1e-4)


@pytest.mark.parametrize("depth_m", [-5.0, 0.0])
def test_a_rod_behind_the_camera_scores_nothing(depth_m):
    codes, ends, roots = scene(n=1)
    ends[..., 2] = depth_m
    overlap, share = kernel(codes, ends, roots)
    assert not overlap.any() and not share.any()


@pytest.mark.parametrize("centre", [(100.0, 0.0, 5.0), (1e9, -1e9, 5.0), (0.0, 0.0, 1e-5), (np.nan, 0.0, 5.0)])
def test_rods_far_outside_belong_to_no_class_and_give_no_nan(centre):
    codes, ends, roots = scene(n=1)
    roots[:, OUTSIDE] = 0
    overlap, share = kernel(codes, ends * [1, 1, 0] + centre, roots)
    assert np.isfinite(overlap).all()
    assert not share.any()


def test_a_rod_viewed_end_on_is_still_compared():
    codes, _, roots = scene(n=1)
    end = np.array([0.0, 0.0, 5.0])
    overlap, share = kernel(codes, np.tile(end, (1, 2, 2, 1)), roots)
    assert (overlap > 0).all()
    assert np.isfinite(share).all()


def test_corners_surround_the_samples():
    _, ends, _ = scene(n=1)
    corners = rod_corners(ends[0], PROJECTION, FOCAL_PX, WIDTHS_M)
    middle = np.array([(px_of(rod[0]) + px_of(rod[1])) / 2 for rod in ends[0]])
    assert np.allclose(corners.mean(axis=1), middle)
    sides = (
        np.linalg.norm(corners[:, 1] - corners[:, 0], axis=-1),
        np.linalg.norm(corners[:, 2] - corners[:, 1], axis=-1),
    )
    assert np.allclose(sides[0], [np.linalg.norm(px_of(rod[0]) - px_of(rod[1])) for rod in ends[0]])
    assert np.allclose(sides[1], FOCAL_PX * WIDTHS_M / ends[0, :, :, 2].mean(axis=1))
