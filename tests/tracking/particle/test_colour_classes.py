"""Colours are classified as skin, shoe or shorts by what one image showed."""

import numpy as np

from airborne.appearance.hue_saturation import bin_table, look_up
from airborne.tracking.particle.colour_classes import code_table, colour_counts
from airborne.tracking.particle.rods import CLASS_SHIFT

SKIN, SHOE, FLOOR, NEVER = (190, 140, 110), (220, 220, 215), (230, 150, 70), (20, 40, 200)


def image(*colours):
    rng = np.random.default_rng(0)
    rows = [np.full((20, 40, 3), colour) for colour in colours]
    return np.clip(np.concatenate(rows) + rng.normal(0, 3, (20 * len(rows), 40, 3)), 0, 255).astype(np.uint8)


def table():
    rgb = image(SKIN, SHOE, FLOOR)
    rows = np.arange(60)[:, None] // 20 * np.ones((1, 40), int)
    counts = [colour_counts(rgb, rows == i) for i in range(3)]
    return code_table(counts[:2], counts[2])


def classes(rgb):
    return look_up(np.array([[rgb]], np.uint8), table())[0, 0] >> CLASS_SHIFT


def test_each_colour_belongs_to_its_own_class():
    assert classes(SKIN) == 1
    assert classes(SHOE) == 2


def test_the_background_and_unobserved_colours_belong_to_none():
    assert classes(FLOOR) == 0
    assert classes(NEVER) == 0


def test_a_colour_commoner_around_than_in_the_part_is_not_the_parts():
    skin, floor = (
        colour_counts(image(SKIN), np.ones((20, 40), bool)),
        colour_counts(image(FLOOR), np.ones((20, 40), bool)),
    )
    mixed = code_table([0.6 * skin + 0.4 * floor], floor)
    codes = look_up(np.array([[SKIN, FLOOR]], np.uint8), mixed) >> CLASS_SHIFT
    assert codes.tolist() == [[1, 0]]


def test_the_low_byte_of_a_code_stays_the_bin():
    assert np.array_equal(table() & 255, bin_table())


def test_every_chosen_pixel_is_counted_once():
    chosen = np.zeros((60, 40), bool)
    chosen[3:9, 5:20] = True
    assert abs(colour_counts(image(SKIN, SHOE, FLOOR), chosen).sum() - 90) < 1e-3
