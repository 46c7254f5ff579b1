"""The paragraph for a methods section says what the summary holds, and nothing that it does not hold."""

from airborne.export.methods_text import describe_corrections, describe_methods

BODY = {
    "n_frames": 34, "n_tracked": 30, "n_uncertain": 3, "n_lost": 1, "rate_hz": 50.0, "median_position_sd_mm": 0.71,
    "median_rotation_sd_deg": 0.1, "uncertainty": "They hold noise.", "method": {"method": "refined"},
    "cameras": [{"calibration_rms_px": 0.61}, {"calibration_rms_px": 0.69}, {"calibration_rms_px": None}],
    "versions": {"airborne": "0.1.0", "numpy": "2.4"},
    "self_check": [{"sentence": "all is well", "is_alarm": False}, {"sentence": "cam1 is late", "is_alarm": True}],
}  # fmt: skip


def test_a_body():
    text = describe_methods(BODY)
    for words in (
        "3 calibrated cameras",
        "Airborne 0.1.0 (method 'refined')", "0.61 to 0.69 px RMS", "At 34 image times at 50 Hz",
        "30 poses were tracked, 3 were uncertain and 1 lost", "0.7 mm in position and 0.1 ° in orientation",
        "They hold noise.", "cam1 is late", "Versions: numpy 2.4.",
    ):  # fmt: skip
        assert words in text
    assert "all is well" not in text
    assert "fitted together" not in text
    assert "fitted together to the images, by a smooth skin" in describe_methods({**BODY, "whole_run": "skin"})


def test_players_and_what_is_missing():
    text = describe_methods(
        {
            "n_frames": 1,
            "n_tracked": 2,
            "n_uncertain": 0,
            "n_lost": 0,
            "players": {"a": {"median_sd_mm": 33.6}, "b": {}},
        }
    )
    assert "The motion of 2 players" in text
    assert "34 mm for a player's joints" in text
    assert "None" not in text
    assert "residuals" not in text


def test_corrections_are_said_with_their_frames_and_deviations():
    clicks = {"gives": ["clicks by hand"], "sd_px": 5.0}
    turn = {"gives": ["orientation by hand"], "sd_deg": 10.0}
    keys = [{"frame": 12, **clicks}, {"frame": 30, **turn}, {"frame": 44, **clicks}]
    masks = [("left", 3, 5), ("right", 7, 7), ("left", 9, 9)]
    summary = {"keys": keys, "masks": [dict(zip(("camera", "first", "last"), mask, strict=True)) for mask in masks]}
    assert describe_corrections(summary) == [
        "The pose was corrected in 3 frames: 12 and 44 (clicks by hand, ± 5 px), 30 (orientation by hand, ± 10 °).",
        "Cameras were left out of some frames: left of 3 to 5 and 9; right of 7.",
    ]
    assert " ".join(describe_corrections(summary)) in describe_methods({**BODY, **summary})
    assert describe_corrections(BODY) == []
