"""A written trial is read back as what it was."""

import json
from fractions import Fraction

import numpy as np
import pytest

from airborne.body.files import body_toml, read_body
from airborne.calibration.from_points import calibrate
from airborne.calibration.sources.control_points import read_control_points
from airborne.cameras import read_rig
from airborne.errors import TrialError
from airborne.evaluation.digitised import fit_digitised_poses, read_digitised
from airborne.evaluation.truth import read_truth
from airborne.synthetic import cross_scene, scene_frames, write_thrown_cross, write_trial
from airborne.synthetic.throw.measurements import control_points
from airborne.trial.file import read_trial
from airborne.video import inspect, open_recording
from airborne.video.decoding import VideoSource
from tests.support.synthetic import small_scene
from tests.support.tolerances import ROUNDTRIP


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    scene, folder, calls = small_scene(), tmp_path_factory.mktemp("trial"), []
    write_trial(scene, folder, progress=lambda done, total: calls.append((done, total)))
    return scene, folder, calls


def test_videos_hold_the_rendered_fields(written):
    scene, folder, _ = written
    rig = read_rig(folder / "calib_true.toml")
    trial = read_trial(folder / "trial.toml")
    sources = [VideoSource(c.name, trial.path(c.video), fields=c.fields) for c in trial.camera]
    assert {inspect(source).flagged_order for source in sources} == {"top-first"}
    rendered = list(scene_frames(scene))
    read = list(open_recording(sources, rig, fields_as="rows"))
    assert [f.time_s for f in read] == [f.time_s for f in rendered] == [Fraction(i, 50) for i in range(4)]
    for a, b in zip(rendered, read, strict=True):
        for x, y in zip(a.views, b.views, strict=True):
            np.testing.assert_allclose(y.camera.K, x.camera.K, atol=ROUNDTRIP)
            grey_x, grey_y = x.rgb.mean(axis=2), y.rgb.mean(axis=2)
            assert np.abs(grey_x - grey_y).mean() < 3
            other = rendered[(a.index + 2) % 4].views[0]
            if y.camera.name == other.camera.name:
                assert np.abs(grey_x - grey_y).mean() < np.abs(other.rgb.mean(axis=2) - grey_y).mean()


def test_truth_is_the_flight_at_the_times_of_the_fields(written):
    scene, folder, _ = written
    truth, flight = read_truth(folder / "truth.csv"), scene.flight(np.arange(4) / 50)
    np.testing.assert_array_equal(truth.index, np.arange(4))
    np.testing.assert_allclose(truth.position, flight.position, atol=ROUNDTRIP)
    np.testing.assert_allclose(truth.R, flight.R, atol=ROUNDTRIP)


def test_cameras_are_recovered_from_the_control_points():
    scene = cross_scene(seed=5)
    points = control_points(scene)
    sizes = {camera.name: camera.size for camera in scene.rig}
    result = calibrate(points, sizes)
    for camera in scene.rig:
        assert np.linalg.norm(result.rig[camera.name].centre - camera.centre) < 0.04
    assert max(fit.rms_px for fit in result.fits) < 1.0


def test_control_points_are_read_back_as_clicked(written):
    scene, folder, _ = written
    points, rendered = read_control_points(folder / "control_points.csv"), control_points(scene)
    np.testing.assert_allclose(points.world, rendered.world, atol=ROUNDTRIP)
    np.testing.assert_allclose(points.px, rendered.px, atol=0.0051)


def test_clicked_ends_give_the_pose_to_what_clicks_allow(written):
    scene, folder, _ = written
    rig, body = read_rig(folder / "calib_true.toml"), read_body(folder / "cross.toml")
    poses = fit_digitised_poses(read_digitised(folder / "digitised.csv", rig), rig, body)
    error = poses.position - scene.flight(np.arange(4) / 50).position
    assert 1e-4 < np.abs(error).max() < 0.1  # 1.2 px of a small picture are 2.5 cm


def test_body_is_read_back_with_its_boxes_positions_and_colours(written, tmp_path):
    scene, folder, _ = written
    gym = tmp_path / "gym.toml"
    gym.write_text(body_toml(scene.surroundings))
    for model, path in ((scene.body, folder / "cross.toml"), (scene.surroundings, gym)):
        for read, part in zip(read_body(path).parts, model.parts, strict=True):
            np.testing.assert_array_equal(read.shape.size_m, part.shape.size_m)
            np.testing.assert_array_equal(read.colour, part.colour)
            np.testing.assert_allclose(
                read.segment_from_part.as_matrix(), part.segment_from_part.as_matrix(), atol=ROUNDTRIP
            )


def test_trial_names_what_was_written_and_starts_near_the_truth(written):
    scene, folder, _ = written
    trial = read_trial(folder / "trial.toml")
    assert [camera.fields for camera in trial.camera] == ["top-first"] * 3
    assert trial.track.stop == scene.n_pictures
    start = trial.start.pose.world_from_root
    true = scene.flight(np.zeros(1))
    assert np.linalg.norm(start.translation - true.position[0]) == pytest.approx(0.025, abs=1e-4)
    assert len(json.loads((folder / "lights.json").read_text())["spotlights"]) == 2


def test_progress_is_reported_after_every_image(written):
    assert written[2] == [(1, 4), (2, 4), (3, 4), (4, 4)]


def test_progressive_trial_has_frames_at_its_rate(tmp_path):
    scene = small_scene(is_interlaced=False, n_pictures=3, rate=Fraction(60000, 1001))
    write_trial(scene, tmp_path)
    facts = inspect(VideoSource("cam1", tmp_path / "cam1.mp4", fields="auto"))
    assert facts.fields == "progressive"
    assert facts.frame_rate == Fraction(60000, 1001)
    assert (tmp_path / "truth.csv").read_text().startswith("frame,")
    assert [camera.fields for camera in read_trial(tmp_path / "trial.toml").camera] == ["progressive"] * 3


def test_folder_with_something_in_it_is_left_alone_unless_overwritten(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    scene = small_scene(n_pictures=2)
    with pytest.raises(TrialError, match="is not empty; give a new folder, or empty this one"):
        write_trial(scene, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]
    write_trial(scene, tmp_path, overwrite=True)
    assert (tmp_path / "trial.toml").is_file()
    assert (tmp_path / "notes.txt").read_text() == "mine"
    with pytest.raises(TrialError, match="is a file; give a folder"):
        write_trial(scene, tmp_path / "notes.txt")


def test_a_recording_that_is_broken_off_leaves_nothing_new_and_an_earlier_one_whole(tmp_path):
    def stop(done, total):
        raise KeyboardInterrupt

    folder = tmp_path / "new"
    with pytest.raises(KeyboardInterrupt):
        write_trial(small_scene(n_pictures=2), folder, progress=stop)
    assert not folder.exists()
    write_trial(small_scene(n_pictures=2), folder)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(KeyboardInterrupt):
        write_trial(small_scene(n_pictures=3), folder, overwrite=True, progress=stop)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_writing_a_preset_writes_its_own_scene(tmp_path, monkeypatch):
    observed = []
    monkeypatch.setattr("airborne.synthetic.throw.writing.write_trial", lambda scene, *_, **__: observed.append(scene))
    write_thrown_cross(tmp_path, preset="side-somersault", seed=9)
    assert (observed[0].seed, observed[0].n_pictures) == (9, 39)
