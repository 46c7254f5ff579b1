import numpy as np
import pytest

from airborne.calibration.sources.control_points import read_control_points
from airborne.errors import CalibrationError

GOOD = "point,x_m,y_m,z_m,a_u,a_v,b_u,b_v\nP1,0,1,2,10,20,30,40\nP2,3,4,5,,,50,60\n"


def written(tmp_path, content):
    path = tmp_path / "points.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def test_blank_pixels_are_points_not_seen(tmp_path):
    points = read_control_points(written(tmp_path, GOOD))
    assert points.names == ("P1", "P2")
    assert points.cameras == ("a", "b")
    assert np.array_equal(points.world, [[0, 1, 2], [3, 4, 5]])
    assert np.array_equal(points.px, [[[10, 20], [30, 40]], [[np.nan, np.nan], [50, 60]]], equal_nan=True)
    assert points.is_seen_by("a").tolist() == [True, False]


@pytest.mark.parametrize("change", ["\ufeff{}", "{}\n\n,,,,,,,\n"])
def test_a_byte_mark_or_blank_rows_change_nothing(tmp_path, change):
    points = read_control_points(written(tmp_path, change.format(GOOD)))
    assert points.names == ("P1", "P2")


@pytest.mark.parametrize("commas", [",", ",,,"])
def test_lines_that_end_in_commas_are_read_without_them(tmp_path, commas):
    points = read_control_points(written(tmp_path, GOOD.replace("\n", f"{commas}\n")))
    assert points.cameras == ("a", "b") and points.px[1, 1].tolist() == [50, 60]


def test_columns_may_stand_in_any_order(tmp_path):
    points = read_control_points(written(tmp_path, "b_v,z_m,b_u,point,x_m,y_m\n40,2,30,P1,0,1\n"))
    assert np.array_equal(points.world, [[0, 1, 2]])
    assert np.array_equal(points.px, [[[30, 40]]])


def test_the_bundled_points_are_seen_by_three_cameras(points):
    assert points.cameras == ("cam1", "cam2", "cam3")
    assert [points.is_seen_by(camera).sum() for camera in points.cameras] == [23, 23, 21]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "is empty"),
        ("\n\n", "is empty"),
        (GOOD.splitlines()[0], "a header but no points"),
        (b"\x89PNG\r\n\x1a\n\xff\xfe", "not a text file"),
        (b"a,b\0c\n1,2\n", "not a text file"),
        (GOOD.replace("z_m", "z_mm"), "no column z_m; found point,x_m,y_m,z_mm"),
        (GOOD.replace(",", ";"), "separated by semicolons"),
        (GOOD.replace("b_v", "a_v"), "column 'a_v' stands twice"),
        (GOOD.replace("b_v", "b_w"), "column 'b_w' is not <camera>_u or <camera>_v"),
        (GOOD.replace("b_v", "c_v"), "camera 'b' has no column b_v"),
        ("point,x_m,y_m,z_m\nP1,0,1,2\n", "no camera columns"),
        (GOOD.replace("50", "fifty"), "row 3, column b_u: 'fifty' is not a number"),
        (
            GOOD.replace("50", "-"),
            "'-' is not a number; give one, or leave both cells empty where the camera does not see",
        ),
        (GOOD.partition("\n")[2], "has no header: its first row holds numbers"),
        (GOOD.replace("b_v\n", "b_v,\n").replace("60\n", "60,7\n"), "column '' is not <camera>_u"),
        (GOOD.replace("3,4,5", "3,inf,5"), "row 3, column y_m: 'inf' is not a number"),
        (GOOD.replace("3,4,5", "3,,5"), "row 3, column y_m: '' is not a number"),
        (GOOD.replace("50", ""), "row 3: camera 'b' has only one of u and v"),
        (GOOD.replace("P2", "P1"), "point 'P1' stands in rows 2 and 3"),
        (GOOD.replace("P2", ""), "row 3: the point has no name"),
        (GOOD.replace(",60", ""), "row 3: 7 values, expected 8"),
        (GOOD + '"' + "x" * 200_000, "not a table with commas"),
    ],
)
def test_a_malformed_file_is_reported_in_one_line(tmp_path, content, message):
    with pytest.raises(CalibrationError) as error:
        read_control_points(written(tmp_path, content))
    assert message in str(error.value)
    assert "points.csv" in str(error.value)
    assert "\n" not in str(error.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(CalibrationError, match=r"none\.csv cannot be read"):
        read_control_points(tmp_path / "none.csv")
