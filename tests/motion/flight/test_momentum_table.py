"""What a flight comes to: centre of mass, momentum, turns, and checks against free fall."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose
from airborne.errors import BodyError, ResultError
from airborne.motion import flight_summary, has_inertias, measure_flight, write_flight
from airborne.motion.flight.fall import fit_fall
from airborne.motion.flight.momentum import centre_of_mass
from airborne.motion.flight.momentum_table import _fit_parabola, state_centres_of_mass, widen_momentum
from airborne.tracking.self_check.free_flight import WrongFall
from tests.support.motions import figure, motion_of, shaken, small_covariance, swinging
from tests.support.tolerances import EXACT, ROUNDTRIP, SOLVED, sampled

MODEL = figure()
TIMES = np.arange(21) / 50
COLUMNS = (
    "frame,time_s,status,com_x_m,com_y_m,com_z_m,com_x_m_sd,com_y_m_sd,com_z_m_sd,"
    "com_x_m_sd_frame,com_y_m_sd_frame,com_z_m_sd_frame,"
    "L_x_kg_m2_s,L_y_kg_m2_s,L_z_kg_m2_s,L_x_kg_m2_s_sd,L_y_kg_m2_s_sd,L_z_kg_m2_s_sd,"
    "somersault_rev,twist_rev,tilt_deg"
)


def falling(gravity=9.81, turns=1.25):
    """Poses whose centre of mass falls freely while the body, held stiff, somersaults."""
    poses = []
    for t in TIMES:
        turn = Rotation.from_rotvec([2 * np.pi * turns * t / TIMES[-1], 0, 0])
        still = Pose(world_from_root=RigidTransform.from_rotation(turn), joint_angles=np.full((4, 3), 0.2))
        com, _ = centre_of_mass(MODEL.with_pose(still))
        poses.append(still.move(np.array([t, 0, 3 * t - gravity * t**2 / 2]) - com, np.zeros(3)))
    return poses


def summarise(motion, model=MODEL):
    return flight_summary(motion, measure_flight(motion, model))


def test_centre_of_mass_deviations_are_those_of_sampled_poses():
    rng, covariance, n = np.random.default_rng(1), small_covariance(MODEL), 1000
    (pose,) = swinging(MODEL, [0.1])
    table = measure_flight(motion_of(MODEL, [pose], covariance=covariance), MODEL)
    drawn = [centre_of_mass(MODEL.with_pose(shaken(rng, pose, covariance)))[0] for _ in range(n)]
    np.testing.assert_allclose(table["com_sd"][0], np.std(drawn, axis=0), rtol=sampled(n))
    assert np.isnan(table["angular_momentum"][0]).all()


def test_lasting_errors_of_the_root_widen_the_centre_of_mass_and_nothing_that_is_fitted():
    rng = np.random.default_rng(2)
    motion = motion_of(MODEL, falling(), covariance=small_covariance(MODEL), lost=[5])
    root = (factor := 0.02 * rng.normal(size=(6, 6))) @ factor.T
    wide = replace(motion, lasting=np.tile(root, (len(motion), 1, 1)))
    now, then = measure_flight(wide, MODEL), measure_flight(motion, MODEL)
    jacobians = [centre_of_mass(MODEL.with_pose(motion.pose(row)))[1][:, :6] for row in np.flatnonzero(motion.has_pose)]
    added = np.diagonal(jacobians @ root @ np.swapaxes(jacobians, 1, 2), axis1=1, axis2=2)
    expected = np.sqrt(then["com_sd"].to_numpy()[motion.has_pose] ** 2 + added)
    np.testing.assert_allclose(now["com_sd"].to_numpy()[motion.has_pose], expected, atol=ROUNDTRIP)
    assert now.drop_vars("com_sd").identical(then.drop_vars("com_sd"))
    assert then["com_sd"].equals(then["com_sd_frame"])
    assert flight_summary(wide, now) == flight_summary(motion, then)
    for each, table in zip(state_centres_of_mass(wide, MODEL), (now["com"], now["com_sd"]), strict=True):
        np.testing.assert_array_equal(each, table)


def test_summary_of_a_free_fall_finds_gravity_rotations_and_a_constant_momentum():
    summary = summarise(motion_of(MODEL, falling()))
    assert summary.fitted_gravity_m_s2 == pytest.approx(9.81, abs=ROUNDTRIP)
    assert summary.ballistic_rms_mm < 1e3 * ROUNDTRIP
    assert summary.somersault_rev == pytest.approx(1.25, abs=ROUNDTRIP)
    assert summary.twist_rev == pytest.approx(0, abs=ROUNDTRIP)
    assert max(np.abs(summary.tilt_range_deg)) < ROUNDTRIP
    assert summary.n_poses == len(TIMES)
    # a stiff body about a fixed axis: momentum turns with the body only across the axis, along it it stays
    assert summary.angular_momentum_spread_kg_m2_s[0] < 1e-6 * summary.angular_momentum_kg_m2_s[0]
    assert summary.to_dict()["fitted_gravity_m_s2"] == summary.fitted_gravity_m_s2


def test_a_summary_states_the_error_of_the_momentum_beside_its_scatter():
    motion = motion_of(MODEL, falling(), covariance=small_covariance(MODEL))
    table = measure_flight(motion, MODEL)
    summary = flight_summary(motion, table)
    np.testing.assert_allclose(summary.angular_momentum_sd_kg_m2_s, np.median(table["angular_momentum_sd"], axis=0))
    assert summary.angular_momentum_sd_kg_m2_s[0] > 10 * summary.angular_momentum_spread_kg_m2_s[0]


def test_a_wrong_fall_widens_the_momentum_by_its_share_of_gravity():
    table = measure_flight(motion_of(MODEL, falling(), covariance=small_covariance(MODEL)), MODEL)
    wide = widen_momentum(table, WrongFall(0.7 * 9.81, 0.04, ""))
    momentum, sd = table["angular_momentum"], table["angular_momentum_sd"]
    np.testing.assert_allclose(wide["angular_momentum_sd"] ** 2, sd**2 + (0.3 * momentum) ** 2, rtol=SOLVED)
    assert wide["angular_momentum_sd"].attrs == sd.attrs and widen_momentum(table, None) is table


def test_places_that_no_view_shows_leave_the_fall_of_the_others_as_it_is():
    known = motion_of(MODEL, falling(), covariance=small_covariance(MODEL))
    covariance = known.covariance.copy()
    covariance[4:8, 2] = covariance[4:8, :, 2] = 0
    covariance[4:8, 2, 2] = np.inf
    table = measure_flight(replace(known, covariance=covariance), MODEL)
    assert not np.isfinite(table["com_sd"][4:8, 2]).any()
    np.testing.assert_allclose(table["com"], measure_flight(known, MODEL)["com"], atol=EXACT)


def test_a_body_that_does_not_fall_freely_is_detected_by_its_gravity_and_its_distance_from_free_fall():
    summary = summarise(motion_of(MODEL, falling(gravity=8.0)))
    assert summary.fitted_gravity_m_s2 == pytest.approx(8.0, abs=ROUNDTRIP)
    t = TIMES - TIMES.mean()
    expected = 0.5 * 1.81 * np.std(t**2)  # what a line cannot take up of the lacking acceleration, even in time
    assert summary.ballistic_rms_mm == pytest.approx(1e3 * expected, rel=ROUNDTRIP)


@pytest.mark.parametrize(("gravity", "falls"), [(0.0, False), (1.5, False), (9.81, True), (20.0, True)])
def test_a_fall_is_stated_only_where_the_body_falls_somewhere(gravity, falls):
    summary = summarise(motion_of(MODEL, falling(gravity), covariance=small_covariance(MODEL)))
    stated = (summary.fitted_gravity_m_s2, summary.fitted_gravity_sd_m_s2, summary.ballistic_rms_mm)
    assert np.isfinite(stated).tolist() == [falls] * 3


def test_deviation_of_the_fitted_gravity_is_that_of_paths_whose_errors_resemble_the_ones_before():
    rng, time_s, n = np.random.default_rng(5), np.arange(80) / 60, 300
    error = lfilter([1.0], [1.0, -0.7], 0.003 * rng.normal(size=(n, len(time_s))), axis=1)
    paths = np.stack([np.zeros_like(error), np.zeros_like(error), error - 9.81 / 2 * time_s**2], axis=-1)
    falls = [fit_fall(time_s, path, np.tile(np.eye(3), (80, 1, 1))) for path in paths]
    gravity, sd = np.transpose([(fall.gravity_m_s2, fall.gravity_sd_m_s2) for fall in falls])
    assert np.median(sd) == pytest.approx(np.std(gravity), rel=sampled(n))
    assert np.mean(np.abs(gravity - 9.81) < 2 * sd) > 0.88


@pytest.mark.parametrize("duration_s", [0.5, 1.0, 1.5])
def test_a_centre_of_mass_that_wanders_a_centimetre_changes_gravity_by_its_deviation(duration_s):
    time_s = np.linspace(0, duration_s, 60)
    wanders = 0.01 * (2 * time_s / duration_s - 1) ** 2  # and comes back
    path = np.stack([0 * time_s, time_s, wanders - 9.81 / 2 * time_s**2], axis=-1)
    gravity, sd, _ = _fit_parabola(time_s, path, np.tile(np.eye(3), (60, 1, 1)))
    assert abs(gravity - 9.81) == pytest.approx(sd, rel=1e-3)


def heavier_behind(model, offset_m):
    """The model with the centre of mass of its root moved so that the whole body's is by (3,) [m] elsewhere."""
    mass = sum(segment.inertia.mass_kg for segment in model.segments)
    root = model.segments[0]
    moved = replace(root.inertia, centre_m=root.inertia.centre_m + mass / root.inertia.mass_kg * np.asarray(offset_m))
    return replace(model, segments=(replace(root, inertia=moved), *model.segments[1:]))


def test_centre_of_mass_of_a_somersault_is_moved_to_where_it_falls():
    off_m, covariance = np.array([0.0, 0.015, -0.01]), small_covariance(MODEL)
    poses = falling(turns=0.4)
    off = heavier_behind(MODEL, off_m)
    motion = motion_of(off, poses, covariance=covariance)
    true = np.array([centre_of_mass(MODEL.with_pose(pose))[0] for pose in poses])
    before = np.array([centre_of_mass(off.with_pose(pose))[0] for pose in poses])
    error, rise = measure_flight(motion, off)["com"].to_numpy() - true, (before - true).std(axis=0).max()
    assert error.std(axis=0).max() < 0.1 * rise
    summary = summarise(motion, off)
    assert abs(summary.fitted_gravity_m_s2 - 9.81) < min(2 * summary.fitted_gravity_sd_m_s2 + 0.02, 0.1)


def test_centre_of_mass_of_a_fall_without_a_turn_stays():
    motion = motion_of(MODEL, falling(turns=0.0), covariance=small_covariance(MODEL))
    expected = [centre_of_mass(MODEL.with_pose(motion.pose(row)))[0] for row in range(len(motion))]
    np.testing.assert_allclose(measure_flight(motion, MODEL)["com"], expected, atol=ROUNDTRIP)


@pytest.mark.parametrize("lost", [range(21), range(1, 21), range(2, 21)])
def test_too_few_poses_leave_the_summary_unknown_not_broken(lost):
    summary = summarise(motion_of(MODEL, falling(), lost=lost))
    assert np.isnan(summary.fitted_gravity_m_s2)
    assert summary.n_poses == 21 - len(lost)


def test_table_has_a_unit_in_every_column_and_empty_cells_where_lost(tmp_path):
    motion = motion_of(MODEL, falling(), covariance=small_covariance(MODEL), lost=[5])
    write_flight(tmp_path / "flight.csv", motion, measure_flight(motion, MODEL))
    with (tmp_path / "flight.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == COLUMNS.split(",")
    assert all(rows[5][name] == "" for name in COLUMNS.split(",")[3:])
    assert [row["status"] for row in rows] == motion.status.tolist()
    assert all(rows[4][name] != "" for name in COLUMNS.split(","))
    table = measure_flight(motion, MODEL)
    assert float(rows[7]["com_z_m"]) == pytest.approx(float(table["com"][7, 2]), abs=EXACT)
    assert float(rows[7]["L_x_kg_m2_s_sd"]) == pytest.approx(float(table["angular_momentum_sd"][7, 0]), rel=EXACT)
    assert float(rows[7]["somersault_rev"]) == pytest.approx(1.25 * 7 / 20, abs=ROUNDTRIP)
    assert "5 frames" in table.attrs["history"][0]
    assert {table[name].attrs["units"] for name in ("com", "angular_momentum", "tilt")} == {"m", "kg m2/s", "deg"}


def test_body_without_all_its_masses_is_refused_in_one_line():
    segments = (*MODEL.segments[:2], replace(MODEL.segments[2], inertia=None), *MODEL.segments[3:])
    weightless = replace(MODEL, segments=segments)
    assert has_inertias(MODEL)
    assert not has_inertias(weightless)
    with pytest.raises(BodyError, match="no mass for arm; give every segment its inertia"):
        measure_flight(motion_of(MODEL, falling()), weightless)


def test_motion_of_another_body_is_refused():
    other = replace(MODEL, segments=MODEL.segments[:3], landmarks=MODEL.landmarks[:3])
    with pytest.raises(ResultError, match="give the run's body"):
        measure_flight(motion_of(MODEL, falling()), other)
