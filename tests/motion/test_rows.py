"""Rows of a motion.csv, read as they come, hold what reading the whole motion gives."""

import numpy as np
import pytest

from airborne.errors import ResultError
from airborne.motion import MotionWriter, drop_rows, read_motion
from airborne.motion import rows as module
from airborne.motion.rows import read_rows
from airborne.tracking import Status
from tests.support.motions import run_with_gap


@pytest.fixture
def path(tmp_path):
    with MotionWriter(tmp_path / "motion.csv") as writer:
        for estimate in run_with_gap():
            writer.append(estimate)
    return tmp_path / "motion.csv"


def assert_alike(rows, motion):
    assert rows.index.tolist() == motion.index.tolist()
    assert rows.status.tolist() == motion.status.tolist()
    for name in ("time_s", "position", "position_sd"):
        assert np.array_equal(getattr(rows, name), getattr(motion, name), equal_nan=True), name
    for row, frame in enumerate(motion.index.tolist()):
        pose = rows.pose(frame)
        assert (pose is not None) == motion.has_pose[row]
        if pose is not None:
            assert np.array_equal(pose.world_from_root.as_matrix(), motion.pose(row).world_from_root.as_matrix())
    assert rows.pose(999) is None


def test_rows_are_those_of_the_motion_in_any_order_of_the_file(path):
    assert_alike(read_rows(path), read_motion(path))
    header, *lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join([header, *lines[4:], *lines[:4], b"99,0.1"]))
    assert_alike(read_rows(path), read_motion(path))


def test_of_a_file_that_grows_only_the_new_rows_are_read(path, monkeypatch):
    whole = path.read_bytes()
    begin = whole[: whole.index(b"\n5,") + 3]  # up to frame 4, and a torn row
    path.write_bytes(begin)
    known, parsed = read_rows(path), []
    assert (len(known), known.newest) == (5, 4)
    with path.open("ab") as file:
        file.write(whole[len(begin) :])
    monkeypatch.setattr(module, "Status", lambda text: parsed.append(text) or Status(text))
    rows = read_rows(path, known)
    assert len(parsed) == 3
    assert_alike(rows, read_motion(path))
    assert read_rows(path, rows) is rows


def test_a_file_that_was_written_anew_is_read_anew(path):
    known = read_rows(path)
    drop_rows(path, lambda frame: frame == 2)
    assert_alike(read_rows(path, known), read_motion(path))


@pytest.mark.parametrize(("old", "new"), [(b"tracked", b"trackd"), (b"\n1,", b"\nx,"), (b"\n0,0.0,", b"\n0,inf,")])
def test_a_row_that_cannot_be_read_is_named(path, old, new):
    path.write_bytes(path.read_bytes().replace(old, new, 1))
    with pytest.raises(ResultError, match="the row of frame"):
        read_rows(path)
