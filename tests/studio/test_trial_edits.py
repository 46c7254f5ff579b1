"""Edits of a trial's text keep its comments and all that they do not speak of."""

import pytest

from airborne.errors import TrialError
from airborne.io.text import parse_toml
from airborne.studio.trial_edits import with_cameras, with_table

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


@pytest.mark.parametrize(
    ("text", "said"), [("start = 3\n", "start is no table"), ("a = [" + "1," * 60_000 + "]", "larger")]
)
def test_what_cannot_be_edited_is_one_line(text, said):
    with pytest.raises(TrialError, match=said):
        with_table(text, "start", {"frame": 1})
