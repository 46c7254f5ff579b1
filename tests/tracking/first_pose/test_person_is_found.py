"""A person is found without a start: in a posture of no library, or said to be undecided."""

import numpy as np
import pytest

from airborne.errors import TrialError
from airborne.tracking.first_pose import person_candidates
from airborne.tracking.first_pose.colour_information import PixelColours, colour_classes
from airborne.tracking.first_pose.moments import empty_scenes, look, spread_sample
from airborne.tracking.first_pose.person import JointedBody, PoseSet, SilhouetteEvidence, apart
from airborne.tracking.first_pose.person_candidates import find_person
from airborne.tracking.first_pose.person_search import _mirror
from airborne.tracking.first_pose.postures import library, limb_postures
from airborne.tracking.model_based.degrees_of_freedom import limbs_of
from airborne.tracking.model_based.render_model import RenderModel
from tests.support.people import CAMERAS, HUMAN, person
from tests.support.scenes import FIGURE

TIMES = range(0, 36, 3)
SCENE = person(cameras=CAMERAS)
PERSON = JointedBody(RenderModel.of(HUMAN))


@pytest.fixture(scope="module")
def moments():
    sample = spread_sample([SCENE.frames(index) for index in TIMES], len(TIMES))
    return look(sample, empty_scenes(sample))


def test_a_person_in_the_air_is_found(moments, monkeypatch):
    monkeypatch.setattr(person_candidates, "_N_MOMENTS", 1)
    monkeypatch.setattr(person_candidates, "_N_ROUNDS", 2)
    finding = find_person(HUMAN, moments)
    true = SCENE.start(finding.moment.frames.index)
    off_m = HUMAN.with_pose(finding.candidates[0].pose).landmarks - HUMAN.with_pose(true).landmarks
    assert np.linalg.norm(off_m, axis=1).mean() < 0.06
    assert finding.candidates[0].is_plausible


def test_colours_tell_a_pose_from_its_mirror_image(moments):
    moment = moments[4]
    true = PoseSet.of([SCENE.start(moment.frames.index)])
    silhouettes = SilhouetteEvidence.around(PERSON, moment, PERSON.middles(true)[0])
    colours, classes = PixelColours.of(silhouettes), colour_classes(HUMAN)
    told = [
        colours.information(PERSON.render_model, posed, classes)
        for posed in PERSON.bodies(PoseSet.join(true, _mirror(PERSON, true)))
    ]
    assert told[0] > told[1] + 0.02


def test_both_sides_and_a_face_and_the_hands_have_their_colours_in_common():
    classes = dict(zip((part.name for part in HUMAN.parts), colour_classes(HUMAN).tolist(), strict=True))
    assert classes["thigh_left_shorts"] == classes["thigh_right_shorts"] != classes["thigh_left_skin"]
    assert classes["head_face"] == classes["hand_left"] == classes["hand_right"] != classes["head_hair"]


def test_a_mirror_image_exchanges_left_and_right_where_they_are():
    straight = PoseSet(np.eye(3)[None], np.zeros((1, 3)), np.zeros((1, HUMAN.n_joints, 3)))
    names = [landmark.name for landmark in HUMAN.landmarks]
    here, there = PERSON.landmarks(straight)[0], PERSON.landmarks(_mirror(PERSON, straight))[0]
    for name in ("knee", "wrist"):
        left, right = names.index(f"{name}_left"), names.index(f"{name}_right")
        assert np.linalg.norm(there[left] - here[right]) < 0.05


def test_postures_keep_the_limits_of_joints():
    n = HUMAN.n_joints
    assert np.abs(HUMAN.limits.excess(pose_rotations(library(HUMAN)))).max() < 1e-6
    for limb in limbs_of(HUMAN):
        angles = np.zeros((16, n, 3))
        angles[:, limb - 1] = limb_postures(HUMAN, limb, 16, seed=0)
        excess = HUMAN.limits.excess(pose_rotations(angles))[:, limb - 1]
        assert np.abs(excess).max() < 1e-6


def pose_rotations(angles):
    """Joint rotations, parent from segment, of many postures."""
    R, _ = HUMAN.pose_segments(np.eye(3), np.zeros(3), angles)
    return np.swapaxes(R[:, HUMAN.parents[1:]], -1, -2) @ R[:, 1:]


def test_the_best_that_are_apart_are_kept_best_first():
    points = np.array([[[0.0, 0, 0]], [[0.05, 0, 0]], [[1.0, 0, 0]]])
    assert apart(points, np.array([1.0, 2.0, 0.5]), 5, 0.1).tolist() == [1, 2]


def test_a_body_that_is_no_person_is_not_looked_for(moments):
    with pytest.raises(TrialError, match="named as those of human18"):
        find_person(FIGURE, moments)
