"""Evidence of a pose: residuals in sds with the right derivatives, and one rule that joins what there is."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.body.chain import delta_between, move_pose
from airborne.tracking.evidence import PoseEvidence
from airborne.tracking.first_pose.evidence_fit import join_evidence
from airborne.tracking.model_based.degrees_of_freedom import PosePrior, all_joints
from tests.support.people import HUMAN, THREE, swinging, wrong

TRUTH = swinging(0)
LANDMARKS = [landmark.name for landmark in HUMAN.landmarks]
WIDE = np.repeat([0.5, 0.5, 0.5], [3, 3, 3 * HUMAN.n_joints])
ARM = ["shoulder_left", "elbow_left", "wrist_left", "hand_left"]


def clicks(names, cameras, sd_px=1.0) -> PoseEvidence:
    """Where landmarks of the true pose are seen."""
    points = HUMAN.with_pose(TRUTH).landmarks
    rows = [(LANDMARKS.index(name), camera) for name in names for camera in cameras]
    return PoseEvidence(
        model=HUMAN,
        clicked=np.array([i for i, _ in rows]),
        P=np.stack([camera.P for _, camera in rows]),
        px=np.stack([camera.px_from_world(points[i]) for i, camera in rows]),
        px_sds=np.full(len(rows), sd_px),
    )


def all_forms() -> PoseEvidence:
    sds = np.full(HUMAN.n_dofs, np.inf)
    sds[[0, 1, 2, 9, 10, 11]] = 0.1
    used = np.array([LANDMARKS.index(name) for name in ("hip_left", "wrist_right")])
    points = HUMAN.with_pose(TRUTH).landmarks[used]
    return replace(
        clicks(ARM, THREE[:2]),
        landmarks=used,
        positions=points,
        position_sds=np.array([0.02, 0.05]),
        pose=TRUTH,
        pose_sds=sds,
    )


def off_mm(pose, names) -> np.ndarray:
    own = [LANDMARKS.index(name) for name in names]
    found, true = HUMAN.with_pose(pose).landmarks[own], HUMAN.with_pose(TRUTH).landmarks[own]
    return 1e3 * np.linalg.norm(found - true, axis=1)


def test_residuals_vanish_in_the_true_pose():
    np.testing.assert_allclose(all_forms().residuals(TRUTH)[1], 0, atol=1e-9)


def test_rows_are_the_derivatives_of_the_values():
    evidence, pose, step = all_forms(), wrong(TRUTH, seed=3), 1e-6
    rows, values = evidence.residuals(pose)
    rng = np.random.default_rng(0)
    for _ in range(5):
        delta = step * rng.normal(size=HUMAN.n_dofs)
        moved = evidence.residuals(move_pose(pose, delta))[1]
        np.testing.assert_allclose(moved - values, rows @ delta, atol=2e-2 * np.abs(rows @ delta).max())


def test_points_behind_a_camera_say_nothing():
    evidence = clicks(ARM, THREE[:1])
    behind = replace(evidence, P=-evidence.P)
    assert len(behind.residuals(TRUTH)[1]) == 0


def test_a_lost_arm_is_set_right_by_clicks_in_two_views():
    lost = replace(TRUTH, joint_angles=TRUTH.joint_angles.copy())
    shoulder = HUMAN.index_of("upper_arm_left") - 1
    lost.joint_angles[shoulder] += [1.6, 0.5, 0.3]
    assert off_mm(lost, ["wrist_left"]) > 200
    assert np.all(off_mm(join_evidence(lost, WIDE, clicks(ARM, THREE[:2])), ARM) < 10)


def test_a_click_in_one_view_moves_the_wrist_onto_its_line_of_sight():
    expected = wrong(TRUTH, off_deg=8.0, seed=2)
    camera, name = THREE[0], LANDMARKS.index("wrist_left")
    pose = join_evidence(expected, WIDE, clicks(["wrist_left"], [camera], sd_px=0.3))
    seen, true = (camera.px_from_world(HUMAN.with_pose(each).landmarks[name]) for each in (pose, TRUTH))
    assert np.linalg.norm(seen - true) < 1
    assert np.linalg.norm(camera.px_from_world(HUMAN.with_pose(expected).landmarks[name]) - true) > 2


def test_a_rough_place_moves_the_body_and_keeps_its_shape():
    sds = np.full(HUMAN.n_dofs, np.inf)
    sds[:3] = 0.01
    elsewhere = TRUTH.move(np.array([0.4, -0.3, 0.1]), np.zeros(3))
    pose = join_evidence(elsewhere, WIDE, PoseEvidence(model=HUMAN, pose=TRUTH, pose_sds=sds))
    away = delta_between(TRUTH, pose)
    assert np.linalg.norm(away[:3]) < 0.01
    assert np.abs(away[3:]).max() < 0.2


@pytest.mark.parametrize("far", [0.02, 0.2])
def test_evidence_and_expectation_are_weighed_by_their_sds(far):
    """Of the root alone, in closed form: the mean weighted by the inverse variances."""
    sds = np.full(HUMAN.n_dofs, np.inf)
    sds[0] = 0.05
    prior_sds = np.repeat([0.1, 1e-3, 1e-3], [3, 3, 3 * HUMAN.n_joints])
    evidence = PoseEvidence(model=HUMAN, pose=TRUTH.move(np.array([far, 0, 0]), np.zeros(3)), pose_sds=sds)
    pose = join_evidence(TRUTH, prior_sds, evidence)
    expected = far * 0.1**2 / (0.1**2 + 0.05**2)
    assert delta_between(TRUTH, pose)[0] == pytest.approx(expected, rel=0.02)


def test_a_prior_costs_what_its_evidence_does():
    dofs, pose, evidence = all_joints(HUMAN), wrong(TRUTH, seed=1), all_forms()
    without, with_it = (dofs.prior_cost(pose, PosePrior(TRUTH, WIDE, each)) for each in (None, evidence))
    assert with_it - without == pytest.approx(0.5 * np.sum(evidence.residuals(pose)[1] ** 2))


def test_evidence_narrows_a_covariance_and_shows_what_the_images_do_not():
    covariance = np.eye(HUMAN.n_dofs) * 1e-2
    own = slice(3 + 3 * HUMAN.index_of("upper_arm_left"), 6 + 3 * HUMAN.index_of("upper_arm_left"))
    covariance[own, own] = np.diag([np.inf] * 3)
    after = np.diag(all_forms().add_to(covariance, TRUTH))
    assert np.all(after[:6] <= 1e-2 + 1e-12)
    assert np.sum(np.isfinite(after[own])) >= 2  # the twist about a straight arm may stay open
