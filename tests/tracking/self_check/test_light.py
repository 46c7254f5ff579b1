"""A silhouette is registered where the body is, however bright its sides are against the scene, however blurred."""

import cv2
import numpy as np
import pytest

from airborne.cameras import camera_looking_at
from airborne.rendering.srgb import srgb_from_light
from airborne.tracking.self_check.light import register_light
from airborne.tracking.self_check.registration import Silhouette, foreground, register

FINE = 8  # subpixels of a pixel's side
SIZE = (120, 100)  # [px]
SCENE = 0.12  # [linear light]
TRUE = np.array([1.3, -0.7])  # [px] right, down
CAMERA = camera_looking_at("cam", (0, -5, 0), (0, 0, 0), focal_px=900.0, size=SIZE)


def bar(fine, shift=(0.0, 0.0)):
    """A slanting bar of 12 px, its upper side 4 px of them and its front, drawn with fine x fine subpixels a pixel."""
    y, x = np.mgrid[: fine * SIZE[1], : fine * SIZE[0]]
    u, v = ((c + 0.5) / fine - 0.5 - d for c, d in ((x, shift[0]), (y, shift[1])))
    along, across = 0.9 * (u - 60) + np.sqrt(0.19) * (v - 50), 0.9 * (v - 50) - np.sqrt(0.19) * (u - 60)
    inside = (np.abs(along) < 38) & (np.abs(across) < 6)
    return inside & (across < -2), inside & (across >= -2)


def silhouette():
    upper, front = bar(1)
    mask = (upper | front).astype(np.float32)
    side = np.where(upper, 1, np.where(front, 2, -1))
    return Silhouette(CAMERA, mask, mask, side, np.array([60.0, 50.0]), (0, 0, *SIZE), np.ones(2), is_whole=True)


def picture(upper, front, blur_px):
    """The bar where it truly is, its sides as bright as said [linear light], with noise of 3 grey levels."""
    light = np.full((FINE * SIZE[1], FINE * SIZE[0]), SCENE, np.float32)
    for side, brightness in zip(bar(FINE, TRUE), (upper, front), strict=True):
        light[side] = brightness
    light = cv2.resize(cv2.GaussianBlur(light, (0, 0), FINE * blur_px), SIZE, interpolation=cv2.INTER_AREA)
    noise = 3 * np.random.default_rng(0).standard_normal((*light.shape, 3))
    return np.clip(np.rint(srgb_from_light(np.asarray(light, float))[..., None] + noise), 0, 255).astype(np.uint8)


EMPTY = np.full((SIZE[1], SIZE[0], 3), np.rint(srgb_from_light(np.array([SCENE]))), np.uint8)


def standing_out(rgb):
    offset = register(silhouette(), foreground(rgb, EMPTY, silhouette()))
    assert offset is not None
    return offset


@pytest.mark.parametrize("blur_px", [0.5, 0.9, 1.5])
@pytest.mark.parametrize(("upper", "front"), [(0.9, 0.3), (0.3, 0.9), (0.8, 0.03), (0.5, 0.5)])
def test_offsets_do_not_depend_on_where_the_light_comes_from(upper, front, blur_px):
    rgb = picture(upper, front, blur_px)
    np.testing.assert_allclose(register_light(silhouette(), standing_out(rgb), rgb, EMPTY)[:2], TRUE, atol=0.2)


def test_what_stands_out_lies_towards_the_light():
    """The bias that the light's own equations do not have: else the test above would hold without them."""
    down = [standing_out(picture(*sides, 0.9))[1] for sides in ((0.9, 0.3), (0.3, 0.9))]
    assert down[0] < down[1] - 0.2
