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


def test_of_players_the_highest_jump_stands_in_the_row_or_else_the_longest(tmp_path):
    def jump(player, **more):
        return {
            "player": player,
            "hip_height_m": None,
            "foot_height_m": None,
            "takeoff_s": 1.0,
            "landing_s": 1.5,
            **more,
        }

    short, long = jump("Anna", flight_s=0.4), jump("Berta", flight_s=0.6)
    found = row(tmp_path, jumps=[short, long, jump("Carla", flight_s=None)])
    assert (found["n_jumps"], found["player"], found["flight_s"]) == (3, "Berta", 0.6)
    assert found["hip_height_m"] is None
    high = jump("Anna", flight_s=0.4, hip_height_m=0.5, hip_height_m_low=0.45, hip_height_m_high=0.55)
    found = row(tmp_path, jumps=[high, long])
    assert (found["player"], found["hip_height_m"]) == ("Anna", 0.5)
    assert found["hip_height_m_sd"] == pytest.approx(0.1 / (2 * 1.96), rel=1e-3)
    assert row(tmp_path, jumps=[jump("Carla", flight_s=None)]).keys() & {"player", "n_jumps"} == {"n_jumps"}
