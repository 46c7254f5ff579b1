"""Images whose exposure or white balance changes are made as bright as their background; others stay as they are."""

import numpy as np
import pytest

from airborne.appearance.background import BackgroundModel
from airborne.appearance.brightness import brightness_ratios, divide_brightness
from airborne.rendering.srgb import light_from_srgb, srgb_from_light

SIZE, CORNER = (150, 190), (100, 90)
RNG = np.random.default_rng(5)
SCENE = RNG.uniform(60, 160, (400, 400, 3))
NOISE = 3.0  # grey levels


def background():
    return BackgroundModel().learn(SCENE.astype(np.uint8), np.zeros(SCENE.shape[:2], bool), (0, 0))


def region(ratios=(1.0, 1.0, 1.0), covered=0.0):
    """A part of the scene with other light, and a body that covers a share of it."""
    (x, y), (height, width) = CORNER, SIZE
    part = srgb_from_light(light_from_srgb(SCENE[y : y + height, x : x + width]) * np.array(ratios))
    part = part + NOISE * RNG.standard_normal(part.shape)
    part[: round(covered * height)] = 50 + NOISE * RNG.standard_normal((round(covered * height), width, 3))
    return np.clip(np.round(part), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("ratios", [(1.3, 1.3, 1.3), (0.5, 0.5, 0.5), (1.1, 1.0, 0.8), (1.9, 1.9, 1.9)])
def test_the_ratios_of_each_channel_are_found_and_divided_out(ratios):
    image = region(ratios)
    found = brightness_ratios(image, background(), CORNER)
    assert found == pytest.approx(ratios, rel=0.03)
    (x, y), (height, width) = CORNER, SIZE
    off = divide_brightness(image, found) - SCENE[y : y + height, x : x + width]
    assert np.abs(np.median(off, axis=(0, 1))).max() < 1.5


@pytest.mark.parametrize("covered", [0.0, 0.3])
def test_an_image_as_bright_as_before_is_left_alone(covered):
    assert brightness_ratios(region((1.02, 0.99, 1.0), covered), background(), CORNER) is None


def test_a_body_over_a_third_of_the_region_does_not_count():
    found = brightness_ratios(region((1.4, 1.4, 1.4), covered=0.3), background(), CORNER)
    assert found == pytest.approx([1.4] * 3, rel=0.06)


def test_where_most_is_covered_or_nothing_known_nothing_is_said():
    assert brightness_ratios(region((1.4, 1.4, 1.4), covered=0.9), background(), CORNER) is None
    assert brightness_ratios(region((1.4, 1.4, 1.4)), BackgroundModel(), CORNER) is None
    white = np.full((*SIZE, 3), 255, np.uint8)
    assert brightness_ratios(white, background(), CORNER) is None
