"""The fit of a jumper: where it converges, and how priors, anchors and occluders act."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.tracking.capsules.dynamics import N_FREE
from airborne.tracking.capsules.first_frame import fit_first_frame, points_of, start_state
from airborne.tracking.capsules.fit import JumperPrior, evidence_of, fit_jumper
from airborne.tracking.capsules.jumper import LIMITS_RAD, N_DOF
from airborne.tracking.capsules.kernel_arguments import NOBODY, Capsules
from airborne.tracking.capsules.views import map_evidence, player_regions
from tests.support.jumping_scenes import LENGTHS, RADII, hop

UPRIGHT = np.zeros(N_DOF)  # upright, both legs bent alike
UPRIGHT[5], UPRIGHT[[8, 13]], UPRIGHT[[11, 16]] = 0.25, -0.4, 0.6


@pytest.fixture(scope="module")
def first(hall):
    return fit_first_frame("anna", hall.starts()[0].joints_m, hall.frames(0), NOBODY)


@pytest.fixture(scope="module")
def region_maps(hall, first):
    """The maps of a later frame, half way down in the squat."""
    frames = hall.frames(6)
    regions = player_regions(frames, hop()(6 / 50)[:3])
    tables = [first.colours.table(region.view) for region in regions]
    return map_evidence(regions, tables, first.scale)


@pytest.fixture(scope="module")
def no_evidence(region_maps):
    """Maps without evidence."""
    return replace(region_maps, sums=np.zeros_like(region_maps.sums), contrast=np.zeros_like(region_maps.contrast))


def standing(pose=UPRIGHT, height_m=0.03):
    """A state whose feet are this high above the floor."""
    state = np.concatenate([pose, LENGTHS, RADII])
    state[2] += height_m - points_of(state)[6:8, 2].min()
    return state


def prior_at(state, sd=0.1, n=N_FREE, **anchors):
    return JumperPrior(state[:n].copy(), np.eye(n) / sd**2, **anchors)


def test_no_step_from_the_optimum_gains(region_maps):
    truth = hop()(6 / 50)
    prior = prior_at(truth, sd=0.3)
    start = truth.copy()
    start[:N_DOF] += np.random.default_rng(0).normal(scale=0.02, size=N_DOF)
    best = fit_jumper(start, prior, region_maps, NOBODY, most_steps=40)
    assert best.total > fit_jumper(start, prior, region_maps, NOBODY, most_steps=0).total + 1
    sd = 1 / np.sqrt(np.diag(best.information))
    for k in range(N_FREE):
        gains = []
        for step in (-0.5 * sd[k], 0.5 * sd[k]):
            moved = best.state.copy()
            moved[k] += step
            gains.append(fit_jumper(moved, prior, region_maps, NOBODY, most_steps=0).total - best.total)
        assert max(gains) < 0.5  # [nat]
        assert abs(gains[1] - gains[0]) < 2.0  # an sd times the slope


def test_the_optimum_is_near_the_truth(region_maps):
    truth = hop()(6 / 50)
    start = truth.copy()
    start[:3] += [0.03, -0.02, 0.02]
    best = fit_jumper(start, prior_at(truth, sd=1.0), region_maps, NOBODY, most_steps=40)
    assert np.linalg.norm(best.points[:6] - points_of(truth)[:6], axis=1).max() < 0.04


def test_total_is_evidence_less_the_priors_cost(region_maps):
    truth = standing()
    at_mean = fit_jumper(truth, prior_at(truth), region_maps, NOBODY, most_steps=0)
    assert at_mean.nats == pytest.approx(evidence_of(truth, region_maps, NOBODY), rel=1e-9)
    assert at_mean.total == pytest.approx(at_mean.nats)
    off = truth.copy()
    off[0] += 0.05
    shifted = fit_jumper(off, prior_at(truth), region_maps, NOBODY, most_steps=0)
    assert shifted.nats - shifted.total == pytest.approx(0.5 * (0.05 / 0.1) ** 2)


def test_without_evidence_the_fit_is_the_priors_mean(no_evidence):
    mean = standing()
    start = mean.copy()
    start[:N_FREE] += np.random.default_rng(1).normal(scale=0.05, size=N_FREE)
    start[2] += 0.2
    best = fit_jumper(start, prior_at(mean), no_evidence, NOBODY, most_steps=40)
    np.testing.assert_allclose(best.state[:N_FREE], mean[:N_FREE], atol=0.02)
    np.testing.assert_array_equal(best.state[N_FREE:], start[N_FREE:])
    assert best.nats == 0


def test_information_is_at_least_the_priors(region_maps):
    truth = hop()(6 / 50)
    prior = prior_at(truth)
    best = fit_jumper(truth, prior, region_maps, NOBODY)
    assert np.linalg.eigvalsh(best.information - prior.information).min() > -1e-6
    assert np.linalg.eigvalsh(best.model_error_covariance).min() > -1e-12
    np.testing.assert_allclose(best.information, best.information.T, rtol=1e-9, atol=1e-6)


def test_anchors_attract_the_joints(no_evidence):
    mean = standing(height_m=0.3)
    anchors = np.full((9, 3), np.nan)
    anchors[:6] = points_of(mean)[:6] + np.array([0.04, -0.03, 0.02])
    prior = prior_at(mean, sd=1.0, anchors=anchors, anchor_sd_m=np.full(9, 0.01))
    best = fit_jumper(mean, prior, no_evidence, NOBODY, most_steps=40)
    np.testing.assert_allclose(best.points[:6], anchors[:6], atol=5e-3)


def test_one_wrong_anchor_has_bounded_influence(no_evidence):
    mean = standing(height_m=0.3)
    shifts_m = []
    for off in (0.02, 0.5):
        anchors = np.full((9, 3), np.nan)
        anchors[:6] = points_of(mean)[:6]
        anchors[3] += [0, -off, 0]
        prior = prior_at(mean, sd=0.3, anchors=anchors, anchor_sd_m=np.full(9, 0.02))
        shifts_m.append(
            np.linalg.norm(fit_jumper(mean, prior, no_evidence, NOBODY, most_steps=40).points[3] - points_of(mean)[3])
        )
    assert shifts_m[1] < 10 * shifts_m[0]


@pytest.mark.parametrize(("number", "angle"), [(11, -0.6), (16, -0.6), (8, 1.2), (12, -1.2), (15, 1.5)])
def test_joint_limits_hold_against_the_prior(no_evidence, number, angle):
    mean = standing(height_m=0.5)
    mean[number] = angle
    best = fit_jumper(mean, prior_at(mean, sd=0.3), no_evidence, NOBODY, most_steps=40)
    low, high = LIMITS_RAD[number]
    assert low - 0.05 < best.state[number] < high + 0.05


def test_the_floor_holds_against_the_prior(no_evidence):
    mean = standing(height_m=-0.07)
    best = fit_jumper(mean, prior_at(mean, sd=0.1), no_evidence, NOBODY, most_steps=40)
    assert best.points[6:8, 2].min() > 0.02


def test_other_players_capsules_occlude_what_lies_behind_them(hall, region_maps):
    truth = hop()(6 / 50)
    ahead = truth[:3] + 0.3 * (hall.cameras[1].camera_from_world.inv().translation - truth[:3]) / 9
    wall = np.stack([ahead + np.array([[x, 0, -1.2], [x, 0, 1.2]]) for x in (-0.4, 0.0, 0.4)])
    others = Capsules(wall, np.full((3, 2), 0.25))
    assert evidence_of(truth, region_maps, others) < 0.9 * evidence_of(truth, region_maps, NOBODY)
    behind = wall + 20 * (truth[:3] - ahead)
    assert evidence_of(truth, region_maps, others._replace(ends=behind)) == pytest.approx(
        evidence_of(truth, region_maps, NOBODY), rel=0.1
    )


def random_pose(rng):
    low, high = LIMITS_RAD[4:].T
    middle, reach = (low + high) / 2, 0.35 * (high - low)
    return np.concatenate([[0.4, -0.2, 1.0, rng.uniform(-3, 3)], middle + rng.uniform(-1, 1, 14) * reach])


@pytest.mark.parametrize("seed", range(6))
def test_the_start_state_meets_hand_set_joints(seed):
    rng = np.random.default_rng(seed)
    pose = random_pose(rng)
    pose[4:8] = 0.15 * pose[4:8]
    truth = points_of(np.concatenate([pose, LENGTHS, RADII]))
    names = ("hip_left", "hip_right", "knee_left", "knee_right", "ankle_left", "ankle_right", "foot_left", "foot_right")
    state = start_state("anna", dict(zip((*names, "torso"), truth, strict=True)))
    np.testing.assert_allclose(points_of(state)[:6], truth[:6], atol=0.01)
    np.testing.assert_allclose(points_of(state)[6:], truth[6:], atol=0.05)
