"""Take-offs and landings are found where there are any, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose
from airborne.motion import Motion
from airborne.motion.flight.phases import ballistic_point, body_events, find_flight_events, player_events
from tests.support.jumping import Jumper, players_motion
from tests.support.jumping import motion_of as jump_of
from tests.support.motions import figure, motion_of, somersault

G = 9.81


def hips(jumper, seed, sd_m):
    motion = jump_of(jumper, sd_m=sd_m, rng=np.random.default_rng(seed))
    return motion.time_s, motion.points[:, 0, :2, 2].mean(axis=1), np.full(len(motion), sd_m**2 / 2)


@pytest.mark.parametrize("seed", range(4))
def test_a_jump_has_one_takeoff_and_one_landing(seed):
    jumper = Jumper()
    result = find_flight_events(*hips(jumper, seed, 0.005))
    assert [event.name for event in result] == ["take-off", "landing"]
    assert result[0].time_s == pytest.approx(jumper.takeoff_s, abs=0.025)
    assert result[1].time_s == pytest.approx(jumper.landing_s, abs=0.04)


def test_two_jumps_have_two_of_each():
    one = Jumper(duration_s=2.5)
    _, height, variance = hips(one, 0, 0.004)
    both = np.concatenate([height, height])
    result = find_flight_events(np.arange(len(both)) / one.rate, both, np.concatenate([variance, variance]))
    assert [event.name for event in result] == ["take-off", "landing"] * 2
    assert result[2].time_s - result[0].time_s == pytest.approx(2.5, abs=0.02)


def test_who_stands_or_walks_or_squats_does_not_fly():
    t, rng = np.arange(180) / 60, np.random.default_rng(1)
    for height in (np.full(180, 0.9), 0.9 + 0.03 * np.sin(12 * t), 0.7 + 0.2 * np.cos(4 * t)):
        assert find_flight_events(t, height + 0.004 * rng.normal(size=180), np.full(180, 0.004**2)) == ()


def test_a_recording_that_is_all_flight_has_no_event():
    t, rng = np.arange(50) / 50, np.random.default_rng(2)
    height = 1 + 4.5 * t - G / 2 * t**2 + 0.004 * rng.normal(size=50)
    assert find_flight_events(t, height, np.full(50, 0.004**2)) == ()


@pytest.mark.parametrize("n", [0, 1, 7])
def test_too_little_shows_nothing(n):
    assert find_flight_events(np.arange(n) / 60, np.ones(n), np.ones(n)) == ()


def test_where_the_mass_of_a_spinning_body_is_follows_from_its_fall():
    estimates, _ = somersault(40, turns=1.5)
    motion = Motion.collect(estimates)
    t, centre = motion.time_s, np.array([0.02, 0.1, -0.05])
    fall = np.stack([t, 0 * t, 1 + 4 * t - G / 2 * t**2], axis=1)
    motion = replace(motion, position=fall - motion.R @ centre)
    assert ballistic_point(motion) == pytest.approx(centre, abs=0.01)


def test_a_thrown_body_without_masses_shows_no_event_though_its_root_is_off_its_mass():
    estimates, _ = somersault(40, turns=1.5)
    motion = Motion.collect(estimates)
    t = motion.time_s
    fall = np.stack([t, 0 * t, 1 + 4 * t - G / 2 * t**2], axis=1)
    motion = replace(motion, position=fall - motion.R @ np.array([0.0, 0.1, 0.0]))
    body = figure()
    without = replace(body, segments=(replace(body.segments[0], inertia=None),), landmarks=())
    assert body_events(motion, without) == ()


def test_of_a_body_with_masses_the_centre_of_mass_counts():
    body = figure()
    jumper = Jumper(rate=60.0, duration_s=2.0)
    rise = jumper.points()[:, :2, 2].mean(axis=1)
    poses = [
        Pose(
            world_from_root=RigidTransform.from_components([0, 0, z], Rotation.identity()),
            joint_angles=np.zeros((4, 3)),
        )
        for z in rise
    ]
    covariance = np.eye(18) * 1e-6
    result = body_events(motion_of(body, poses, 60, covariance), body)
    assert [event.name for event in result] == ["take-off", "landing"]
    assert result[0].time_s == pytest.approx(jumper.takeoff_s, abs=0.03)


def test_of_players_the_events_are_those_of_their_jumps():
    jumper = Jumper()
    standing = np.repeat(jumper.points()[:1], len(jumper.time_s), axis=0)
    points = np.stack([jumper.points(), standing], axis=1)[:, :, :6]
    result = player_events(players_motion(jumper.time_s, points, players=("one", "two")))
    assert [event.name for event in result["one"]] == ["take-off", "landing"]
    assert result["one"][0].time_s == pytest.approx(jumper.takeoff_s, abs=0.02)
    assert result["two"] == ()


def test_a_flight_that_the_recording_begins_in_ends_a_segment_at_its_landing_only():
    jumper = Jumper()
    motion = jump_of(jumper)
    late = motion.time_s > jumper.takeoff_s + 0.1
    cut = players_motion(motion.time_s[late], motion.points[late])
    result = player_events(cut)["one"]
    assert [event.name for event in result] == ["landing"]
