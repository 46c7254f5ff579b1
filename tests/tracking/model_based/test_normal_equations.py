"""The Gauss-Newton kernels against blurs by SciPy and against images of the moved body."""

from typing import NamedTuple

import numpy as np
import pytest
from scipy.ndimage import correlate1d, gaussian_filter

from airborne.appearance.lighting import LIGHT_FROM_SRGB, LIGHT_TERMS, light_planes
from airborne.body.chain import move_pose
from airborne.rendering.lights import FLAT
from airborne.rendering.maps import empty_maps
from airborne.rendering.packing import pack_lights
from airborne.tracking.image_regions import crop_regions
from airborne.tracking.model_based.absent_segments import absence_costs_in_fitted_light, absence_costs_in_known_light
from airborne.tracking.model_based.blur import RADIUS_PX, blur_planes, gaussian_taps
from airborne.tracking.model_based.degrees_of_freedom import all_joints, root_only
from airborne.tracking.model_based.kernel_arguments import Comparison, Projection, Window
from airborne.tracking.model_based.normal_equations import (
    MASK,
    equations_of_known_light,
    photometric_equations,
    prepare_rows,
)
from airborne.tracking.model_based.owners import REACH_PX, find_owners, mask_box
from airborne.tracking.model_based.render_model import RenderModel, ViewBuffers
from airborne.tracking.model_based.twist_equations import Sums, new_blocks
from tests.support.scenes import FIGURE, Scene, standing

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
    observation, out = planes(), np.empty((3, 30, 41), np.float32)
    taps_u, taps_v = gaussian_taps(1.2), gaussian_taps(0.6)
    blur_planes(observation, taps_u, taps_v, out)
    both = [np.concatenate([taps[:0:-1], taps]) for taps in (taps_u, taps_v)]
    expected = correlate1d(correlate1d(observation, both[0], axis=2, mode="nearest"), both[1], axis=1, mode="nearest")
    np.testing.assert_allclose(out, expected, atol=SINGLE)


def test_blur_is_scipys_gaussian():
    observation, out = planes(shape=(1, 20, 25)), np.empty((1, 20, 25), np.float32)
    blur_planes(observation, gaussian_taps(1.2), gaussian_taps(1.2), out)
    np.testing.assert_allclose(
        out[0], gaussian_filter(observation[0], 1.2, mode="nearest", radius=RADIUS_PX), atol=SINGLE
    )


def test_blur_leaves_an_even_plane_alone():
    out = np.empty((2, 9, 5), np.float32)
    blur_planes(np.full((2, 9, 5), 0.7, np.float32), gaussian_taps(1.2), gaussian_taps(0.5), out)
    np.testing.assert_allclose(out, 0.7, atol=SINGLE)


def test_box_holds_the_mask():
    part = np.full((60, 80), -1, np.int16)
    assert mask_box(part) == (0, 0, 0, 0)
    part[30, 40] = 0
    assert mask_box(part) == (40, 30, 41, 31)
    part[0, 79] = part[59, 0] = 1
    assert mask_box(part) == (0, 0, 80, 60)


class SingleView:
    """One noiseless image of a body, from the first camera; the equations of poses near it."""

    def __init__(self, scene, dofs=root_only):
        frames = scene.frames(0)
        self.truth, self.dofs = scene.start(), dofs(scene.model)
        self._render_model = RenderModel.of(scene.model)
        self._region = crop_regions([self.with_pose(self.truth)], self._render_model.geometry, frames, 32)[0]
        self._observed = np.empty((3, *self._region.rgb.shape[:2]), np.float32)
        light_planes(self._region.rgb, LIGHT_FROM_SRGB, self._observed)
        background = self._region.crop(scene.backgrounds[0]).transpose(2, 0, 1)
        self._background = np.ascontiguousarray(background, np.float32)
        self._light = np.zeros((3, LIGHT_TERMS), np.float32)
        self._light[:, 0] = 1
        self.photometric(self.truth, iterations=5)

    def with_pose(self, pose):
        return self._render_model.with_pose(pose)

    def moved(self, delta):
        return move_pose(self.truth, delta)

    def photometric(self, pose, iterations=0, clip=NO_CLIP):
        """The equations and the squared residual; the light stays as it was fitted at the truth."""
        render_model, certainty = self._render_model, np.ones(self._region.rgb.shape[:2], np.float32)
        body, projection, comparison, maps = self._common(pose, clip)
        observation = prepare_rows(self._observed, self._background, certainty, comparison)
        paint = render_model.paint
        sums, blocks = Sums.zero(len(render_model.model.segments)), self._blocks()
        _, total, _ = photometric_equations(
            body, projection, observation, comparison, maps, paint, self._light, iterations, sums, blocks
        )  # fmt: skip
        return self._map_to_dofs(pose, sums), total

    def view(self):
        """The view's buffers, with the light that was fitted at the truth, and how it is compared."""
        size, certainty = self._region.camera.size, np.ones(self._region.rgb.shape[:2], np.float32)
        comparison = self._common(self.truth, 0.1)[2]
        rows = prepare_rows(self._observed, self._background, certainty, comparison)
        K, whole = self._region.camera.K, Window(0, 0, *size)
        return ViewBuffers(self._region.packed_view, K, rows, empty_maps(size), whole, self._light), comparison

    def cost(self, view, comparison, pose):
        """The robust squared residual of a view or a part of it, less that of the empty scene."""
        render_model, n = self._render_model, len(self._render_model.model.segments)
        paint, blocks = render_model.paint, new_blocks(view.whole.x1, view.whole.y1, n)
        args = render_model.body, view.projection(self.with_pose(pose)), view.observation, comparison, view.maps
        return photometric_equations(*args, paint, view.light, 0, Sums.zero(n), blocks)[0]

    def absence_costs(self, pose):
        """By how much each segment's absence raises the cost, in the fitted light and in an even one: (2, segments).

        First as the kernels find it, then by the equations of the body with that segment behind the camera.
        """
        view, comparison = self.view()
        posed, n = self.with_pose(pose), len(self._render_model.model.segments)
        paint = self._render_model.paint
        even = pack_lights(FLAT, self._region.camera), np.float32(FLAT.ambient)
        args = self._render_model.body, view.projection(posed), view.observation, comparison
        rises, costs = np.zeros((2, n)), np.empty((2, n + 1))
        absence_costs_in_fitted_light(*args, paint, view.light, np.ones(n, bool), rises[0])
        absence_costs_in_known_light(*args, *even, np.ones(n, bool), rises[1])
        for absent in range(n + 1):  # at last, none
            t = posed.t.copy()
            t[absent:][:1] -= 1e3 * self._region.camera.camera_from_world.rotation.as_matrix()[2]
            args = args[0], view.projection(posed)._replace(t=t), *args[2:4], view.maps
            sums = Sums.zero(n), self._blocks()
            costs[0, absent] = photometric_equations(*args, paint, view.light, 0, *sums)[0]
            costs[1, absent] = equations_of_known_light(*args, paint, *even, *sums)[0]
        return rises, costs[:, :-1] - costs[:, -1:]

    def silhouette(self, pose):
        """The equations against the true mask, as probabilities."""
        mask = (self._render_model.draw_parts(self.with_pose(self.truth), self._region) >= 0).astype(np.float32)
        body, projection, comparison, maps = self._common(pose, 0.5)
        observation = prepare_rows(mask[None], np.zeros((1, *mask.shape), np.float32), np.ones_like(mask), comparison)
        sums, blocks = Sums.zero(len(self._render_model.model.segments)), self._blocks()
        photometric_equations(body, projection, observation, comparison, maps, *MASK, sums, blocks)
        return self._map_to_dofs(pose, sums)

    def _common(self, pose, clip):
        posed, region, taps = self.with_pose(pose), self._region, gaussian_taps(1.2)
        projection = Projection(posed.R, posed.t, region.packed_view, region.camera.K, posed.t[0])
        comparison = Comparison(taps, taps, clip)
        return self._render_model.body, projection, comparison, empty_maps(region.camera.size)

    def _blocks(self):
        return new_blocks(*self._region.camera.size, len(self._render_model.model.segments))

    def _map_to_dofs(self, pose, sums):
        J = self._render_model.jacobian(self.with_pose(pose), self.dofs)
        return Equations(np.einsum("sia,sij,sjb->ab", J, sums.A, J), np.einsum("sia,si->a", J, sums.g))


class Equations(NamedTuple):
    curvature: np.ndarray
    g: np.ndarray


@pytest.fixture(scope="module")
def single_view():
    return SingleView(Scene(noise_grey=0.0))


@pytest.fixture(scope="module")
def figure_view():
    return SingleView(Scene(FIGURE, standing, noise_grey=0.0), all_joints)


def offsets(n, size, seed=0):
    """Deltas (n, 6) of `size` steps."""
    directions = np.random.default_rng(seed).normal(size=(n, 6))
    return size * STEP * directions / np.linalg.norm(directions, axis=1, keepdims=True)


def test_curvature_predicts_how_the_image_changes_when_the_body_moves(single_view):
    """E(d) = d' A d, E the squared difference of the blurred images, against images rendered at d."""
    sums, at_truth = single_view.photometric(single_view.truth)
    ratios = []
    for d in offsets(24, 3.0):
        both_ways = [single_view.photometric(single_view.moved(sign * d))[1] - at_truth for sign in (1, -1)]
        ratios.append(np.mean(both_ways) / (d @ sums.curvature @ d))
    np.testing.assert_allclose(np.median(ratios), 1, atol=0.06)
    assert 0.7 < min(ratios) < max(ratios) < 1.6


def test_gradient_is_minus_half_the_slope_of_the_squared_residual(single_view):
    got, expected = [], []
    for d in offsets(12, 4.0, seed=1):
        pose = single_view.moved(d)
        got.append(single_view.photometric(pose)[0].g * STEP)
        ends = [
            [single_view.photometric(move_pose(pose, sign * step))[1] for sign in (1, -1)] for step in np.diag(2 * STEP)
        ]
        expected.append([-(up - down) / 8 for up, down in ends])  # over 4 STEP, halved, times STEP
    got, expected = np.array(got), np.array(expected)
    assert np.corrcoef(got.ravel(), expected.ravel())[0, 1] > 0.99
    np.testing.assert_allclose(np.vdot(got, expected) / np.vdot(expected, expected), 1, atol=0.1)


@pytest.mark.parametrize("kind", ["photometric", "silhouette"])
def test_step_goes_back_to_where_the_body_is(single_view, kind):
    left = []
    for d in offsets(12, 2.0, seed=2):
        pose = single_view.moved(d)
        sums = single_view.silhouette(pose) if kind == "silhouette" else single_view.photometric(pose)[0]
        stiff = sums.curvature + np.diag(1e-3 * np.trace(sums.curvature * np.outer(STEP, STEP)) / STEP**2)
        step = np.linalg.solve(stiff, sums.g)
        after = (d + step) / STEP
        left.append(after @ (sums.curvature * np.outer(STEP, STEP)) @ after / (d @ sums.curvature @ d))
    assert np.median(left) < 0.25


def test_absence_of_a_segment_costs_what_the_equations_of_the_body_without_it_say(figure_view):
    for pose in (figure_view.truth, figure_view.moved(0.05 * np.ones(len(figure_view.dofs.columns)))):
        rises, expected = figure_view.absence_costs(pose)
        assert np.ptp(expected) > 1
        np.testing.assert_allclose(rises, expected, atol=1e-3 * np.abs(expected).max())


def test_large_residuals_weigh_less(single_view):
    pose = single_view.moved(offsets(1, 4.0)[0])
    _, full = single_view.photometric(pose)
    _, clipped = single_view.photometric(pose, clip=0.1)
    assert clipped < 0.8 * full


def test_body_outside_the_image_adds_nothing(single_view):
    equations, total = single_view.photometric(single_view.moved(np.array([50.0, 0, 0, 0, 0, 0])))
    assert total == 0
    assert not any(np.any(array) for array in equations)


@pytest.mark.parametrize("joint", range(1, len(FIGURE.segments)))
def test_gradient_along_every_joint_is_the_slope_of_the_squared_residual(figure_view, joint):
    """Off the truth by 4 degrees about each axis in turn; a rotation that the image does not show has no slope."""
    got, expected = [], []
    for axis in range(3):
        for sign in (1, -1):
            step = np.zeros(6 + 3 * (len(FIGURE.segments) - 1))
            step[3 + 3 * joint + axis] = np.radians(4.0) * sign
            pose = figure_view.moved(step)
            got.append(figure_view.photometric(pose)[0].g @ step)
            ends = [figure_view.photometric(move_pose(pose, way * step / 4))[1] for way in (1, -1)]
            expected.append(-(ends[0] - ends[1]) / (2 * 2 / 4))
    got, expected = np.array(got), np.array(expected)
    assert np.corrcoef(got, expected)[0, 1] > 0.95
    np.testing.assert_allclose(np.vdot(got, expected) / np.vdot(expected, expected), 1, atol=0.3)


def test_an_edge_moves_with_what_is_in_front():
    part = np.full((9, 12), -1, np.int16)
    part[:, 3:], part[:, 7:] = 0, 1
    nearness = np.select([part == 0, part == 1], [0.2, 0.25]).astype(np.float32)  # part 1 is nearer
    owner, owner_nearness = np.empty((9, 12), np.int16), np.empty((9, 12), np.float32)
    find_owners(part, nearness, np.array([4, 5], np.int16), owner, owner_nearness)
    np.testing.assert_array_equal(owner[4], np.repeat([4, 5], [7 - REACH_PX, 5 + REACH_PX]))
    np.testing.assert_allclose(owner_nearness[4], np.where(owner[4] == 5, 0.25, 0.2), atol=SINGLE)
