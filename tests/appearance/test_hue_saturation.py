"""Colours fall into bins of hue, saturation and value."""

import colorsys

import cv2
import numpy as np
import pytest

from airborne.appearance.hue_saturation import CODES, HSV_BINS, bin_table, hsv_bins, look_up, root_histograms


def standard_bin(rgb):
    """The bin by Python's own conversion."""
    h, s, v = colorsys.rgb_to_hsv(*(np.asarray(rgb) / 255))
    if s > 0.1 and v > 0.2:
        return 10 * min(int(10 * h), 9) + min(int(10 * s), 9)
    return 100 + min(int(10 * v), 9)


def test_bins_are_those_of_the_standard_conversion():
    rgb = np.random.default_rng(0).integers(0, 256, (3000, 3))
    expected = np.array([standard_bin(colour) for colour in rgb])
    assert np.mean(hsv_bins(rgb) == expected) > 0.995, "a value on an edge may fall either way"


@pytest.mark.parametrize(
    "rgb, bin_", [((255, 0, 0), 9), ((0, 0, 0), 100), ((255, 255, 255), 109), ((128, 128, 128), 105)]
)
def test_pure_colours_and_greys_have_the_expected_bins(rgb, bin_):
    assert hsv_bins(np.array(rgb)) == bin_


def test_every_colour_has_a_bin_and_all_of_them_are_reached():
    table = bin_table()
    assert table.shape == (CODES,)
    assert table.max() < HSV_BINS
    assert len(np.unique(table[:CODES])) > 95


def test_the_table_says_what_the_formula_says_to_within_a_cell():
    rgb = np.random.default_rng(1).integers(0, 256, (40, 50, 3)).astype(np.uint8)
    middle = (rgb >> 3) * 8 + 3.5
    assert np.array_equal(look_up(rgb, bin_table()), hsv_bins(middle))


def test_brightness_does_not_move_a_strong_colour_out_of_its_hue():
    hsv = np.array([[[20, 200, v] for v in range(80, 250, 10)]], np.uint8)
    rgb = cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB)[0]
    assert len(set(hsv_bins(rgb) // 10)) == 1


def test_root_shares_have_unit_norm_and_nothing_counted_is_nothing():
    roots = root_histograms(np.array([[4, 0, 12], [0, 0, 0]]))
    assert np.sum(roots[0] ** 2) == pytest.approx(1)
    assert np.array_equal(roots[1], [0, 0, 0])
