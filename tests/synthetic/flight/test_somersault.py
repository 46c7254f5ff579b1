"""The somersault is the paper's, and its recordings say what was done."""

import csv
import sys
import tomllib
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from airborne import cli
from airborne.body import human18
from airborne.body.files import read_body
from airborne.cameras import Rig, read_rig
from airborne.errors import BodyError, TrialError
from airborne.evaluation import read_flight_paths
from airborne.evaluation.truth import read_truth
from airborne.geometry.rotations import angles_from_matrix, geodesic, matrix_from_angles, unwrap
from airborne.motion.flight.momentum import centre_of_mass
from airborne.synthetic import half_twist, scene_frames, somersault_scene, write_trial
from airborne.synthetic.flight.skill import PAPER_RANGES
from airborne.synthetic.flight.somersault import MASS_KG, STATURE_M
from airborne.synthetic.throw.measurements import start_pose
from airborne.synthetic.throw.pictures import background, linear_image
from airborne.trial.file import read_trial
from airborne.video import open_recording
from airborne.video.decoding import VideoSource
from tests.support.bodies import is_within_limits
from tests.support.synthetic import constant_joints, pose_ranges
from tests.support.tolerances import EXACT, ROUNDTRIP, SOLVED

PRESETS = ["paper", "moving-arms", "pike"]
MODEL = human18(STATURE_M, MASS_KG)


def reduce_scene(scene, scale=4):
    """The scene with images smaller by `scale`."""
    cameras = (
        c.resample(scale=(scale, scale), offset=((scale - 1) / 2,) * 2, size=(c.size[0] // scale, c.size[1] // scale))
        for c in scene.rig
    )
    return replace(scene, rig=Rig(tuple(cameras)))


def fly_scene(scene):
    return scene.flight(np.array([float(scene.time_s(i)) for i in range(scene.n_pictures)]))


def joint(flight, name):
    return flight.joint_angles[:, MODEL.index_of(name) - 1]


def test_ranges_of_the_poses_are_those_of_the_paper():
    result = pose_ranges(fly_scene(somersault_scene("paper", target="ellipsoids")))
    for name in ("forward_m", "lateral_m", "somersault_rad", "tilt_rad", "twist_rad"):
        assert getattr(result, name) == pytest.approx(getattr(PAPER_RANGES, name), rel=SOLVED), name
    assert result.vertical_m == pytest.approx(0.79, abs=0.002)  # durations are whole milliseconds
    assert (PAPER_RANGES.vertical_m, PAPER_RANGES.forward_m, PAPER_RANGES.lateral_m) == (0.79, 1.0, 0.01)


def test_ranges_are_those_of_positions_and_unwrapped_angles():
    flight = half_twist(MODEL)(np.linspace(0, 0.5, 11))
    angles = np.linspace([0, 0, 0], [7.0, -0.2, -4.0], 11)
    positions = np.linspace([0.1, 0.2, 0.3], [0.4, -0.7, 0.3], 11)
    positions[4, 2] = 0.8
    result = pose_ranges(replace(flight, R=matrix_from_angles(angles), position=positions))
    assert (result.somersault_rad, result.tilt_rad, result.twist_rad) == pytest.approx((7.0, 0.2, 4.0), abs=ROUNDTRIP)
    assert (result.lateral_m, result.forward_m, result.vertical_m) == pytest.approx((0.3, 0.9, 0.5), abs=ROUNDTRIP)


@pytest.mark.parametrize("has_pike", [False, True])
def test_gymnast_flies_forward_lands_upright_facing_back_and_obeys_the_laws(has_pike):
    skill = half_twist(MODEL, has_pike=has_pike)
    flight = skill(skill.poses_s)
    angles = unwrap(angles_from_matrix(flight.R), flight.time_s)
    np.testing.assert_allclose(angles[-1, [0, 2]], [2 * np.pi, np.pi], rtol=SOLVED)
    assert flight.position[-1, 1] - flight.position[0, 1] == pytest.approx(-1.0, abs=0.02)  # toward -y, as faced first
    assert flight.R[0, 1, 1] == pytest.approx(1.0, abs=EXACT)
    assert flight.R[-1, 1, 1] < -0.99  # what was behind is in front
    assert flight.R[5, 2, 2] < -0.9  # upside down in mid-flight
    assert flight.position[-1, 2] == pytest.approx(flight.position[0, 2], abs=ROUNDTRIP)
    L = flight.angular_momentum
    np.testing.assert_allclose(L, np.tile([L[0, 0], 0, 0], (11, 1)), atol=ROUNDTRIP)
    acceleration = np.diff(flight.centre, 2, axis=0) / np.diff(flight.time_s)[0] ** 2
    np.testing.assert_allclose(acceleration, np.tile([0, 0, -9.81], (9, 1)), atol=ROUNDTRIP)


@pytest.mark.parametrize("preset", PRESETS)
def test_joints_stay_within_their_limits_and_arms_between_down_and_up(preset):
    flight = fly_scene(somersault_scene(preset, target="ellipsoids"))
    assert np.all(MODEL.limits.slack(matrix_from_angles(flight.joint_angles)) >= 0)
    for abduction in (-joint(flight, "upper_arm_left")[:, 1], joint(flight, "upper_arm_right")[:, 1]):
        assert np.all((abduction >= 0) & (abduction <= np.pi))


def test_arms_swing_by_equal_angles_and_only_a_pike_bends_the_rest():
    arms, pike = (fly_scene(somersault_scene(preset, target="ellipsoids")) for preset in ("moving-arms", "pike"))
    left, right = joint(arms, "upper_arm_left")[:, 1], joint(arms, "upper_arm_right")[:, 1]
    np.testing.assert_allclose(left + np.pi / 2, right - np.pi / 2, atol=EXACT)  # left up, right down
    assert np.ptp(left) > 0.3
    for name in ("thigh_left", "shank_right", "torso"):
        assert np.ptp(joint(arms, name)) == 0
        assert np.ptp(joint(pike, name)) > 0.2
    np.testing.assert_allclose(joint(pike, "thigh_left")[[0, -1]], 0, atol=1e-2)


def test_paper_holds_the_first_shape_along_the_path_of_the_moving_arms():
    scene, moving = (somersault_scene(preset, target="ellipsoids") for preset in ("paper", "moving-arms"))
    held, times = fly_scene(scene), np.array([float(scene.time_s(i)) for i in range(11)])
    true = moving.flight(times)
    np.testing.assert_array_equal(held.R, true.R)
    np.testing.assert_array_equal(held.position, true.position)
    np.testing.assert_array_equal(held.joint_angles, np.broadcast_to(true.joint_angles[0], held.joint_angles.shape))
    assert np.ptp(true.joint_angles, axis=0).max() > 0.3


def test_presets_last_the_whole_flight_at_their_rates():
    paper, arms = (somersault_scene(preset, target="ellipsoids") for preset in ("paper", "moving-arms"))
    duration = half_twist(MODEL).duration_s
    assert float(paper.time_s(10)) == pytest.approx(duration, abs=ROUNDTRIP)
    assert (paper.n_pictures, arms.rate) == (11, Fraction(50))
    assert 0 <= duration - float(arms.time_s(arms.n_pictures - 1)) < 0.02


@pytest.mark.parametrize(("preset", "target"), [("paper", "skin"), ("pike", "ellipsoids")])
def test_whole_flight_is_in_view_and_the_person_large(preset, target):
    scene = reduce_scene(somersault_scene(preset, target=target), 2)
    tallest = dict.fromkeys(scene.rig.names, 0)
    for recorded in scene_frames(scene):
        for view in recorded.views:
            body = view.rgb.any(axis=2)
            rows = np.flatnonzero(body.any(axis=1))
            assert not (body[[0, -1]].any() or body[:, [0, -1]].any())
            tallest[view.camera.name] = max(
                tallest[view.camera.name], np.ptp(rows), np.ptp(np.flatnonzero(body.any(0)))
            )
    assert min(tallest.values()) > 220 / 2
    assert list(tallest) == ["front", "side", "top"]


def test_cameras_look_from_the_front_the_side_and_the_top():
    axes = {c.name: c.camera_from_world.rotation.as_matrix()[2] for c in somersault_scene(target="ellipsoids").rig}
    for name, direction in (("front", [0, 1, 0]), ("side", [-1, 0, 0]), ("top", [0, 0, -1])):
        assert axes[name] @ direction > 0.99


def test_skin_and_ellipsoids_are_two_surfaces_of_one_flight():
    skin, plain = (reduce_scene(somersault_scene(target=target)) for target in ("skin", "ellipsoids"))
    for a, b in zip(scene_frames(skin), scene_frames(plain), strict=True):
        for x, y in zip(a.views, b.views, strict=True):
            one, two = x.rgb.any(axis=2), y.rgb.any(axis=2)
            assert 0.6 < np.count_nonzero(one & two) / np.count_nonzero(one | two) < 1
    assert skin.model is plain.model is plain.body


def test_frames_of_the_gym_are_the_same_again_and_other_seeds_make_another_gym():
    scene, other = (
        replace(
            reduce_scene(somersault_scene("moving-arms", target="ellipsoids", style="gym", seed=s), 8), n_pictures=1
        )
        for s in (3, 4)
    )
    (first,), (again,), (another,) = list(scene_frames(scene)), list(scene_frames(scene)), list(scene_frames(other))
    for x, y, z in zip(first.views, again.views, another.views, strict=True):
        np.testing.assert_array_equal(x.rgb, y.rgb)
        assert np.mean(np.abs(x.rgb.astype(int) - z.rgb)) > 5
        assert np.mean(x.rgb > 0) > 0.99  # no camera sees beside the hall


def test_skin_in_the_gym_casts_the_shadow_of_its_ellipsoids():
    scenes = [reduce_scene(somersault_scene(target=t, style="gym")) for t in ("skin", "ellipsoids")]
    darkened = []
    for scene in scenes:
        camera = scene.rig["top"]
        empty = replace(scene, blur_px=0.0)
        backdrop = background(empty, camera)
        lit = backdrop.ambient + backdrop.spots.sum(axis=0)
        posed = [scene.body.with_pose(scene.flight(np.zeros(1)).pose(0))]
        light = linear_image(empty, backdrop, posed)
        low = (backdrop.points[..., 2] < 0.05) & np.all(light < 0.9 * lit, axis=2)
        darkened.append(low)
    both = np.count_nonzero(darkened[0] & darkened[1])
    assert both > 100
    assert both > 0.8 * np.count_nonzero(darkened[1])


def test_unknown_choice_is_refused_with_those_there_are():
    for wrong, known in (({"preset": "tuck"}, "moving-arms"), ({"target": "mesh"}, "skin"), ({"style": "hd"}, "exact")):
        with pytest.raises(TrialError, match=f"is not known; choose .*{known}"):
            somersault_scene(**wrong)


def test_body_whose_arms_weigh_nothing_cannot_twist():
    light = [
        replace(s, inertia=replace(s.inertia, mass_kg=1e-6, tensor_kg_m2=1e-6 * s.inertia.tensor_kg_m2))
        if s.name.startswith(("upper_arm", "forearm", "hand"))
        else s
        for s in MODEL.segments
    ]
    with pytest.raises(BodyError, match="no swing of the arms gives body 'human18' half a twist"):
        half_twist(replace(MODEL, segments=tuple(light)))


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder, calls = tmp_path_factory.mktemp("somersault"), []
    scene = replace(reduce_scene(somersault_scene("pike", target="ellipsoids", seed=2)), n_pictures=6)
    write_trial(scene, folder, progress=lambda done, total: calls.append((done, total)))
    return scene, folder, calls


def test_trial_has_its_truth_and_its_body(written):
    scene, folder, calls = written
    flight, truth = fly_scene(scene), read_truth(folder / "truth.csv")
    np.testing.assert_allclose(truth.position, flight.position, atol=ROUNDTRIP)
    np.testing.assert_allclose(truth.R, flight.R, atol=ROUNDTRIP)
    body = read_body(folder / "body.toml")
    assert [s.name for s in body.segments] == [s.name for s in MODEL.segments]
    with (folder / "truth_angles.csv").open() as file:
        rows = list(csv.DictReader(file))
    result = [[float(row[f"{s.name}_{axis}_rad"]) for s in body.segments[1:] for axis in "xyz"] for row in rows]
    np.testing.assert_array_equal(np.reshape(result, flight.joint_angles.shape), flight.joint_angles)
    with (folder / "truth_joints.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6 * len(body.landmarks)
    for row in rows:
        posed = body.with_pose(flight.pose(int(row["frame"])))
        position = dict(zip([landmark.name for landmark in body.landmarks], posed.landmarks, strict=True))[row["joint"]]
        np.testing.assert_allclose([float(row[f"{axis}_m"]) for axis in "xyz"], position, atol=ROUNDTRIP)
        assert float(row["time_s"]) == int(row["frame"]) / 50
    true = read_flight_paths(folder / "truth_flight.csv")
    com = [centre_of_mass(MODEL.with_pose(flight.pose(i)))[0] for i in range(6)]
    np.testing.assert_allclose(true.com, com, atol=SOLVED)
    np.testing.assert_array_equal(true.angular_momentum, [scene.flight.takeoff.angular_momentum] * 6)
    turned = np.radians(np.stack([true.rotation_deg[name] for name in ("somersault", "tilt", "twist")], axis=1))
    np.testing.assert_allclose(matrix_from_angles(turned), flight.R, atol=ROUNDTRIP)
    assert calls[-1] == (6, 6)
    assert not (folder / "control_points.csv").exists()


def test_trial_starts_off_by_the_errors_of_the_scene_and_within_the_limits(written):
    scene, folder, _ = written
    trial = read_trial(folder / "trial.toml")
    start, true = start_pose(scene), scene.flight(np.zeros(1)).pose(0)
    assert np.linalg.norm(start.world_from_root.translation - true.world_from_root.translation) == pytest.approx(0.025)
    turned = start.world_from_root.rotation.as_matrix(), true.world_from_root.rotation.as_matrix()
    assert geodesic(*turned) == pytest.approx(np.radians(3.0))
    off = np.degrees(geodesic(matrix_from_angles(start.joint_angles), matrix_from_angles(true.joint_angles)))
    assert np.all(off < 3.0 + 1e-6)
    assert np.median(off) > 2.9  # limits hold back a few
    assert is_within_limits(MODEL, start)
    lights = trial.lights.lights
    assert lights.ambient == scene.lights.ambient
    for lamp, given in zip(lights.lamps, scene.lights.lamps, strict=True):
        np.testing.assert_array_equal(lamp.position_m, given.position_m)
        assert lamp.intensity == given.intensity
    calls = tomllib.loads((folder / "trial.toml").read_text())["start"]["joint_angles_deg"]
    assert list(calls) == [segment.name for segment in MODEL.segments[1:]]
    np.testing.assert_allclose(list(calls.values()), np.degrees(start.joint_angles), atol=1e-4)


def test_shape_at_the_start_is_exact_where_it_is_fixed():
    scene = somersault_scene("paper", target="ellipsoids")
    np.testing.assert_allclose(start_pose(scene).joint_angles, fly_scene(scene).joint_angles[0], atol=ROUNDTRIP)


def test_videos_hold_nearly_the_exact_images(written):
    scene, folder, _ = written
    sources = [VideoSource(c.name, folder / f"{c.name}.mp4", fields="progressive") for c in scene.rig]
    read = list(open_recording(sources, read_rig(folder / "calib_true.toml")))
    for a, b in zip(scene_frames(scene), read, strict=True):
        assert a.time_s == b.time_s
        for x, y in zip(a.views, b.views, strict=True):
            grey = np.abs(x.rgb.mean(axis=2) - y.rgb.mean(axis=2))
            assert grey.mean() < 0.5
            assert np.abs(x.rgb.astype(int) - y.rgb).mean() < 1.0


def test_command_writes_the_requested_trial(tmp_path, capsys, monkeypatch):
    asked = []
    monkeypatch.setattr(
        "airborne.synthetic.write_somersault", lambda folder, **options: asked.append((folder, options))
    )
    monkeypatch.setattr("airborne.export.models.write_model", lambda path, body: None)
    words = ["--preset", "pike", "--target", "ellipsoids", "--style", "gym", "--seed", "7"]
    monkeypatch.setattr(sys, "argv", ["airborne", "synth", "somersault", "-o", str(tmp_path / "new"), *words])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert not ended.value.code
    (folder, options), *rest = asked
    assert (folder, rest) == (tmp_path / "new", [])
    options.pop("progress")
    assert options == {"preset": "pike", "target": "ellipsoids", "style": "gym", "seed": 7}
    assert "trial.toml" in capsys.readouterr().out


def test_folder_with_something_in_it_is_refused_before_anything_is_solved(tmp_path, monkeypatch):
    from airborne.synthetic import write_somersault

    (tmp_path / "notes.txt").write_text("mine")
    monkeypatch.setattr("airborne.synthetic.throw.writing.somersault_scene", lambda *_, **__: pytest.fail("solved"))
    with pytest.raises(TrialError, match="is not empty"):
        write_somersault(tmp_path)


def test_constant_joints_give_no_half_twist():
    skill = half_twist(MODEL)
    stiff = replace(skill, joints=constant_joints(skill.joints(skill.joints.x[0])))
    assert pose_ranges(stiff(skill.poses_s)).twist_rad < 1e-3
