import numpy as np

from airborne.rendering import (
    FLAT,
    full_height,
    mask_picture,
    match_picture,
    model_picture,
    overlay,
    render,
    through_mask,
)
from airborne.rendering.pictures import OUTLINE_RGB, outline
from tests.rendering.bodies import camera, noise_view, posed_random

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


def test_the_outline_is_inside_the_mask_and_one_pixel_wide():
    square = np.zeros((8, 9), bool)
    square[2:6, 3:8] = True
    expected = square.copy()
    expected[3:5, 4:7] = False
    assert np.array_equal(outline(square), expected)


def test_an_overlay_changes_the_outline_only():
    drawn = overlay(VIEW.rgb, DRAWN)
    edge = outline(DRAWN.mask)
    assert np.all(drawn[edge] == OUTLINE_RGB)
    assert np.array_equal(drawn[~edge], VIEW.rgb[~edge])


def test_a_field_is_stretched_to_the_frame_before_its_outline_is_drawn():
    field_camera = camera().field(0)
    drawn = render(SHAPES, POSED, field_camera, FLAT)
    picture = overlay(VIEW.rgb[::2].copy(), drawn, height=70)
    assert picture.shape == VIEW.rgb.shape
    green = np.all(picture == OUTLINE_RGB, axis=2)
    whole = outline(DRAWN.mask)
    assert abs(np.nonzero(green)[0].mean() - np.nonzero(whole)[0].mean()) < 1
    assert abs(green.sum() - whole.sum()) < 0.2 * whole.sum()


def test_full_height_keeps_columns_and_levels():
    ramp = np.repeat(np.arange(10, dtype=np.uint8)[:, None], 4, axis=1)
    tall = full_height(ramp, 20)
    assert tall.shape == (20, 4)
    assert np.all(np.diff(tall[:, 0].astype(int)) >= 0) and tall[0, 0] == 0 and tall[-1, 0] == 9
