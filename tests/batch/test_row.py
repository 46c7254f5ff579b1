"""The row of a finished run in a batch's table."""

import json

import numpy as np
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


@pytest.mark.parametrize(("n", "said"), [(0, "no frame is tracked"), (1, "1 of 10 frames is tracked"), (5, None)])
def test_a_run_that_is_mostly_untracked_is_an_alarm(tmp_path, n, said):
    found = row(tmp_path, n_tracked=n, n_uncertain=10 - n)
    assert found["n_alarms"] == (said is not None)
    assert found["findings"].startswith(said or "")


def test_a_rise_has_the_deviations_of_single_frames(tmp_path):
    t = np.arange(60) / 50
    falls = np.clip(t, 0.4, 0.8) - 0.4
    height_m = 1 + 1.962 * falls - 9.81 / 2 * falls**2
    (tmp_path / "tables").mkdir()
    for names, cells in (("com_z_m_sd", "0.001"), ("com_z_m_sd,com_z_m_sd_frame", "0.5,0.001")):
        lines = [f"{at},{high},{cells}\n" for at, high in zip(t, height_m, strict=True)]
        (tmp_path / "tables" / "flight.csv").write_text(f"time_s,com_z_m,{names}\n{''.join(lines)}")
        found = row(tmp_path)
        assert found["com_rise_m_sd"] == pytest.approx(0.001 * 2**0.5, rel=0.01)


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
