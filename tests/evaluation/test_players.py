"""Players against the truth: errors come out as they were put in."""

import json
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from airborne.body.legs import LEG_POINTS
from airborne.cameras import read_rig
from airborne.errors import ResultError
from airborne.evaluation.players import assess_players, compare_players
from airborne.evaluation.players_truth import read_players_truth, read_reference_jumps
from airborne.evaluation.success import success_cover
from airborne.motion.players import PlayersWriter
from airborne.tracking import Status
from airborne.tracking.players import PlayerEstimate
from tests.support.jumping import Jumper, motion_of, noise, players_motion
from tests.support.tolerances import ROUNDTRIP, sampled

JUMPER = Jumper()
TRUTH = motion_of(JUMPER)
OTHER_SIDE = {name: name.replace("left", "right") for name in TRUTH.joints if name.endswith("left")}
OTHER_SIDE |= {other: name for name, other in OTHER_SIDE.items()}
STILL = players_motion(np.arange(40) / 60, np.repeat(JUMPER.points()[:1, None, :6], 40, axis=0))


def compare_with_truth(estimate, truth=STILL, **kwargs):
    return compare_players(estimate, truth, **kwargs).players["one"]


def shift_joints(rows, columns, by_m, motion=STILL):
    points = motion.points.copy()
    points[rows, 0, columns] += by_m
    return replace(motion, points=points)


def test_no_error_where_the_estimate_is_the_truth():
    errors = compare_with_truth(STILL)
    whole = errors.parts["all"]
    assert (whole.mean_mm, whole.largest_mm, whole.jitter_mm) == (0.0, 0.0, 0.0)
    assert (whole.within_50mm, whole.auc_200mm, whole.within_95, errors.pcp) == (1.0, 1.0, 1.0, 1.0)
    assert set(errors.swap_rate.values()) == {0.0}
    assert errors.n_losses == 0


def test_a_known_error_of_one_joint_is_its_mean_and_that_of_its_group_half():
    errors = compare_with_truth(shift_joints(slice(None), 4, [0.06, 0.0, 0.08]))
    assert errors.parts["ankle_left"].mean_mm == pytest.approx(100.0, rel=ROUNDTRIP)
    assert errors.parts["ankles"].mean_mm == pytest.approx(50.0, rel=ROUNDTRIP)
    assert errors.parts["ankle_left"].auc_200mm == pytest.approx(0.5, rel=ROUNDTRIP)
    assert errors.parts["ankle_left"].within_50mm == 0.0
    assert errors.parts["all"].mean_mm == pytest.approx(100 / 6, rel=ROUNDTRIP)


def test_strict_success_counts_missing_estimates_as_failed():
    points = STILL.points.copy()
    points[:10, 0, 2] = np.nan
    knee = compare_with_truth(replace(STILL, points=points)).parts["knee_left"]
    assert (knee.n, knee.n_unknown, knee.mean_mm) == (40, 10, 0.0)
    assert knee.within_100mm == knee.within_50mm == knee.auc_200mm == 0.75


def test_swapped_sides_are_counted_and_near_misses_are_not():
    points = STILL.points.copy()
    points[:8, 0, [4, 5]] = points[:8, 0, [5, 4]]
    points[20:, 0, 4, 0] += 0.02
    assert compare_with_truth(replace(STILL, points=points)).swap_rate == {"hips": 0.0, "knees": 0.0, "ankles": 0.2}


def test_limbs_are_correct_up_to_half_their_length_on_the_mean():
    length = float(np.linalg.norm(STILL.points[0, 0, 2] - STILL.points[0, 0, 4]))
    assert compare_with_truth(shift_joints(slice(None), 4, [0.99 * length, 0, 0])).pcp == 1.0
    assert compare_with_truth(shift_joints(slice(None), 4, [1.01 * length, 0, 0])).pcp == 0.75


def test_recovery_is_the_time_until_the_error_is_small_again():
    errors = compare_with_truth(shift_joints(slice(10, 16), slice(None), [0.2, 0, 0]))
    assert errors.n_losses == 1
    assert errors.mean_recovery_s == pytest.approx(6 / 60, rel=ROUNDTRIP)
    assert np.isnan(compare_with_truth(shift_joints(slice(30, 40), slice(None), [0.2, 0, 0])).mean_recovery_s), (
        "never recovered"
    )


def test_jitter_of_white_noise_is_the_root_of_six_times_its_deviation():
    rng = np.random.default_rng(0)
    long = players_motion(np.arange(400) / 60, np.repeat(STILL.points[:1], 400, axis=0))
    shaken = replace(long, points=long.points + 0.01 * rng.standard_normal(long.points.shape))
    assert compare_with_truth(shaken, long).parts["all"].jitter_mm == pytest.approx(10 * np.sqrt(6), rel=0.05)


def test_correct_covariances_contain_95_percent_and_too_small_ones_fewer():
    rng = np.random.default_rng(1)
    long = players_motion(np.arange(200) / 60, np.repeat(STILL.points[:1], 200, axis=0))
    points = long.points + 0.02 * rng.standard_normal(long.points.shape)
    honest = replace(long, points=points, covariance=np.broadcast_to(4e-4 * np.eye(3), long.covariance.shape))
    assert compare_with_truth(honest, long).parts["all"].within_95 == pytest.approx(0.95, abs=sampled(200 * 6))
    boast = replace(honest, covariance=honest.covariance / 4)
    assert compare_with_truth(boast, long).parts["all"].within_95 < 0.7
    unknown = replace(honest, covariance=np.full_like(honest.covariance, np.nan))
    assert np.isnan(compare_with_truth(unknown, long).parts["all"].within_95)


def test_changing_segment_length_is_detected():
    points = STILL.points.copy()
    points[::2, 0, 4, 2] -= 0.02
    lengths = compare_with_truth(replace(STILL, points=points)).length_sd_mm
    assert lengths["thigh_left"] == pytest.approx(0.0, abs=ROUNDTRIP)
    assert lengths["shank_left"] == pytest.approx(10.0, rel=0.1)


def test_jumps_are_compared_in_every_definition():
    rng = np.random.default_rng(2)
    shaken = replace(TRUTH, points=TRUTH.points + 0.01 * noise(rng, TRUTH.points.shape))
    shaken = replace(shaken, covariance=np.broadcast_to(1e-4 * np.eye(3), TRUTH.covariance.shape))
    stated = {"one": {"takeoff_frame": 60 * JUMPER.takeoff_s, "takeoff_speed_height_m": JUMPER.rise_m}}
    comparison = compare_players(shaken, TRUTH, reference_jumps=stated)
    (jump,) = comparison.jumps
    assert jump.is_found
    assert all(abs(error) < 0.03 for error in jump.height_error_m.values())
    assert set(jump.stated_height_error_m) == {"takeoff_speed_height_m"}
    assert abs(jump.stated_event_error_frames["takeoff_frame"]) < 1.0
    assert "take-off speed" in comparison.describe()
    assert json.loads(json.dumps(comparison.to_dict(), allow_nan=False))["n_matched"] == len(TRUTH)


def test_a_jump_that_was_not_found_is_reported():
    flat = replace(TRUTH, points=np.repeat(TRUTH.points[:1], len(TRUTH), axis=0))
    (jump,) = compare_players(flat, TRUTH).jumps
    assert not jump.is_found
    assert np.isnan(jump.height_error_m["foot_height_m"])
    assert jump.describe() == "one: jump 1 not found"


def test_text_holds_no_nan_and_names_what_has_no_partner():
    estimate = replace(STILL, players=("one",), joints=(*LEG_POINTS[:5], "tail"))
    text = compare_players(estimate, STILL).describe()
    assert "nan" not in text.lower()
    assert "not compared: tail" in text
    hips = replace(STILL, joints=LEG_POINTS[:2], points=STILL.points[:2, :, :2] + 1.0, time_s=STILL.time_s[:2])
    hips = replace(hips, **{name: getattr(STILL, name)[:2] for name in ("index", "score", "n_views")})
    hips = replace(hips, covariance=STILL.covariance[:2, :, :2], joint_status=STILL.joint_status[:2, :, :2])
    text = compare_players(hips, STILL).describe()
    assert "nan" not in text.lower()
    assert " time; not recovered" in text


def test_a_player_by_another_name_is_the_one_who_stands_there():
    found = replace(STILL, players=("player1",), points=STILL.points + 0.03)
    assert list(compare_players(found, STILL).players) == ["one"]
    points = np.concatenate([STILL.points, STILL.points + np.array([1.0, 0.0, 0.0])], axis=1)
    pair = replace(players_motion(STILL.time_s, points), players=("one", "two"))
    other_order = replace(pair, points=pair.points[:, ::-1], players=("player1", "player2"))
    errors = compare_players(other_order, pair).players
    assert [each.parts["all"].mean_mm for each in errors.values()] == [0.0, 0.0]


def test_a_player_of_whom_nothing_is_known_stands_by_nobody():
    points = np.concatenate([STILL.points, np.full_like(STILL.points, np.nan)], axis=1)
    found = replace(players_motion(STILL.time_s, points), players=("player1", "player2"))
    assert list(compare_players(found, STILL).players) == ["one"]


def test_a_truth_that_is_near_is_not_asked_about():
    assert compare_players(replace(STILL, points=STILL.points + 0.05), STILL).questions == ()
    assert compare_players(TRUTH, TRUTH).questions == ()


@pytest.mark.parametrize(
    ("truth", "question"),
    [
        (replace(TRUTH, points=1e3 * TRUTH.points), "are its numbers millimetres that are read as metres?"),
        (replace(TRUTH, time_s=TRUTH.time_s + 3 / 60), "with -50.0 ms added to the truth's times"),
        (replace(TRUTH, points=TRUTH.points + 1.1), "is it of this recording"),
        (
            replace(TRUTH, joints=tuple(map(OTHER_SIDE.get, TRUTH.joints))),
            "left and right exchanged",
        ),
    ],
    ids=["millimetres", "late", "of another recording", "sides"],
)
def test_a_truth_that_is_far_is_asked_about(truth, question):
    found = compare_players(TRUTH, truth)
    (asked,) = found.questions
    assert question in asked
    assert found.describe().splitlines()[-1] == asked


def test_other_recordings_are_refused_in_one_line():
    with pytest.raises(ResultError, match="no player in common: the run has two, the truth one"):
        compare_players(replace(STILL, players=("two",), points=STILL.points + 0.6), STILL)
    with pytest.raises(ResultError, match="no frame to compare"):
        compare_players(replace(STILL, time_s=STILL.time_s + 9), STILL)


def test_a_folder_without_a_run_is_refused(tmp_path):
    with pytest.raises(ResultError, match=r"holds no run of players; expected the joints\.csv"):
        assess_players(tmp_path, tmp_path / "truth.csv")


def test_a_run_in_a_folder_is_compared_with_a_truth_table_and_its_stated_jumps(tmp_path):
    motion = STILL
    with PlayersWriter(tmp_path / "joints.csv", motion.joints) as writer:
        for row in range(len(motion)):
            writer.append([estimate_at(motion, row)])
    stems = [f"{name.split('_')[1][0]}_{name.split('_')[0]}" for name in motion.joints]
    header = ["frame", "time_s", "player", *(f"{stem}_{axis}" for stem in stems for axis in "xyz")]
    shifted = motion.points + np.array([0.0, 0.003, 0.004])
    lines = [
        ",".join([str(k), repr(float(t)), "one", *map(repr, shifted[k].ravel().tolist())])
        for k, t in enumerate(motion.time_s)
    ]
    (tmp_path / "truth.csv").write_text("\n".join([",".join(header), *lines]) + "\n")
    result = assess_players(tmp_path, tmp_path / "truth.csv")
    assert result.n_matched == len(motion)
    assert result.players["one"].parts["all"].mean_mm == pytest.approx(5.0, rel=1e-6)
    assert result.players["one"].cover is None, "no cameras in the folder"
    assert result.jumps == ()


def estimate_at(motion, row):
    return PlayerEstimate(
        player="one",
        index=int(motion.index[row]),
        time_s=Fraction(row, 60),
        joint_status=(Status.TRACKED,) * len(motion.joints),
        points=motion.points[row, 0],
        covariance=motion.covariance[row, 0],
        score=0.0,
        n_views=3,
    )


def truth_file(path, lines):
    path.write_text("frame,time_s,player,l_hip_x,l_hip_y,l_hip_z\n" + "\n".join(lines) + "\n")
    return path


def test_truth_is_read_by_player_and_frame_in_any_order(tmp_path):
    lines = ["1,0.1,b,4,4,4", "0,0,a,1,2,3", "0,0,b,3,3,3", "1,0.1,a,2,2,2"]
    truth = read_players_truth(truth_file(tmp_path / "truth.csv", lines))
    assert (truth.players, truth.joints) == (("b", "a"), ("hip_left",))
    assert truth.points[0, 1, 0].tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (["0,0,a,1,2,3", "1,0.1,b,1,2,3"], "not one row for each of 2 players"),
        (["0,0,a,1,2,3", "0,0.1,b,1,2,3"], "time_s must be one number in each frame"),
        (["0,0,a,1,2,3", "1,,a,1,2,3"], "line 3 has no time_s"),
        (["0,0,a,,nan,", "1,0.1,a,,,"], "holds no position of any point"),
    ],
)
def test_broken_truth_is_refused_in_one_line(tmp_path, lines, message):
    with pytest.raises(ResultError, match=message):
        read_players_truth(truth_file(tmp_path / "truth.csv", lines))


def test_stated_jumps_are_read_where_there_are_any(tmp_path):
    path = tmp_path / "players.json"
    assert read_reference_jumps(path) == {}
    path.write_text('[{"name": "a", "jump": {"last_contact_frame": 29.5, "flight_s": 0.6}}, {"name": "b"}]')
    assert read_reference_jumps(path) == {"a": {"takeoff_frame": 29.5, "flight_time_height_m": 9.81 * 0.36 / 8}}
    path.write_text("[1]")
    with pytest.raises(ResultError, match="no list of players"):
        read_reference_jumps(path)


def test_noisy_tracking_of_the_block_jump_clip_gives_heights_to_two_centimetres(shared_data):
    folder = shared_data("block_jump")
    truth = read_players_truth(folder / "truth.csv")
    stated = read_reference_jumps(folder / "players.json")
    errors = []
    for seed in range(2):
        rng = np.random.default_rng(seed)
        points = truth.points + 0.01 * noise(rng, truth.points.shape)
        estimate = replace(truth, points=points, covariance=np.broadcast_to(1e-4 * np.eye(3), truth.covariance.shape))
        comparison = compare_players(estimate, truth, reference_jumps=stated)
        assert [jump.player for jump in comparison.jumps] == ["blocker1", "spiker"], "nobody else jumps"
        for jump in comparison.jumps:
            assert all(abs(error) < 1.0 for error in jump.stated_event_error_frames.values())
            errors.append(list(jump.stated_height_error_m.values()))
    assert (np.abs(errors).mean(axis=0) < 0.02).all()


@pytest.fixture(scope="module")
def rig(shared_data):
    return read_rig(shared_data("block_jump") / "calib.toml")


def test_cover_counts_what_lies_within_the_part_and_its_margin_in_two_views(rig):
    truth = STILL.points[:, 0]
    near, far = success_cover(rig, truth + 0.03, truth, LEG_POINTS), success_cover(rig, truth + 0.3, truth, LEG_POINTS)
    assert set(near.rate.values()) == {1.0}
    assert set(far.rate.values()) == {0.0}
    assert near.tolerance_m["hip_left"] == pytest.approx(0.12, abs=0.01)
    assert near.tolerance_m["ankle_left"] == pytest.approx(0.10, abs=0.01)


def test_rectangles_touch_within_a_whole_width(rig):
    truth = STILL.points[:, 0]
    above = success_cover(rig, truth + np.array([0, 0, 0.175]), truth, LEG_POINTS)
    assert set(above.rate.values()) == {0.0}
    assert {name: above.touching_rate[name] for name in ("hip_left", "ankle_left")} == {"hip_left": 1, "ankle_left": 0}
    assert above.touching_tolerance_m["hip_left"] == pytest.approx(above.tolerance_m["hip_left"] + 0.075, abs=0.001)
    assert above.touching_tolerance_m["ankle_left"] == pytest.approx(0.155, abs=0.01)


def test_cover_leaves_frames_out_that_fewer_than_two_cameras_show(rig):
    truth = STILL.points[:, 0]
    visible = np.ones((40, 3, 6), bool)
    visible[:15, :2, 4] = False
    cover = success_cover(rig, truth, truth, LEG_POINTS, visible=visible)
    assert (cover.n["ankle_left"], cover.n["ankle_right"]) == (25, 40)
    visible[:] = False
    assert np.isnan(success_cover(rig, truth, truth, LEG_POINTS, visible=visible).rate["hip_left"])


def test_missing_estimates_and_errors_along_one_ray_cover_nothing(rig):
    truth = STILL.points[:, 0]
    estimate = truth.copy()
    estimate[:, 4] = np.nan
    assert success_cover(rig, estimate, truth, LEG_POINTS).rate["ankle_left"] == 0.0
    toward = rig["cam3"].centre - truth[:, 4]
    estimate[:, 4] = truth[:, 4] + 0.25 * toward / np.linalg.norm(toward, axis=1)[:, None]
    assert success_cover(rig, estimate, truth, LEG_POINTS).rate["ankle_left"] == 0.0, "two other cameras see the error"
