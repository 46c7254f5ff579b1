"""Edits of a trial's text keep its comments and all that they do not speak of."""

import pytest

from airborne.errors import TrialError
from airborne.io.text import parse_toml
from airborne.studio.pages.mask_cameras import clip_frames
from airborne.studio.trial_edits import (
    with_cameras,
    with_clicks,
    with_key,
    with_mask,
    with_players,
    with_table,
    without_key,
    without_mask,
)

TEXT = """# filmed on a Sunday
name = "throw"

[[camera]]
name = "left"         # behind the net
video = "a.mp4"
offset_s = -0.004     # by flash
fields = "top-first"

[calibration]
file = "calib.toml"   # of last week
mend = []

[track]
method = "refined"
"""


def test_cameras_keep_what_is_not_said_anew():
    text = with_cameras(
        TEXT, "unused", [{"name": "l", "video": "a.mp4", "fields": None}, {"name": "r", "video": "b.mp4"}]
    )
    assert parse_toml(text) == parse_toml(TEXT) | {
        "camera": [{"name": "l", "video": "a.mp4", "offset_s": -0.004}, {"name": "r", "video": "b.mp4"}]
    }
    for comment in ("# filmed on a Sunday", "# by flash", "# of last week"):
        assert comment in text


def test_a_first_trial_gets_a_name_and_its_cameras():
    text = with_cameras("", "my throw", [{"name": "a", "video": "a.mp4"}])
    assert parse_toml(text) == {"name": "my throw", "camera": [{"name": "a", "video": "a.mp4"}]}


def test_tables_are_made_changed_and_rid_of_keys():
    text = with_table(TEXT, "calibration", {"control_points": "points.csv", "file": None})
    assert parse_toml(text)["calibration"] == {"control_points": "points.csv", "mend": []}
    assert "# behind the net" in text
    text = with_table(text, "start", {"frame": 3, "position_m": [0.1, 0.2, 1.0]})
    assert parse_toml(text)["start"] == {"frame": 3, "position_m": [0.1, 0.2, 1.0]}
    assert parse_toml(text)["track"] == {"method": "refined"}


def test_a_click_is_written_into_the_key_of_its_frame():
    text = with_clicks(TEXT, 9, "left", {"wrist_left": (100.04, 50)})
    text = with_clicks(text, 9, "right", {"wrist_left": (1, 2)})
    text = with_clicks(text, 9, "left", {"wrist_left": (101, 51)})
    text = with_clicks(text, 4, "left", {"knee_left": (3, 4)})
    assert parse_toml(text) == parse_toml(TEXT) | {
        "key": [
            {"frame": 9, "points_px": {"wrist_left": {"left": [101.0, 51.0], "right": [1.0, 2.0]}}},
            {"frame": 4, "points_px": {"knee_left": {"left": [3.0, 4.0]}}},
        ]
    }
    assert "# behind the net" in text


def test_a_key_that_says_more_keeps_it():
    text = with_clicks(f"{TEXT}\n[[key]]\nframe = 9\nsd_px = 2.0   # careful\n", 9, "left", {"wrist_left": (1, 2)})
    assert parse_toml(text)["key"] == [{"frame": 9, "sd_px": 2.0, "points_px": {"wrist_left": {"left": [1.0, 2.0]}}}]
    assert "# careful" in text


def test_a_key_whose_clicks_are_in_a_table_of_their_own_is_left_alone():
    with pytest.raises(TrialError, match=r"has its clicks in clicks.csv; correct them there"):
        with_clicks(f'{TEXT}\n[[key]]\nframe = 9\npoints_px = "clicks.csv"\n', 9, "left", {"wrist_left": (1, 2)})


def test_masks_are_added_and_taken_away_beside_what_stands_there():
    text = with_mask(with_mask(TEXT, "left", 3, 9), "right", 5, 5)
    assert parse_toml(text)["mask"] == [
        {"camera": "left", "first": 3, "last": 9},
        {"camera": "right", "first": 5, "last": 5},
    ]
    text = without_mask(text, 0)
    assert parse_toml(text)["mask"] == [{"camera": "right", "first": 5, "last": 5}]
    assert parse_toml(without_mask(text, 0)) == parse_toml(TEXT)
    with pytest.raises(TrialError, match="the trial has 1 mask;"):
        without_mask(text, 1)


def test_a_key_is_dropped_and_others_stay():
    text = with_key(with_key(TEXT, 9, {"sd_m": 0.1}), 4, {"sd_m": 0.2})
    assert parse_toml(without_key(text, 9)) == parse_toml(TEXT) | {"key": [{"frame": 4, "sd_m": 0.2}]}
    assert parse_toml(without_key(without_key(text, 9), 4)) == parse_toml(TEXT)
    with pytest.raises(TrialError, match="the trial has no key of frame 5;"):
        without_key(text, 5)


def test_a_new_table_stands_below_an_empty_line():
    text = with_mask(with_mask(with_key(TEXT.rstrip("\n") + "\n", 9, {"sd_m": 0.1}), "left", 3, 9), "right", 5, 5)
    for head in ("[[key]]", "[[mask]]"):
        assert text.count(f"\n\n{head}\n") == text.count(head) > 0
    assert "\n\n\n" not in text


@pytest.mark.parametrize(
    ("text", "said"), [("start = 3\n", "start is no table"), ("a = [" + "1," * 60_000 + "]", "larger")]
)
def test_what_cannot_be_edited_is_one_line(text, said):
    with pytest.raises(TrialError, match=said):
        with_table(text, "start", {"frame": 1})


def test_a_turn_takes_the_place_of_the_other_forms_in_its_key():
    text = f"{TEXT}\n[[key]]\nframe = 9\nsomersault_tilt_twist_deg = [1, 2, 3]\nsd_deg = 4.0   # careful\n"
    text = with_key(text, 9, {"somersault_tilt_twist_deg": None, "quaternion_xyzw": [0.0, 0.0, 0.0, 1.0]})
    assert parse_toml(text)["key"] == [{"frame": 9, "sd_deg": 4.0, "quaternion_xyzw": [0.0, 0.0, 0.0, 1.0]}]
    assert "# careful" in text


def test_cameras_that_stand_in_one_line_keep_what_is_said_of_them():
    text = 'name = "two"\ncamera = [{ name = "a", video = "a.mp4", drift_ppm = 3.0 }]\nbody = { file = "b.toml" }\n'
    after = parse_toml(with_cameras(text, "two", [{"video": "a.mp4", "offset_s": 0.5}]))
    assert after == {**parse_toml(text), "camera": [{"name": "a", "video": "a.mp4", "drift_ppm": 3.0, "offset_s": 0.5}]}


def test_a_camera_is_left_out_of_frames_that_there_are():
    assert clip_frames(3, 5, 33) == (5, "")
    assert clip_frames(12, 500, 33) == (33, ", the last there is: 500 was asked for")
    with pytest.raises(TrialError, match="frames 0 to 33, not 40"):
        clip_frames(40, 500, 33)
    with pytest.raises(TrialError, match="exchange them"):
        clip_frames(5, 3, 33)


def test_players_that_were_found_stay_beside_those_clicked_in_the_same_frame():
    found = with_players(TEXT, 4, {"a": {"joints_m": {"torso": [0, 0, 1]}}, "b": {"points_px": "b.csv"}})
    clicked = {"c": {"points_px": "c.csv"}}

    def names(text):
        return [player["name"] for player in parse_toml(text)["start"]["player"]]

    assert names(with_players(found, 4, clicked, keeps_found=True)) == ["a", "c"]
    assert names(with_players(found, 5, clicked, keeps_found=True)) == ["c"]  # where they were in another frame is old
    assert names(with_players(found, 4, clicked)) == ["c"]
    again = with_players(found, 4, {"a": {"points_px": "a.csv"}}, keeps_found=True)
    assert parse_toml(again)["start"]["player"] == [{"name": "a", "points_px": "a.csv"}]
