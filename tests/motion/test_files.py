"""motion.csv keeps every finished frame, to the last bit."""

import os
import signal
import subprocess
import sys
import textwrap
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from airborne.errors import ResultError
from airborne.motion import Motion, MotionWriter, read_estimates, read_motion
from airborne.tracking import Doubt, Status
from tests.support.motions import estimate, run_with_gap
from tests.support.places import ROOT
from tests.support.tolerances import ROUNDTRIP

COLUMNS = (
    "frame,time_s,status,score,x_m,y_m,z_m,qx,qy,qz,qw,x_m_sd,y_m_sd,z_m_sd,rx_deg_sd,ry_deg_sd,rz_deg_sd,n_views,"
    "doubts,uncertain_joints"
)
MARKED = ((0, 2), (), (1,))  # of three joints, in three frames


def write(path, estimates, joints=()):
    with MotionWriter(path, joints) as writer:
        for item in estimates:
            writer.append(item)
    return path


def assert_same(result, expected):
    assert len(result) == len(expected)
    for a, b in zip(result, expected, strict=True):
        assert (a.index, a.time_s, a.status, a.n_views) == (b.index, b.time_s, b.status, b.n_views)
        assert (a.uncertain_joints, a.doubts) == (b.uncertain_joints, b.doubts)
        np.testing.assert_array_equal(a.score, b.score)
        assert (a.pose is None, a.covariance is None) == (b.pose is None, b.covariance is None)
        if a.pose is not None:
            np.testing.assert_array_equal(a.pose.world_from_root.as_matrix(), b.pose.world_from_root.as_matrix())
            np.testing.assert_array_equal(a.pose.joint_angles, b.pose.joint_angles)
        if a.covariance is not None:
            np.testing.assert_array_equal(a.covariance, b.covariance)


def test_estimates_come_back_bit_for_bit(tmp_path):
    estimates = run_with_gap(n=200, lost=range(50, 70))
    assert_same(read_estimates(write(tmp_path / "motion.csv", estimates)), estimates)


def test_joint_angles_and_their_names_come_back_bit_for_bit(tmp_path):
    estimates = run_with_gap(n_joints=2)
    path = write(tmp_path / "motion.csv", estimates, ("chest", "head"))
    assert_same(read_estimates(path), estimates)
    assert read_motion(path).joints == ("chest", "head")


def test_uncertain_joints_come_back_and_another_bodys_are_refused(tmp_path):
    joints = ("upper arm left", "forearm", "hand")
    marked = [replace(each, uncertain_joints=of) for each, of in zip(run_with_gap(3, n_joints=3), MARKED, strict=True)]
    path = write(tmp_path / "motion.csv", marked, joints)
    assert_same(read_estimates(path), marked)
    assert read_motion(path).uncertain_joints.tolist() == [[True, False, True], [False] * 3, [False, True, False]]
    path.write_text(path.read_text().replace("/hand", "/tail"))
    with pytest.raises(ResultError, match=r"line 2: uncertain_joints names 'tail', expected some of upper arm"):
        read_motion(path)


def test_doubts_come_back_are_counted_and_others_are_refused(tmp_path):
    doubts = [(Doubt.IMAGES, Doubt.VIEW), (), (Doubt.IMAGES,)]
    doubted = [replace(each, doubts=of) for each, of in zip(run_with_gap(3), doubts, strict=True)]
    path = write(tmp_path / "motion.csv", doubted)
    assert_same(read_estimates(path), doubted)
    assert read_motion(path).doubts.tolist() == ["images/view", "", "images"]
    assert list(read_motion(path).count_doubts().items()) == [("images", 2), ("view", 1)]
    path.write_text(path.read_text().replace("/view", "/fog"))
    with pytest.raises(ResultError, match=r"line 2: doubts names 'fog', expected some of images, position, view"):
        read_motion(path)


def test_one_frame_is_a_motion(tmp_path):
    motion = read_motion(write(tmp_path / "motion.csv", [estimate(0)]))
    assert len(motion) == 1
    assert motion.has_pose.all()


def test_run_killed_before_its_first_frame_has_no_frames(tmp_path):
    assert len(read_motion(write(tmp_path / "motion.csv", []))) == 0


def test_infinite_and_unknown_variances_come_back(tmp_path):
    item = estimate(0)
    item.covariance[5, :] = item.covariance[:, 5] = np.nan
    item.covariance[5, 5] = np.inf
    path = write(tmp_path / "motion.csv", [item, estimate(1, covariance=False)])
    assert_same(read_estimates(path), [item, estimate(1, covariance=False)])
    assert np.isinf(read_motion(path).rotation_sd[0, 2])


def test_columns_begin_as_documented_and_lost_frames_have_empty_cells(tmp_path):
    lines = write(tmp_path / "motion.csv", run_with_gap(2, lost=[1])).read_text().splitlines()
    assert lines[0].startswith(COLUMNS + ",cov_00,")
    assert lines[2].startswith("1,0.016683333333333335,lost,,,,,,,,,,,,,,,0,,")


def test_deviations_are_the_roots_of_the_variances_with_rotation_in_degrees(tmp_path):
    item = estimate(0)
    path = write(tmp_path / "motion.csv", [item])
    header, row = (line.split(",") for line in path.read_text().splitlines())
    variance = np.diag(item.covariance)
    assert float(row[header.index("y_m_sd")]) == pytest.approx(np.sqrt(variance[1]), rel=ROUNDTRIP)
    assert float(row[header.index("rz_deg_sd")]) == pytest.approx(np.rad2deg(np.sqrt(variance[5])), rel=ROUNDTRIP)


def test_cutting_the_file_anywhere_keeps_every_whole_row(tmp_path):
    estimates = run_with_gap(3, lost=[1])
    path = write(tmp_path / "motion.csv", estimates)
    data = path.read_bytes()
    ends = [i + 1 for i, byte in enumerate(data) if byte == ord("\n")]
    for length in [*range(ends[0], len(data), 7), *ends, *[end - 1 for end in ends[1:]]]:
        path.write_bytes(data[:length])
        n_whole = sum(end <= length for end in ends) - 1
        assert_same(read_estimates(path), estimates[:n_whole])


def test_resumed_file_is_the_file_of_an_unbroken_run(tmp_path):
    estimates = run_with_gap(6)
    whole = write(tmp_path / "whole.csv", estimates).read_bytes()
    broken = write(tmp_path / "broken.csv", estimates[:4])
    broken.write_bytes(broken.read_bytes()[:-20])  # frame 3 is torn
    n_kept = len(read_estimates(broken))
    with MotionWriter(broken, resume=True) as writer:
        for item in estimates[n_kept:]:
            writer.append(item)
    assert n_kept == 3
    assert broken.read_bytes() == whole


def test_resuming_cuts_the_torn_line_at_once(tmp_path):
    path = write(tmp_path / "motion.csv", run_with_gap(3, lost=[]))
    whole = path.read_bytes()
    path.write_bytes(whole + whole.splitlines()[-1])
    with MotionWriter(path, resume=True):
        pass
    assert path.read_bytes() == whole


@pytest.mark.parametrize("content", [None, b"", b"frame,time_s,sta"])
def test_resuming_before_the_header_was_written_starts_anew(tmp_path, content):
    path = tmp_path / "motion.csv"
    if content is not None:
        path.write_bytes(content)
    with MotionWriter(path, resume=True) as writer:
        writer.append(estimate(0))
    assert_same(read_estimates(path), [estimate(0)])


def test_without_resume_an_old_file_is_replaced(tmp_path):
    path = write(tmp_path / "motion.csv", run_with_gap(6))
    assert_same(read_estimates(write(path, [estimate(9)])), [estimate(9)])


def test_resuming_with_another_body_is_refused(tmp_path):
    path = write(tmp_path / "motion.csv", [estimate(0)])
    before = path.read_bytes()
    with pytest.raises(ResultError, match="another body"):
        MotionWriter(path, ("chest",), resume=True)
    assert path.read_bytes() == before


@pytest.mark.parametrize("joints", [(), ("chest", "head")])
def test_killed_process_leaves_every_finished_frame(tmp_path, joints):
    path = tmp_path / "motion.csv"
    script = textwrap.dedent(
        f"""
        import itertools, pathlib
        from airborne.motion import MotionWriter
        from tests.support.motions import estimate
        writer = MotionWriter(pathlib.Path({str(path)!r}), {joints!r})
        for i in itertools.count():
            writer.append(estimate(i, n_joints={len(joints)}))
            print(i, flush=True)
        """
    )
    with subprocess.Popen([sys.executable, "-c", script], cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        for line in process.stdout:
            if int(line) == 20:
                os.kill(process.pid, signal.SIGKILL)
                break
        finished = max([20, *map(int, process.stdout.read().split())])
    result = read_estimates(path)
    assert finished <= result[-1].index <= finished + 1
    assert_same(result, [estimate(i, n_joints=len(joints)) for i in range(len(result))])


JOINTS = ("chest", "head")


def test_whole_covariance_of_a_body_with_joints_comes_back_bit_for_bit(tmp_path):
    estimates = run_with_gap(n=20, n_joints=2)
    estimates[1].covariance[7] = estimates[1].covariance[:, 7] = 0.0
    estimates[1].covariance[7, 7] = np.inf
    path = write(tmp_path / "motion.csv", estimates, JOINTS)
    assert_same(read_estimates(path), estimates)
    assert read_motion(path).covariance.shape == (20, 12, 12)
    assert np.isinf(read_motion(path).joint_rotation_sd[1, 0, 1])
    assert (tmp_path / "covariance.bin").stat().st_size == 20 * 8 * 12 * 13 / 2


def test_body_in_one_piece_has_no_second_file(tmp_path):
    write(tmp_path / "motion.csv", run_with_gap())
    assert [path.name for path in tmp_path.iterdir()] == ["motion.csv"]


def test_without_covariance_bin_only_what_the_joints_add_is_unknown(tmp_path):
    estimates = run_with_gap(5, lost=[2], n_joints=2)
    path = write(tmp_path / "motion.csv", estimates, JOINTS)
    (tmp_path / "covariance.bin").unlink()
    result = read_motion(path).covariance
    expected = Motion.collect(estimates, JOINTS).covariance
    expected[:, 6:] = expected[:, :, 6:] = np.nan
    np.testing.assert_array_equal(result, expected)


@pytest.mark.parametrize(
    ("column", "cell", "said"),
    [
        ("status", "trackd", "status is 'trackd', expected tracked, uncertain, lost"),
        ("n_views", "two", "n_views is 'two', expected a whole number"),
    ],
)
def test_damaged_cell_is_named_with_what_was_expected(tmp_path, column, cell, said):
    path = write(tmp_path / "motion.csv", run_with_gap(1))
    header, row = (line.split(",") for line in path.read_text().splitlines())
    row[header.index(column)] = cell
    path.write_text("\n".join([",".join(header), ",".join(row), ""]))
    with pytest.raises(ResultError, match=f"line 2: {said}"):
        read_motion(path)


def test_covariance_of_the_root_alone_leaves_the_joints_unknown(tmp_path):
    item = estimate(0, n_joints=2)
    alone = replace(item, covariance=item.covariance[:6, :6])
    result = read_motion(write(tmp_path / "motion.csv", [alone], JOINTS))
    np.testing.assert_array_equal(result.covariance[0, :6, :6], alone.covariance)
    assert np.isnan(result.covariance[0, 6:]).all()


def test_cutting_both_files_of_a_body_with_joints_keeps_every_whole_row(tmp_path):
    estimates = run_with_gap(4, lost=[1], n_joints=2)
    path = write(tmp_path / "motion.csv", estimates, JOINTS)
    rows, covariances = path.read_bytes(), (tmp_path / "covariance.bin").read_bytes()
    row_bytes = len(covariances) // 4
    second = [i for i, byte in enumerate(rows) if byte == ord("\n")][2]  # the end of frame 1
    for left in (2 * row_bytes, 2 * row_bytes + 5, 3 * row_bytes, 3 * row_bytes + 77, 4 * row_bytes):
        path.write_bytes(rows[: second + 1 + 30])  # frame 2 is torn
        (tmp_path / "covariance.bin").write_bytes(covariances[:left])
        assert_same(read_estimates(path), estimates[:2])
        with MotionWriter(path, JOINTS, resume=True) as writer:
            for item in estimates[2:]:
                writer.append(item)
        assert path.read_bytes() == rows
        assert (tmp_path / "covariance.bin").read_bytes() == covariances


@pytest.mark.parametrize("left", [None, 0, 1])
def test_resuming_without_whole_covariances_keeps_the_rows_together(tmp_path, left):
    estimates = run_with_gap(4, lost=[], n_joints=2)
    path, beside = write(tmp_path / "motion.csv", estimates[:3], JOINTS), tmp_path / "covariance.bin"
    if left is None:
        beside.unlink()
    else:
        beside.write_bytes(beside.read_bytes()[: left * 8 * 78])
    with MotionWriter(path, JOINTS, resume=True) as writer:
        writer.append(estimates[3])
    result = read_motion(path).covariance
    is_known = np.array([k < (left or 0) for k in range(3)] + [True])
    np.testing.assert_array_equal(np.isnan(result).any(axis=(1, 2)), ~is_known)
    whole = Motion.collect(estimates, JOINTS).covariance
    np.testing.assert_array_equal(result[is_known], whole[is_known])
    np.testing.assert_array_equal(result[:, :6, :6], whole[:, :6, :6])


def test_covariances_of_another_run_are_refused_in_one_line(tmp_path):
    path = write(tmp_path / "motion.csv", run_with_gap(3, n_joints=2), JOINTS)
    (tmp_path / "other").mkdir()
    other = write(tmp_path / "other" / "motion.csv", run_with_gap(3, n_joints=2, seed=1), JOINTS)
    path.with_name("covariance.bin").write_bytes(other.with_name("covariance.bin").read_bytes())
    with pytest.raises(ResultError, match=r"line 2: covariance\.bin holds another covariance.*remove it") as caught:
        read_motion(path)
    assert "\n" not in str(caught.value)


def test_without_resume_old_covariances_are_replaced(tmp_path):
    path = write(tmp_path / "motion.csv", run_with_gap(6, n_joints=2), JOINTS)
    assert_same(read_estimates(write(path, [estimate(9, n_joints=2)], JOINTS)), [estimate(9, n_joints=2)])


def test_exact_time_does_not_pass_through_a_float(tmp_path):
    (result,) = read_estimates(write(tmp_path / "motion.csv", [estimate(7)]))
    assert result.time_s == Fraction(1001 * 7, 60000)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda text: text.replace("frame,time_s", "field,time"), "has no column frame, time_s"),
        (lambda text: text.replace("frame,time_s", "time_s,frame"), "columns in another order"),
        (lambda text: "", "is empty"),
        (lambda text: text.replace(",tracked,", ",found,"), "line 2: status is 'found', expected tracked"),
        (lambda text: text.replace("\n1,", "\n1,1,"), "line 3: .* cells, expected"),
        (lambda text: text.replace("\n1,", "\n0,"), "line 3: frame 0 a second time"),
        (lambda text: text.replace("\n1,", "\nx,"), "line 3: .*'x'"),
        (lambda text: text.replace(",1001/60000,", ",1001/0,"), "line 3"),
    ],
)
def test_malformed_file_is_named_with_its_line(tmp_path, change, complaint):
    path = write(tmp_path / "motion.csv", run_with_gap(3, lost=[]))
    path.write_text(change(path.read_text()))
    with pytest.raises(ResultError, match=complaint) as caught:
        read_motion(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_rotation_that_is_none_is_refused(tmp_path):
    path = write(tmp_path / "motion.csv", [estimate(0)])
    header, row = path.read_text().splitlines()
    cells = row.split(",")
    cells[header.split(",").index("r11")] = "7.0"
    path.write_text(f"{header}\n{','.join(cells)}\n")
    with pytest.raises(ResultError, match="not a rotation"):
        read_estimates(path)


@pytest.mark.parametrize("content", [b"\xff\xfe\x00\x01\n", b"\x00\n"])
def test_file_that_is_no_text_is_refused_in_one_line(tmp_path, content):
    path = tmp_path / "motion.csv"
    path.write_bytes(content)
    with pytest.raises(ResultError, match="expected the motion"):
        read_motion(path)


def test_missing_file_is_refused_in_one_line(tmp_path):
    with pytest.raises(ResultError, match="cannot be read"):
        read_motion(tmp_path / "motion.csv")


def test_status_values_are_the_documented_three():
    assert [str(status) for status in Status] == ["tracked", "uncertain", "lost"]
