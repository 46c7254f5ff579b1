"""What the terminal says of a run in which no frame is tracked."""

from airborne.cli.track import _describe

SUMMARY = {
    **{"n_frames": 5, "n_tracked": 0, "n_uncertain": 3, "n_lost": 2, "rate_hz": 4.0, "warnings": [], "events": []},
    "doubts": {"images": 2, "view": 1},
    **{"median_position_sd_mm": 3.6, "median_rotation_sd_deg": 0.15},
}


def test_it_is_said_before_any_number(tmp_path):
    lines = _describe(SUMMARY, tmp_path).splitlines()
    assert lines[0] == "5 frames at 4 Hz: 0 tracked, 3 uncertain, 2 lost"
    why = "images and pose agree too little (2), much of the body is out of the pictures (1)"
    assert lines[1] == f"uncertain: {why}"
    assert lines[2] == "no frame was tracked, so none of these numbers can be relied on"
    single = {"n_frames": 1, "n_uncertain": 1, "n_lost": 0, "doubts": {"position": 1}}
    one = _describe({**SUMMARY, **single}, tmp_path).splitlines()
    assert one[2] == "one frame alone does not show what else looks like the body, so it is often uncertain"
    assert not any("relied on" in line for line in _describe({**SUMMARY, "n_tracked": 1}, tmp_path).splitlines())
