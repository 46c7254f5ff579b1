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


def person(*segments):
    """Return a body of segments, each given its parent and the names of its parts."""
    shape = Ellipsoid(np.array([0.1, 0.1, 0.1]))
    return BodyModel(
        "person",
        tuple(
            Segment(
                name, parent, np.zeros(3), tuple(Part(part, shape, RigidTransform.identity(), None) for part in parts)
            )
            for name, parent, parts in segments
        ),
    )


LEGS = person(
    ("pelvis", None, ["shorts"]),
    ("thigh_left", "pelvis", ["thigh_left_skin"]),
    ("thigh_right", "pelvis", ["thigh_right_skin"]),
    ("foot_right", "thigh_right", ["foot_right"]),
)


def shown(*greys):
    return [np.full((0 if grey is None else FEWEST_PX, 3), grey or 0, np.uint8) for grey in greys]


def test_part_that_nothing_shows_has_the_colour_of_its_other_side():
    notes = []
    model = with_sampled_colours(LEGS, shown(10, 20, None, 40), notes.append)
    assert [part.colour[0] for part in model.parts] == [10, 20, 20, 40]
    assert notes == [
        "body: part 'thigh_right_skin' has the colour of 'thigh_left_skin', as only 0 pixels show it at the first pose "
        "(at least 20 needed)"
    ]


def test_part_of_which_neither_side_is_seen_has_the_colour_of_the_next_segment_toward_the_root():
    notes = []
    model = with_sampled_colours(LEGS, shown(10, None, None, None), notes.append)
    assert [part.colour[0] for part in model.parts] == [10, 10, 10, 10]
    assert len(notes) == 3
    with pytest.raises(BodyError, match=r"part 'shorts' .* only 0 pixels show it"):
        with_sampled_colours(LEGS, shown(None, 20, 30, 40))
