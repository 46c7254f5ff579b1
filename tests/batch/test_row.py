"""The row of a finished run in a batch's table."""

import json

import pytest

from airborne.batch.row import row_of

SUMMARY = {
    **{"name": "jump", "n_frames": 10, "n_tracked": 10, "n_uncertain": 0, "n_lost": 0},
    **{"warnings": [], "versions": {"airborne": "0.1.0"}},
}


def row(folder, **more):
    (folder / "summary.json").write_text(json.dumps(SUMMARY | more))
    return row_of(folder)


def test_frames_may_be_tracked_where_joints_are_not(tmp_path):
    statuses = {
        "hip": {"tracked": 10, "uncertain": 0, "unknown": 0, "lost": 0},
        "foot": {"tracked": 1, "uncertain": 2, "unknown": 7, "lost": 0},
    }
    found = row(tmp_path, joint_statuses=statuses)
    assert found["share_tracked"] == 1
    assert found["share_joints_tracked"] == pytest.approx(11 / 20)
    assert "share_joints_tracked" not in row(tmp_path)
