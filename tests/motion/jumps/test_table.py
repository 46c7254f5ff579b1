"""jumps.csv: every number with its interval, unknown ones empty."""

import csv

import numpy as np
import pytest

from airborne.motion.jumps.heights import measure_jumps
from airborne.motion.jumps.table import write_jumps
from tests.support.jumping import Jumper, motion_of, players_motion

CLEAN = Jumper()


@pytest.fixture(scope="module")
def whole():
    return measure_jumps(motion_of(CLEAN))


@pytest.fixture(scope="module")
def cut():
    n = round(60 * (CLEAN.takeoff_s + 0.4))
    return measure_jumps(players_motion(np.arange(n) / 60, CLEAN.points()[:n, None, :6]))


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_table_reads_back_to_the_last_bit(whole, tmp_path):
    write_jumps(tmp_path / "jumps.csv", whole)
    (row,) = rows_of(tmp_path / "jumps.csv")
    assert (row["player"], row["jump"], row["status"]) == ("one", "1", "whole")
    assert tuple(float(row[f"foot_height_m{end}"]) for end in ("", "_low", "_high")) == tuple(whole[0].foot_height_m)
    assert float(row["landing_y_m"]) == whole[0].landing_position_m[1].value
    assert row["standing_source"] == "stance"
    assert int(row["standing_first_frame"]) == whole[0].standing.frames[0]


def test_unknown_numbers_are_empty_cells(cut, tmp_path):
    write_jumps(tmp_path / "jumps.csv", cut)
    (row,) = rows_of(tmp_path / "jumps.csv")
    assert row["status"] == "no landing"
    assert [row[name] for name in ("landing_s", "flight_time_height_m_low", "reach_m", "drift_m_high")] == [""] * 4
    assert float(row["takeoff_speed_height_m"]) > 0.3


def test_no_jump_leaves_a_table_with_its_first_line_alone(whole, tmp_path):
    write_jumps(tmp_path / "none.csv", ())
    write_jumps(tmp_path / "one.csv", whole)
    none, one = ((tmp_path / name).read_text().splitlines() for name in ("none.csv", "one.csv"))
    assert none == one[:1]
    assert len(one) == 2
