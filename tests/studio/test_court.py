"""The points of a volleyball court, chosen on the page Cameras in a real browser and clicked as surveyed ones are."""

from fractions import Fraction

import pytest

from airborne.io.text import read_toml
from airborne.studio.clicks import read_clicked
from tests.support.browser import open_page
from tests.support.clips import textured, write_clip
from tests.support.studio import at_pixel, fork_studio, wait_for_frame


def test_a_court_becomes_a_table_whose_points_are_clicked(tmp_path):
    folder = tmp_path / "court"
    folder.mkdir()
    write_clip(folder / "a.mp4", textured(3, (320, 240)), rate=Fraction(50), codec="libx264", pix_fmt="yuv420p")
    (folder / "trial.toml").write_text('name = "court"\ncamera = [{ name = "a", video = "a.mp4" }]\n')
    with fork_studio(folder) as address, open_page(address.replace("/?", "/cameras?")) as page:
        page.get_by_text("The folder holds neither a calibration of these cameras nor a table").wait_for()
        page.get_by_label("volleyball court").click()
        page.get_by_role("option", name="women").click()
        page.locator(".point.here").wait_for()
        wait_for_frame(page, 0)
        page.mouse.click(*at_pixel(page, 0, 100.0, 80.0))
        page.get_by_text("1 point of the 6 that are needed").wait_for()
    assert read_toml(folder / "trial.toml")["calibration"] == {"control_points": "court_women.csv"}
    clicked = read_clicked(folder / "court_women.csv")
    assert clicked.at(clicked.names[0], "a") == pytest.approx([100.0, 80.0], abs=1.0)
