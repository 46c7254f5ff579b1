"""Poses from clicked points."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Ellipsoid, Part, Segment
from airborne.cameras import read_rig
from airborne.errors import ResultError
from airborne.evaluation import compare_digitised, fit_digitised_poses, read_digitised, read_truth
from airborne.evaluation.digitised import DigitisedPoints, body_points, fit_rigid
from tests.support.evaluation import HALF_TURN, IDENTITY, cross, motion_of, shifted
from tests.support.tolerances import ROUNDTRIP, SOLVED

ENDS = ("long_minus", "long_plus", "short_minus", "short_plus")


@pytest.fixture(scope="module")
def rig(thrown_cross):
    return read_rig(thrown_cross / "calib_true.toml")


@pytest.fixture(scope="module")
def truth(thrown_cross):
    return read_truth(thrown_cross / "truth.csv")


def clicks(truth, rig, noise_px=0.0):
    world = np.einsum("nij,pj->npi", truth.R, body_points(cross(), ENDS)) + truth.position[:, None]
    px = np.stack([camera.px_from_world(world) for camera in rig], axis=2)
    noise = np.random.default_rng(0).normal(size=px.shape) * noise_px
    return DigitisedPoints(index=truth.index, points=ENDS, px=px + noise)


def test_points_of_the_cross_are_the_ends_of_its_bars():
    expected = [(0, -0.45, 0), (0, 0.45, 0), (-0.3, 0.18, 0), (0.3, 0.18, 0)]
    np.testing.assert_array_equal(body_points(cross(), ENDS), expected)


def test_points_follow_rotated_parts_on_jointed_segments():
    turn = RigidTransform.from_components([0, 0, 0.1], Rotation.from_euler("X", 90, degrees=True))
    arm = Part("arm", Box(np.array([0.1, 0.4, 0.1])), turn, None)
    trunk = Part("trunk", Ellipsoid(np.ones(3)), RigidTransform.identity(), None)
    model = BodyModel(
        "b", (Segment("root", None, np.zeros(3), (trunk,)), Segment("arm", "root", np.array([1.0, 0, 0]), (arm,)))
    )
    np.testing.assert_allclose(body_points(model, ["arm_plus"]), [[1, 0, 0.3]], atol=ROUNDTRIP)


@pytest.mark.parametrize("point", ["tall_minus", "long_end", "long", "_minus", "short_bar_tip_plus"])
def test_point_of_no_box_is_refused_with_the_boxes_there_are(point):
    with pytest.raises(ResultError, match="with one of the boxes: long_bar, short_bar"):
        body_points(cross(), [point])


def test_exact_clicks_give_the_true_poses(rig, truth):
    poses = fit_digitised_poses(clicks(truth, rig), rig, cross())
    np.testing.assert_allclose(poses.position, truth.position, atol=ROUNDTRIP)
    np.testing.assert_allclose(poses.R, truth.R, atol=ROUNDTRIP)
    assert poses.residual.max() < ROUNDTRIP


def test_points_that_the_body_does_not_have_are_left_out_and_named(rig, truth):
    own = clicks(truth, rig)
    px = np.concatenate([own.px, own.px[:, :2] + 40], axis=1)
    px[:, -1] = np.nan  # named, but never clicked
    more = replace(own, points=(*ENDS, "hand", "foot"), px=px)
    poses = fit_digitised_poses(more, rig, cross())
    np.testing.assert_array_equal(poses.position, fit_digitised_poses(own, rig, cross()).position)
    result = compare_digitised(motion_of(truth), poses, IDENTITY)
    assert "not compared, as the body has no such points: hand" in result.describe().splitlines()
    assert result.to_dict()["points_left_out"] == ["hand"]
    with pytest.raises(ResultError, match="point 'hand' is the end of no single box"):
        fit_digitised_poses(replace(more, points=("hand", "foot"), px=px[:, -2:]), rig, cross())


def test_exact_clicks_through_bent_lenses_give_the_true_poses(rig, truth):
    bent = replace(rig, cameras=tuple(replace(c, distortion=np.array([-0.1, 0.02, 1e-3, 1e-3, 0])) for c in rig))
    poses = fit_digitised_poses(clicks(truth, bent), bent, cross())
    np.testing.assert_allclose(poses.position, truth.position, atol=SOLVED)


def test_pose_needs_three_points_not_in_a_line(rig, truth):
    seen = clicks(truth, rig)
    seen.px[0, 0] = np.nan  # one point missing: still three
    seen.px[1, :2] = np.nan  # two are left
    seen.px[2, 2, 1:] = np.nan  # one of the three points left is seen by one camera only
    seen.px[2, 0] = np.nan
    poses = fit_digitised_poses(seen, rig, cross())
    is_known = np.isfinite(poses.position).all(axis=-1)
    assert is_known[:4].tolist() == [True, False, False, True]
    np.testing.assert_allclose(poses.R[0], truth.R[0], atol=ROUNDTRIP)


def test_bundled_clicks_are_near_the_truth(thrown_cross, rig, truth):
    poses = fit_digitised_poses(read_digitised(thrown_cross / "digitised.csv", rig), rig, cross())
    result = compare_digitised(motion_of(truth), poses, HALF_TURN)
    assert result.n_poses == 34
    assert result.tracked_minus_digitised.n_matched == 34
    assert result.tracked_minus_digitised.position.rms_3d_mm < 5
    assert result.tracked_minus_digitised.raw.geodesic_rms_deg < 1.5
    assert 1 < result.rigid_fit_residual_rms_mm < 10


@pytest.mark.parametrize(("axis", "order"), [(2, [1, 0, 2]), (1, [1, 0, 2, 3])], ids=["cameras", "points"])
def test_clicks_that_do_not_fit_the_body_are_asked_about(rig, truth, axis, order):
    seen = clicks(truth, rig, noise_px=1.0)
    right, wrong = (
        compare_digitised(motion_of(truth), fit_digitised_poses(each, rig, cross()), HALF_TURN)
        for each in (seen, replace(seen, px=np.take(seen.px, order, axis=axis)))
    )
    assert right.questions == ()
    assert [each for each in wrong.questions if "are cameras' columns or points exchanged" in each]
    assert "are cameras' columns or points exchanged" in wrong.describe()


def test_difference_is_tracked_minus_digitised_by_frame_number(rig, truth):
    motion = shifted(motion_of(truth), [0.005, 0, 0])
    poses = fit_digitised_poses(clicks(truth, rig), rig, cross())
    late = replace(motion, time_s=motion.time_s + 10)  # clicked fields have numbers, not times
    result = compare_digitised(late, poses, IDENTITY).tracked_minus_digitised
    np.testing.assert_allclose(result.position.rms_mm, [5, 0, 0], atol=1e3 * ROUNDTRIP)
    assert result.n_matched == 34


def test_fields_that_were_not_tracked_or_not_clicked_are_left_out(rig, truth):
    seen = clicks(truth, rig)
    seen.px[10:15] = np.nan
    poses = fit_digitised_poses(seen, rig, cross())
    result = compare_digitised(motion_of(truth, lost=range(20, 24)), poses, IDENTITY)
    assert result.n_poses == 29
    assert (result.tracked_minus_digitised.n_tracked, result.tracked_minus_digitised.n_lost) == (25, 4)


def test_clicks_of_other_fields_are_refused(rig, truth):
    poses = fit_digitised_poses(clicks(truth, rig), rig, cross())
    with pytest.raises(ResultError, match=r"34 poses, 34 frames"):
        compare_digitised(motion_of(replace(truth, index=truth.index + 100)), poses, IDENTITY)


def test_deviations_are_not_judged_by_clicks_and_the_rest_goes_to_json(rig, truth):
    poses = fit_digitised_poses(clicks(truth, rig, noise_px=1.0), rig, cross())
    result = compare_digitised(motion_of(truth, covariance=np.eye(6)), poses, IDENTITY)
    numbers = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert numbers["tracked_minus_digitised"]["position_calibration"]["n"] == 0
    assert numbers["rigid_fit_residual_rms_mm"] > 0
    assert "34 digitised poses" in result.describe()


@given(
    seed=st.integers(0, 1000), n=st.integers(3, 8), flat=st.booleans(), weights=st.sampled_from([(1.0,), (1.0, 3.0)])
)
@settings(max_examples=60, deadline=None, derandomize=True)
def test_rigid_fit_finds_the_motion_of_any_points_not_in_a_line(seed, n, flat, weights):
    rng = np.random.default_rng(seed)
    source = rng.normal(size=(n, 3)) * [1, 1, 0 if flat else 1]
    R, t = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    found_R, found_t = fit_rigid(source, source @ R.T + t, np.resize(weights, n))
    np.testing.assert_allclose(found_R, R, atol=SOLVED)
    np.testing.assert_allclose(found_t, t, atol=SOLVED)


def test_rigid_fit_agrees_with_scipy_on_noisy_weighted_points():
    rng = np.random.default_rng(2)
    source, weights = rng.normal(size=(6, 3)), rng.uniform(1, 3, size=6)
    target = source @ Rotation.random(rng=rng).as_matrix().T + 0.1 * rng.normal(size=(6, 3))
    centred = [points - np.average(points, axis=0, weights=weights) for points in (target, source)]
    expected, _ = Rotation.align_vectors(*centred, weights=weights)
    np.testing.assert_allclose(fit_rigid(source, target, weights)[0], expected.as_matrix(), atol=ROUNDTRIP)


def test_rigid_fit_of_points_in_a_line_is_unknown():
    line = np.arange(4.0)[:, None] * [1, 2, 3]
    assert np.isnan(fit_rigid(line, line + 1, np.ones(4))[0]).all()


def write(tmp_path, text):
    path = tmp_path / "digitised.csv"
    path.write_text(text)
    return path


def test_blank_cells_are_points_not_clicked(tmp_path, rig):
    path = write(tmp_path, "field,long_minus_cam2_u,long_minus_cam2_v\n4,1.5,2.5\n5,,\n")
    found = read_digitised(path, rig)
    assert (found.index.tolist(), found.points) == ([4, 5], ("long_minus",))
    np.testing.assert_array_equal(found.px[0, 0], [[np.nan] * 2, [1.5, 2.5], [np.nan] * 2])
    assert np.isnan(found.px[1]).all()


def test_camera_names_may_hold_underscores_and_end_alike(tmp_path, rig):
    names = ("left", "far_left", "top")
    renamed = replace(rig, cameras=tuple(replace(c, name=n) for c, n in zip(rig, names, strict=True)))
    text = "field,bar_plus_far_left_u,bar_plus_far_left_v,bar_plus_left_u,bar_plus_left_v\n0,1,2,3,4\n"
    found = read_digitised(write(tmp_path, text), renamed)
    assert found.points == ("bar_plus",)
    np.testing.assert_array_equal(found.px[0, 0, :2], [[3, 4], [1, 2]])


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("field,long_minus_cam9_u\n0,1\n", "long_minus_cam9_u is no .* cameras: cam1, cam2, cam3"),
        ("field,long_minus_cam1_w\n0,1\n", "long_minus_cam1_w is no"),
        ("x,y\n0,1\n", "begins with column x"),
        ("field\n0\n", "no clicked points"),
        ("field,a_plus_cam1_u\n0,one\n", "line 2: a_plus_cam1_u is 'one', expected a number"),
        ("field,a_plus_cam1_u\n", "no lines of numbers"),
    ],
)
def test_wrong_table_is_refused_in_one_line(tmp_path, rig, text, complaint):
    with pytest.raises(ResultError, match=complaint) as caught:
        read_digitised(write(tmp_path, text), rig)
    assert "\n" not in str(caught.value)
