"""Calibration from recordings and tables, alone and together, end to end."""

import json
from dataclasses import replace

import numpy as np
import pytest

from airborne import cli
from airborne.calibration import calibrate_from, sources_from
from airborne.calibration.bundle.lenses import CAMERA_PARAMETERS
from airborne.calibration.report import calibration_to_dict, describe_calibration
from airborne.cameras import Rig, read_rig, write_pose2sim
from airborne.errors import AirborneError
from tests.support.calibration_scenes import (
    board_pictures,
    three_side_by_side,
    wave_board,
    write_clicks,
    write_control_points,
    write_pictures,
    write_videos,
    write_wand,
)
from tests.support.once import remember_calibration
from tests.support.rigs import apart

RIG = three_side_by_side()
POINTS = np.random.default_rng(1).uniform([-0.6, -0.4, 0.4], [0.6, 0.6, 1.6], (14, 3))


def silent(what, done, total):
    pass


@pytest.fixture(scope="module", autouse=True)
def _once():
    with pytest.MonkeyPatch.context() as patch:
        remember_calibration(patch)
        yield


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """A folder with videos and pictures of a board, control points and a calibration."""
    folder = tmp_path_factory.mktemp("recordings")
    pictures = board_pictures(RIG, wave_board(16))
    write_videos(folder, pictures)
    (folder / "pictures").mkdir()
    write_pictures(folder / "pictures", pictures)
    write_control_points(folder / "points.csv", RIG, POINTS)
    write_pose2sim(folder / "calib.toml", RIG)
    return folder


def videos(**extra):
    return [{"name": name, "video": f"{name}.mp4", **extra} for name in RIG.names]


def test_a_place_that_no_source_shows_is_open(by_board):
    assert "open" not in describe_calibration(by_board)
    sd = np.array(by_board.adjustment.camera_sd)
    sd[1, CAMERA_PARAMETERS.index("x_m")] = 100.0
    said = describe_calibration(replace(by_board, adjustment=replace(by_board.adjustment, camera_sd=sd)))
    assert f"warning: no source shows where {RIG.names[1]} stand" in said
    assert "open" in next(line for line in said.splitlines() if line.startswith(RIG.names[1]))


def test_left_out_errors_far_beyond_the_fits_bring_a_warning(by_board):
    assert "what is left out of the fit" not in describe_calibration(by_board)
    far = {name: 5 * distances for name, distances in by_board.held_out_px.items()}
    said = describe_calibration(replace(by_board, held_out_px=far))
    assert "warning: what is left out of the fit lies 5" in said
    assert "the standard deviations, here and in the calibration file, are enlarged by it" in said


@pytest.fixture(scope="module")
def by_board(recordings):
    document = {"camera": videos(), "board": {"file": "board.toml", "sync": "exact"}}
    return calibrate_from(sources_from(document, recordings, "test"), silent)


def test_a_board_alone_gives_the_rig_in_metres(by_board):
    np.testing.assert_allclose(apart(by_board.rig), apart(RIG), rtol=0.01)
    for camera, true in zip(by_board.rig, RIG, strict=True):
        assert camera.K[0, 0] == pytest.approx(true.K[0, 0], rel=0.01)
    assert by_board.adjustment.rms_px() < 0.5
    assert np.nanmedian(by_board.held_out_px["board"]) < 0.5


def test_the_world_is_the_board_at_one_moment_with_z_out_of_its_face(by_board):
    source = by_board.adjustment.sources[0]
    held = int(np.flatnonzero(source.is_fixed)[0])
    np.testing.assert_allclose(source.world_from_target[held].translation, 0, atol=1e-9)
    assert all(camera.centre[2] > 0.5 for camera in by_board.rig)
    assert not by_board.adjustment.is_gauge_free
    assert f"moment {held}" in by_board.world


def test_the_report_has_every_number(by_board):
    told = calibration_to_dict(by_board)
    json.dumps(told, allow_nan=False)
    camera = told["cameras"]["cam0"]
    assert {"x_m", "y_m", "z_m", "turn_x_rad", "fx_px"} <= set(camera["sd"])
    assert camera["n_observations"] > 100
    assert told["sources"]["board"]["rms_px_by_camera"].keys() == set(RIG.names)
    assert not told["sd_is_within_the_rig"]


def test_images_do_as_well_as_videos(recordings):
    document = {
        "camera": [{"name": name, "pictures": f"pictures/{name}", "focal": "fixed"} for name in RIG.names],
        "start": {"file": "calib.toml"},
        "board": {"file": "pictures/board.toml"},
    }
    found = calibrate_from(sources_from(document, recordings, "test"), silent)
    np.testing.assert_allclose(apart(found.rig), apart(RIG), rtol=0.01)
    assert found.lag_s == {}
    assert "calib.toml" in found.world


def test_a_board_and_control_points_together_are_in_the_points_world(recordings):
    document = {
        "camera": videos(focal="fixed"),
        "start": {"file": "calib.toml"},
        "board": {"file": "board.toml", "sync": "exact"},
        "control_points": {"file": "points.csv"},
    }
    found = calibrate_from(sources_from(document, recordings, "test"), silent)
    assert [source.name for source in found.adjustment.sources] == ["control points", "board"]
    for camera in found.rig:
        np.testing.assert_allclose(camera.centre, RIG[camera.name].centre, atol=0.02)
    assert "control points" in found.world
    sd = found.adjustment.camera_sd[:, 3:6]
    off = np.stack([camera.centre - RIG[camera.name].centre for camera in found.rig])
    assert np.mean(np.abs(off) < 3 * sd + 1e-3) > 0.7


def test_control_points_alone_in_a_file_of_sources(recordings):
    document = {
        "camera": [{"name": name, "size": [640, 480]} for name in RIG.names],
        "control_points": {"file": "points.csv"},
    }
    found = calibrate_from(sources_from(document, recordings, "test"), silent)
    for camera in found.rig:
        np.testing.assert_allclose(camera.centre, RIG[camera.name].centre, atol=0.08)


def test_a_wand_alone_gives_the_rig_and_clicked_points_its_world(tmp_path):
    write_wand(tmp_path / "wand.csv", RIG)
    write_clicks(tmp_path / "frame.csv", RIG, {"A": [0, 0, 0.6], "B": [0.5, 0, 0.6], "C": [0, 0.5, 0.6]})
    document = {
        "camera": [{"name": name, "size": [640, 480]} for name in RIG.names],
        "wand": {"file": "wand.csv", "length_m": 0.6},
        "world": {"points": "frame.csv", "origin": "A", "along_x": "B", "in_xy": "C"},
    }
    found = calibrate_from(sources_from(document, tmp_path, "test"), silent)
    assert found.adjustment.rms_px() < 0.6
    np.testing.assert_allclose(apart(found.rig), apart(RIG), rtol=0.03)
    for camera in found.rig:
        np.testing.assert_allclose(camera.centre, RIG[camera.name].centre - np.array([0, 0, 0.6]), atol=0.1)
    assert "origin A" in found.world
    first = {**document, "world": {"frame": "camera"}}
    seen = calibrate_from(sources_from(first, tmp_path, "test"), silent)
    np.testing.assert_allclose(seen.rig.cameras[0].centre, 0, atol=1e-9)
    assert not seen.adjustment.camera_sd[0, :6].any()


def test_a_start_keeps_its_lenses_and_its_world(recordings):
    document = {
        "camera": videos(focal="fixed"),
        "start": {"file": "calib.toml"},
        "board": {"file": "board.toml", "sync": "exact"},
    }
    found = calibrate_from(sources_from(document, recordings, "test"), silent)
    for camera in found.rig:
        np.testing.assert_array_equal(camera.K, RIG[camera.name].K)
        np.testing.assert_allclose(camera.centre, RIG[camera.name].centre, atol=0.02)


def test_the_command_writes_the_rig_a_report_and_an_image_a_camera(tmp_path, capsys, monkeypatch):
    folder = tmp_path / "short"
    folder.mkdir()
    two = Rig(RIG.cameras[:2])
    write_videos(folder, board_pictures(two, wave_board(8)))
    output = tmp_path / "calib.toml"
    words = ["calibrate", "--board", "board.toml", *(f"{name}.mp4" for name in two.names), "-o", str(output)]
    monkeypatch.chdir(folder)
    monkeypatch.setattr("sys.argv", ["airborne", *words])
    with pytest.raises(SystemExit) as left:
        cli.main()
    assert not left.value.code
    rig = read_rig(output)
    assert isinstance(rig, Rig) and rig.names == two.names
    names = {path.name for path in (tmp_path / "calib_report").iterdir()}
    assert names == {"report.json", "residuals_cam0.png", "residuals_cam1.png"}
    assert "world: the board" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("document", "said"),
    [
        ({"camera": [{"name": "a"}]}, "no source"),
        ({"camera": [{"name": "a"}, {"name": "a"}], "board": {"file": "b"}}, "share a name"),
        ({"camera": [{"name": "a", "lense": "brown"}], "board": {"file": "b"}}, "unknown key"),
        ({"camera": [{"name": "a", "size": [640, 480]}], "board": {"columns": 5}}, "rows"),
        ({"camera": [{"name": "a"}], "board": {"file": "none.toml"}}, "give its video, or size"),
        ({"camera": [{"name": "a", "size": [640, 480]}], "board": {"file": "none.toml"}}, "cannot be read"),
        ({"camera": [{"name": "a", "size": [640, 480]}], "detections": {"file": "x.npz"}}, "give \\[start\\]"),
        ({"camera": [{"name": "a", "size": [640, 480]}], "wand": {"file": "x.csv"}}, "length_m"),
    ],
)
def test_what_cannot_be_used_is_said_in_one_line(tmp_path, document, said):
    with pytest.raises(AirborneError, match=said) as caught:
        calibrate_from(sources_from(document, tmp_path, "sources.toml"), silent)
    assert "\n" not in str(caught.value)
