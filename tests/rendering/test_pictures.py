import numpy as np

from airborne.rendering import FLAT, mask_picture, match_picture, model_picture, render, through_mask
from tests.support.bodies import camera, noise_view, posed_random

SHAPES, POSED = posed_random(["ellipsoid", "box", "mesh"], 1)
VIEW = noise_view(camera(), 0)
DRAWN = render(SHAPES, POSED, VIEW.camera, FLAT)


def test_pictures_are_black_outside_the_mask_and_show_their_subject_inside():
    mask = DRAWN.mask
    for picture in (
        model_picture(DRAWN),
        mask_picture(DRAWN),
        through_mask(VIEW.rgb, DRAWN),
        match_picture(VIEW.rgb, DRAWN),
    ):
        assert picture.shape == VIEW.rgb.shape and picture.dtype == np.uint8
        assert not picture[~mask].any()
    assert np.array_equal(through_mask(VIEW.rgb, DRAWN)[mask], VIEW.rgb[mask])
    assert np.all(mask_picture(DRAWN)[mask] == 255)


def test_a_perfect_match_is_white_and_the_opposite_is_dark():
    perfect = model_picture(DRAWN)
    assert np.all(match_picture(perfect, DRAWN)[DRAWN.mask] == 255)
    assert match_picture(255 - perfect, DRAWN)[DRAWN.mask].mean() < 200


def test_pictures_of_a_region_show_that_region_of_the_view():
    region = render(SHAPES, POSED, VIEW.camera, FLAT, region=(30, 20, 60, 50))
    assert np.array_equal(through_mask(VIEW.rgb, region), through_mask(VIEW.rgb, DRAWN)[20:50, 30:60])
