"""Players over time: the table is written as it goes and read back to the last bit."""

from dataclasses import fields, replace
from fractions import Fraction

import numpy as np
import pyarrow.parquet as pq
import pytest

from airborne.errors import ResultError
from airborne.motion import PlayersMotion, PlayersWriter, read_players, write_players_parquet
from airborne.tracking import Status
from airborne.tracking.players import PlayerEstimate

JOINTS = ("hip_left", "knee_left", "torso")
PLAYERS = ("Anna", "number 7")


def estimate(rng, player, index, status=Status.TRACKED):
    root = rng.normal(0, 0.01, (len(JOINTS), 3, 3))
    is_lost = status is Status.LOST
    points = rng.normal(size=(len(JOINTS), 3))
    covariance = root @ root.transpose(0, 2, 1)
    return PlayerEstimate(
        player=player,
        index=index,
        time_s=Fraction(1001 * index, 60000),
        joint_status=(status,) * len(JOINTS),
        points=np.full_like(points, np.nan) if is_lost else points,
        covariance=np.full_like(covariance, np.nan) if is_lost else covariance,
        score=np.nan if is_lost else float(rng.normal()),
        n_views=0 if is_lost else 3,
    )


def steps(n, seed=0):
    """Both players at n times; the second is lost now and then."""
    rng = np.random.default_rng(seed)
    status = {True: Status.LOST, False: Status.TRACKED}
    return [
        tuple(estimate(rng, player, 3 * k, status[p == 1 and k % 3 == 1]) for p, player in enumerate(PLAYERS))
        for k in range(n)
    ]


def written(path, run, *, resume=False):
    with PlayersWriter(path, JOINTS, resume=resume) as writer:
        for step in run:
            writer.append(step)
    return path


def assert_same(result, expected):
    for field in fields(PlayersMotion):
        np.testing.assert_array_equal(getattr(result, field.name), getattr(expected, field.name), err_msg=field.name)


def test_what_was_written_is_read_back_to_the_last_bit(tmp_path):
    run = steps(7)
    assert_same(read_players(written(tmp_path / "joints.csv", run)), PlayersMotion.collect(run, JOINTS))


def test_an_infinite_deviation_and_a_single_frame_come_back(tmp_path):
    (step,) = steps(1)
    unseen = np.array(step[0].covariance)
    unseen[1] = np.diag([1e-4, np.inf, 1e-4])
    run = [(replace(step[0], covariance=unseen), step[1])]
    result = read_players(written(tmp_path / "joints.csv", run))
    assert_same(result, PlayersMotion.collect(run, JOINTS))
    assert np.isinf(result.sd[0, 0, 1]) and np.isnan(result.rate)


def test_deviation_is_the_root_mean_square_of_the_axes():
    (step,) = steps(1)
    covariance = np.tile(np.diag([1e-4, 4e-4, 4e-4]), (len(JOINTS), 1, 1))
    motion = PlayersMotion.collect([tuple(replace(each, covariance=covariance) for each in step)], JOINTS)
    np.testing.assert_allclose(motion.sd, np.sqrt(3e-4), rtol=1e-12)


def test_rate_is_that_of_the_median_step_or_the_one_given():
    run = steps(9)
    assert PlayersMotion.collect(run, JOINTS).rate == pytest.approx(20000 / 1001, rel=1e-12)
    assert PlayersMotion.collect(run[:4] + run[5:], JOINTS).rate == pytest.approx(20000 / 1001, rel=1e-12)
    assert PlayersMotion.collect(run, JOINTS, rate=25).rate == 25


def test_statuses_are_counted_player_by_player():
    motion = PlayersMotion.collect(steps(7), JOINTS)
    assert [motion.count(player, Status.LOST) for player in PLAYERS] == [0, 2]
    assert [motion.count(player, Status.TRACKED) for player in PLAYERS] == [7, 5]


def test_each_joint_has_its_own_status_and_a_player_the_worst_of_the_legs(tmp_path):
    (step,) = steps(1)
    doubtful = [(Status.TRACKED, Status.UNCERTAIN, Status.TRACKED), (Status.TRACKED, Status.TRACKED, Status.UNCERTAIN)]
    run = [tuple(replace(each, joint_status=status) for each, status in zip(step, doubtful, strict=True))]
    result = read_players(written(tmp_path / "joints.csv", run))
    assert_same(result, PlayersMotion.collect(run, JOINTS))
    assert result.joint_status[0].tolist() == [[status.value for status in each] for each in doubtful]
    assert result.status[0].tolist() == ["uncertain", "tracked"], "the torso is no leg"


@pytest.mark.parametrize("share", [0.0, 0.02, 0.4, 0.75, 1.0])
def test_a_run_that_was_cut_off_anywhere_is_completed_to_the_same_file(tmp_path, share):
    run = steps(6)
    whole = written(tmp_path / "whole.csv", run).read_bytes()
    cut = tmp_path / "cut.csv"
    cut.write_bytes(whole[: int(share * len(whole))])
    assert written(cut, run, resume=True).read_bytes() == whole


def test_a_torn_last_time_is_dropped(tmp_path):
    run = steps(4)
    path = written(tmp_path / "joints.csv", run)
    lines = path.read_bytes().splitlines(keepends=True)
    for torn in (lines[-1][:-20], b""):
        path.write_bytes(b"".join(lines[:-1]) + torn)
        assert_same(read_players(path), PlayersMotion.collect(run[:3], JOINTS))


def test_going_on_with_another_result_is_refused_and_leaves_the_file(tmp_path):
    path = written(tmp_path / "joints.csv", steps(3))
    before = path.read_bytes()
    with pytest.raises(ResultError, match="differs from this run in frame 0"):
        written(path, steps(3, seed=1), resume=True)
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"score,n_views", b"score", "has no column n_views"),
        (b"\nAnna,0,0.0,tracked,hip_left", b"\nAnna,0,0.0,tracked,knee_left", "the rows of some frame"),
        (b"\nAnna,3,", b"\nAnna,12,", "the rows of some frame"),
        (b"\nAnna,3,", b"\nAnna,three,", "three"),
    ],
)
def test_a_table_that_cannot_be_right_is_refused_in_one_line(tmp_path, old, new, message):
    path = written(tmp_path / "joints.csv", steps(4))
    data = path.read_bytes()
    assert old in data
    path.write_bytes(data.replace(old, new, 1))
    with pytest.raises(ResultError) as caught:
        read_players(path)
    assert message in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("data", [None, b"", b"player,fra"])
def test_a_table_without_a_finished_frame_is_refused(tmp_path, data):
    if data is not None:
        (tmp_path / "joints.csv").write_bytes(data)
    with pytest.raises(ResultError, match=r"joints\.csv"):
        read_players(tmp_path / "joints.csv")
    header_only = written(tmp_path / "header.csv", [])
    with pytest.raises(ResultError, match="no finished frame"):
        read_players(header_only)


def test_parquet_holds_the_same_table_with_units_and_nulls(tmp_path):
    run = steps(3)
    path = written(tmp_path / "joints.csv", run)
    write_players_parquet(tmp_path / "joints.parquet", path)
    table = pq.read_table(tmp_path / "joints.parquet")
    motion = PlayersMotion.collect(run, JOINTS)
    assert table.schema.field("cov_xy_m2").metadata == {b"units": b"m2"}
    assert table.schema.field("x_m").metadata == {b"units": b"m"}
    np.testing.assert_array_equal(table["z_m"].to_numpy().reshape(motion.points.shape[:3]), motion.points[..., 2])
    assert table["z_m"].null_count == int(np.isnan(motion.points[..., 2]).sum()) > 0
