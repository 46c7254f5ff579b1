"""Jumps of a jumper by closed formulas: heights are recovered, unobserved events unreported, intervals calibrated."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.errors import ResultError
from airborne.motion.free_fall import free_fall_height, noise_covariance
from airborne.motion.jumps import heights
from airborne.motion.jumps.heights import measure_jumps
from airborne.motion.jumps.standing_posture import leg_lengths
from airborne.motion.local_polynomials import local_fits
from tests.support.jumping import (
    FLAT_M,
    HEEL_M,
    LEG_M,
    SHARE,
    G,
    Jumper,
    first_legs,
    motion_of,
    noise,
    only,
    players_motion,
)
from tests.support.tolerances import ROUNDTRIP

CLEAN = Jumper()
MEDIAN = 1e-6  # of a square against the square of the median
REDRAWN = 3e-3  # rounding lets single draws fall otherwise
HEIGHTS = ("foot_height_m", "hip_height_m", "flight_time_height_m", "takeoff_speed_height_m", "hip_rise_m")


def true_numbers(jumper):
    """The true numbers of a jumper, by the names of `Jump`."""
    over = HEEL_M + jumper.rise_m
    return {
        "takeoff_s": jumper.takeoff_s,
        "landing_s": jumper.landing_s,
        "foot_height_m": over,
        "hip_height_m": over,
        "flight_time_height_m": G * jumper.flight_s**2 / 8,
        "takeoff_speed_height_m": jumper.rise_m,
        "hip_rise_m": jumper.rise_m,
    }


def without(motion, rows):
    """The same motion, its joints lost in some frames."""
    points = motion.points.copy()
    points[rows] = np.nan
    return replace(motion, points=points)


@pytest.fixture(scope="module")
def clean():
    return only(motion_of(CLEAN))


def test_peaks_over_standing_are_exact_without_noise(clean):
    assert clean.foot_height_m.value == pytest.approx(HEEL_M + CLEAN.rise_m, abs=2e-3)
    assert clean.hip_height_m.value == pytest.approx(HEEL_M + CLEAN.rise_m, abs=5e-3)
    assert clean.standing.source == "stance"
    assert clean.standing.ankles_m.value == pytest.approx(FLAT_M, abs=2e-3)


def test_every_interval_holds_the_truth_without_noise(clean):
    for name, value in true_numbers(CLEAN).items():
        measured = getattr(clean, name)
        assert measured.low - 0.006 <= value <= measured.high + 0.006, name


def test_events_are_within_a_third_of_a_frame_and_heights_within_a_centimetre_with_the_feet_tracked():
    jump = only(motion_of(CLEAN, feet=True))
    assert jump.takeoff_frame.value == pytest.approx(60 * CLEAN.takeoff_s, abs=0.33)
    assert jump.landing_frame.value == pytest.approx(60 * CLEAN.landing_s, abs=0.33)
    for name in HEIGHTS:
        assert getattr(jump, name).value == pytest.approx(true_numbers(CLEAN)[name], abs=0.012), name


def test_flight_is_landing_minus_takeoff_and_its_height_goes_with_its_square(clean):
    assert clean.flight_s.value == pytest.approx(clean.landing_s.value - clean.takeoff_s.value, abs=2e-3)
    assert clean.flight_time_height_m.value == pytest.approx(G * clean.flight_s.value**2 / 8, rel=MEDIAN)
    assert clean.takeoff_speed_height_m.value == pytest.approx(clean.takeoff_speed_m_s.value**2 / (2 * G), rel=MEDIAN)


def test_time_over_the_level_is_that_of_the_parabola_above_it(clean):
    above = clean.hip_height_m.value - clean.block_level_m
    assert clean.block_s.value == pytest.approx(2 * np.sqrt(2 * above / G), rel=1e-3)
    assert only_level(0.9).block_s.value == 0.0


def only_level(level_m):
    (jump,) = measure_jumps(motion_of(CLEAN), block_level_m=level_m)
    return jump


def test_nothing_changes_when_the_jump_is_elsewhere_or_later():
    rng = np.random.default_rng(3)
    motion = motion_of(CLEAN, sd_m=0.01, rng=rng)
    moved = replace(motion, points=motion.points + np.array([3.0, -2.0, 0.0]), time_s=motion.time_s + 7.0)
    here, there = only(motion), only(moved)
    for name in (*HEIGHTS, "drift_m", "flight_s", "hip_peak_speed_m_s"):
        assert tuple(getattr(there, name)) == pytest.approx(tuple(getattr(here, name)), abs=REDRAWN), name
    assert there.takeoff_s.value == pytest.approx(here.takeoff_s.value + 7.0, abs=REDRAWN)
    assert there.takeoff_frame.value == pytest.approx(here.takeoff_frame.value, abs=60 * REDRAWN)
    for k, shift in enumerate((3.0, -2.0)):
        assert there.takeoff_position_m[k].value == pytest.approx(here.takeoff_position_m[k].value + shift, abs=REDRAWN)


def test_rises_do_not_change_when_the_floor_is_higher():
    motion = motion_of(CLEAN, sd_m=0.01, rng=np.random.default_rng(4))
    here, there = only(motion), only(replace(motion, points=motion.points + np.array([0.0, 0.0, 0.5])))
    for name in HEIGHTS:
        assert tuple(getattr(there, name)) == pytest.approx(tuple(getattr(here, name)), abs=REDRAWN), name


def test_the_same_motion_gives_the_same_numbers():
    motion = motion_of(CLEAN, sd_m=0.02, rng=np.random.default_rng(5))
    one, other = only(motion), only(motion)
    assert [getattr(one, name) for name in HEIGHTS] == [getattr(other, name) for name in HEIGHTS]


def test_a_measurement_that_is_left_out_moves_no_other(monkeypatch):
    motion = motion_of(CLEAN, sd_m=0.02, rng=np.random.default_rng(5))
    whole = only(motion)
    peak = heights._peak
    of_hips = motion.points[:, 0, :2].mean(axis=1)[:, 2]
    monkeypatch.setattr(
        heights,
        "_peak",
        lambda rng, track, flight, path, **prior: (
            None if np.array_equal(path[0][:, 2], of_hips) else peak(rng, track, flight, path, **prior)
        ),
    )
    rest = only(motion)
    assert np.isnan(rest.hip_height_m.value)
    same = ("foot_height_m", "takeoff_speed_m_s", "drift_m", "takeoff_position_m", "landing_position_m", "standing")
    assert [getattr(rest, name) for name in same] == [getattr(whole, name) for name in same]


def test_more_noise_gives_wider_intervals():
    width = {}
    for sd_m in (0.005, 0.03):
        jump = only(motion_of(CLEAN, sd_m=sd_m, rng=np.random.default_rng(6)))
        width[sd_m] = {name: getattr(jump, name).high - getattr(jump, name).low for name in (*HEIGHTS, "takeoff_s")}
    for name, narrow in width[0.005].items():
        assert width[0.03][name] > narrow, name


def test_noise_that_is_larger_than_stated_is_noticed_and_widens_the_intervals():
    rng = np.random.default_rng(7)
    honest = motion_of(CLEAN, sd_m=0.03, rng=rng)
    boast = replace(honest, covariance=honest.covariance / 100)
    assert only(honest).noise_scale == 1.0
    assert only(boast).noise_scale > 2.0


def test_intervals_hold_the_truth_about_as_often_as_they_say_and_errors_are_small():
    n, hits, errors = 24, [], []
    for seed in range(n):
        rng = np.random.default_rng(seed)
        jumper = Jumper(
            takeoff_s=1.0 + rng.uniform(0, 1 / 60), speed_m_s=np.sqrt(2 * G * rng.uniform(0.3, 0.6)), depth_m=0.3
        )
        jump = only(motion_of(jumper, sd_m=0.015, rng=rng, feet=bool(seed % 2)))
        true = true_numbers(jumper)
        hits.append([getattr(jump, name).low <= value <= getattr(jump, name).high for name, value in true.items()])
        errors.append([getattr(jump, name).value - value for name, value in true.items()])
    share = np.mean(hits, axis=0)
    assert (share >= 0.95 - 3 * np.sqrt(0.05 * 0.95 / n)).all(), share
    mean_error = np.abs(errors).mean(axis=0)
    assert (mean_error[:2] < 0.5 / 60).all(), "events to half a frame"
    assert (mean_error[2:] < 0.015).all(), "heights to 1.5 cm"


def test_who_stands_does_not_jump():
    points = np.repeat(CLEAN.points()[:1, None, :6], 90, axis=0)
    points = points + 0.02 * noise(np.random.default_rng(8), points.shape)
    assert measure_jumps(players_motion(np.arange(90) / 60, points, sd_m=0.02)) == ()


def test_who_is_carried_up_at_rest_does_not_jump():
    points = np.repeat(CLEAN.points()[:1, None, :6], 150, axis=0)
    lift = 0.4 * np.clip((np.arange(150) / 60 - 0.8) / 0.3, 0, 1)
    points[..., 2] += lift[:, None, None]
    assert measure_jumps(players_motion(np.arange(150) / 60, points, sd_m=0.01)) == ()


def test_two_jumps_are_separated():
    first, second = Jumper(takeoff_s=1.0), Jumper(takeoff_s=1.2, speed_m_s=2.6)
    points = np.concatenate([first.points(), second.points()])[:, None, :6]
    motion = players_motion(np.arange(len(points)) / 60, points)
    one, two = measure_jumps(motion)
    assert (one.number, two.number) == (1, 2)
    assert one.takeoff_s.value == pytest.approx(1.0, abs=1 / 60)
    assert two.takeoff_s.value == pytest.approx(2.5 + 1.2, abs=1 / 60)
    assert one.takeoff_speed_height_m.value > two.takeoff_speed_height_m.value


def test_players_come_in_their_order_each_with_its_own_jump():
    low, high = Jumper(speed_m_s=2.5), Jumper(takeoff_s=1.2)
    points = np.stack([high.points(), low.points()], axis=1)[:, :, :6]
    result = measure_jumps(players_motion(CLEAN.time_s, points, players=("high", "low")))
    assert [jump.player for jump in result] == ["high", "low"]
    assert result[0].foot_height_m.value > result[1].foot_height_m.value


def test_a_drift_is_as_long_as_the_way_between_the_places_however_noisy():
    ways = [only(motion_of(CLEAN, sd_m=0.05, rng=np.random.default_rng(seed))) for seed in range(5)]
    for jump in ways:
        way = [a.value - b.value for a, b in zip(jump.landing_position_m, jump.takeoff_position_m, strict=True)]
        assert jump.drift_m.value == pytest.approx(np.hypot(*way), abs=0.005)  # medians of draws
        assert jump.drift_m.low >= 0


def test_a_jump_that_the_end_cuts_off_has_no_landing_and_nothing_that_needs_one():
    n = round(60 * (CLEAN.takeoff_s + 0.4))
    points = CLEAN.points()[:n, None, :6]
    jump = only(players_motion(np.arange(n) / 60, points))
    assert jump.status == "no landing"
    assert np.isnan([*jump.landing_s, *jump.flight_s, *jump.flight_time_height_m, *jump.drift_m]).all()
    assert jump.takeoff_speed_height_m.value == pytest.approx(CLEAN.rise_m, abs=0.02)
    assert jump.foot_height_m.value == pytest.approx(HEEL_M + CLEAN.rise_m, abs=0.02)


def test_a_jump_cut_off_before_its_peak_has_no_peak():
    n = round(60 * (CLEAN.takeoff_s + 0.22))
    jump = only(players_motion(np.arange(n) / 60, CLEAN.points()[:n, None, :6]))
    assert jump.status == "no landing"
    assert np.isnan([*jump.foot_height_m, *jump.hip_height_m, *jump.hip_rise_m, *jump.block_s]).all()


def test_a_clip_that_begins_in_the_air_has_no_takeoff():
    start = round(60 * (CLEAN.takeoff_s + 0.15))
    points = CLEAN.points()[start:, None, :6]
    jump = only(players_motion(np.arange(len(points)) / 60, points))
    assert jump.status == "no take-off"
    assert np.isnan([*jump.takeoff_s, *jump.takeoff_speed_height_m, *jump.flight_time_height_m]).all()
    assert jump.landing_s.value == pytest.approx(CLEAN.landing_s - start / 60, abs=1 / 60)


def test_a_long_gap_at_takeoff_leaves_it_unknown():
    motion = motion_of(CLEAN, sd_m=0.01, rng=np.random.default_rng(9))
    at = round(60 * CLEAN.takeoff_s)
    jump = only(without(motion, slice(at - 20, at + 8)))
    assert jump.status == "no take-off"
    assert np.isnan([*jump.takeoff_s, *jump.flight_s, *jump.takeoff_speed_height_m]).all()


def test_a_short_gap_at_takeoff_is_bridged_with_an_interval_that_holds_the_truth():
    motion = motion_of(CLEAN, sd_m=0.01, rng=np.random.default_rng(10))
    at = round(60 * CLEAN.takeoff_s)
    whole, gappy = only(motion), only(without(motion, slice(at - 1, at + 2)))
    assert gappy.status == "whole"
    assert gappy.takeoff_s.low <= CLEAN.takeoff_s <= gappy.takeoff_s.high
    width = [jump.takeoff_s.high - jump.takeoff_s.low for jump in (whole, gappy)]
    assert width[1] > 0.8 * width[0]


def test_a_gap_at_the_peak_leaves_the_peak_unknown_and_counts_its_frames():
    motion = motion_of(CLEAN)
    top = round(60 * (CLEAN.takeoff_s + CLEAN.speed_m_s / G))
    jump = only(without(motion, slice(top - 6, top + 7)))
    assert jump.n_lost == 13
    assert np.isnan(jump.foot_height_m).all()
    assert jump.takeoff_speed_height_m.value == pytest.approx(CLEAN.rise_m, abs=0.03)


def test_who_never_stands_straight_is_measured_from_the_lengths_of_the_legs():
    begin = round(60 * (CLEAN.takeoff_s - 0.45))
    points = CLEAN.points()[begin : begin + 80, None, :6]
    jump = only(players_motion(np.arange(80) / 60, points))
    assert jump.standing.source == "lengths"
    assert jump.standing.frames is None
    stand = jump.standing.hips_m
    assert stand.low <= FLAT_M + SHARE * LEG_M + 0.01
    assert stand.high >= FLAT_M + SHARE * LEG_M


def test_lengths_of_legs_are_not_made_longer_by_noise():
    motion = motion_of(CLEAN, sd_m=0.03, rng=np.random.default_rng(11))
    assert leg_lengths(first_legs(motion)) == pytest.approx([LEG_M, LEG_M], abs=0.025)


def test_errors_that_a_whole_leg_shares_leave_its_length():
    motion = motion_of(CLEAN, sd_m=0.03, rng=np.random.default_rng(11))
    stiff = replace(motion_of(CLEAN), covariance=motion.covariance)
    assert leg_lengths(first_legs(stiff)) == pytest.approx([LEG_M, LEG_M], abs=1e-3)


def test_peak_speeds_and_drift_are_those_of_the_motion():
    jumper = CLEAN
    motion = motion_of(jumper)
    points = motion.points + 0.8 * motion.time_s[:, None, None, None] * [1.0, 0.0, 0.0]
    jump = only(replace(motion, points=points))
    assert jump.drift_m.value == pytest.approx(0.8 * jumper.flight_s, abs=0.02)
    touch = G * jumper.flight_s - jumper.speed_m_s
    assert jump.hip_peak_speed_m_s.value == pytest.approx(np.hypot(0.8, max(touch, jumper.speed_m_s)), rel=0.1)


def test_foot_paths_are_the_tracked_ankles_of_the_flight(clean):
    motion = motion_of(CLEAN)
    assert clean.path_frames[0] == np.ceil(clean.takeoff_frame.value)
    assert clean.path_frames[-1] == np.floor(clean.landing_frame.value)
    assert np.array_equal(clean.foot_paths_m, motion.points[clean.path_frames, 0, 4:6])


def test_reach_is_the_higher_wrist_at_its_peak(clean):
    assert np.isnan(clean.reach_m).all()
    legs = CLEAN.points()[:, None, :6]
    wrists = legs[:, :, :2] + [[0.0, 0.0, 1.3], [0.0, 0.0, 1.2]]
    joints = (*motion_of(CLEAN).joints, "wrist_left", "wrist_right")
    jump = only(players_motion(CLEAN.time_s, np.concatenate([legs, wrists], axis=2), joints=joints))
    assert jump.reach_m.value == pytest.approx(legs[:, 0, 0, 2].max() + 1.3, abs=2e-3)


def test_a_covariance_that_is_not_given_counts_as_20_mm():
    motion = motion_of(CLEAN, sd_m=0.02, rng=np.random.default_rng(12))
    unknown = replace(motion, covariance=np.full_like(motion.covariance, np.nan))
    assert tuple(only(unknown).foot_height_m) == pytest.approx(tuple(only(motion).foot_height_m), abs=ROUNDTRIP)


def test_a_joint_that_jumps_away_and_back_counts_as_unknown():
    motion = motion_of(CLEAN, sd_m=0.01, rng=np.random.default_rng(13))
    points = motion.points.copy()
    at = round(60 * (CLEAN.takeoff_s + CLEAN.speed_m_s / G))
    points[at, 0, 0, 2] += 0.5
    points[at + 3, 0, 4, 2] -= 0.5
    jump, whole = only(replace(motion, points=points)), only(motion)
    assert (whole.n_lost, jump.n_lost) == (0, 2)
    for name in HEIGHTS:
        assert getattr(jump, name).value == pytest.approx(getattr(whole, name).value, abs=0.01), name


def test_a_motion_without_legs_is_refused_by_name():
    motion = motion_of(CLEAN)
    with pytest.raises(ResultError, match="lacks ankle_right"):
        measure_jumps(replace(motion, joints=(*motion.joints[:5], "head")))


def test_a_motion_of_one_frame_or_none_known_has_no_jump():
    motion = motion_of(CLEAN)
    assert measure_jumps(without(motion, slice(None))) == ()
    assert measure_jumps(players_motion(CLEAN.time_s[:1], CLEAN.points()[:1, None, :6])) == ()


def test_local_fits_are_exact_on_parabolas_and_unknown_outside_the_data():
    time_s = np.arange(12) / 60
    values = np.column_stack([1.0 + 2 * time_s + free_fall_height(time_s), 3 - time_s])
    at_s = np.array([0.0871, 0.3, 0.1])
    fit, covariance = local_fits(time_s, values, np.full_like(values, 1e-4), at_s)
    for k in (0, 2):
        at = at_s[k]
        assert fit[k, 0] == pytest.approx([1 + 2 * at - G / 2 * at**2, 3 - at], abs=ROUNDTRIP)
        assert fit[k, 1] == pytest.approx([2 - G * at, -1], abs=ROUNDTRIP)
        assert (np.linalg.eigvalsh(covariance[k]) > 0).all()
    assert np.isnan(fit[1]).all() and np.isnan(covariance[1]).all()


@pytest.mark.parametrize("rate_hz", [25, 60, 240])
def test_local_fits_take_the_nine_known_values_nearest_to_the_time(rate_hz):
    rng = np.random.default_rng(rate_hz)
    time_s = np.arange(60) / rate_hz
    values, variance = rng.normal(size=(60, 2)), rng.uniform(1, 2, (60, 2))
    values[rng.random(60) < 0.15, 1] = np.nan
    known = np.flatnonzero(np.isfinite(values[:, 1]))
    at_s = rng.uniform(time_s[known[0]], time_s[known[-1]], 50)
    fit, covariance = local_fits(time_s, values, variance, at_s)
    for at, result, spread in zip(at_s, fit, covariance, strict=True):
        rows = np.sort(known[np.argsort(np.abs(time_s[known] - at))[:9]])
        rows = rows[np.abs(time_s[rows] - at) <= 0.12]
        if len(rows) < 5:
            assert np.isnan(result).all() and np.isnan(spread).all()
            continue
        hat = np.linalg.pinv(np.vander(time_s[rows] - at, 3, increasing=True))[:2]
        np.testing.assert_allclose(result, hat @ values[rows], rtol=1e-6, atol=1e-8)
        noise_of = noise_covariance(time_s[rows], variance[rows, 1])
        np.testing.assert_allclose(spread[1], hat @ noise_of @ hat.T, rtol=1e-6, atol=1e-8)
    assert np.isfinite(fit).all(axis=(1, 2)).mean() > 0.5
