"""Tables of digitised points: what is written is read again, and what is expected follows one's own clicks."""

import numpy as np
import pytest

from airborne.errors import AirborneError
from airborne.evaluation import format_clicked_frames
from airborne.studio.digitising import (
    Repetition,
    clicks_of_frame,
    list_other_clicks,
    list_repetitions,
    parse_repetition,
    predict_click,
    read_digitising,
    set_frame,
)

CAMERAS = ("left", "far_left")
POINTS = ("bar_minus", "bar_plus")


def digitise(table, frame, point, camera, px):
    clicked = clicks_of_frame(table, frame, CAMERAS).click(point, camera, px)
    return set_frame(table, frame, clicked, CAMERAS)


@pytest.fixture
def table(tmp_path):
    table = read_digitising(tmp_path / "none.csv", CAMERAS, POINTS)
    for frame, u in ((8, 30.0), (2, 10.0), (4, 20.0)):
        table = digitise(table, frame, "bar_plus", "far_left", (u, 5.0))
    return digitise(table, 4, "hand", "left", (7.25, 8.5))


def test_what_is_written_is_read_again(table, tmp_path):
    path = tmp_path / "digitised_A_1.csv"
    path.write_text(format_clicked_frames(table, CAMERAS))
    again = read_digitising(path, CAMERAS, ())
    assert again.points == ("bar_minus", "bar_plus", "hand") and again.index.tolist() == [2, 4, 8]
    np.testing.assert_array_equal(again.px, table.px)
    assert clicks_of_frame(again, 4, CAMERAS).at("hand", "left").tolist() == [7.25, 8.5]
    assert np.isnan(clicks_of_frame(again, 5, CAMERAS).at("hand", "left")).all()


def test_a_click_taken_back_leaves_a_blank(table):
    table = digitise(table, 4, "hand", "left", (np.nan, np.nan))
    assert format_clicked_frames(table, CAMERAS).splitlines()[2] == "4,,,,,,,20.0,5.0,,,,"


def test_a_point_is_expected_on_the_line_through_the_two_nearest_frames(table):
    assert predict_click(table, 3, "bar_plus", 1).tolist() == [15, 5]
    assert predict_click(table, 6, "bar_plus", 1).tolist() == [25, 5]
    assert np.isnan(predict_click(table, 60, "bar_plus", 1)).all()
    assert np.isnan(predict_click(table, 3, "bar_minus", 1)).all()
    assert predict_click(table, 6, "hand", 0).tolist() == [7.25, 8.5]


def test_people_and_repetitions_are_told_from_the_files_names(tmp_path):
    for name in (
        "digitised_A_1.csv",
        "digitised_K-2_12.csv",
        "digitised_.._1.csv",
        "digitised_A_1.json",
        "digitised.csv",
    ):
        (tmp_path / name).touch()
    assert list_repetitions(tmp_path) == [Repetition("A", 1), Repetition("K-2", 12)]
    (tmp_path / "digitised.csv").touch()
    (tmp_path / "digitised_A_1_joints.csv").touch()
    assert "digitised.csv" in list_other_clicks(tmp_path)
    assert not {"digitised_A_1.csv", "digitised_A_1_joints.csv"} & set(list_other_clicks(tmp_path))


@pytest.mark.parametrize(("operator", "number"), [("", 1), ("a/b", 1), ("..", 2), ("A", 0), ("A", 100), ("A", None)])
def test_a_name_that_no_file_can_have_is_refused(operator, number):
    with pytest.raises(AirborneError, match="letters"):
        parse_repetition(operator, number)
