"""Unknown light is fitted from the surface's own normals."""

import numpy as np

from airborne.appearance.lighting import (
    LIGHT_FROM_SRGB,
    LIGHT_TERMS,
    fit_light,
    flatten_shading,
    light_planes,
    shade_body,
)
from airborne.rendering.srgb import light_from_srgb
from tests.support.tolerances import EXACT

SHAPE = (40, 50)
WHOLE = (0, 0, SHAPE[1], SHAPE[0])
LIGHT = np.array(  # ambient, normal (3), image coordinates (2)
    [
        [0.6, 0.2, -0.1, -0.3, 0.05, -0.03],
        [0.5, 0.1, 0.05, -0.2, 0.0, 0.04],
        [0.7, -0.2, 0.1, -0.25, -0.06, 0.02],
    ]
)
ALBEDO = np.array([[0.8, 0.6, 0.1], [0.2, 0.3, 0.9]], np.float32)
CLOTH = np.arange(len(ALBEDO), dtype=np.int16)
FOUND = 5e-3  # of the light: the fit holds its slopes back by a ten-thousandth
FACET_PX = 5


def body(seed=0):
    """A mask of two parts whose many facets face the camera, and its light as the model has it."""
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(3, SHAPE[0] // FACET_PX, SHAPE[1] // FACET_PX))
    normals[2] = -np.abs(normals[2])
    normals = (normals / np.linalg.norm(normals, axis=0)).repeat(FACET_PX, axis=1).repeat(FACET_PX, axis=2)
    part = np.full(SHAPE, -1, np.int16)
    part[5:35, 5:25], part[5:35, 25:45] = 0, 1
    v, u = (2 * np.indices(SHAPE) / np.array(SHAPE)[:, None, None]) - 1
    terms = np.stack([np.ones(SHAPE), *normals, u, v])
    observed = np.where(part >= 0, ALBEDO.T[:, part] * np.einsum("kq,qyx->kyx", LIGHT, terms), 0.05)
    return part, normals.astype(np.float32), observed.astype(np.float32)


def ambient_light():
    light = np.zeros((3, LIGHT_TERMS), np.float32)
    light[:, 0] = 1
    return light


def test_light_is_fitted_from_a_shaded_body():
    part, normals, observed = body()
    light = ambient_light()
    sd = fit_light(observed, part, normals, ALBEDO, CLOTH, light, 3, *WHOLE)
    np.testing.assert_allclose(light, LIGHT, atol=FOUND)
    assert sd < 2e-3


def test_shadow_over_a_fifth_of_the_body_does_not_matter():
    part, normals, observed = body()
    shadowed = observed.copy()
    shadowed[:, 5:11] *= 0.2
    light = ambient_light()
    fit_light(shadowed, part, normals, ALBEDO, CLOTH, light, 8, *WHOLE)
    np.testing.assert_allclose(light, LIGHT, atol=0.03)


def test_noise_averages_out_and_its_size_is_returned():
    part, normals, observed = body()
    noise = np.random.default_rng(1).normal(0, 0.02, observed.shape).astype(np.float32)
    light = ambient_light()
    sd = fit_light(observed + noise, part, normals, ALBEDO, CLOTH, light, 4, *WHOLE)
    assert np.abs(light - LIGHT).max() < 0.05
    assert 0.02 < sd < 3 * 1.5 * 0.02


def test_too_few_pixels_leave_the_light_as_it_was():
    _, normals, observed = body()
    few = np.full(SHAPE, -1, np.int16)
    few[10, 10:21] = 0
    light = ambient_light()
    assert fit_light(observed, few, normals, ALBEDO, CLOTH, light, 3, *WHOLE) == 1
    np.testing.assert_array_equal(light, ambient_light())
    few[10, 10:22] = 0
    fit_light(observed, few, normals, ALBEDO, CLOTH, light, 3, *WHOLE)
    assert np.abs(light - ambient_light()).max() > 0.05


def test_mixed_pixels_at_the_borders_of_facets_hardly_count():
    part, normals, observed = body()
    y, x = np.indices(SHAPE)
    is_border = (y % FACET_PX == 0) | (y % FACET_PX == FACET_PX - 1) | (x % FACET_PX == 0) | (x % FACET_PX == 4)
    mixed = np.where(is_border, 0.8 * observed, observed).astype(np.float32)
    light = ambient_light()
    fit_light(mixed, part, normals, ALBEDO, CLOTH, light, 8, *WHOLE)
    np.testing.assert_allclose(light, LIGHT, atol=0.04)


def test_only_the_window_is_used():
    part, normals, observed = body()
    observed[:, :, 25:] = 9.0
    light = ambient_light()
    fit_light(observed, part, normals, ALBEDO, CLOTH, light, 3, 0, 0, 25, SHAPE[0])
    np.testing.assert_allclose(light, LIGHT, atol=FOUND)


def test_black_body_leaves_a_finite_light():
    part, normals, observed = body()
    light = ambient_light()
    fit_light(observed, part, normals, np.zeros_like(ALBEDO), CLOTH, light, 3, *WHOLE)
    assert np.isfinite(light).all()


def shade(light, part, normals, x0=0, y0=0, size=SHAPE):
    """The body's light (3, h, w) in the window at (x0, y0)."""
    lit = np.zeros((3, *size), np.float32)
    shade_body(part, normals, ALBEDO, light.astype(np.float32), x0, y0, lit)
    return lit


def test_body_lit_by_the_right_light_is_what_was_observed():
    part, normals, observed = body()
    lit = shade(LIGHT, part, normals)
    np.testing.assert_allclose(lit[:, part >= 0], observed[:, part >= 0], atol=1e-6)
    assert np.all(lit[:, part < 0] == 0)


def test_a_faceted_part_keeps_its_light_and_a_smooth_one_gets_its_mean_light():
    part, normals, observed = body()
    lit = shade(LIGHT, part, normals)
    flatten_shading(part, ALBEDO, np.array([True, False]), CLOTH, lit)
    np.testing.assert_allclose(lit[:, part == 0], observed[:, part == 0], atol=1e-6)
    mean = observed[:, part == 1].mean(axis=1, keepdims=True)
    np.testing.assert_allclose(lit[:, part == 1], np.broadcast_to(mean, (3, (part == 1).sum())), rtol=1e-4)


def test_light_covers_the_window_it_is_asked_for():
    part, normals, _ = body()
    whole, window = shade(LIGHT, part, normals), shade(LIGHT, part, normals, 12, 7, (20, 25))
    np.testing.assert_array_equal(window, whole[:, 7:27, 12:37])


def test_light_of_srgb_has_its_known_values():
    np.testing.assert_allclose(light_from_srgb([0, 255]), [0, 1], atol=EXACT)
    np.testing.assert_allclose(light_from_srgb(0.04045 * 255), 0.04045 / 12.92, atol=EXACT)
    np.testing.assert_allclose(light_from_srgb(188), 0.5029, atol=1e-4)


def test_planes_of_an_image_are_the_light_of_its_channels():
    image = np.random.default_rng(4).integers(0, 256, (*SHAPE, 3), dtype=np.uint8)
    planes = np.empty((3, *SHAPE), np.float32)
    light_planes(image, LIGHT_FROM_SRGB, planes)
    np.testing.assert_allclose(planes, light_from_srgb(image).transpose(2, 0, 1), atol=2e-3)
    light_planes(image.astype(np.float32), LIGHT_FROM_SRGB, planes)
    np.testing.assert_allclose(planes, light_from_srgb(image).transpose(2, 0, 1), atol=2e-3)
