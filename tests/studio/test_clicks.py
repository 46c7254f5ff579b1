"""Tables of clicked points: read in any state of completion, and written so that the command line reads them."""

import numpy as np
import pytest

from airborne.calibration.sources.control_points import read_control_points
from airborne.cameras import Rig, camera_looking_at
from airborne.cameras.clicks import read_clicks
from airborne.studio.clicks import Clicked, count_clicked, list_surveys, measure_between, read_clicked

SURVEY = "point,x_m,y_m,z_m\nP1,0.0,1.25,0.5\nP2,1.0,2.0,-0.125\n"


def test_a_survey_without_clicks_grows_into_control_points(tmp_path):
    path = tmp_path / "survey.csv"
    path.write_text(SURVEY)
    clicked = read_clicked(path)
    assert count_clicked(clicked, "left") == 0
    clicked = clicked.click("P2", "left", (10.123, 20.5)).click("P1", "right", (1, 2))
    path.write_text(clicked.text(["left", "right"]))
    points = read_control_points(path)
    assert points.names == ("P1", "P2")
    assert np.array_equal(points.world, [[0, 1.25, 0.5], [1, 2, -0.125]])
    assert np.array_equal(points.px, [[[np.nan] * 2, [1, 2]], [[10.12, 20.5], [np.nan] * 2]], equal_nan=True)


def test_a_click_is_taken_back(tmp_path):
    clicked = Clicked((), None, {}).click("hip_left", "left", (1, 2)).click("hip_left", "left", (np.nan, np.nan))
    assert clicked.text(["left"]) == "point,left_u,left_v\nhip_left,,\n"


def test_landmarks_are_read_as_clicks(tmp_path):
    clicked = Clicked((), None, {}).click("hip_left", "left", (1, 2)).click("hip_right", "right", (3, 4))
    (tmp_path / "points.csv").write_text(clicked.text(["left", "right"]))
    names, px = read_clicks(tmp_path / "points.csv", ("left", "right"))
    assert names == ("hip_left", "hip_right")
    assert np.array_equal(px, [[[1, 2], [np.nan] * 2], [[np.nan] * 2, [3, 4]]], equal_nan=True)


def test_surveys_are_told_from_other_tables(tmp_path):
    (tmp_path / "survey.csv").write_text(SURVEY)
    (tmp_path / "clicks.csv").write_text("point,a_u,a_v\nP1,1,2\n")
    (tmp_path / "truth.csv").write_text("field,time_s\n0,0.0\n")
    found = list_surveys(tmp_path)
    assert (found.usable, found.refused) == (["survey.csv"], {})


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (SURVEY.replace("2.0", "two"), "survey.csv, row 3 (point 'P2'), column y_m: 'two' is not a number; correct it"),
        (SURVEY.replace("1.25", ""), "survey.csv, point 'P1', column y_m: nothing stands there; expected metres"),
        ("point,x_m,y_m,z_m,a_u,a_v\nP1,0,0,0,3,\n", "survey.csv, point 'P1': only one of a_u and a_v is there"),
        (SURVEY.replace(",", ";"), "survey.csv: columns are separated by semicolons; save it with commas"),
        (SURVEY.replace("_m", ""), "survey.csv has no columns x_m, y_m, z_m; expected surveyed points"),
        ("point,x_m,y_m,z_m\n", "survey.csv: found header point,x_m,y_m,z_m and 0 rows"),
    ],
)
def test_a_survey_with_a_mistake_is_listed_and_says_where(tmp_path, text, says):
    (tmp_path / "survey.csv").write_text(text)
    found = list_surveys(tmp_path)
    assert found.usable == [] and list(found.refused) == ["survey.csv"]
    assert found.refused["survey.csv"].startswith(says)


def test_the_deviation_of_a_length_is_that_of_lengths_from_many_clicks():
    places = {"a": [3.0, -4.0, 1.5], "b": [-4.0, -3.0, 1.2], "c": [0.0, 5.0, 1.4]}
    rig = Rig(tuple(camera_looking_at(n, p, [0, 0, 1.1], focal_px=600, size=(640, 480)) for n, p in places.items()))
    ends, rng = np.array([[0.0, 0.1, 0.2], [0.3, -0.2, 1.5]]), np.random.default_rng(5)
    px = np.stack([[camera.px_from_world(end) for camera in rig] for end in ends])
    px[1, 2] = np.nan  # the second end is clicked in two cameras
    clicks = px + rng.standard_normal((400, *px.shape))
    measured = np.array([measure_between(rig, *each, sd_px=1.0) for each in clicks])
    assert measured[:, 0].mean() == pytest.approx(np.linalg.norm(ends[1] - ends[0]), abs=0.002)
    assert measured[:, 0].std() == pytest.approx(measured[:, 1].mean(), rel=0.12)
