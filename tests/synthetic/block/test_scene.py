"""Scenes of block jumps: players with room, cameras as asked for, pictures and truth that agree, whole trials."""

import csv
import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from airborne.cameras import Rig, read_rig
from airborne.errors import TrialError
from airborne.synthetic import (
    DIFFICULTIES,
    Difficulty,
    block_frames,
    block_scene,
    jump_truth,
    noisy_starts,
    torso_input,
    true_joints,
    write_block,
)
from airborne.synthetic.block.margins import gap_m, margins_of
from airborne.synthetic.block.pictures import _merge
from airborne.synthetic.block.players import volume_over
from airborne.synthetic.block.rig import hall_rig, perturb_calibration
from airborne.synthetic.block.scene import paper_lengths
from airborne.trial.file import read_trial
from airborne.video import inspect
from airborne.video.decoding import VideoSource
from tests.support.tolerances import ROUNDTRIP, sampled

JOINTS = ("hip_left", "hip_right", "knee_left", "knee_right", "ankle_left", "ankle_right")


@pytest.fixture(scope="module")
def scene():
    return block_scene(4, n_blockers=2)


def shorten(scene, n_frames, *, scale=3):
    """The same scene with fewer frames and smaller pictures."""

    def small(rig):
        return Rig(
            tuple(
                camera.resample(scale=(scale, scale), offset=(0, 0), size=tuple(s // scale for s in camera.size))
                for camera in rig
            )
        )

    return replace(scene, n_frames=n_frames, rig=small(scene.rig), calibrated_rig=small(scene.calibrated_rig))


def test_scene_has_blockers_a_spiker_decoys_and_three_mates(scene):
    roles = [player.role for player in scene.players]
    assert [player.name for player in scene.blockers] == ["blocker1", "blocker2"]
    assert roles.count("team mate") == 3
    assert 2 <= roles.count("opponent") <= 4
    assert next(player for player in scene.players if player.name == "spiker").takeoff_s is not None
    assert scene.n_frames == 82


def test_every_player_respects_floor_net_and_joint_limits(scene):
    for player in scene.players:
        margins = margins_of(player.movement.person, player.poses(scene.times_s), side=player.side)
        assert margins.floor_m > -ROUNDTRIP
        assert margins.net_m > 0.02
        assert margins.limits_rad > 0


def test_no_two_players_touch(scene):
    rooms = [volume_over(player, scene.n_frames / 60) for player in scene.players]
    gaps = [gap_m(a, b) for i, a in enumerate(rooms) for b in rooms[i + 1 :]]
    assert min(gaps) >= 0.03 - 1e-9


def test_neighbours_stand_as_close_as_blockers_do(scene):
    hips = [true_joints(player, np.array([player.takeoff_s]))["torso"][0, 0] for player in scene.blockers]
    assert 0.5 < abs(hips[1] - hips[0]) < 1.1
    assert abs(scene.blockers[1].takeoff_s - scene.blockers[0].takeoff_s) <= 0.08


def test_jumps_lie_within_the_recording_and_their_truth_agrees_with_the_motion(scene):
    for player in scene.blockers:
        facts = jump_truth(player, 60.0)
        assert 0.1 < facts["last_contact_s"] < facts["first_contact_s"] < scene.n_frames / 60
        assert facts["last_contact_frame"] == pytest.approx(60 * facts["last_contact_s"])
        assert 0.30 <= facts["com_rise_from_takeoff_m"] <= 0.62
        t = np.linspace(0, scene.n_frames / 60, 800)
        lowest = np.min([true_joints(player, t)[name][:, 2] for name in ("toe_left", "toe_right")], axis=0)
        is_up = (t > facts["last_contact_s"] + 0.02) & (t < facts["first_contact_s"] - 0.02)
        assert lowest[is_up].min() > 0.005
        ankles = true_joints(player, t)
        peak = (ankles["ankle_left"] + ankles["ankle_right"])[:, 2].max() / 2
        assert facts["ankle_apex_m"] == pytest.approx(peak, abs=1e-3)
        assert facts["hip_rise_over_standing_m"] > facts["com_rise_from_takeoff_m"] - 0.1


def test_seed_makes_the_scene_and_the_frame_rate_only_says_how_often_one_looks(scene):
    fast = block_scene(4, n_blockers=2, difficulty=Difficulty(frame_rate=120))
    assert fast.n_frames == 164
    for player, same in zip(scene.players, fast.players, strict=True):
        knees = [true_joints(player, scene.times_s)["knee_left"], true_joints(same, fast.times_s[::2])["knee_left"]]
        np.testing.assert_allclose(knees[0], knees[1], atol=ROUNDTRIP)
    other = block_scene(5, n_frames=70)
    positions = [true_joints(s.blockers[0], np.zeros(1))["torso"] for s in (scene, other)]
    assert np.abs(positions[0] - positions[1]).max() > 0.01


def test_paper_has_22_sequences_of_1798_frames_five_with_several_blockers():
    counts, blockers = paper_lengths(np.random.default_rng(0))
    assert len(counts) == len(blockers) == 22
    assert counts.sum() == 1798
    assert counts.min() >= 70
    assert sorted(blockers.tolist()) == [1] * 17 + [2, 2, 2, 3, 3]


def test_torso_input_has_the_specified_noise(scene):
    noisy = torso_input(scene)
    true = np.stack([true_joints(player, scene.times_s)["torso"] for player in scene.players], axis=1)
    error = noisy - true
    n = error.size
    assert noisy.shape == (82, len(scene.players), 3)
    assert error.std() / 0.025 == pytest.approx(1, abs=3 * sampled(n))  # neighbours in time are alike
    correlation = np.mean(error[1:] * error[:-1]) / error.var()
    assert correlation == pytest.approx(0.8, abs=2 * sampled(n))


def test_start_is_the_truth_plus_noise(scene):
    starts = noisy_starts(scene)
    errors = []
    for player in scene.players:
        true = true_joints(player, np.zeros(1))
        joints = starts[player.name]
        assert ("knee_left" in joints) == (player.role == "blocker")
        errors += [joints[name] - true[name][0] for name in joints]
    assert np.std(errors) == pytest.approx(0.015, rel=3 / np.sqrt(2 * np.size(errors)) + 0.05)


def test_calibration_is_off_by_the_specified_error():
    rng = np.random.default_rng(3)
    true = hall_rig(rng, 6)
    middle = np.array([0.0, -0.7, 1.6])
    off = [
        calls.px_from_world(middle) - camera.px_from_world(middle)
        for _ in range(25)
        for calls, camera in zip(perturb_calibration(rng, true, 2.0), true, strict=True)
    ]
    assert np.std(off) == pytest.approx(2.0, rel=3 / np.sqrt(2 * np.size(off)) + 0.02)
    exact = perturb_calibration(rng, true, 0.0)
    np.testing.assert_allclose(exact.P, true.P, atol=1e-9)


def test_cameras_see_the_block():
    rig = hall_rig(np.random.default_rng(1), 6)
    assert len(rig) == 6
    for camera in rig:
        px = camera.px_from_world(np.array([[x, -0.5, z] for x in (-3.0, 3.0) for z in (0.0, 3.1)]))
        assert np.all(px > 0)
        assert np.all(px < camera.size)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"frame_rate": 50}, "choose 30, 60 or 120"),
        ({"occlusion": 1.5}, "expected 0 to 1"),
        ({"noise_sd": -1.0}, "zero or more"),
        ({"jpeg_quality": 101}, "expected 1 to 100"),
    ],
)
def test_impossible_difficulties_are_refused(changes, said):
    with pytest.raises(TrialError, match=said):
        Difficulty(**changes)


def test_impossible_scenes_are_refused():
    with pytest.raises(TrialError, match="give 1 to 3"):
        block_scene(0, n_blockers=4)
    with pytest.raises(TrialError, match="too few for a jump"):
        block_scene(0, n_frames=40)
    with pytest.raises(TrialError, match="give 2 to 6"):
        block_scene(0, difficulty=Difficulty(n_cameras=1))


def test_images_show_the_players_at_their_positions(scene):
    small = shorten(replace(scene, difficulty=replace(scene.difficulty, noise_sd=1.0, gain_spread=0.0)), 31)
    wanted = {0: None, 30: None}
    for frames in block_frames(small):
        if frames.index in wanted:
            wanted[frames.index] = frames
    red = 0
    for index, frames in wanted.items():
        for camera, view in zip(small.rig, frames.views, strict=True):
            for player in small.blockers:
                u, v = np.round(camera.px_from_world(true_joints(player, np.array([index / 60]))["torso"][0])).astype(
                    int
                )
                r, g, b = view.rgb[v, u].astype(int)
                red += r > 1.5 * g and r > 1.5 * b
    assert red >= 9  # of 12; another player may stand in the way
    first, later = (wanted[i].views[0].rgb for i in wanted)
    assert np.abs(first.astype(int) - later).max() > 100


def test_frames_are_reproducible_and_carry_the_calibrated_cameras(scene):
    small = shorten(scene, 2, scale=4)
    one, two = (list(block_frames(small)) for _ in range(2))
    for a, b in zip(one, two, strict=True):
        for x, y, camera in zip(a.views, b.views, small.calibrated_rig, strict=True):
            np.testing.assert_array_equal(x.rgb, y.rgb)
            assert x.camera is camera
    assert [frames.time_s for frames in one] == [0, 1 / small.rate]


def test_only_regions_near_players_are_rendered_anew(scene):
    small = shorten(replace(scene, difficulty=replace(scene.difficulty, noise_sd=0.0, jpeg_quality=0)), 3)
    frames = list(block_frames(small))
    for view, next_view in zip(frames[0].views, frames[2].views, strict=True):
        is_same = np.all(view.rgb == next_view.rgb, axis=2)
        assert 0.8 < is_same.mean() < 1.0


def test_overlapping_boxes_become_one():
    boxes = [np.array(box) for box in ((0, 0, 10, 10), (30, 0, 40, 10), (8, 5, 31, 7), (50, 50, 60, 60), (5, 5, 5, 9))]
    assert sorted(_merge(boxes)) == [(0, 0, 40, 10), (50, 50, 60, 60)]


def test_written_trial_is_whole_and_reads_back(scene, tmp_path):
    small, calls = shorten(scene, 3, scale=4), []
    write_block(tmp_path / "new", small, progress=lambda done, total: calls.append((done, total)))
    folder = tmp_path / "new"
    assert calls == [(1, 3), (2, 3), (3, 3)]
    trial = read_trial(folder / "trial.toml")
    assert [camera.name for camera in trial.camera] == ["cam1", "cam2", "cam3"]
    tables = tomllib.loads((folder / "trial.toml").read_text())["start"]["player"]
    assert [table["name"] for table in tables] == [player.name for player in scene.players]
    assert set(tables[0]["joints_m"]) == {"torso", *JOINTS, "foot_left", "foot_right"}
    assert set(tables[-1]["joints_m"]) == {"torso"}
    np.testing.assert_allclose(read_rig(folder / "calib.toml").P, small.calibrated_rig.P, atol=1e-6)
    np.testing.assert_allclose(read_rig(folder / "calib_true.toml").P, small.rig.P, atol=1e-6)
    facts = inspect(VideoSource("cam1", folder / "cam1.mp4"))
    assert facts.size == small.rig["cam1"].size
    with (folder / "truth.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3 * len(scene.players)
    knee = [float(rows[-1][f"r_knee_{axis}"]) for axis in "xyz"]
    true = true_joints(scene.players[-1], small.times_s)["knee_right"][2]
    np.testing.assert_allclose(knee, true, atol=1e-6)
    players = json.loads((folder / "players.json").read_text())
    assert [player["jumps"] for player in players] == [player.takeoff_s is not None for player in scene.players]
    assert json.loads((folder / "first_frame.json").read_text())["blockers"].keys() == {"blocker1", "blocker2"}
    with pytest.raises(TrialError, match="not empty"):
        write_block(folder, small)


def test_truth_has_the_columns_of_the_rendered_block_jump(shared_data, scene, tmp_path):
    write_block(tmp_path / "new", shorten(scene, 1, scale=6))
    headers = [
        (folder / "truth.csv").read_text().splitlines()[0] for folder in (shared_data("block_jump"), tmp_path / "new")
    ]
    assert headers[0] == headers[1]


def test_difficulties_are_in_order():
    easy, default, hard = (DIFFICULTIES[name] for name in ("easy", "default", "hard"))
    for knob in ("colour_similarity", "occlusion", "calibration_error_px", "noise_sd"):
        assert getattr(easy, knob) < getattr(default, knob) < getattr(hard, knob)
