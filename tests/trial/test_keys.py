"""[[key]] tables: read with any form of help, refused in one line where they say nothing or do not fit."""

import numpy as np
import pytest

from airborne.body import human18
from airborne.cameras import Rig
from airborne.errors import AirborneError
from airborne.run.keys import read_keys
from airborne.trial.file import Trial, list_wrong_names
from tests.support.people import THREE
from tests.support.scenes import CROSS

MODEL, RIG = human18(), Rig(THREE)
LANDMARKS = [landmark.name for landmark in MODEL.landmarks]
HEAD = {
    "name": "a jump",
    "camera": [{"name": camera.name, "video": f"{camera.name}.mp4"} for camera in THREE],
    "calibration": {"file": "calib.toml"},
    "body": {"preset": "human18", "stature_m": 1.8, "mass_kg": 75.0},
    "start": {"position_m": [0, 0, 1.4], "quaternion_xyzw": [0, 0, 0, 1]},
}


def trial(*keys, **tables) -> Trial:
    return Trial(**{**HEAD, "key": list(keys), **tables})


def test_a_mask_names_a_camera_of_the_trial_and_frames_in_order():
    with pytest.raises(AirborneError, match=r"\[\[mask\]\]: no camera above; there are:"):
        trial(mask=[{"camera": "above", "first": 3, "last": 5}])
    with pytest.raises(AirborneError, match="last = 3 lies before first = 5; exchange them"):
        trial(mask=[{"camera": THREE[0].name, "first": 5, "last": 3}])


def evidence(**key):
    return read_keys(trial({"frame": 9, **key}), MODEL, RIG, ())[9]


def complaint(*keys, **tables) -> str:
    with pytest.raises(AirborneError) as caught:
        read_keys(trial(*keys, **tables), MODEL, RIG, ())
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_a_click_in_one_camera_is_two_residuals():
    key = evidence(points_px={"wrist_left": {"cam1": [100.0, 120.0]}}, sd_px=4.0)
    assert key.clicked.tolist() == [LANDMARKS.index("wrist_left")]
    np.testing.assert_allclose(key.px, [[100, 120]])
    np.testing.assert_allclose(key.P[0], THREE[1].P)
    assert key.px_sds.tolist() == [4.0]


def test_a_table_may_hold_clicks_of_one_camera(tmp_path):
    (tmp_path / "clicks.csv").write_text("point,cam0_u,cam0_v\nwrist_left,10,20\nelbow_left,,\n")
    given = trial({"frame": 9, "points_px": "clicks.csv"})
    given._folder = tmp_path
    assert len(read_keys(given, MODEL, RIG, ())[9].clicked) == 1


def test_positions_of_any_landmarks_count_with_their_sd():
    key = evidence(joints_m={"wrist_left": [0.1, 0.2, 1.0], "head": [0, 0, 1.7]}, sd_m=0.02)
    by_name = dict(zip(key.landmarks.tolist(), key.position_sds.tolist(), strict=True))
    assert by_name[LANDMARKS.index("wrist_left")] == pytest.approx(0.02)
    assert by_name[LANDMARKS.index("head")] > 0.05  # it only lies near the landmark it stands for


def test_what_a_pose_by_hand_leaves_open_is_not_known():
    key = evidence(position_m=[0, 0, 1], joint_angles_deg={"forearm_left": [-90, 0, 0]}, sd_m=0.3, sd_deg=20)
    own = 3 + 3 * MODEL.index_of("forearm_left")
    known = np.flatnonzero(np.isfinite(key.pose_sds))
    assert known.tolist() == [0, 1, 2, own, own + 1, own + 2]
    assert key.pose_sds[0] == 0.3
    assert np.degrees(key.pose_sds[own]) == pytest.approx(20)


def test_forms_join():
    key = evidence(
        joints_m={"wrist_left": [0.1, 0.2, 1.0]}, points_px={"knee_left": {"cam0": [5, 6]}}, position_m=[0, 0, 1]
    )
    assert (len(key.landmarks), len(key.clicked), np.isfinite(key.pose_sds).sum()) == (1, 1, 3)


def test_keys_come_in_the_order_of_time():
    keys = [{"frame": frame, "position_m": [0, 0, 1]} for frame in (30, 10, 20)]
    assert list(read_keys(trial(*keys), MODEL, RIG, ())) == [10, 20, 30]


PLACE = {"position_m": [0, 0, 1]}


@pytest.mark.parametrize(
    ("keys", "tables", "said"),
    [
        ([{"frame": 9}], {}, "nothing is said of the pose"),
        ([{"frame": 0, **PLACE}], {}, "not after start.frame = 0"),
        ([{"frame": 9, **PLACE}, {"frame": 9, **PLACE}], {}, "two [[key]] tables are of frame 9"),
        ([{"frame": 9, **PLACE}], {"track": {"method": "stepping"}}, "not read by method 'stepping'"),
        ([{"frame": 9, "points_px": {"wrist_left": {"cam9": [1, 2]}}}], {}, "no camera cam9"),
        (
            [{"frame": 9, "points_px": {"wing": {"cam0": [1, 2]}}}],
            {},
            "key of frame 9: body 'human18' has no landmark wing",
        ),
        ([{"frame": 9, "joint_angles_deg": {"wing": [1, 2, 3]}}], {}, "key of frame 9.joint_angles_deg"),
        ([{"frame": 9, "sd_px": 0, **PLACE}], {}, "sd_px"),
        ([{"frame": 9, "quaternion_xyzw": [0, 0, 0, 0]}], {}, "all zeros"),
    ],
)
def test_what_cannot_serve_is_refused_in_one_line(keys, tables, said):
    assert said in complaint(*keys, **tables)


def test_a_missing_table_is_named(tmp_path):
    given = trial({"frame": 9, "points_px": "clicks.csv"})
    given._folder = tmp_path
    assert any("clicks.csv" in line for line in list_wrong_names(given))


def test_a_click_outside_the_image_is_refused():
    said = complaint({"frame": 9, "points_px": {"wrist_left": {"cam1": [30000.0, 120.0]}}})
    assert "wrist_left is clicked at 30000, 120 in cam1, whose images have" in said


def test_a_thing_has_no_landmarks_of_a_person():
    with pytest.raises(AirborneError, match="has no landmark elbow_left; it has: "):
        read_keys(trial({"frame": 9, "joints_m": {"elbow_left": [0, 0, 1]}}), CROSS, RIG, ())
