"""The laws of free flight."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Ellipsoid, Part, Segment
from airborne.constants import FREE_FALL_M_S2
from airborne.errors import BodyError
from airborne.synthetic.flight.rigid import Launch, MassProperties, fly, mass_properties
from airborne.synthetic.throw.scene import cross_scene
from tests.support.tolerances import EXACT, ROUNDTRIP

TIMES = np.arange(40) / 50


def throw(**changes):
    launch = Launch(
        centre=np.array([0.1, -0.2, 1.3]),
        velocity=np.array([1.0, 0.2, 3.2]),
        R=Rotation.from_rotvec([0.4, 1.1, -0.7]).as_matrix(),
        angular_velocity=np.array([9.0, 3.0, -1.0]),
    )
    return replace(launch, **changes)


def cross_mass():
    return mass_properties(cross_scene().body, 500.0)


def body(*parts):
    segment = Segment("all", None, np.zeros(3), parts)
    return BodyModel("body", (segment,))


def part(shape, centre=(0, 0, 0), turn=None):
    place = RigidTransform.from_components(np.array(centre, float), turn or Rotation.identity())
    return Part("part", shape, place, None)


def test_angular_momentum_stays_the_same_in_the_world():
    mass = cross_mass()
    flight = fly(mass, throw(), TIMES)
    momentum = np.einsum("nij,nj->ni", flight.R @ mass.inertia, flight.angular_velocity)
    np.testing.assert_allclose(momentum, np.broadcast_to(momentum[0], momentum.shape), atol=ROUNDTRIP)


def test_rotational_energy_stays_the_same():
    mass = cross_mass()
    w = fly(mass, throw(), TIMES).angular_velocity
    energy = np.einsum("ni,ij,nj->n", w, mass.inertia, w) / 2
    np.testing.assert_allclose(energy, energy[0], rtol=ROUNDTRIP)


def test_top_precesses_at_the_rate_of_its_angular_momentum_over_its_transverse_inertia():
    A, C = 0.3, 0.1
    mass = MassProperties(2.0, np.zeros(3), np.diag([A, A, C]))
    flight = fly(mass, throw(angular_velocity=np.array([1.5, 0.0, 12.0])), TIMES)
    momentum = flight.R[0] @ mass.inertia @ flight.angular_velocity[0]
    precession = Rotation.from_rotvec(TIMES[:, None] * momentum / A).as_matrix()
    np.testing.assert_allclose(flight.R[:, :, 2], precession @ flight.R[0, :, 2], atol=ROUNDTRIP)
    spin = (1 - C / A) * 12.0  # the transverse angular velocity turns backward in the body at this rate
    np.testing.assert_allclose(flight.angular_velocity[:, 0], 1.5 * np.cos(spin * TIMES), atol=ROUNDTRIP)


def test_second_difference_of_the_centre_of_mass_is_gravity():
    flight = fly(cross_mass(), throw(), TIMES)
    acceleration = np.diff(flight.centre, 2, axis=0) * 50**2
    np.testing.assert_allclose(acceleration, np.broadcast_to(FREE_FALL_M_S2, acceleration.shape), atol=ROUNDTRIP)


def test_centre_of_mass_stays_where_it_is_in_the_body():
    mass = cross_mass()
    flight = fly(mass, throw(), TIMES)
    np.testing.assert_allclose(flight.R @ mass.centre + flight.position, flight.centre, atol=EXACT)
    assert np.ptp(np.linalg.norm(np.diff(flight.position, 2, axis=0), axis=1)) > 1e-3  # the origin is no such point


def test_rotations_follow_the_angular_velocity():
    step = 1e-5
    flight = fly(cross_mass(), throw(), np.array([0.3 - step, 0.3, 0.3 + step]))
    turned = Rotation.from_matrix(flight.R[0].T @ flight.R[2]).as_rotvec() / (2 * step)
    np.testing.assert_allclose(turned, flight.angular_velocity[1], rtol=1e-6)


def test_flight_is_the_same_in_any_order_of_times_and_runs_backward():
    launch, times = throw(), np.array([0.3, -0.2, 0.0, 0.3, -0.1, 0.1])
    flight = fly(cross_mass(), launch, times)
    for i, time in enumerate(times):
        alone = fly(cross_mass(), launch, np.array([time]))
        np.testing.assert_allclose(flight.R[i], alone.R[0], atol=ROUNDTRIP)
    np.testing.assert_allclose(flight.R[2], launch.R, atol=EXACT)
    earlier = Launch(
        centre=flight.centre[1],
        velocity=launch.velocity + FREE_FALL_M_S2 * -0.2,
        R=flight.R[1],
        angular_velocity=flight.angular_velocity[1],
    )
    again = fly(cross_mass(), earlier, np.array([0.5]))
    np.testing.assert_allclose(again.R[0], flight.R[0], atol=ROUNDTRIP)
    np.testing.assert_allclose(again.position[0], flight.position[0], atol=ROUNDTRIP)


def test_box_cut_in_two_has_the_mass_of_the_whole():
    turn = Rotation.from_euler("Z", 30, degrees=True)
    whole = mass_properties(body(part(Box(np.array([0.2, 0.6, 0.1])), turn=turn)), 400.0)
    half = Box(np.array([0.2, 0.3, 0.1]))
    halves = mass_properties(
        body(part(half, turn.apply([0, 0.15, 0]), turn), part(half, turn.apply([0, -0.15, 0]), turn)), 400.0
    )
    assert whole.mass_kg == pytest.approx(400 * 0.012, rel=EXACT)
    np.testing.assert_allclose(halves.centre, whole.centre, atol=EXACT)
    np.testing.assert_allclose(halves.inertia, whole.inertia, atol=EXACT)
    np.testing.assert_allclose(np.linalg.eigvalsh(whole.inertia), whole.mass_kg / 12 * np.array([0.05, 0.37, 0.4]))


def test_cross_has_its_centre_of_mass_between_its_bars():
    np.testing.assert_allclose(cross_mass().centre, [0, 0.18 * 0.6 / 1.5, 0], atol=EXACT)


def test_body_with_a_part_that_is_no_box_is_refused_by_name():
    with pytest.raises(BodyError, match="'part' is not a box"):
        mass_properties(body(part(Ellipsoid(np.ones(3)))), 500.0)
