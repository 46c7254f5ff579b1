"""Tables of clicked points and of places."""

import numpy as np
import pytest

from airborne.cameras.clicks import read_clicks, read_positions
from airborne.errors import CalibrationError

CLICKS = "point,right_u,right_v,left_u,left_v\nhip_left,3,4,1,2\nknee_left,,,5,6\n"
PLACES = "joint,x_m,y_m,z_m\nhip_left,1,2,3\nhead,,,\n"


def write(folder, text):
    (folder / "points.csv").write_text(text, encoding="utf-8")
    return folder / "points.csv"


def test_clicks_are_given_by_camera_in_the_order_asked_for(tmp_path):
    names, px = read_clicks(write(tmp_path, CLICKS), ["left", "right"])
    assert names == ("hip_left", "knee_left")
    np.testing.assert_array_equal(px, [[[1, 2], [3, 4]], [[5, 6], [np.nan, np.nan]]])


def test_camera_without_columns_saw_nothing_and_others_do_not_matter(tmp_path):
    _, px = read_clicks(write(tmp_path, CLICKS), ["left", "above", "right"])
    assert np.isnan(px[:, 1]).all()
    with pytest.raises(CalibrationError, match="of left of the cameras left, above; a position needs two"):
        read_clicks(write(tmp_path, CLICKS), ["left", "above"])


def test_the_same_clicks_given_to_two_cameras_are_refused(tmp_path):
    rows = ["a,1,2,1,2", "b,3,4,3,4", "c,5,6,5,6", "d,7,8,,"]
    table = write(tmp_path, "\n".join(["point,left_u,left_v,right_u,right_v", *rows]))
    with pytest.raises(
        CalibrationError, match=r"points\.csv: cameras left and right have the same 3 clicks; give each"
    ):
        read_clicks(table, ["left", "right"])
    rows[2] = "c,5,6,5,6.5"
    assert read_clicks(write(tmp_path, "\n".join(["point,left_u,left_v,right_u,right_v", *rows])), ["left", "right"])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("knee_left,,", "knee_left,7,", "point 'knee_left' has only one of right_u and right_v"),
        ("3,4", "3,x", r"row 2 \(point 'hip_left'\), column right_v: 'x' is not a number; correct it"),
        ("3,4", "3,inf", "'inf' is not a number"),
        ("knee_left", "hip_left", "row 3: 'hip_left,,,5,6': hip_left stands in row 2 already; name each point once"),
        ("5,6", "5,5,6", "row 3: 'knee_left,,,5,5,6' has 6 values; it needs 5, and decimals points"),
        ("5,6", "5", "row 3: 'knee_left,,,5' has 4 values; it needs 5"),
        ("point", "joint", "found header joint,right_u"),
        ("right_u", "x_m", "column 'x_m' is not <camera>_u or <camera>_v"),
        ("knee_left", "", "row 3: ',,,5,6' names no point"),
        ("right_u,right_v", "Right u_u,RIGHT_v", "column 'RIGHT_v' is of no camera; write right_v"),
        (CLICKS, "", "points.csv: is empty; expected point"),
        (CLICKS, "point,a_u,a_v\n", "and 0 rows"),
    ],
)
def test_malformed_table_is_refused_in_one_line(tmp_path, old, new, said):
    assert old in CLICKS
    with pytest.raises(CalibrationError, match=said) as caught:
        read_clicks(write(tmp_path, CLICKS.replace(old, new, 1)), ["left", "right"])
    assert str(caught.value).startswith("points.csv")
    assert "\n" not in str(caught.value)


def test_places_are_read_and_blank_ones_unknown(tmp_path):
    found = read_positions(write(tmp_path, PLACES))
    np.testing.assert_array_equal(found["hip_left"], [1, 2, 3])
    assert np.isnan(found["head"]).all()
    swapped = read_positions(write(tmp_path, "z_m,joint,y_m,x_m\n3,hip_left,2,1\n"))
    np.testing.assert_array_equal(swapped["hip_left"], [1, 2, 3])


@pytest.mark.parametrize(
    "text", ["joint,x,y,z\nhip_left,1,2,3\n", PLACES.replace("z_m", "z_m,w").replace("3\n", "3,4\n")]
)
def test_places_of_other_columns_are_refused(tmp_path, text):
    with pytest.raises(CalibrationError, match=r"expected joint,x_m,y_m,z_m"):
        read_positions(write(tmp_path, text))


def test_file_that_is_no_text_or_not_there_is_refused(tmp_path):
    (tmp_path / "points.csv").write_bytes(bytes(range(256)))
    with pytest.raises(CalibrationError, match="is not a text file"):
        read_positions(tmp_path / "points.csv")
    with pytest.raises(CalibrationError, match="cannot be read"):
        read_positions(tmp_path / "none.csv")
