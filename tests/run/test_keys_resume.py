"""Which frames a changed key touches, and a table of rows in any order."""

import math

import numpy as np
import pytest

from airborne.motion import MotionWriter, drop_rows, read_estimates, sort_rows
from airborne.run.folder import stretches_of
from tests.support.motions import run_with_gap

OLD = {"0": "start", "20": "a", "40": "b", "60": "c"}


def write(path, estimates):
    with MotionWriter(path) as writer:
        for each in estimates:
            writer.append(each)
    return path


@pytest.mark.parametrize(
    ("new", "stretches"),
    [
        (OLD, []),
        ({**OLD, "40": "changed"}, [(20, 60)]),
        ({**OLD, "30": "added"}, [(20, 40)]),
        ({key: OLD[key] for key in ("0", "20", "60")}, [(20, 60)]),
        ({**OLD, "60": "changed"}, [(40, math.inf)]),
        ({**OLD, "20": "changed", "40": "too"}, [(0, 60), (0, 60)]),
    ],
)
def test_a_changed_key_touches_the_frames_between_its_neighbours(new, stretches):
    assert stretches_of(OLD, new) == stretches


@pytest.mark.parametrize(
    ("masked", "stretch"),
    [((22, 25), (20, 40)), ((0, 3), (-math.inf, 20)), ((20, 41), (0, 60)), ((61, 90), (60, math.inf))],
)
def test_a_changed_mask_touches_the_frames_between_the_keys_around_it(masked, stretch):
    assert stretches_of(OLD, OLD, [masked]) == [stretch]


def test_rows_that_are_dropped_are_gone_and_the_others_stay_to_the_byte(tmp_path):
    path = write(tmp_path / "motion.csv", run_with_gap(6, lost=[2]))
    before = path.read_bytes().splitlines()
    drop_rows(path, lambda frame: frame in (1, 2))
    assert path.read_bytes().splitlines() == [line for row, line in enumerate(before) if row not in (2, 3)]


def test_rows_out_of_order_are_read_and_sorted_by_time(tmp_path):
    path = write(tmp_path / "motion.csv", run_with_gap(5, lost=[]))
    ordered = path.read_bytes()
    head, *rows = ordered.splitlines(keepends=True)
    path.write_bytes(head + b"".join([rows[0], rows[3], rows[4], rows[1], rows[2]]))
    assert [each.index for each in read_estimates(path)] == [0, 1, 2, 3, 4]
    sort_rows(path)
    assert path.read_bytes() == ordered
    assert np.all(np.diff([each.index for each in read_estimates(path)]) == 1)
