"""Colours that are taken from the video."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from airborne.body import BodyModel, Ellipsoid, Part, Segment
from airborne.body.colours import FEWEST_PX, with_sampled_colours
from airborne.errors import BodyError

PAINTED = np.array([1.0, 2.0, 3.0])


def body(*colours):
    shape = Ellipsoid(np.array([0.1, 0.1, 0.1]))
    parts = [Part(f"part{i}", shape, RigidTransform.identity(), colour) for i, colour in enumerate(colours)]
    return BodyModel("body", (Segment("root", None, np.zeros(3), tuple(parts)),))


def test_part_takes_the_median_colour_so_that_a_few_foreign_pixels_do_not_matter():
    pixels = np.vstack([np.tile([200, 150, 40], (60, 1)), np.tile([0, 255, 255], (40, 1))]).astype(np.uint8)
    model = with_sampled_colours(body(None), [pixels])
    np.testing.assert_array_equal(model.parts[0].colour, [200, 150, 40])
    assert not model.needs_colours


def test_part_with_a_colour_of_its_own_keeps_it():
    pixels = np.full((FEWEST_PX, 3), 99, np.uint8)
    model = with_sampled_colours(body(PAINTED, None), [pixels[:0], pixels])
    np.testing.assert_array_equal(model.parts[0].colour, PAINTED)
    np.testing.assert_array_equal(model.parts[1].colour, [99, 99, 99])


def test_part_that_too_few_pixels_show_is_refused_by_name():
    pixels = np.full((FEWEST_PX - 1, 3), 99, np.uint8)
    with pytest.raises(BodyError, match=f"part 'part1' .* only {FEWEST_PX - 1} pixels show it"):
        with_sampled_colours(body(PAINTED, None), [pixels, pixels])
