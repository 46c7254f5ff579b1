"""Truth tables, right and wrong."""

import numpy as np
import pytest

from airborne.errors import ResultError
from airborne.evaluation import read_truth
from tests.support.tolerances import ROUNDTRIP

HEADER = "frame,time_s,x_m,y_m,z_m,r00,r01,r02,r10,r11,r12,r20,r21,r22"
LINE = "{},{},1,2,3,0,-1,0,1,0,0,0,0,1"


def write(tmp_path, *lines, header=HEADER):
    path = tmp_path / "truth.csv"
    path.write_text("\n".join([header, *lines]) + "\n")
    return path


def test_truth_is_read_with_its_rotations_row_by_row(tmp_path):
    truth = read_truth(write(tmp_path, LINE.format(0, 0.0), LINE.format(1, 0.5)))
    assert truth.index.tolist() == [0, 1]
    assert truth.time_s.tolist() == [0.0, 0.5]
    np.testing.assert_array_equal(truth.position[1], [1, 2, 3])
    np.testing.assert_array_equal(truth.R[1] @ [1, 0, 0], [0, 1, 0])


def test_one_line_is_a_truth(tmp_path):
    assert len(read_truth(write(tmp_path, LINE.format(0, 0.0))).time_s) == 1


def test_fields_count_as_frames_and_columns_may_stand_in_any_order(tmp_path):
    header = HEADER.replace("frame,", "").replace("x_m", "field,x_m")
    truth = read_truth(write(tmp_path, "0.5,7,1,2,3,0,-1,0,1,0,0,0,0,1", header=header))
    assert truth.index.tolist() == [7]


def test_bundled_truth_is_read(thrown_cross):
    truth = read_truth(thrown_cross / "truth.csv")
    assert len(truth.index) == 34
    np.testing.assert_allclose(np.diff(truth.time_s), 0.02, atol=ROUNDTRIP)


@pytest.mark.parametrize(
    ("lines", "complaint"),
    [
        ([], "no lines of numbers"),
        (["0,0"], "line 2 has 2 cells, expected 14"),
        ([LINE.format(0, "soon")], "line 2: time_s is 'soon', expected a number"),
        ([LINE.format(0, "")], "line 2 has an empty cell"),
        ([LINE.format(0, "inf")], "line 2: time_s is 'inf', expected a number"),
        ([LINE.format(0.5, 0)], "line 2: frame must be a whole number"),
        ([LINE.format(0, 1), LINE.format(1, 1)], "line 3: time_s 1 is not after"),
        (["", LINE.format(0, 1), "", LINE.format(1, 1)], "line 5: time_s 1 is not after"),
        (["", "", LINE.format(0, "soon")], "line 4: time_s is .soon., expected a number"),
        ([LINE.format(0, 1).replace("-1", "1")], "line 2: .* not a rotation"),
        ([LINE.format(0, 1).replace("-1", "-2")], "line 2: .* not a rotation"),
    ],
)
def test_wrong_line_is_named(tmp_path, lines, complaint):
    with pytest.raises(ResultError, match=complaint) as caught:
        read_truth(write(tmp_path, *lines))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("missing", ["frame", "time_s", "r22"])
def test_missing_column_is_named(tmp_path, missing):
    with pytest.raises(ResultError, match=f"no column {missing}"):
        read_truth(write(tmp_path, LINE.format(0, 0), header=HEADER.replace(missing, "other")))


def test_missing_and_unreadable_files_are_refused_in_one_line(tmp_path):
    with pytest.raises(ResultError, match="cannot be read"):
        read_truth(tmp_path / "none.csv")
    (tmp_path / "picture.csv").write_bytes(b"\x89PNG\xff\xd8")
    with pytest.raises(ResultError, match="is not a text file"):
        read_truth(tmp_path / "picture.csv")


def test_truth_of_joint_centres_is_refused_as_no_truth_of_poses(shared_data):
    with pytest.raises(ResultError, match="no column x_m"):
        read_truth(shared_data("block_jump") / "truth.csv")
