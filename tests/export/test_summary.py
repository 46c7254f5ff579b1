import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from airborne.export import body_warnings, headline, write_json
from airborne.export.summary import is_hardly_tracked, is_mostly_untracked, joint_warnings, json_ready
from airborne.motion import Motion
from tests.support.export_scenes import run
from tests.support.tolerances import ROUNDTRIP


def test_headline_counts_frames_revolutions_and_time():
    head = headline(run(21, uncertain=(4, 5)))
    assert (head["n_frames"], head["n_tracked"], head["n_uncertain"], head["n_lost"]) == (21, 19, 2, 0)
    assert head["duration_s"] == pytest.approx(0.4, abs=ROUNDTRIP)
    assert head["rate_hz"] == 50
    assert head["somersault_rev"] == pytest.approx(1.0, abs=ROUNDTRIP)
    assert head["twist_rev"] == pytest.approx(0.5, abs=ROUNDTRIP)
    sds = [head["somersault_rev_sd"], head["twist_rev_sd"]]
    assert sds == pytest.approx([np.sqrt(2) * 0.01 / (2 * np.pi)] * 2, abs=ROUNDTRIP)  # both ends 0.01 rad
    assert head["range_m"] == pytest.approx([2.0, 0.0, 0.0], abs=ROUNDTRIP)
    assert head["median_position_sd_mm"] == pytest.approx(2.0, abs=ROUNDTRIP)
    assert head["median_rotation_sd_deg"] == pytest.approx(np.rad2deg(0.01), abs=ROUNDTRIP)


def test_backward_revolutions_are_negative():
    assert headline(run(turns=-2.0))["somersault_rev"] == pytest.approx(-2.0, abs=ROUNDTRIP)


def test_median_sd_is_infinite_where_most_frames_do_not_show_a_direction():
    head = headline(run(10, unseen=range(6)))
    assert head["median_rotation_sd_deg"] == np.inf
    assert (head["n_rotation_unobservable"], head["n_position_unobservable"]) == (6, 0)


def test_turns_are_counted_between_the_first_and_the_last_pose_that_shows_them():
    head = headline(run(21, unseen=(0, 19, 20)))
    assert head["turns_s"] == pytest.approx([0.02, 0.36])
    assert head["somersault_rev"] == pytest.approx(17 / 20) and np.isfinite(head["twist_rev_sd"])
    assert any("are counted from 0.02 to 0.36 s" in warning for warning in body_warnings(json_ready(head)))
    assert not any("counted" in warning for warning in body_warnings(json_ready(headline(run(21)))))
    hidden = headline(run(21, unseen=range(1, 21)))
    assert hidden["turns_s"] == pytest.approx([0, 0.4]) and np.isnan(hidden["somersault_rev_sd"])


def test_only_lost_frames_between_poses_make_a_gap():
    assert headline(run(10, lost=(4,)))["has_gap"]
    assert not headline(run(10, lost=(0, 1, 9)))["has_gap"]


@pytest.mark.parametrize("motion", [Motion.collect([]), run(3, lost=(0, 1, 2))], ids=["no frame", "all lost"])
def test_a_run_without_poses_claims_no_number(motion):
    head = json_ready(headline(motion))
    for key in ("somersault_rev", "twist_rev_sd", "median_position_sd_mm", "median_rotation_sd_deg", "median_score"):
        assert head[key] is None
    assert head["range_m"] == [None] * 3
    assert head["tilt_range_deg"] == [None] * 2
    assert "found in no frame" in " ".join(body_warnings(head))


def test_a_run_without_faults_warns_of_nothing():
    assert list(body_warnings(json_ready(headline(run())))) == []


def test_joints_that_cannot_be_trusted_are_warned_of_with_the_worst():
    good = {"tracked": 9, "uncertain": 1, "unknown": 0, "lost": 0}
    bad = {"tracked": 2, "uncertain": 3, "unknown": 5, "lost": 0}
    (warning,) = joint_warnings({"hip": good, "foot": bad})
    counts = "20 joint positions: 11 tracked, 4 uncertain, 5 unknown, 0 lost"
    assert warning.startswith(f"{counts}; the fewest tracked are those of foot, 2 of 10 frames")
    assert list(joint_warnings({"hip": {"tracked": 10, "uncertain": 0, "unknown": 0, "lost": 0}})) == []
    assert list(joint_warnings({})) == []


@pytest.mark.parametrize(
    ("kwargs", "words"),
    [
        ({"lost": (0,)}, "1 of 20 frames is lost"),
        ({"uncertain": (1, 2)}, "2 of 20 frames are uncertain"),
        ({"unseen": (5,)}, "its standard deviation is infinite"),
        ({"lost": (7,)}, "off by whole turns"),
    ],
)
def test_each_weakness_has_its_warning(kwargs, words):
    assert words in " ".join(body_warnings(json_ready(headline(run(**kwargs)))))


def test_unknown_uncertainty_is_warned_of():
    head = json_ready(headline(run())) | {"median_position_sd_mm": None}
    assert "uncertainty of the position is not known" in " ".join(body_warnings(head))


def test_json_holds_null_for_what_is_not_a_number(tmp_path):
    values = {
        "nan": float("nan"),
        "nested": [{"infinite": np.float64(-np.inf)}, np.array([1.5, np.nan])],
        "fraction": Fraction(1, 4),
        "count": np.int64(3),
        "flag": np.bool_(True),
        "path": Path("a") / "b",
        "text": "Übung",
    }
    write_json(tmp_path / "summary.json", values)
    read = json.loads((tmp_path / "summary.json").read_text("utf-8"), parse_constant=pytest.fail)
    assert read == {
        "nan": None,
        "nested": [{"infinite": None}, [1.5, None]],
        "fraction": 0.25,
        "count": 3,
        "flag": True,
        "path": str(Path("a") / "b"),
        "text": "Übung",
    }


def test_json_that_cannot_be_written_leaves_the_old_file_whole(tmp_path):
    path = tmp_path / "summary.json"
    write_json(path, {"a": 1})
    with pytest.raises(TypeError):
        write_json(path, {"a": object()})
    assert json.loads(path.read_text()) == {"a": 1}
    assert list(tmp_path.iterdir()) == [path]


def test_a_run_of_which_less_than_half_is_tracked_says_so():
    head = json_ready(headline(run())) | {"n_frames": 9, "n_tracked": 4, "n_uncertain": 5}
    assert any("Only 4 of 9 frames are tracked" in warning for warning in body_warnings(head))
    assert not any("Only" in warning for warning in body_warnings(head | {"n_tracked": 5, "n_uncertain": 4}))


def test_of_players_the_one_who_is_tracked_best_tells_whether_a_run_says_anything():
    head = {"n_frames": 40, "n_tracked": 0, "players": {"a": {"n_tracked": 40}, "b": {"n_tracked": 0}}}
    assert not is_mostly_untracked(head) and not is_hardly_tracked(head)
    assert is_mostly_untracked({**head, "players": {}}) and is_hardly_tracked({**head, "players": {}})
