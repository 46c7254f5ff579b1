"""Calibrations of a folder: those of these cameras, those with other names for them, and why the rest are none."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from airborne.cameras import Rig, camera_looking_at, write_pose2sim
from airborne.io.text import read_toml
from airborne.studio.calibrations import guess_name, list_calibrations
from airborne.trial.file import read_trial
from tests.support.browser import open_page
from tests.support.clips import write_clip
from tests.support.places import THROWN_CROSS
from tests.support.studio import User, fork_studio

SIZE = (320, 240)
SURVEY = "point,x_m,y_m,z_m\nP1,1,2,3\n"
NAMES = ("left", "right")
PLACES = ([3.0, -4.0, 1.5], [-4.0, -3.0, 1.2])
TRIAL = """name = "fall"
[[camera]]  # a remark
name = "left"
video = "left.mp4"

[[camera]]
name = "right"
video = "right.mp4"

[body]
file = "cross.toml"
"""


def rig_of(*names):
    cameras = (camera_looking_at("x", place, [0, 0, 1], focal_px=300, size=SIZE) for place in PLACES)
    return Rig(tuple(replace(camera, name=name) for camera, name in zip(cameras, names, strict=False)))


@pytest.fixture
def folder(tmp_path):
    """A folder with calibrations of all kinds, and with files that are none."""
    folder = tmp_path / "fall"
    folder.mkdir()
    for name in NAMES:
        write_clip(folder / f"{name}.mp4", [np.full((*SIZE[::-1], 3), 90, np.uint8)] * 3)
    shutil.copyfile(THROWN_CROSS / "cross.toml", folder / "cross.toml")
    (folder / "trial.toml").write_text(TRIAL)
    write_pose2sim(folder / "own.toml", rig_of("right", "left"))
    write_pose2sim(folder / "theirs.toml", rig_of("cam_0", "cam_1"))
    write_pose2sim(folder / "one.toml", rig_of("left"))
    (folder / "broken.xcp").write_text("<Cameras>")
    (folder / "clicks.csv").write_text("point,left_u,left_v\nP1,1,2\n")
    return folder


def test_files_are_sorted_by_what_they_hold_of_the_cameras(folder):
    found = list_calibrations(folder, set(NAMES))
    assert found.usable == ["own.toml"]
    assert found.renamed == {"theirs.toml": ("cam_0", "cam_1")}
    assert set(found.refused) == {"broken.xcp", "one.toml", "trial.toml"}  # no body, no table of clicks
    assert found.refused["one.toml"] == "one.toml holds 1 camera, left; expected one for each of the trial's 2"
    assert found.refused["broken.xcp"].startswith("broken.xcp is not a calibration")


@pytest.mark.parametrize(
    ("camera", "names", "guess"),
    [
        ("cam2", ("a1", "b2"), "b2"),
        ("cam2", ("a2", "b2"), None),
        ("b2", ("a2", "b2"), "b2"),
        ("left", ("cam_0", "cam_1"), None),
    ],
)
def test_a_camera_is_guessed_by_its_name_or_number_only(camera, names, guess):
    assert guess_name(camera, names) == guess


def test_names_of_a_file_are_chosen_in_the_browser(folder):
    with fork_studio(folder) as address, open_page(address.replace("/?", "/cameras?")) as page:
        user = User(page)
        user.click(page.get_by_text("2 other files: no calibration of these cameras"))
        page.get_by_text("one.toml holds 1 camera, left", exact=False).wait_for()
        user.click(page.get_by_label("calibration file"))
        user.click(page.get_by_role("option", name="theirs.toml"))
        page.get_by_text("In theirs.toml the cameras have other names.").wait_for()
        user.press("Use these names")
        page.get_by_text("choose a camera of the file for each, and none twice").wait_for()
        for name, there in (("left", "cam_1"), ("right", "cam_0")):
            user.click(page.get_by_label(name, exact=True))
            user.click(page.get_by_role("option", name=there))
            page.locator(".q-menu").wait_for(state="detached")
        user.press("Use these names")
        page.get_by_text("focal length 300 px", exact=False).first.wait_for()
        trial = read_trial(folder / "trial.toml")
        assert [camera.calibrated_as for camera in trial.camera] == ["cam_1", "cam_0"]
        assert trial.calibration.file == "theirs.toml" and "# a remark" in (folder / "trial.toml").read_text()
        user.click(page.get_by_label("Undo"))
        page.get_by_text("undone", exact=False).wait_for()
        page.get_by_text("focal length 300 px", exact=False).first.wait_for(state="detached")
        assert "calibration" not in read_toml(folder / "trial.toml")
        user.click(page.get_by_label("calibration file"))  # the choice was taken back too: it can be made again
        user.click(page.get_by_role("option", name="own.toml"))
        page.get_by_text("focal length 300 px", exact=False).first.wait_for()
        (folder / "points.csv").write_text(SURVEY.replace("2", "two"))
        page.get_by_text("points.csv, row 2 (point 'P1'), column y_m: 'two' is not a number").wait_for()
        (folder / "points.csv").write_text(SURVEY)
        page.get_by_text("points.csv, row 2").wait_for(state="detached")
        user.click(page.get_by_label("surveyed points"))
        user.click(page.get_by_role("option", name="points.csv"))
        page.get_by_text("0 points of the 6 that are needed").first.wait_for()
        (folder / "points.csv").write_text(SURVEY.replace("2", "two"))  # a table that is in use
        page.get_by_text("points.csv, row 2 (point 'P1'), column y_m: 'two' is not a number").first.wait_for()
    assert read_toml(folder / "trial.toml")["calibration"] == {"control_points": "points.csv"}
