"""Files that are not quite what they should be: told in one line, or read as the format means them."""

import re

import numpy as np
import pytest

from airborne.cameras import read_rig, write_rig
from airborne.errors import CalibrationError
from tests.support.cameras import LENS, three_cameras
from tests.support.format_rigs import assert_same

RIG = three_cameras(LENS * [1, 1, 0, 0, 1])
XML_BOMB = '<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "b">]><calibration><cameras/></calibration>'


@pytest.fixture
def text_of(tmp_path):
    """The text of a rig in a format; and a function that reads a changed one."""

    def write(kind, rig=RIG):
        write_rig(tmp_path / "whole", rig, format=kind)
        return (tmp_path / "whole").read_text()

    return write


def read(tmp_path, text, **options):
    (tmp_path / "changed").write_text(text)
    return read_rig(tmp_path / "changed", **options)


def test_caliscope_cameras_without_a_place_are_left_out(tmp_path, text_of):
    text = text_of("caliscope")
    rotation = re.findall(r"rotation = .*\n", text)[1]
    for absent in ("", 'rotation = "null"\n'):
        found = read(tmp_path, text.replace(rotation, absent))
        assert found.names == ("cam_0", "cam_2")
    with pytest.raises(CalibrationError, match="none of its 3 cameras has a pose"):
        read(tmp_path, re.sub(r"rotation = .*\n", "", text))


def test_a_caliscope_rotation_count_turns_no_calibration(tmp_path, text_of):
    text = text_of("caliscope").replace("rotation_count = 0", "rotation_count = 1")
    assert_same(read(tmp_path, text), RIG, with_names=False)


def test_the_recorded_caliscope_session_is_in_metres(shared_data):
    rig = read_rig(shared_data("charuco") / "camera_array.toml")
    assert rig.names == ("cam_0", "cam_1", "cam_2", "cam_3")
    centres = np.stack([camera.centre for camera in rig])
    assert 0.5 < np.linalg.norm(centres[:, None] - centres, axis=-1).max() < 3


def test_a_cameras_order_is_not_that_of_sorted_keys(tmp_path, text_of):
    """Other tools put cam_10 before cam_2; names stay with their cameras."""
    blocks = text_of("pose2sim").split("\n\n")
    found = read(tmp_path, "\n\n".join([blocks[2], blocks[0], blocks[1], *blocks[3:]]))
    assert found.names == ("side", "left", "right")
    assert_same(found.select(RIG.names), RIG)


@pytest.mark.parametrize(
    ("kind", "old", "new", "message"),
    [
        ("vicon", "<KeyFrames>", "<Keys>", "is not a calibration: as XML"),
        ("vicon", "KeyFrame", "Key", "has no calibrated cameras"),
        ("vicon", 'SKEW="0"', 'SKEW="2"', "SKEW is not 0"),
        ("vicon", "FOCAL_LENGTH", "FOCUS", "FOCAL_LENGTH of <KeyFrame> is missing, expected a number"),
        ("vicon", 'FOCAL_LENGTH="1000.0"', 'FOCAL_LENGTH="-1"', "FOCAL_LENGTH and PIXEL_ASPECT_RATIO must be positive"),
        ("vicon", 'ORIENTATION="', 'ORIENTATION="1 ', "ORIENTATION = ['1', "),
        ("vicon", 'ORIENTATION="0.', 'ORIENTATION="9.', "ORIENTATION is not a unit quaternion"),
        ("vicon", 'SENSOR_SIZE="768 576"', 'SENSOR_SIZE="768.5 576"', "expected width and height in whole pixels"),
        ("opencv", "dt: d", "dt: d\n   rows: 4", "is 4×"),
        ("opencv", "K_left", "C_left", "camera 'left': no K_left; expected an OpenCV matrix of 3×3 numbers"),
        ("opencv", "W_left: 768", "W_left: wide", "W_left = wide"),
        ("opencv", "H_left: 576", "H_left: 99999999", "expected width and height in whole pixels"),
        ("opencv", "data: [ ", "data: [ one, ", "expected 9 numbers"),
        ("caliscope", "matrix", "K", "[cameras.0]: no matrix; expected 3×3 numbers"),
        ("pose2sim", "distortions = [", "distortions = [1, 2, ", "distortions = [1, 2,"),
        ("pose2sim", "1000.0", "1e300", "expected 3×3 numbers"),
        ("qualisys", "<?xml", XML_BOMB + "<?xml", "declares a document type or entities"),
    ],
)
def test_what_is_wrong_is_reported_in_one_line(tmp_path, text_of, kind, old, new, message):
    text = text_of(kind)
    assert old in text
    with pytest.raises(CalibrationError) as error:
        read(tmp_path, text.replace(old, new))
    assert message in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,2\n" * 10, "10 rows of 2 numbers; expected 11 rows, one column a camera"),
        ("1,2\n" * 10 + "1\n", "11 rows of 1 or 2 numbers"),
        ("1,2\n" * 10 + "1,x\n", "a coefficient is not a number"),
        ("1,2\n" * 11, "these coefficients are no camera's"),
        ("0\n" * 11, "these coefficients are no camera's"),
    ],
)
def test_a_table_that_is_no_cameras_is_reported(tmp_path, text, message):
    with pytest.raises(CalibrationError) as error:
        read(tmp_path, text, size=(768, 576))
    assert message in str(error.value)


def test_a_file_larger_than_any_calibration_is_not_read(tmp_path):
    with pytest.raises(CalibrationError, match="larger than 2 MB; expected Pose2Sim"):
        read(tmp_path, " " * 2_000_001)


def test_a_folder_without_yaml_is_reported(tmp_path):
    with pytest.raises(CalibrationError, match="is a folder without OpenCV YAML"):
        read_rig(tmp_path)
