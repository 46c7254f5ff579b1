"""Trial files: what is read, and what is refused in one line."""

import re
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.body.anthropometry import measurements_of
from airborne.errors import MistakesError, TrialError
from airborne.geometry.rotations import matrix_from_angles
from airborne.trial.file import read_trial
from tests.support.bodies import write_measurements
from tests.support.tolerances import EXACT

GOOD = """
name = "a throw"
[[camera]]
name = "left"
video = "left.mp4"
fields = "top-first"
offset_s = 0.004
[[camera]]
name = "right"
video = "right.mp4"
[calibration]
file = "calib.toml"
[body]
file = "body.toml"
[start]
frame = 3
position_m = [0.1, 0.2, 1.3]
quaternion_xyzw = [0.0, 0.0, 0.0, 1.0]
[track]
method = "stepping"
every = 2
steps_mm = [50, 5]
steps_deg = [10, 1]
"""
QUATERNION = "quaternion_xyzw = [0.0, 0.0, 0.0, 1.0]"


@pytest.fixture
def folder(tmp_path):
    for name in ("calib.toml", "body.toml"):
        (tmp_path / name).write_text("")
    return tmp_path


def read(folder, text=GOOD, **kwargs):
    (folder / "trial.toml").write_text(text, encoding="utf-8")
    return read_trial(folder / "trial.toml", **kwargs)


def complaint(folder, text, **kwargs):
    with pytest.raises(TrialError) as caught:
        read(folder, text, **kwargs)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith("trial.toml: ")
    return message


def test_file_gives_cameras_body_start_and_method(folder):
    trial = read(folder)
    assert trial.name == "a throw"
    assert [(c.name, c.video, c.fields, c.offset_s) for c in trial.camera] == [
        ("left", "left.mp4", "top-first", 0.004),
        ("right", "right.mp4", "progressive", 0.0),
    ]
    assert (trial.start.frame, trial.track.every, trial.track.stop) == (3, 2, None)
    np.testing.assert_array_equal(trial.start.pose.world_from_root.translation, [0.1, 0.2, 1.3])


def test_paths_are_relative_to_the_file(folder):
    assert read(folder).path("left.mp4") == folder / "left.mp4"


def test_settings_are_in_metres_and_radians(folder):
    settings = read(folder).settings
    assert settings.method == "stepping"
    np.testing.assert_allclose(settings.loops, [(0.05, np.radians(10)), (0.005, np.radians(1))], atol=EXACT)
    assert settings.lights is None


def test_method_is_refined_by_default(folder):
    assert read(folder, GOOD[: GOOD.index("[track]")]).settings.method == "refined"


def test_lights_become_lamps(folder):
    lamps = "[lights]\nambient = 0.3\n[[lights.lamp]]\nposition_m = [1, 2, 3]\nintensity = 0.5\n"
    spot = "[[lights.lamp]]\nposition_m = [1, 2, 3]\nintensity = 0.5\ndirection = [0, 0, -1]\nhalf_angle_deg = 30\n"
    lights = read(folder, GOOD + lamps + spot).settings.lights
    assert lights.ambient == 0.3
    assert lights.lamps[0].direction is None
    np.testing.assert_array_equal(lights.lamps[1].direction, [0, 0, -1])
    assert lights.lamps[1].half_angle_rad == pytest.approx(np.pi / 6, abs=EXACT)


def test_start_can_be_given_in_three_ways(folder):
    angles = np.array([200.0, -15.0, 95.0])
    R = matrix_from_angles(np.radians(angles))
    ways = (
        f"rotation_matrix = {R.tolist()}",
        f"quaternion_xyzw = {(2 * Rotation.from_matrix(R).as_quat()).tolist()}",
        f"somersault_tilt_twist_deg = {angles.tolist()}",
    )
    for way in ways:
        pose = read(folder, GOOD.replace(QUATERNION, way)).start.pose
        np.testing.assert_allclose(pose.world_from_root.rotation.as_matrix(), R, atol=EXACT)


def test_entries_of_the_track_table_can_be_replaced(folder):
    trial = read(folder, track={"method": "simplex", "stop": 9})
    assert (trial.track.method, trial.track.stop, trial.track.every) == ("simplex", 9, 2)
    assert read(folder, GOOD[: GOOD.index("[track]")], track={"every": 5}).track.every == 5
    assert "track.every" in complaint(folder, GOOD.replace("every = 2", "every = 0"), track={"stop": 9})


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"every": 0}, "every = 0: expected 1 or more"),
        ({"method": "magic"}, "method = 'magic': expected 'refined', 'joint'"),
        ({"method": "blocker"}, "method = 'blocker': track: method 'blocker' does not go with this body"),
        ({"overlay": "paper"}, "overlay = 'paper': not read by method 'stepping'; remove it"),
    ],
)
def test_a_change_that_cannot_be_is_named_instead_of_the_file(folder, changes, said):
    with pytest.raises(TrialError) as caught:
        read(folder, track=changes)
    assert str(caught.value).startswith(said)
    assert "literal" not in str(caught.value)


def test_cameras_can_be_chosen_by_name(folder):
    assert [camera.name for camera in read(folder, cameras=["right"]).camera] == ["right"]
    assert "no camera top; it has: left, right" in complaint(folder, GOOD, cameras=["right", "top"])


def test_every_mistake_of_a_file_is_listed(folder):
    text = GOOD.replace("every = 2", "every = 0").replace("frame = 3", "frame = -1").replace('"top-first"', '"odd"')
    with pytest.raises(MistakesError) as caught:
        read(folder, text)
    places = ["camera 'left'", "start.frame", "track.every"]
    assert [line.split(": ")[1] for line in caught.value.mistakes] == places
    assert str(caught.value) == f"{caught.value.mistakes[0]}; and 2 more mistakes"


def test_bundled_example_is_a_good_trial(thrown_cross):
    trial = read_trial(thrown_cross / "trial.toml")
    assert len(trial.camera) == 3
    assert trial.track.method == "refined"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name = "a throw"', "", "name is missing"),
        ('name = "a throw"', 'name = "a throw"\nplace = "hall"', "place: unknown key"),
        ('video = "left.mp4"', "", "camera 'left': video is missing"),
        ('video = "left.mp4"', 'vidoe = "left.mp4"', "and 1 more"),
        ('name = "right"', 'name = "left"', "two cameras share a name: left, left; give each its own"),
        ('"top-first"', '"odd-first"', "camera 'left': fields"),
        ("offset_s = 0.004", "offset_s = nan", "camera 'left': offset_s: expected a finite number"),
        ("offset_s = 0.004", "saved_scale = 0", "camera 'left': saved_scale"),
        ("offset_s = 0.004", "saved_offset_px = [1]", "camera 'left': saved_offset_px"),
        ('file = "calib.toml"', "", 'calibration: give file = "..." or control_points = "..."'),
        ('file = "calib.toml"', 'file = "calib.toml"\ncontrol_points = "a.csv"', "one of them"),
        ('file = "calib.toml"', 'file = "none.toml"', "none.toml not found in "),
        ('file = "calib.toml"', 'control_points = "none.csv"', "none.csv not found in "),
        ('file = "body.toml"', 'file = "none.toml"', "none.toml not found in "),
        ('[body]\nfile = "body.toml"', "", "body is missing"),
        ('file = "body.toml"', 'file = "body.toml"\npreset = "human18"', "body: give file"),
        ('file = "body.toml"', "", 'body: give file = "...", preset = "human18" or measurements = "...", one of them'),
        ('file = "body.toml"', 'preset = "human19"', "body.preset"),
        ('file = "body.toml"', 'preset = "human18"\nstature_m = 1.8', "needs stature_m and mass_kg; add mass_kg"),
        (
            'file = "body.toml"',
            'file = "body.toml"\nmass_kg = 70',
            'go with preset = "human18" alone',
        ),
        ('file = "body.toml"', 'preset = "human18"\nstature_m = -1\nmass_kg = 70', "body.stature_m"),
        (
            'file = "body.toml"',
            'preset = "human18"\nstature_m = 172\nmass_kg = 70',
            "stature_m is 172; expected 0.8 to 2.5 metres: is it in centimetres",
        ),
        ('file = "body.toml"', 'measurements = "none.txt"', "none.txt not found in "),
        (
            'file = "calib.toml"',
            'file = "calib.toml"\nmend = ["left"]',
            "calibration.mend needs [start] with detections",
        ),
        (
            'file = "calib.toml"',
            'file = "calib.toml"\nmend = ["top"]',
            "calibration.mend: no camera top; there are: left",
        ),
        ("frame = 3", 'joints_m = "joints.csv"', "or joints_m, points_px, detections or find = true, one of them"),
        ("frame = 3", 'detections_cameras = {left = "c1"}', "detections_cameras goes with detections"),
        ("position_m = [0.1, 0.2, 1.3]", "", "position_m is missing: give where the root's origin is"),
        ("frame = 3", "joint_angles_deg = {knee = [1, 2]}", "start.joint_angles_deg.knee"),
        ("frame = 3", "frame = -1", "start.frame"),
        ("frame = 3", "frame = 2.5", "start.frame"),
        ("position_m = [0.1, 0.2, 1.3]", "position_m = [0.1, 0.2]", "start.position_m"),
        ("position_m = [0.1, 0.2, 1.3]", "position_m = [0.1, 0.2, nan]", "start.position_m, value 3"),
        ("position_m = [0.1, 0.2, 1.3]", "position_m = [0.1, 0.2, inf]", "start.position_m, value 3"),
        (QUATERNION, "", "give rotation_matrix, quaternion_xyzw or somersault_tilt_twist_deg, one of them"),
        (QUATERNION, f"{QUATERNION}\nsomersault_tilt_twist_deg = [1, 2, 3]", "one of them"),
        (QUATERNION, "quaternion_xyzw = [0, 0, 0, 0]", "quaternion_xyzw is all zeros"),
        (QUATERNION, "quaternion_xyzw = [0, 0, 1]", "start.quaternion_xyzw"),
        (QUATERNION, "somersault_tilt_twist_deg = [1, 2, nan]", "start.somersault_tilt_twist_deg, value 3"),
        (QUATERNION, "rotation_matrix = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]", "rotation_matrix is not a rotation"),
        (QUATERNION, "rotation_matrix = [[2, 0, 0], [0, 1, 0], [0, 0, 1]]", "rotation_matrix is not a rotation"),
        (QUATERNION, "rotation_matrix = [[1, 0, 0], [0, 1, 0]]", "start.rotation_matrix"),
        ('"stepping"', '"magic"', "track.method"),
        ("every = 2", "every = 0", "track.every"),
        ("every = 2", "every = 2\nstop = 0", "track.stop"),
        ("every = 2", "evrey = 2", "track.evrey: unknown key; did you mean every?"),
        ("every = 2", "end = 20", "track.end: unknown key; did you mean stop?"),
        ("every = 2", "whole_run = 1", "track.whole_run: expected true or false (found 1)"),
        ("every = 2", "scale = 3", "track.scale"),
        ("every = 2", 'colour = "blue"', "track.colour"),
        ("every = 2", 'v_rule = "v"', "track.v_rule"),
        ("every = 2", 'prediction = "psychic"', "track.prediction"),
        ("steps_mm = [50, 5]", "steps_mm = [50]", "steps_mm and steps_deg need one number each for every loop"),
        (
            "steps_mm = [50, 5]\nsteps_deg = [10, 1]",
            "steps_mm = []\nsteps_deg = []",
            "one number each for every loop",
        ),
        ("steps_mm = [50, 5]", "steps_mm = [50, 0]", "track.steps_mm, value 2: expected more than 0"),
        ("steps_mm = [50, 5]", "steps_mm = [50, inf]", "track.steps_mm, value 2"),
        ("[track]", "[lights]\nambient = -1\n[track]", "lights.ambient"),
        ("[track]", "[lights]\nambient = inf\n[track]", "lights.ambient"),
        ("[[camera]]", "[[camera", "not a TOML file"),
        ("[[camera]]", "[camera]", "not a TOML file"),
    ],
)
def test_malformed_file_is_refused_in_one_line_that_names_it_and_the_fault(folder, old, new, said):
    assert old in GOOD
    assert said in complaint(folder, GOOD.replace(old, new, 1))


def test_misspelt_key_of_the_body_is_the_only_complaint_where_no_method_is_given(folder):
    """Which methods go with a body that is wrong is not known."""
    text = GOOD[: GOOD.index("[track]")].replace("[body]", "[body]\nstatur_m = 1.8", 1)
    said = complaint(folder, text)
    assert "body.statur_m: unknown key; did you mean stature_m?" in said
    assert "track" not in said


PLACES = "joints_m = {a = [1, 2, 3], b = [4, 5, 6]}"


def by(start):
    """The good trial with another start."""
    return GOOD[: GOOD.index("[start]")] + f"[start]\n{start}\n" + GOOD[GOOD.index("[track]") :]


def test_start_can_be_given_by_positions_clicks_or_detections(folder):
    for name in ("joints.csv", "clicks.csv", "found.npz"):
        (folder / name).write_text("")
    (folder / "json").mkdir()
    assert read(folder, by(PLACES)).start.joints_m == {"a": [1, 2, 3], "b": [4, 5, 6]}
    for start, name in (
        ('joints_m = "joints.csv"', "joints.csv"),
        ('points_px = "clicks.csv"', "clicks.csv"),
        ('detections = "found.npz"', "found.npz"),
        ('detections = "json"\ndetections_cameras = {left = "c1"}', "json"),
    ):
        assert read(folder, by(start)).start.source_files == [name]


@pytest.mark.parametrize(
    ("start", "said"),
    [
        (
            "frame = 3",
            "give a position_m and a rotation, or joints_m, points_px, detections or find = true, one of them",
        ),
        (f'{PLACES}\npoints_px = "clicks.csv"', "one of them"),
        (f"{PLACES}\nposition_m = [1, 2, 3]", "one of them"),
        (f"{PLACES}\njoint_angles_deg = {{a = [1, 2, 3]}}", "one of them"),
        ("joints_m = {a = [1, 2]}", "start.joints_m"),
        ("joints_m = {a = [1, 2, inf]}", "start.joints_m"),
        ('joints_m = "none.csv"', "none.csv not found in "),
        ('points_px = "none.csv"', "none.csv not found in "),
        ('detections = "none"', "none not found in "),
        ('points_px = "."', ". not found in "),
    ],
)
def test_start_without_one_clear_source_is_refused(folder, start, said):
    assert said in complaint(folder, by(start))


def test_start_that_needs_the_body_gives_no_pose_by_itself(folder):
    angles = GOOD.replace("frame = 3", "joint_angles_deg = {knee = [1, 2, 3]}")
    for text in (angles, by(PLACES)):
        with pytest.raises(TrialError, match=r"use airborne\.run\.first_pose"):
            _ = read(folder, text).start.pose


def test_person_can_be_asked_for_by_stature_and_mass_or_by_measurements(folder):
    by_stature = read(folder, GOOD.replace('file = "body.toml"', 'preset = "human18"\nstature_m = 1.7\nmass_kg = 60'))
    preset = by_stature.model()
    assert by_stature.body.is_preset
    assert len(preset.segments) == 18
    assert preset.needs_colours
    write_measurements(folder / "person.txt", measurements_of(1.7, 60.0))
    by_measurements = read(folder, GOOD.replace('file = "body.toml"', 'measurements = "person.txt"'))
    measured = by_measurements.model()
    assert not by_measurements.body.is_preset
    for one, other in zip(preset.segments, measured.segments, strict=True):
        np.testing.assert_allclose(one.joint_m, other.joint_m, atol=1e-6)
    assert measured.needs_colours


def test_resection_is_for_selected_cameras(folder):
    (folder / "found.npz").write_text("")
    text = by('detections = "found.npz"').replace('file = "calib.toml"', 'file = "calib.toml"\nmend = ["right"]')
    assert read(folder, text).calibration.mend == ["right"]
    assert read(folder, text, cameras=["left"]).calibration.mend == []


@pytest.mark.parametrize(
    ("lamp", "said"),
    [
        ("intensity = 1", "lights.lamp 1: position_m is missing"),
        ("position_m = [1, 2, 3]\nintensity = 1\ndirection = [0, 0, 1]", "a spot light needs a direction"),
        ("position_m = [1, 2, 3]\nintensity = 1\nhalf_angle_deg = 20", "a spot light needs a direction"),
        ("position_m = [1, 2, 3]\nintensity = 1\ndirection = [0, 0, 0]\nhalf_angle_deg = 20", "with a length"),
        ("position_m = [1, 2, 3]\nintensity = 1\ndirection = [0, 0, 1]\nhalf_angle_deg = 90", "half_angle_deg"),
        ("position_m = [1, 2, 3]\nintensity = -1", "lights.lamp 1: intensity"),
    ],
)
def test_impossible_lamp_is_refused(folder, lamp, said):
    assert said in complaint(folder, f"{GOOD}\n[lights]\nambient = 0.5\n[[lights.lamp]]\n{lamp}\n")


@pytest.mark.parametrize("wrong", ["track = 3", "start = 3", "camera = 3", "body = [1]", 'lights = "on"'])
def test_value_where_a_table_belongs_is_refused(folder, wrong):
    key = wrong.split()[0]
    lines = [line for line in GOOD.splitlines() if line]
    starts = [i for i, line in enumerate(lines) if line.startswith("[")] + [len(lines)]
    remaining = [lines[a:b] for a, b in pairwise(starts) if lines[a].strip("[]") != key]
    text = "\n".join([lines[0], wrong, *(line for table in remaining for line in table)])
    assert key in complaint(folder, text)


def test_empty_missing_or_binary_file_is_refused(folder):
    assert "not a trial file, as [[camera]], [calibration], [body] are missing" in complaint(folder, "")
    assert "(found segment)" in complaint(folder, "[[segment]]")
    with pytest.raises(TrialError, match=r"none\.toml: cannot be read \(No such file or directory\)"):
        read_trial(folder / "none.toml")
    with pytest.raises(TrialError, match="cannot be read"):
        read_trial(folder)
    (folder / "binary.toml").write_bytes(bytes(range(256)))
    with pytest.raises(TrialError, match=r"binary\.toml: not a TOML file: it is not a text file; correct it"):
        read_trial(folder / "binary.toml")


def test_saved_pixels_go_with_a_calibration_file_only(folder):
    saved = GOOD.replace('fields = "top-first"', "saved_scale = 1.01")
    assert read(folder, saved).camera[0].saved_scale == 1.01
    (folder / "points.csv").write_text("")
    clicked = saved.replace('file = "calib.toml"', 'control_points = "points.csv"')
    assert "camera 'left': calibrated_as, saved_scale" in complaint(folder, clicked)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('video = "cam1.mp4"', 'video = ""', "camera 'cam1': video: a file's name is empty; give the file's path"),
        ('video = "cam1.mp4"', f'video = "{"a" * 300}"', "camera 'cam1': video: a file's name has at most 255 bytes"),
        ('video = "cam1.mp4"', 'video = "a\\u0000b"', "camera 'cam1': video: a path holds no control character"),
        ('name = "cam1"', 'name = "../cam1"', "name: a name must not hold a slash"),
        ('name = "cam1"', f'name = "{"a" * 81}"', "name: a name has 1 to 80 characters"),
        ("frame = 0", "frame = 9", "track.stop = 3 leaves no frame, as start.frame = 9"),
    ],
)
def test_names_paths_and_ranges_that_cannot_be_are_refused_where_declared(thrown_cross, tmp_path, old, new, expected):
    text = (thrown_cross / "trial.toml").read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "trial.toml").write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(TrialError, match=re.escape(expected)) as caught:
        read_trial(tmp_path / "trial.toml", {"stop": 3})
    assert "\n" not in str(caught.value)


def test_a_camera_is_named_once(thrown_cross):
    with pytest.raises(TrialError, match="cameras names cam1 twice; name each camera once"):
        read_trial(thrown_cross / "trial.toml", cameras=["cam1", "cam2", "cam1"])
