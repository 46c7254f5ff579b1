"""Landmarks against paths of joints: known errors come out as they were put in, wrong files are named in one line."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.body import Landmark
from airborne.errors import ResultError
from airborne.evaluation import JointPaths, compare_joints, landmark_of, read_joint_paths
from airborne.motion import Motion, landmarks, write_joints
from airborne.tracking import Status
from tests.support.motions import figure, motion_of, small_covariance, swinging
from tests.support.tolerances import ROUNDTRIP, sampled

MARKS = ("pelvis", "head", "elbow_left", "wrist_left", "knee_right")
PLAIN = figure()
MODEL = replace(
    PLAIN,
    landmarks=tuple(
        Landmark(name, mark.segment, mark.position_m) for name, mark in zip(MARKS, PLAIN.landmarks, strict=True)
    ),
)
TIMES = np.arange(30) / 60


def run(**kwargs):
    return motion_of(MODEL, swinging(MODEL, TIMES), rate_hz=60, **kwargs)


def paths(motion=None, names=MARKS, error_m=0.0, shift_s=0.0):
    points, _ = landmarks(motion or run(), MODEL)
    return JointPaths(names=tuple(names), time_s=TIMES + shift_s, points=points + error_m)


def test_a_motion_against_itself_has_no_errors():
    result = compare_joints(run(), MODEL, paths())
    assert result.whole.mean_mm == 0
    assert result.whole.n == 30 * 5
    assert list(result.joints) == list(MARKS)
    assert (result.n_matched, result.n_tracked, result.better_shift_s, result.not_compared) == (30, 30, 0, ())


def test_a_shift_of_the_world_is_the_bias_and_goes_with_it():
    result = compare_joints(run(), MODEL, paths(error_m=np.array([-0.003, 0.0, 0.004])))
    assert result.whole.mean_mm == pytest.approx(5.0, abs=1e3 * ROUNDTRIP)
    assert result.joints["head"].rms_mm == pytest.approx(5.0, abs=1e3 * ROUNDTRIP)
    np.testing.assert_allclose(result.whole.bias_mm, [3.0, 0.0, -4.0], atol=1e3 * ROUNDTRIP)
    assert result.whole.mean_without_bias_mm == pytest.approx(0, abs=1e3 * ROUNDTRIP)
    assert result.whole.mean_without_offset_mm > 0.1  # the segments turn under it


def test_another_origin_of_the_world_is_asked_about_and_a_small_shift_is_not():
    (question,) = compare_joints(run(), MODEL, paths(error_m=np.array([-1.0, 0.0, 0.0]))).questions
    assert "less a constant shift in the world the mean would be 0 mm, not 1000 mm" in question
    assert compare_joints(run(), MODEL, paths(error_m=np.array([-0.05, 0.0, 0.0]))).questions == ()


def test_paths_of_another_recording_are_asked_about():
    question = "are they of this recording?"
    elsewhere = np.random.default_rng(3).uniform(-2, 2, (len(TIMES), len(MARKS), 3))
    assert question in compare_joints(run(), MODEL, paths(error_m=elsewhere)).describe()
    assert question not in compare_joints(run(), MODEL, paths(error_m=np.array([-3.0, 0.0, 4.0]))).describe()
    assert question not in compare_joints(run(), MODEL, paths()).describe()


def test_smoothed_joints_take_the_places_of_the_tracked_ones_and_their_deviations():
    off_m = np.array([0.003, 0.0, -0.004])
    smooth = paths(names=MARKS, error_m=off_m)
    smooth = replace(smooth, sd=np.full(smooth.points.shape[:2], 1e-4))
    result = compare_joints(run(), MODEL, paths(), smooth)
    np.testing.assert_allclose(result.whole.bias_mm, 1e3 * off_m, atol=1e3 * ROUNDTRIP)
    assert result.calibration.within_2sd == pytest.approx(1 / 3)  # the one axis without an error
    reordered = replace(
        smooth, names=MARKS[::-1], points=smooth.points[:, ::-1], sd=np.full(smooth.points.shape[:2], np.inf)
    )
    assert compare_joints(run(), MODEL, paths(), reordered).whole == result.whole
    assert "from frame to frame" not in result.describe()


@pytest.mark.parametrize("other", [{"names": ("a", *MARKS[1:])}, {"time_s": TIMES + 1}, {"time_s": TIMES[:-1]}])
def test_smoothed_joints_of_another_run_are_refused(other):
    with pytest.raises(ResultError, match="smoothed joints are of another run"):
        compare_joints(run(), MODEL, paths(), replace(paths(), **other))


def test_another_definition_of_a_joint_is_an_offset_in_its_segment_and_goes_with_it():
    offset = np.array([0.02, -0.01, 0.005])
    other = replace(
        MODEL, landmarks=tuple(replace(mark, position_m=mark.position_m - offset) for mark in MODEL.landmarks)
    )
    points, _ = landmarks(run(), other)
    result = compare_joints(run(), MODEL, JointPaths(names=MARKS, time_s=TIMES, points=points))
    np.testing.assert_allclose(result.joints["wrist_left"].offset_mm, 1e3 * offset, atol=1e3 * ROUNDTRIP)
    assert result.whole.mean_mm == pytest.approx(1e3 * np.linalg.norm(offset), abs=1e3 * ROUNDTRIP)
    assert result.whole.mean_without_offset_mm == pytest.approx(0, abs=1e3 * ROUNDTRIP)
    assert result.whole.mean_without_bias_mm > 0.1
    assert result.whole.offset_mm is None


def test_errors_of_one_landmark_are_its_own():
    reference = paths()
    reference.points[:, 1, 0] += 0.01 * (-1.0) ** np.arange(30)
    result = compare_joints(run(), MODEL, reference)
    assert result.joints["head"].mean_mm == pytest.approx(10, abs=1e3 * ROUNDTRIP)
    assert result.joints["head"].largest_mm == pytest.approx(10, abs=1e3 * ROUNDTRIP)
    assert result.joints["pelvis"].mean_mm == 0
    assert result.whole.mean_mm == pytest.approx(10 / 5, abs=1e3 * ROUNDTRIP)
    assert result.whole.rms_mm == pytest.approx(10 / 5**0.5, abs=1e3 * ROUNDTRIP)


def test_lost_frames_are_counted_and_uncertain_ones_separately():
    motion = run(lost=[3, 4], covariance=small_covariance(MODEL))
    status = motion.status.astype("<U9")
    status[7] = Status.UNCERTAIN.value
    reference = paths()
    reference.points[7] += 0.05
    result = compare_joints(replace(motion, status=status), MODEL, reference)
    assert (result.n_matched, result.n_tracked, result.n_uncertain, result.n_lost) == (30, 27, 1, 2)
    assert result.whole.n == 28 * 5
    assert result.whole.mean_mm > 1
    assert result.tracked is not None
    assert result.tracked.mean_mm == 0


def test_missing_points_of_the_reference_are_left_out():
    reference = paths()
    reference.points[:, 2] = np.nan
    reference.points[5:10, 0, 1] = np.nan
    result = compare_joints(run(), MODEL, reference)
    assert result.joints["pelvis"].n == 25
    assert "elbow_left" not in result.joints
    assert result.not_compared == ("elbow_left",)


def test_a_reference_whose_clock_is_off_by_a_frame_is_reported():
    result = compare_joints(run(), MODEL, paths(shift_s=1 / 60))
    assert result.better_shift_s == pytest.approx(-1 / 60, abs=ROUNDTRIP)
    assert result.better_mean_without_offset_mm == pytest.approx(0, abs=1e3 * ROUNDTRIP)
    assert "-16.7 ms" in result.describe()


@pytest.mark.parametrize(
    ("change", "question"),
    [
        (lambda p: replace(p, points=p.points / 1000), "metres that are read as millimetres?"),
        (lambda p: replace(p, points=p.points * 1000), "millimetres that are read as metres?"),
        (lambda p: replace(p, points=p.points * 100), "centimetres that are read as metres?"),
        (lambda p: replace(p, points=p.points[..., [2, 0, 1]]), "with its y, z, x taken as x, y, z the reference"),
        (lambda p: replace(p, points=p.points * [-1, -1, 1]), "with its -x, -y, z taken as x, y, z the reference"),
        (lambda p: replace(p, time_s=2 * p.time_s), "is its rate 60 times a second, not 30?"),
    ],
)
def test_a_reference_that_is_mixed_up_is_asked_about_and_no_clock(change, question):
    text = compare_joints(run(), MODEL, change(paths())).describe()
    assert question in text and text.count("?") == 1 and "both clocks" not in text


def test_left_and_right_of_a_reference_that_are_exchanged_are_asked_about():
    marks = ("pelvis", "head", "knee_left", "knee_right", "knee")
    model = replace(MODEL, landmarks=tuple(replace(m, name=n) for m, n in zip(MODEL.landmarks, marks, strict=True)))
    exchanged = ("pelvis", "head", "knee_right", "knee_left", "knee")
    text = compare_joints(run(), model, paths(names=exchanged)).describe()
    assert "with its left and right exchanged the reference would lie 0 mm" in text and text.count("?") == 1
    assert "?" not in compare_joints(run(), model, paths(names=marks)).describe()


def test_a_reference_with_times_in_milliseconds_is_asked_about():
    with pytest.raises(ResultError, match="are they in milliseconds"):
        compare_joints(run(), MODEL, replace(paths(), time_s=1e3 * paths().time_s))


def test_correct_deviations_contain_two_thirds_of_the_errors():
    covariance, rng = small_covariance(MODEL, sd=5e-3), np.random.default_rng(0)
    motion = run(covariance=covariance)
    points, sd = landmarks(motion, MODEL)
    noisy = points + sd[..., None] * rng.normal(size=points.shape)
    whole = compare_joints(
        motion, MODEL, JointPaths(names=MARKS, time_s=TIMES, points=noisy + np.array([0.0, 0.0, 0.02]))
    )
    assert whole.coverage_with_offset.within_95 < whole.coverage.within_95
    result = compare_joints(motion, MODEL, JointPaths(names=MARKS, time_s=TIMES, points=noisy)).calibration
    assert result.n == 30 * 5 * 3
    assert result.within_1sd == pytest.approx(0.683, abs=sampled(result.n))
    assert result.within_2sd == pytest.approx(0.954, abs=sampled(result.n))


def test_deviations_of_single_frames_leave_out_what_lasts():
    covariance, rng = small_covariance(MODEL, sd=5e-3), np.random.default_rng(0)
    motion = run(covariance=covariance)
    points, sd = landmarks(motion, MODEL)
    noisy = points + sd[..., None] * rng.normal(size=points.shape)
    lasting = np.broadcast_to(np.diag([0.05**2] * 3 + [0.0] * 3), (len(motion), 6, 6))
    result = compare_joints(
        replace(motion, lasting=lasting), MODEL, JointPaths(names=MARKS, time_s=TIMES, points=noisy)
    )
    assert result.coverage.within_50 > 0.99
    assert result.coverage_by_frame.within_80 == pytest.approx(0.8, abs=sampled(result.coverage_by_frame.n))
    assert "from frame to frame" in result.describe()


def test_numbers_go_to_json_without_nan():
    result = compare_joints(run(), MODEL, replace(paths(), time_s=TIMES[:1], points=paths().points[:1]))
    values = result.to_dict()
    assert values["whole"]["mean_without_offset_mm"] is None
    assert values["joints"]["head"]["mean_mm"] == 0
    assert "pelvis" in result.describe()


@pytest.mark.parametrize(
    ("marker", "landmark"),
    [
        ("RHip", "hip_right"),
        ("LKnee", "knee_left"),
        ("left_ankle", "ankle_left"),
        ("hip_left", "hip_left"),
        ("r_elbow", "elbow_right"),
        ("LeftShoulder", "shoulder_left"),
        ("RIGHT_WRIST", "wrist_right"),
        ("RBigToe", "foot_right"),
        ("left_foot_index", "foot_left"),
        ("MidHip", "pelvis"),
        ("CHip", "pelvis"),
        ("Hip", "pelvis"),
        ("Neck", "neck"),
        ("head", "head"),
        ("Head", None),  # of HALPE its top, where the landmark lies between the ears
        ("RHeel", None),
        ("Nose", None),
        ("LEye", None),
        ("LHead", None),
        ("", None),
    ],
)
def test_markers_of_pose_networks_have_their_landmarks(marker, landmark):
    assert landmark_of(marker) == landmark


def test_markers_go_with_landmarks_and_the_others_are_named():
    reference = paths(names=("Hip", "head", "LElbow", "Nose", "RKnee"))
    reference.points[:, 3] += 1.0
    result = compare_joints(run(), MODEL, reference)
    assert set(result.joints) == {"pelvis", "head", "elbow_left", "knee_right"}
    assert result.not_compared == ("Nose", "wrist_left")
    assert result.whole.mean_mm == 0


def test_reference_of_other_joints_or_another_time_is_refused():
    with pytest.raises(ResultError, match="no joint in common"):
        compare_joints(run(), MODEL, paths(names=("a", "b", "c", "d", "e")))
    with pytest.raises(ResultError, match="no pose to compare"):
        compare_joints(run(), MODEL, paths(shift_s=100.0))
    with pytest.raises(ResultError, match="no number where the motion has a pose"):
        compare_joints(run(), MODEL, paths(error_m=np.nan))
    with pytest.raises(ResultError, match="no pose to compare"):
        compare_joints(Motion.collect([], run().joints), MODEL, paths())


def test_joints_of_a_run_are_read_back_as_paths(tmp_path):
    write_joints(tmp_path / "joints.csv", run(lost=[2]), MODEL)
    result = read_joint_paths(tmp_path / "joints.csv")
    assert result.names == MARKS
    np.testing.assert_array_equal(result.time_s, TIMES)
    points, sd = landmarks(run(lost=[2]), MODEL)
    np.testing.assert_array_equal(result.points, points)
    np.testing.assert_array_equal(result.sd, sd)


def test_an_infinite_deviation_is_read_as_it_is_written(tmp_path):
    write_joints(tmp_path / "joints.csv", run(covariance=np.diag(np.full(MODEL.n_dofs, np.inf))), MODEL)
    assert np.isinf(read_joint_paths(tmp_path / "joints.csv").sd).all()


TRC = (
    "PathFileType\t4\t(X/Y/Z)\ttrial.trc\n"
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n"
    "50\t50\t2\t2\tmm\t50\t1\t2\n"
    "Frame#\tTime\tRHip\t\t\tLHip\t\t\n"
    "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\t\n"
    "\n"
    "1\t0.0\t100\t900\t20\tNaN\tNaN\tNaN\n"
    "2\t0.02\t110\t905\t21\t1\t2\t3\t\n"
)


def written(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    return tmp_path / name


def test_trc_points_come_in_metres_with_z_up(tmp_path):
    for text in (TRC, TRC.replace("\n", "\r\n"), TRC.replace("\t\n\n", "\n")):
        result = read_joint_paths(written(tmp_path, "a.TRC", text))
        assert result.names == ("RHip", "LHip")
        np.testing.assert_array_equal(result.time_s, [0.0, 0.02])
        np.testing.assert_allclose(result.points[0, 0], [0.02, 0.1, 0.9], atol=ROUNDTRIP)
        np.testing.assert_allclose(result.points[1, 1], [0.003, 0.001, 0.002], atol=ROUNDTRIP)
        assert np.isnan(result.points[0, 1]).all()


LONG = "frame,time_s,joint,x_m,y_m,z_m\n0,0.0,head,1,2,3\n0,0.0,pelvis,1,2,2\n1,0.02,pelvis,1,2,2.5\n"


def test_long_table_has_gaps_where_a_joint_has_no_line(tmp_path):
    result = read_joint_paths(written(tmp_path, "truth_joints.csv", LONG))
    assert result.names == ("head", "pelvis")
    np.testing.assert_array_equal(result.points[:, 1], [[1, 2, 2], [1, 2, 2.5]])
    assert np.isnan(result.points[1, 0]).all()


@pytest.mark.parametrize(
    ("name", "text", "complaint"),
    [
        ("t.csv", LONG.replace("joint", "name"), "no column joint"),
        ("t.csv", LONG.replace("1,2,2.5", "1,2"), "line 4 has 5 cells"),
        ("t.csv", LONG.replace("0.02", ""), "line 4 has no time_s"),
        ("t.csv", LONG.replace("2.5", "up"), "line 4: z_m is 'up'"),
        ("t.csv", LONG.replace("0.02", "0.0"), "pelvis 2 times at 0 s"),
        ("t.csv", "player,time_s,joint,x_m,y_m,z_m\na,0,head,1,2,3\nb,0,head,1,2,3\n", "holds 2 players"),
        ("t.csv", "", "no lines of numbers"),
        ("t.trc", "", "does not begin like a TRC"),
        ("t.trc", LONG, "does not begin like a TRC"),
        ("t.trc", TRC.replace("\tmm\t", "\tinch\t"), "Units is 'inch'"),
        ("t.trc", TRC.replace("905", "high"), "line 8: a cell is not a number"),
        ("t.trc", TRC.replace("\t0.02\t", "\t0.0\t"), "line 8: its time is not after"),
        ("t.trc", TRC.replace("\t21\t", "\t21\t5\t"), "line 8 has 10 cells, expected 8"),
        ("t.trc", TRC[: TRC.index("1\t0.0")], "no lines of numbers"),
    ],
)
def test_wrong_file_is_named_with_what_is_wrong_in_one_line(tmp_path, name, text, complaint):
    path = written(tmp_path, name, text)
    with pytest.raises(ResultError, match=complaint) as caught:
        read_joint_paths(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("name", ["none.trc", "none.csv"])
def test_missing_file_is_refused_in_one_line(tmp_path, name):
    with pytest.raises(ResultError, match="cannot be read"):
        read_joint_paths(tmp_path / name)


def test_file_that_is_no_text_is_refused(tmp_path):
    (tmp_path / "a.trc").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ResultError, match="is not a text file"):
        read_joint_paths(tmp_path / "a.trc")


def test_paths_of_a_real_recording_are_read(shared_data):
    result = read_joint_paths(shared_data("balance") / "Pose2Sim_markers.trc")
    assert result.points.shape == (100, 21, 3)
    assert 0.8 < np.nanmean(result.points[:, result.names.index("RHip"), 2]) < 1.1  # a standing man's hip, z up
    assert len({landmark_of(name) for name in result.names} - {None}) == 15
