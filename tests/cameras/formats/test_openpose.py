"""Detections as OpenPose's JSON: there and back, and which of several people."""

import json

import numpy as np
import pytest

from airborne.cameras import Detections, read_detections
from airborne.cameras.detections import camera_names, write_detections
from airborne.errors import CalibrationError
from tests.support.people_seen import four_cameras, seen, walking


def some():
    found = seen(four_cameras(), walking(3))
    found.px[1, 4, 2], found.visibility[1, 4, 2] = np.nan, 0
    found.px[2, :, 0], found.visibility[2, :, 0] = np.nan, 0  # nobody in the last picture
    return found


def crowd(folder, *people):
    """A camera's folder with one picture of people of a network of 17, each as sure as said."""
    (folder / "a_json").mkdir()
    points = [np.column_stack([np.full((17, 2), 10.0 * k), np.full(17, sure)]) for k, sure in enumerate(people, 1)]
    document = {"people": [{"pose_keypoints_2d": each.ravel().tolist()} for each in points]}
    (folder / "a_json" / "a_000000.json").write_text(json.dumps(document))


@pytest.mark.parametrize("as_folder", [True, False])
def test_detections_come_back(tmp_path, as_folder):
    path = tmp_path / "pose"
    write_detections(path, some(), as_folder=as_folder)
    assert sorted(camera_names(path)) == sorted(some().cameras)
    back = read_detections(path, some().cameras)
    np.testing.assert_array_equal(back.px, some().px)
    np.testing.assert_array_equal(back.visibility, some().visibility)


def test_an_image_with_nobody_has_no_people(tmp_path):
    write_detections(tmp_path, some(), as_folder=True)
    document = json.loads((tmp_path / "left_json" / "left_000002.json").read_text())
    assert document["people"] == []


def test_the_surest_of_several_people_is_taken_where_it_is_clear(tmp_path):
    crowd(tmp_path, 0.4, 0.9)
    found = read_detections(tmp_path, ["a"])
    assert found.px[0, 0, 0].tolist() == [20, 20]
    assert found.notes == ("a: up to 2 people in an image; took the one detected most surely",)


def test_people_detected_alike_are_refused_until_one_is_chosen(tmp_path):
    crowd(tmp_path, 0.8, 0.9)
    with pytest.raises(CalibrationError, match="two of 2 people are detected about equally surely; say which one"):
        read_detections(tmp_path, ["a"])
    for person in (0, 1):
        assert read_detections(tmp_path, ["a"], person=person).px[0, 0, 0].tolist() == [10 * (person + 1)] * 2
    with pytest.raises(CalibrationError, match="there is nobody in any image"):
        read_detections(tmp_path, ["a"], person=2)


def test_a_frame_far_away_takes_no_memory(tmp_path):
    crowd(tmp_path, 0.9)
    (tmp_path / "a_json" / "a_000000.json").rename(tmp_path / "a_json" / "a_999999999999.json")
    with pytest.raises(CalibrationError, match="a file is of frame 999999999999"):
        read_detections(tmp_path, ["a"])


def test_clicked_points_are_no_networks(tmp_path):
    points = Detections.from_clicks(("a",), ("toe",), np.zeros((2, 1, 1, 2)))
    with pytest.raises(CalibrationError, match=r"1 points \(toe, ...\) are not a pose network's"):
        write_detections(tmp_path / "d.npz", points)
