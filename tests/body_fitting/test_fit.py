"""A body fitted to a person: other lengths, girths, clothes and colours are found from a few frames."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import ATHLETE, SAMPLED, Pose, human18, with_girths, with_segment_lengths
from airborne.body.outfits import Border, ellipsoid_of, with_borders
from airborne.body_fitting.fit import BodyObservation, fit_body
from airborne.body_fitting.shape import (
    apply_shape,
    border_parameters,
    borders_of,
    girths_of,
    lengths_of,
    shape_parameters,
)
from airborne.errors import BodyError
from tests.support.scenes import CAMERAS, FPS, Scene

STATURE_M, MASS_KG = 1.72, 68.0
LENGTHS = {"thigh": 1.06, "shank": 0.95, "forearm": 0.94, "upper_arm": 1.04}
GIRTHS = {"thigh": 0.88, "upper_arm": 1.12, "shank": 1.08, "torso": (1.1, 0.94), "chest": (1.06, 1.0)}
BORDERS = {"thigh": Border(0.75), "upper_arm": None}
TIMES = (0, 8, 16)
JOINT_SD_M = 0.015


def person():
    """The body that is observations."""
    given = human18(STATURE_M, MASS_KG, outfit=ATHLETE)
    return with_borders(with_girths(with_segment_lengths(given, LENGTHS), GIRTHS), BORDERS)


def moving(time_s: Fraction) -> Pose:
    """Arms and legs out, turning."""
    t = float(time_s)
    angles = {
        "upper_arm_left": (-0.5, -0.9 + 1.5 * t, 0.0),
        "upper_arm_right": (0.4 - t, 0.8, 0.0),
        "forearm_left": (-0.7, 0.0, 0.0),
        "forearm_right": (-0.4 - 2 * t, 0.0, 0.0),
        "thigh_left": (-0.7 + t, -0.25, 0.0),
        "thigh_right": (0.2 - t, 0.2, 0.0),
        "shank_left": (0.8, 0.0, 0.0),
        "shank_right": (0.3 + t, 0.0, 0.0),
        "torso": (0.2 - t, 0.1, 0.0),
    }
    names = [segment.name for segment in human18().segments[1:]]
    joints = np.array([angles.get(name, (0.0, 0.0, 0.0)) for name in names])
    root = RigidTransform.from_components([0.5 * t - 0.1, 0.3 * t, 1.45], Rotation.from_euler("xyz", [0.1, 0, 2 * t]))
    return Pose(world_from_root=root, joint_angles=joints)


@pytest.fixture(scope="module")
def observations():
    """Observations of the person, with joints that are a little off."""
    rng = np.random.default_rng(7)
    scene = Scene(model=person(), motion=moving, cameras=CAMERAS[:3], reach=0.3)
    found = []
    for index in TIMES:
        posed = scene.model.with_pose(moving(Fraction(index, FPS)))
        seen = posed.landmarks + JOINT_SD_M * rng.standard_normal(posed.landmarks.shape)
        names = [landmark.name for landmark in scene.model.landmarks]
        found.append(BodyObservation(scene.frames(index), dict(zip(names, seen, strict=True))))
    return found


@pytest.fixture(scope="module")
def fitted(observations):
    given = human18(STATURE_M, MASS_KG, outfit=SAMPLED)
    return fit_body(given, observations, mass_kg=70.0, levels_px_per_m=(50.0, 100.0))


def axes(model, segment):
    """Semi-axes of the segment's ellipsoid along the segment's axes."""
    return ellipsoid_of(model, segment)[0].semi_axes_m


def length(model, child):
    """How far a joint is from its parent's."""
    return np.linalg.norm(model.segments[model.index_of(child)].joint_m)


def off_m(model, poses):
    """Mean distance of all landmarks from where they truly are."""
    truth = [person().with_pose(moving(Fraction(index, FPS))).landmarks for index in TIMES]
    found = [model.with_pose(pose).landmarks for pose in poses]
    return float(np.linalg.norm(np.array(found) - np.array(truth), axis=-1).mean())


def test_lengths_between_borders_and_ends_that_can_be_seen_are_found(fitted):
    for child in ("shank_left", "foot_right"):
        assert length(fitted.model, child) == pytest.approx(length(person(), child), rel=0.015), child


def test_lengths_that_the_joints_alone_give_are_kept_within_their_noise(fitted):
    for child in ("forearm_left", "hand_left"):
        assert length(fitted.model, child) == pytest.approx(length(person(), child), rel=0.06), child


def test_girths_are_found_in_both_directions(fitted):
    for segment, across in (("thigh_left", 2), ("shank_right", 2), ("torso", 2), ("chest", 2), ("upper_arm_left", 2)):
        found, truth = axes(fitted.model, segment)[:across], axes(person(), segment)[:across]
        np.testing.assert_allclose(found, truth, rtol=0.035, err_msg=segment)


def test_borders_of_the_clothes_are_found_where_they_are(fitted):
    assert fitted.borders["thigh"].share == pytest.approx(0.75, abs=0.02)
    assert fitted.borders["shank"].share == pytest.approx(0.70, abs=0.02)  # socks, seen from the knee
    assert fitted.borders["head"].axis == 1
    assert fitted.borders["head"].share == pytest.approx(0.5, abs=0.04)
    assert "upper_arm" not in fitted.borders


def test_colours_are_those_of_the_clothes_under_their_light(fitted):
    colours = {part.name: part.colour for part in fitted.model.parts}
    above, below = (colours[f"thigh_left_{name}"] for name in ("shorts", "skin"))
    assert np.argmax(above) == 0
    assert above[0] > 3 * above[1:].max()
    assert below[1] > 2 * above[1]
    assert np.all(colours["thigh_right_shorts"] == above)


def test_poses_come_nearer_to_the_truth_than_the_joints_were(fitted):
    assert off_m(fitted.model, fitted.poses) < 0.6 * off_m(fitted.start, fitted.start_poses)


def test_the_images_agree_better_with_the_fitted_body(fitted):
    before, after = fitted.rms_light
    assert after < 0.75 * before


def test_left_and_right_are_alike_and_the_mass_is_as_given(fitted):
    for segment in ("thigh", "upper_arm", "foot"):
        assert np.all(axes(fitted.model, f"{segment}_left") == axes(fitted.model, f"{segment}_right"))
    assert sum(s.inertia.mass_kg for s in fitted.model.segments) == pytest.approx(70.0)


def test_a_shape_of_zeros_is_the_body_itself_and_a_shape_says_its_factors():
    body = human18(outfit=ATHLETE)
    parameters = (*shape_parameters(body), *border_parameters(body, {"thigh": Border(0.5), "head": None}))
    np.testing.assert_allclose(
        axes(apply_shape(body, parameters, np.zeros(len(parameters))), "thigh_left"), axes(body, "thigh_left")
    )
    shape = np.linspace(-0.1, 0.1, len(parameters))
    other = apply_shape(body, parameters, shape)
    lengths, girths = lengths_of(parameters, shape), girths_of(parameters, shape)
    ratio = axes(other, "torso") / axes(body, "torso")
    np.testing.assert_allclose(ratio, (*girths["torso"], lengths["torso"]))
    assert borders_of(parameters, shape)["thigh"].share == pytest.approx(0.5 + shape[-1])
    assert girths["thigh"][0] == girths["thigh"][1]


def test_without_a_frame_there_is_nothing_to_fit_to():
    with pytest.raises(BodyError, match="at least one"):
        fit_body(human18(), [])
