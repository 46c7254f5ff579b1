"""A thing described in the studio: what is typed and clicked is its body file."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from airborne.body.files import read_body
from airborne.errors import BodyError
from airborne.io.text import read_toml
from airborne.studio.things import Solid, check_thing, colour_at, parse_thing, thing_text
from tests.support.browser import open_page
from tests.support.example_trial import copy_cross
from tests.support.studio import User, at_pixel, fork_studio, wait_for_frame

BOX = Solid("bar", "box", (60.0, 900.0, 45.0), (0.0, 10.0, 0.0), (0.0, 0.0, 90.0), colour=(231, 200, 48))
YELLOW_PX = (313, 354)  # of the cross at frame 0
BALL = Solid("ball", "ellipsoid", (200.0, 200.0, 210.0))


def test_a_thing_is_read_back_and_is_a_body(tmp_path):
    path = tmp_path / "thing.toml"
    path.write_text(thing_text("a club", [BOX, BALL]))
    assert parse_thing(path.read_text(), path.name) == ("a club", [BOX, BALL])
    (segment,) = read_body(path).segments
    bar, ball = segment.parts
    assert bar.shape.size_m.tolist() == [0.06, 0.9, 0.045]
    assert bar.segment_from_part.translation.tolist() == [0.0, 0.01, 0.0]
    assert ball.shape.semi_axes_m.tolist() == [0.1, 0.1, 0.105]


def test_a_body_of_several_pieces_is_left_alone():
    text = thing_text("a", [BOX]) + '[[segment]]\nname = "b"\nparent = "thing"\n'
    with pytest.raises(BodyError, match=r"thing\.toml is more than solids in one piece"):
        parse_thing(text, "thing.toml")


@pytest.mark.parametrize(
    ("solid", "says"),
    [
        (replace(BOX, size_mm=(60.0, -5.0, 45.0)), r"bar: lengths \[mm\] y is -5; expected more than 0"),
        (replace(BOX, size_mm=(60.0, math.nan, 45.0)), r"bar: lengths \[mm\] y is missing; give a number"),
        (replace(BOX, centre_mm=(0.0, 0.0, math.nan)), r"bar: centre \[mm\] z is missing"),
        (replace(BOX, size_mm=(60.0, 900.0, 45000.0)), r"bar: lengths \[mm\] z is 45000; expected at most 20000 mm"),
        (replace(BOX, shape="hull.stl", scale=0.0), r"bar: its unit \[m\] is 0; expected more than 0"),
        (replace(BOX, shape="hull.stl"), r"hull\.stl"),
        (replace(BOX, name=""), "a name has 1 to 80 characters"),
        (BALL, "two solids have the same name"),
    ],
)
def test_what_cannot_be_used_is_refused_in_the_form_s_words_and_not_written(tmp_path, solid, says):
    with pytest.raises(BodyError, match=says):
        check_thing(tmp_path, "thing.toml", "a club", [BALL, solid])
    assert list(tmp_path.iterdir()) == []


def test_a_field_that_is_empty_stays_empty_in_the_draft():
    _, (solid,) = parse_thing(thing_text("a", [replace(BOX, size_mm=(60.0, math.nan, 45.0))]), "thing.toml")
    assert math.isnan(solid.size_mm[1]) and solid.size_mm[::2] == (60.0, 45.0)


def test_a_colour_is_the_median_about_a_click_even_at_the_border():
    image = np.full((20, 30, 3), (10, 200, 30), np.uint8)
    image[9, 9] = 255
    assert colour_at(image, 9.2, 8.9) == colour_at(image, -0.4, 19.4) == (10, 200, 30)


def test_a_solid_takes_the_colour_that_is_clicked_in_a_picture(tmp_path):
    folder = copy_cross(tmp_path / "cross")
    with fork_studio(folder) as address, open_page(address.replace("/?", "/thing?")) as page:
        wait_for_frame(page, 0)
        page.get_by_label("lengths [mm] y").fill("900")
        page.mouse.click(*at_pixel(page, 0, *YELLOW_PX))
        page.get_by_text(re.compile(r"colour \d")).wait_for()
        User(page).press("Use this thing")
        page.get_by_text("the body is written into the trial").wait_for()
        User(page).go("Body")
        page.get_by_text("The body now: thing.toml").wait_for()
        page.wait_for_function("document.querySelector('canvas.view')?.view?.nowItems().length >= 3")  # its first pose
    (solid,) = parse_thing((folder / "thing.toml").read_text(), "thing.toml")[1]
    assert (solid.size_mm, read_toml(folder / "trial.toml")["body"]["file"]) == ((100.0, 900.0, 100.0), "thing.toml")
    red, green, blue = solid.colour
    assert red > green > 2 * blue
