"""Left and right exchanged in a start's landmarks are named, of the body or of limbs; right ones raise no alarm."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose, human18, with_segment_lengths
from airborne.body.inverse_kinematics import fit_pose
from airborne.tracking.first_pose import LANDMARK_WEIGHTS, fit_to_points
from airborne.tracking.first_pose.exchange import find_exchange
from airborne.tracking.first_pose.postures import library

MODEL = human18(1.75, 70.0)
NAMES = [mark.name for mark in MODEL.landmarks]
STRADDLE, RUN, STRAIGHT = 6 * 13 + 5, 10 * 13 + 2, 3  # of the library: legs apart, one before the other, side by side


def points(posture, seed=0, lengths=None):
    """Landmarks (landmarks, 3) [m] of a posture of the library, 15 mm off, of a body of these lengths."""
    rng = np.random.default_rng(seed)
    person = with_segment_lengths(MODEL, lengths or {"thigh": 1.05, "shank": 0.95, "upper_arm": 0.95, "forearm": 1.04})
    root = RigidTransform.from_components([0.3, -0.2, 1.5], Rotation.random(rng=rng))
    pose = Pose(world_from_root=root, joint_angles=library(MODEL)[posture])
    return person.with_pose(pose).landmarks + rng.normal(0, 0.015, (len(NAMES), 3))


def exchanged(places, stems):
    other = dict(zip(NAMES, places, strict=True))
    for stem in stems:
        other |= {f"{stem}_left": other[f"{stem}_right"], f"{stem}_right": other[f"{stem}_left"]}
    return np.array([other[name] for name in NAMES])


@pytest.mark.parametrize(
    ("words", "stems"),
    [
        (" of the legs from the knees down", ("knee", "ankle", "foot")),
        (" of the arms from the elbows down", ("elbow", "wrist", "hand")),
    ],
)
def test_limbs_exchanged_are_named_and_no_body_is_called_too_small(words, stems):
    first = fit_to_points(MODEL, "start", NAMES, exchanged(points(STRADDLE), stems))
    assert first.exchange.startswith(f"start: left and right{words} look exchanged: landmarks ")
    assert first.exchange in first.doubts and first.wrong_size is None


def test_mirrored_space_is_the_whole_body_exchanged():
    first = fit_to_points(MODEL, "start", NAMES, points(RUN) * [-1, 1, 1])
    assert first.exchange.startswith("start: left and right look exchanged: ")
    assert first.exchange.endswith("no image is mirrored")


@pytest.mark.parametrize("posture", [RUN, STRADDLE, STRAIGHT])
def test_right_sides_of_a_body_of_other_lengths_raise_no_alarm(posture):
    targets = dict(zip(NAMES, points(posture, seed=posture), strict=True))
    fit = fit_pose(MODEL, targets, weights=LANDMARK_WEIGHTS)
    assert find_exchange(MODEL, targets, LANDMARK_WEIGHTS, fit) is None


@pytest.mark.parametrize(("has_feet", "tells"), [(False, False), (True, True)])
def test_points_of_a_straight_body_tell_which_way_it_faces_by_its_feet_alone(has_feet, tells):
    kept = [
        i for i, name in enumerate(NAMES) if "_" in name and "hand" not in name and (has_feet or "foot" not in name)
    ]
    first = fit_to_points(MODEL, "start", [NAMES[i] for i in kept], points(STRAIGHT)[kept])
    assert bool(first.ambiguity) is not tells
    assert not first.exchange and not first.doubts
    assert tells or (first.ambiguity in first.notes and "points of foot_left and foot_right" in first.ambiguity)
