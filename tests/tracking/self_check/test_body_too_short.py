"""A body whose shanks are too short for the person: the images go on beyond its feet, and the self-check says so."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from airborne.body.shaping import with_segment_lengths
from airborne.cameras import Rig
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.self_check.check import gather_equations
from airborne.tracking.self_check.nuisances import PRESET_SD
from airborne.tracking.self_check.path import TrackedPath
from airborne.tracking.self_check.reach import doubtful_joints, find_far_reach, reach_beyond
from airborne.tracking.self_check.registration import draw_silhouette, foreground
from tests.support.people import HUMAN, PLACE, THREE, UPRIGHT, person, turned_to

INDICES = range(0, 60, 5)
SHANK_M = 0.44  # of a person of 1.80 m
limbs_at = turned_to(UPRIGHT)


def flying(time_s: Fraction):
    t = float(time_s) - 0.6
    at = PLACE + np.array([1.5 * t, 0.2 * t, 0.9 - 9.81 * t**2 / 2])
    return replace(limbs_at(time_s), world_from_root=RigidTransform.from_components(at, UPRIGHT))


@pytest.fixture(scope="module")
def recording():
    scene = person(flying)
    return scene, [scene.frames(index) for index in INDICES]


def reach_of(recording, model):
    scene, frames = recording
    poses = [scene.start(index) for index in INDICES]
    covariances = np.tile(np.diag([2e-3] * 3 + [1e-2] * 3) ** 2, (len(poses), 1, 1))
    path = TrackedPath(np.array(INDICES), np.array([float(each.time_s) for each in frames]), poses, covariances)
    run = gather_equations(model, Rig(THREE), path, frames, body_sd=PRESET_SD)
    assert run is not None
    return run.reach


def test_nothing_is_said_of_the_right_body(recording):
    assert find_far_reach(HUMAN, reach_of(recording, HUMAN)) is None


def test_feet_are_named_with_how_far_the_images_go_on(recording):
    short = with_segment_lengths(HUMAN, {"shank": 0.6})
    far = find_far_reach(short, reach_of(recording, short))
    assert far is not None
    assert set(far.segments) == {"foot_left", "foot_right"}
    assert far.value == pytest.approx(0.4 * SHANK_M, abs=0.06)
    assert far.n_views >= 2
    assert far.to_dict()["is_alarm"] and far.sentence.startswith(f"the images go on {100 * far.value:.0f} ± ")


def test_joints_of_the_limb_are_doubtful_but_for_the_one_at_the_trunk(recording):
    short = with_segment_lengths(HUMAN, {"shank": 0.6})
    far = find_far_reach(short, reach_of(recording, short))
    doubtful = {each.name for each, is_so in zip(HUMAN.segments[1:], doubtful_joints(short, far), strict=True) if is_so}
    assert doubtful == {"shank_left", "foot_left", "shank_right", "foot_right"}


def test_one_view_of_three_is_not_enough(recording):
    short = with_segment_lengths(HUMAN, {"shank": 0.6})
    reach = reach_of(recording, short)
    reach[:, 1:] = 0.01
    assert find_far_reach(short, reach) is None


@pytest.mark.parametrize(("factors", "counts"), [((0.6, 0.6, 0.6), False), ((0.6, 0.2, 0.2), True)])
def test_a_shadow_does_not_count(recording, factors, counts):
    scene, frames = recording
    view, render_model = frames[0].views[0], RenderModel.of(HUMAN)
    silhouette = draw_silhouette(render_model, render_model.with_pose(scene.start(0)), view.camera)
    x0, y0, x1, y1 = silhouette.box
    empty = np.full((y1 - y0, x1 - x0, 3), 200, np.uint8)
    rgb, body = np.full_like(view.rgb, 200), render_model.draw(render_model.with_pose(scene.start(0)), view.camera).part
    rgb[body >= 0] = 20, 200, 20
    bottom = int(np.flatnonzero((body >= 0).any(axis=1))[-1])
    column = int(np.median(np.flatnonzero(body[bottom] >= 0)))
    rgb[bottom - 2 : bottom + 20, column - 8 : column + 8] = 200 * np.array(factors)
    shown = foreground(rgb, empty, silhouette)
    reach = reach_beyond(render_model, silhouette, rgb, empty, shown)
    assert (np.nanmax(reach) > 0.06) == counts
