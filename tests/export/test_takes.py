"""Takes: evenly numbered frames at the rate that the run had, gaps where it had none, names that all programs read."""

from fractions import Fraction

import numpy as np
import pytest

from airborne.errors import ResultError
from airborne.export.takes import part_paths, player_takes, portable_names, sampling_rate, with_axis_markers
from tests.support.export_scenes import BOX, PERSON
from tests.support.takes import NTSC, jumping, take_of, tumbling
from tests.support.tolerances import EXACT, ROUNDTRIP


@pytest.mark.parametrize("rate", [NTSC, Fraction(50), Fraction(24000, 1001), Fraction(25, 2), Fraction(240)])
def test_the_rate_is_the_fraction_that_the_recording_had(rate):
    index = np.array([3, 4, 6, 900])
    assert sampling_rate(index, np.array([float(i / rate) for i in index])) == rate


def test_a_rate_that_is_no_simple_fraction_is_kept_as_it_is():
    assert float(sampling_rate(np.array([0, 100]), np.array([0.0, 100 / 59.9512345]))) == pytest.approx(
        59.9512345, rel=EXACT
    )


def test_frames_that_the_run_left_out_are_gaps_at_their_times():
    motion = tumbling(4, step=2, first=6)
    whole = take_of(motion, PERSON)
    np.testing.assert_array_equal(whole.frame, [4, 5, 6, 7])
    assert whole.rate == NTSC / 2
    motion.index[:] = [6, 8, 14, 16]  # two of every second frame are missing
    motion.time_s[:] = [float(i / NTSC) for i in motion.index]
    take = take_of(motion, PERSON)
    np.testing.assert_array_equal(take.frame, np.arange(4, 10))
    np.testing.assert_array_equal(take.has_pose, [True, True, False, False, True, True])
    np.testing.assert_array_equal(np.isfinite(take.points).all(axis=(1, 2)), take.has_pose)
    np.testing.assert_allclose(take.time_s, [float(i / NTSC) for i in range(6, 18, 2)], atol=ROUNDTRIP)
    assert take.jitter_s < ROUNDTRIP
    assert take.stretches() == [slice(0, 2), slice(4, 6)]


def test_lost_frames_at_both_ends_and_between_split_a_take():
    take = take_of(tumbling(9, lost=(0, 4, 5, 8)), PERSON)
    assert take.stretches() == [slice(1, 4), slice(6, 8)]
    assert take_of(tumbling(3, lost=(0, 1, 2)), PERSON).stretches() == []


def test_root_angles_are_unwrapped_and_give_the_rotation_back():
    motion = tumbling(40, turns=3.0)
    take = take_of(motion, PERSON)
    assert np.rad2deg(take.root_angles[-1, 0]) == pytest.approx(1080, abs=40)
    assert np.abs(np.diff(take.root_angles, axis=0)).max() < np.pi / 2
    np.testing.assert_allclose(take.R, motion.R, atol=ROUNDTRIP)


def test_jitter_is_the_largest_deviation_from_uniform_sampling():
    motion = tumbling(5, rate=Fraction(50))
    motion.time_s[2] += 0.004
    assert take_of(motion, PERSON).jitter_s == pytest.approx(0.004)


def test_a_body_known_by_its_origin_alone_gets_markers_on_its_axes_and_a_person_does_not():
    names = [landmark.name for landmark in with_axis_markers(BOX).landmarks]
    assert names == ["root", *(f"root_axis_{axis}" for axis in "xyz")]
    assert with_axis_markers(PERSON) is PERSON
    motion = tumbling(3, model=BOX)
    take = take_of(motion, BOX)
    np.testing.assert_allclose(take.points[:, 2] - take.points[:, 0], 0.1 * motion.R[..., 1], atol=EXACT)


def test_names_become_portable_and_stay_unique():
    names = portable_names(["Jürgen Müller (7)", "hip_left", "a/b", "a b", "№", "", "x" * 300])
    assert names[:4] == ("Jurgen_Muller_7", "hip_left", "a_b", "a_b_2")
    assert len(set(names)) == len(names)
    assert all(0 < len(name) <= 62 and name.isascii() and " " not in name for name in names)


def test_a_player_is_a_take_with_the_joints_as_tracked():
    motion = jumping(lost=(2, 3))
    anna, seven = player_takes(motion)
    assert (anna.name, seven.name) == ("Anna", "number_7")
    np.testing.assert_array_equal(seven.points, motion.points[:, 1])
    assert seven.stretches() == [slice(0, 2), slice(4, 10)]
    assert anna.stretches() == [slice(0, 10)]
    assert anna.rate == 60


def test_a_player_who_was_never_found_is_left_out():
    assert [take.name for take in player_takes(jumping(4, lost=range(4)))] == ["Anna"]


def test_runs_that_have_no_rate_or_no_order_are_refused_in_one_line():
    with pytest.raises(ResultError, match=r"1 frame.*two or more"):
        take_of(tumbling(1), PERSON)
    motion = tumbling(4)
    motion.index[-1] = 10**12
    with pytest.raises(ResultError, match="numbered up to 1000000000000"):
        take_of(motion, PERSON)
    motion = tumbling(4)
    motion.time_s[2] = motion.time_s[1]
    with pytest.raises(ResultError, match=r"times.*do not increase"):
        take_of(motion, PERSON)


@pytest.mark.parametrize("place", [1e9, np.inf])
def test_positions_off_the_earth_are_refused_in_one_line(place):
    motion = tumbling(4)
    motion.position[1, 2] = place
    with pytest.raises(ResultError, match=r"holds a point (1e\+09|inf) m from the origin"):
        take_of(motion, PERSON)


def test_parts_replace_the_parts_of_an_older_export_and_nothing_else(tmp_path):
    remaining = ["run_b.mot", "run.trc", "run_part.mot", "rerun_part1.mot", "run_part1.mot.bak"]
    for name in [*remaining, "run.mot", "run_part1.mot", "run_part2.mot", "run_part13.mot"]:
        (tmp_path / name).touch()
    assert [path.name for path in part_paths(tmp_path / "run.mot", 2)] == ["run_part1.mot", "run_part2.mot"]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(remaining)
    assert part_paths(tmp_path / "run.mot", 1) == [tmp_path / "run.mot"]
