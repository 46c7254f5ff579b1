"""Masses, centres and tensors: of pieces put together, and of a person in a pose."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import (
    BodyModel,
    Box,
    Inertia,
    Part,
    Pose,
    Segment,
    human18,
    human18_from_measurements,
)
from airborne.body.anthropometry import measurements_of, segment_properties
from airborne.body.inertia import combine_inertias, segment_inertias, transform_inertia
from airborne.errors import BodyError
from tests.support.bodies import total_inertia
from tests.support.tolerances import EXACT, ROUNDTRIP
from tests.support.yeadon_oracle import random_configuration, same_pose, whole_by_slices, yeadon_person

SLICED = 3e-5  # relative, of an integral by slices


def cloud(seed, n=40):
    """Point masses: mass (n,), place (n, 3)."""
    rng = np.random.default_rng(seed)
    return rng.uniform(0.1, 1, n), rng.normal(size=(n, 3))


def of_points(mass, place):
    centre = mass @ place / mass.sum()
    arm = place - centre
    tensor = sum(m * (a @ a * np.eye(3) - np.outer(a, a)) for m, a in zip(mass, arm, strict=True))
    return Inertia(float(mass.sum()), centre, tensor)


def same(a, b, tolerance=ROUNDTRIP):
    np.testing.assert_allclose(a.mass_kg, b.mass_kg, rtol=tolerance)
    np.testing.assert_allclose(a.centre_m, b.centre_m, atol=tolerance)
    np.testing.assert_allclose(a.tensor_kg_m2, b.tensor_kg_m2, atol=tolerance * np.abs(b.tensor_kg_m2).max())


def random_pose(seed):
    rng = np.random.default_rng(seed)
    root = RigidTransform.from_components(rng.normal(size=3), Rotation.random(rng=rng))
    return Pose(world_from_root=root, joint_angles=rng.uniform(-1.5, 1.5, (17, 3)))


def test_pieces_together_are_all_their_points():
    mass, place = cloud(1)
    pieces = [of_points(mass[i : i + 10], place[i : i + 10]) for i in range(0, 40, 10)]
    same(combine_inertias(pieces), of_points(mass, place), EXACT * 10)


def test_joining_is_associative():
    pieces = [of_points(*cloud(seed)) for seed in range(3)]
    same(
        combine_inertias([combine_inertias(pieces[:2]), pieces[2]]),
        combine_inertias([pieces[0], combine_inertias(pieces[1:])]),
        EXACT * 10,
    )


def test_a_piece_in_another_frame_is_its_points_in_that_frame():
    (mass, place), R, t = cloud(2), Rotation.random(rng=np.random.default_rng(2)).as_matrix(), np.array([1.0, -2, 3])
    same(transform_inertia(of_points(mass, place), R, t), of_points(mass, place @ R.T + t), EXACT * 10)


@pytest.mark.parametrize("seed", range(3))
def test_moving_the_whole_body_moves_its_centre_and_turns_its_tensor(seed):
    model, pose = human18(), random_pose(seed)
    turn, step = Rotation.random(rng=np.random.default_rng(seed)), np.array([0.3, -2.0, 1.0])
    motion = RigidTransform.from_components(step, turn)
    moved = Pose(world_from_root=motion * pose.world_from_root, joint_angles=pose.joint_angles)
    before, after = total_inertia(model.with_pose(pose)), total_inertia(model.with_pose(moved))
    same(after, transform_inertia(before, turn.as_matrix(), step))


def test_body_of_unknown_mass_is_refused():
    part = Part("stick", Box(np.ones(3)), RigidTransform.identity(), None)
    model = BodyModel("cross", (Segment("bar", None, np.zeros(3), (part,)),))
    with pytest.raises(BodyError, match="body 'cross': the mass of segment 'bar' is not known"):
        segment_inertias(model)


@pytest.mark.parametrize("seed", range(6))
def test_a_person_in_any_configuration_is_the_sum_of_yeadons_solids(seed):
    person, configuration = measurements_of(1.70, 64.0), random_configuration(seed)
    human, ours = yeadon_person(person, configuration), in_configuration(person, configuration)
    assert ours.mass_kg == pytest.approx(human.mass, rel=EXACT * 10), "the girths give the mass; densities stay"
    same(ours, whole_by_slices(human), SLICED)


def test_a_leaner_density_is_shared_by_all_segments():
    person = measurements_of(1.70, 64.0)
    plain, weighed = (
        segment_properties(replace(person, mass_kg=None)),
        segment_properties(replace(person, mass_kg=60.0)),
    )
    for name, bulk in plain.items():
        np.testing.assert_allclose(weighed[name].inertia.mass_kg / bulk.inertia.mass_kg, 60 / 64, rtol=ROUNDTRIP)
        np.testing.assert_array_equal(weighed[name].inertia.centre_m, bulk.inertia.centre_m)
        tensor = bulk.inertia.tensor_kg_m2 * 60 / 64
        np.testing.assert_allclose(weighed[name].inertia.tensor_kg_m2, tensor, atol=ROUNDTRIP)


def test_left_and_right_limbs_have_their_own_measurements():
    person = measurements_of(1.80, 75.0)
    on_right = {key for key in person.values_m if key[:2] in ("Lb", "Lk") and key[-1] != "L"}
    thicker = {key: value * (1.1 if key in on_right else 1) for key, value in person.values_m.items()}
    found, usual = (
        segment_properties(replace(person, values_m=thicker, mass_kg=None)),
        segment_properties(replace(person, mass_kg=None)),
    )
    for name in ("upper_arm", "forearm", "hand", "shank", "foot"):
        was = usual[f"{name}_right"].volume_m3
        assert found[f"{name}_left"].volume_m3 == pytest.approx(was, rel=EXACT)
        assert found[f"{name}_right"].volume_m3 == pytest.approx(1.21 * was, rel=ROUNDTRIP)


def in_configuration(person, configuration):
    return total_inertia(human18_from_measurements(person).with_pose(same_pose(person, configuration)))
