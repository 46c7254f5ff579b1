"""The report's viewer in a real browser: one file, one frame in pictures, 3D and curves, and no request to anywhere."""

import json
import re

import numpy as np
import pytest

from airborne.export.film import N_MOMENTS, Film, read_film
from airborne.export.report import write_report
from airborne.export.summary import headline
from airborne.export.viewer import body_viewer
from airborne.geometry.even_sample import EvenSample
from airborne.motion.run_folder import PICTURES, videos_of
from tests.support.browser import open_file
from tests.support.export_scenes import PERSON, person_run


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """The report of a person, whose pictures' red says the frame."""
    folder, motion = tmp_path_factory.mktemp("run"), person_run()
    film = Film(videos_of(folder) / PICTURES, ["left", "right"])
    for frame in motion.index[::3].tolist():
        film.add(frame, [np.full((90, 160, 3), (10 * frame, 60, 60), np.uint8)] * 2)
    film.write()
    last = int(motion.index[-1])
    summary = {"name": "a person", **headline(motion), "warnings": [f"look at frame {last} & think"]}
    return write_report(folder, summary, body_viewer(folder, motion, PERSON)), motion


def test_all_of_it_shows_one_frame(report):
    path, motion = report
    with open_file(path) as page:
        view = page.locator("#viewer")
        x, sd = motion.position[0, 0], motion.position_sd[0, 0]
        says = page.locator("#viewer .curves").get_attribute("aria-description")
        value, _, spread, unit = says.split(",")[0].removeprefix("x ").split()
        assert (float(value), float(spread), unit) == (pytest.approx(x, abs=sd / 10), pytest.approx(sd, rel=0.1), "m")
        assert view.is_visible() and view.get_attribute("data-frame") == str(motion.index[0])
        before = page.locator(".in-3d").screenshot()
        last = int(motion.index[-1])
        page.get_by_role("link", name=f"frame {last}", exact=True).click()
        assert view.get_attribute("data-frame") == str(last)
        assert f"frame {last}, {motion.time_s[-1]:.3f} s" in page.locator(".now").inner_text()
        shown = last - last % 3
        assert (str(shown) in page.locator(".film-note").inner_text()) == (shown != last)
        page.wait_for_function("() => document.querySelector('.film img').complete")
        red = page.evaluate(
            "() => { const c = document.createElement('canvas'), p = c.getContext('2d');"
            "p.drawImage(document.querySelector('.film img'), 0, 0); return p.getImageData(5, 5, 1, 1).data[0]; }"
        )
        assert red == pytest.approx(10 * shown, abs=6)
        assert page.locator(".in-3d").screenshot() != before
        page.locator(".group").select_option(label="knee")
        curves = page.locator("#viewer .curves")
        curves.focus()
        curves.press("ArrowLeft")
        assert view.get_attribute("data-frame") == str(motion.index[-2])


def test_numbers_of_the_viewer_are_those_of_the_run(report):
    path, motion = report
    data = json.loads(re.search(r'id="run">(.*?)</script>', path.read_text("utf-8"), re.DOTALL)[1])
    assert data["frame"] == motion.index.tolist() and data["status"] == motion.status.tolist()
    x, y, z = (series["value"] for series in data["groups"][0]["series"])
    known = motion.has_pose
    np.testing.assert_allclose(
        np.array([x, y, z], float).T[known], motion.position[known], rtol=1e-4, atol=1e-9, equal_nan=True
    )


def test_pictures_are_spread_over_a_run_of_any_length(tmp_path):
    film = Film(tmp_path / PICTURES, ["a"])
    for frame in range(1000):
        film.add(frame, [np.zeros((4, 4, 3), np.uint8)])
    film.write()
    frames = read_film(tmp_path / PICTURES)["frame"]
    assert N_MOMENTS / 2 <= len(frames) <= N_MOMENTS and len(set(np.diff(frames))) == 1 and frames[-1] > 900


def test_what_is_not_kept_is_not_made():
    made, sample = [], EvenSample(4)
    for k in range(20):
        sample.offer(lambda k=k: made.append(k) or k)
    assert list(sample) == [0, 8, 16] and made == [0, 1, 2, 3, 4, 6, 8, 12, 16]
