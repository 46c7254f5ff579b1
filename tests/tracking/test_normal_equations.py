"""The Gauss-Newton kernels against blurs by SciPy and against pictures of the moved body."""

import numpy as np
import pytest
from scipy.ndimage import correlate1d, gaussian_filter

from airborne.rendering.maps import empty_maps
from airborne.scoring.lighting import TERMS, TO_LIGHT, light_planes
from airborne.tracking.gauss_newton import Synthesis
from airborne.tracking.normal_equations import (
    RADIUS_PX,
    Sums,
    blur,
    gaussian_taps,
    photometric_equations,
    silhouette_equations,
    window_of,
)
from airborne.tracking.regions import regions_round
from tests.tracking.scenes import CROSS, Scene

SINGLE = 1e-5  # float32
NO_CLIP = 1e6  # every pixel weighs the same
STEP = np.array([0.005] * 3 + [0.02] * 3)  # [m], [rad]: about half a pixel


def planes(seed=0, shape=(3, 30, 41)):
    return np.random.default_rng(seed).uniform(0, 1, shape).astype(np.float32)


@pytest.mark.parametrize("sigma", [0.5, 0.8, 1.2, 1.3])
def test_taps_sum_to_one_and_fall_off_as_a_gaussian(sigma):
    taps = gaussian_taps(sigma)
    np.testing.assert_allclose(taps[0] + 2 * taps[1:].sum(), 1, atol=SINGLE)
    np.testing.assert_allclose(taps / taps[0], np.exp(-0.5 * (np.arange(RADIUS_PX + 1) / sigma) ** 2), atol=SINGLE)


def test_blur_is_scipys_along_each_axis_with_its_own_taps():
    seen, out = planes(), np.empty((3, 30, 41), np.float32)
    taps_u, taps_v = gaussian_taps(1.2), gaussian_taps(0.6)
    blur(seen, taps_u, taps_v, out)
    both = [np.concatenate([taps[:0:-1], taps]) for taps in (taps_u, taps_v)]
    expected = correlate1d(correlate1d(seen, both[0], axis=2, mode="nearest"), both[1], axis=1, mode="nearest")
    np.testing.assert_allclose(out, expected, atol=SINGLE)


def test_blur_is_scipys_gaussian():
    seen, out = planes(shape=(1, 20, 25)), np.empty((1, 20, 25), np.float32)
    blur(seen, gaussian_taps(1.2), gaussian_taps(1.2), out)
    np.testing.assert_allclose(out[0], gaussian_filter(seen[0], 1.2, mode="nearest", radius=RADIUS_PX), atol=SINGLE)


def test_blur_leaves_an_even_plane_alone():
    out = np.empty((2, 9, 5), np.float32)
    blur(np.full((2, 9, 5), 0.7, np.float32), gaussian_taps(1.2), gaussian_taps(0.5), out)
    np.testing.assert_allclose(out, 0.7, atol=SINGLE)


def test_window_holds_the_mask_and_the_blurs_reach_and_stops_at_the_edge():
    part = np.full((60, 80), -1, np.int16)
    assert window_of(part) == (0, 0, 0, 0)
    part[30, 40] = 0
    x0, y0, x1, y1 = window_of(part)
    assert (40 - x0, x1 - 41, 30 - y0, y1 - 31) == (RADIUS_PX + 3,) * 4
    part[0, 79] = part[59, 0] = 1
    assert window_of(part) == (0, 0, 80, 60)


class Filmed:
    """One noiseless picture of the cross, from the first camera; the equations of bodies near it."""

    def __init__(self):
        scene = Scene(noise_grey=0.0)
        frames = scene.frames(0)
        self.truth = CROSS.with_pose(scene.start())
        self._synthesis = Synthesis.of(CROSS)
        self._region = regions_round([self.truth], self._synthesis.geometry, frames, 32)[0]
        self._observed = np.empty((3, *self._region.rgb.shape[:2]), np.float32)
        light_planes(self._region.rgb, TO_LIGHT, self._observed)
        background = self._region.crop(scene.backgrounds[0]).transpose(2, 0, 1)
        self._scene = np.ascontiguousarray(background, np.float32)
        self._light = np.zeros((3, TERMS), np.float32)
        self._light[:, 0] = 1
        self.photometric(self.truth, rounds=5)

    def _body(self, posed):
        synthesis, region = self._synthesis, self._region
        return synthesis.shapes, synthesis.geometry, posed.R, posed.t, region.packed, region.camera.K

    def photometric(self, posed, rounds=0, clip=NO_CLIP):
        """The sums and the squared residual; the light stays as it was fitted at the truth."""
        synthesis, region = self._synthesis, self._region
        taps, sums = gaussian_taps(1.2), Sums.zero()
        certainty = np.ones(region.rgb.shape[:2], np.float32)
        total, _ = photometric_equations(
            *self._body(posed), self._observed, self._scene, certainty, synthesis.albedo, synthesis.is_faceted,
            self._light, rounds, empty_maps(region.camera.size), taps, taps, clip, sums,
        )  # fmt: skip
        return sums, total

    def silhouette(self, posed):
        """The sums against the true mask, as probabilities."""
        region, sums = self._region, Sums.zero()
        mask = (self._synthesis.parts(self.truth, region) >= 0).astype(np.float32)
        taps, maps = gaussian_taps(1.2), empty_maps(region.camera.size)
        black, ones = np.zeros((1, *mask.shape), np.float32), np.ones_like(mask)
        silhouette_equations(*self._body(posed), mask, black, ones, maps, taps, taps, sums)
        return sums


@pytest.fixture(scope="module")
def filmed():
    return Filmed()


def offsets(n, size, seed=0):
    """Motions (n, 6) of `size` steps."""
    directions = np.random.default_rng(seed).normal(size=(n, 6))
    return size * STEP * directions / np.linalg.norm(directions, axis=1, keepdims=True)


def test_curvature_predicts_how_the_picture_changes_when_the_body_moves(filmed):
    """E(d) = d' A d, E the squared difference of the blurred pictures, against pictures drawn at d."""
    sums, at_truth = filmed.photometric(filmed.truth)
    ratios = []
    for d in offsets(24, 3.0):
        both_ways = [filmed.photometric(filmed.truth.moved(sign * d))[1] - at_truth for sign in (1, -1)]
        ratios.append(np.mean(both_ways) / (d @ sums.curvature @ d))
    np.testing.assert_allclose(np.median(ratios), 1, atol=0.06)
    assert 0.7 < min(ratios) < max(ratios) < 1.6


def test_gradient_is_minus_half_the_slope_of_the_squared_residual(filmed):
    got, expected = [], []
    for d in offsets(12, 4.0, seed=1):
        posed = filmed.truth.moved(d)
        got.append(filmed.photometric(posed)[0].g * STEP)
        ends = [[filmed.photometric(posed.moved(sign * step))[1] for sign in (1, -1)] for step in np.diag(2 * STEP)]
        expected.append([-(up - down) / 8 for up, down in ends])  # over 4 STEP, halved, times STEP
    got, expected = np.array(got), np.array(expected)
    assert np.corrcoef(got.ravel(), expected.ravel())[0, 1] > 0.99
    np.testing.assert_allclose(np.vdot(got, expected) / np.vdot(expected, expected), 1, atol=0.1)


@pytest.mark.parametrize("kind", ["photometric", "silhouette"])
def test_step_goes_back_to_where_the_body_is(filmed, kind):
    left = []
    for d in offsets(12, 2.0, seed=2):
        posed = filmed.truth.moved(d)
        sums = filmed.silhouette(posed) if kind == "silhouette" else filmed.photometric(posed)[0]
        stiff = sums.curvature + np.diag(1e-3 * np.trace(sums.curvature * np.outer(STEP, STEP)) / STEP**2)
        step = np.linalg.solve(stiff, sums.g)
        after = (d + step) / STEP
        left.append(after @ (sums.curvature * np.outer(STEP, STEP)) @ after / (d @ sums.curvature @ d))
    assert np.median(left) < 0.25


def test_far_residuals_weigh_less(filmed):
    posed = filmed.truth.moved(offsets(1, 4.0)[0])
    _, full = filmed.photometric(posed)
    _, clipped = filmed.photometric(posed, clip=0.1)
    assert clipped < 0.8 * full


def test_body_outside_the_picture_adds_nothing(filmed):
    sums, total = filmed.photometric(filmed.truth.moved(np.array([50.0, 0, 0, 0, 0, 0])))
    assert total == 0
    assert not any(np.any(array) for array in sums)
