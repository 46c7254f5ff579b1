"""What the step Cameras writes: files that `calibrate` reads, and a court's points to be clicked."""

import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from airborne.calibration.from_points import calibrate
from airborne.calibration.sources.boards import read_board
from airborne.calibration.sources.court import court_lines, court_points, survey_points
from airborne.calibration.sources.files import read_sources
from airborne.calibration.sources.wand import read_wand
from airborne.cameras import camera_looking_at
from airborne.cameras.formats.options import FileOptions
from airborne.errors import CalibrationError, TrialError
from airborne.evaluation import DigitisedPoints, read_clicked_frames, write_clicked_frames
from airborne.studio.calibrating import (
    REPORT,
    board_text,
    court_text,
    find_picture,
    guess_video,
    list_boards,
    list_pictures,
    list_wands,
    read_deviations,
    read_findings,
    read_report,
    sources_text,
    wand_text,
    write_calibration_report,
)
from airborne.studio.clicks import read_clicked
from airborne.studio.pages.cameras import _describe
from airborne.studio.project import find_trial, read_project

TRIAL = '[[camera]]\nname = "left"\nvideo = "a.mp4"\n[[camera]]\nname = "right"\nvideo = "b.mp4"\ncalibrated_as = "R"\n'


@pytest.fixture
def project(tmp_path):
    (tmp_path / "trial.toml").write_text(TRIAL)
    for name in ("a.mp4", "b.mp4", "board_LEFT.mp4"):
        (tmp_path / name).write_bytes(b"video")
    return read_project(*find_trial(tmp_path))


def test_boards_and_wands_are_found_by_what_is_in_the_files(project):
    folder = project.folder
    (folder / "board.toml").write_text(board_text(7, 5, 40.0, marker_mm=30.0, dictionary="DICT_5X5_50"))
    (folder / "chess.toml").write_text(board_text(7, 5, 25.5, marker_mm=0, dictionary="DICT_4X4_50"))
    (folder / "wand.csv").write_text("pt1_cam1_X,pt1_cam1_Y,pt1_cam2_X,pt1_cam2_Y\n1,2,3,4\n")
    (folder / "other.csv").write_text("point,x_m\nA,1\n")
    assert list_boards(folder) == ["board.toml", "chess.toml"]
    assert list_wands(folder) == ["wand.csv"]
    board, chess = read_board(folder / "board.toml"), read_board(folder / "chess.toml")
    assert (board.kind, board.square_m, board.marker_m, board.dictionary) == ("charuco", 0.04, 0.03, "DICT_5X5_50")
    assert (chess.kind, chess.columns, chess.square_m) == ("chessboard", 7, 0.0255)


def test_clicks_of_a_wand_s_ends_are_its_tracks(project):
    px = np.arange(24.0).reshape(2, 3, 2, 2) + 0.5  # frames, points, cameras
    px[:, 1], px[1, 0, 1] = np.nan, np.nan  # a point that is never clicked, and a click that is missing
    clicks = DigitisedPoints(index=np.array([4, 9]), points=("a", "b", "c"), px=px)
    write_clicked_frames(project.folder / "digitised_A_1.csv", clicks, ["left", "right"])
    assert list_wands(project.folder) == ["digitised_A_1.csv"]
    read = read_clicked_frames(project.folder / "digitised_A_1.csv", ["left", "right"])
    (project.folder / "wand.csv").write_text(wand_text(project, read))
    tracks = read_wand(project.folder / "wand.csv", ["left", "R"], FileOptions(), [0.5])
    assert np.array_equal(tracks.px, px[:, [0, 2]], equal_nan=True)
    with pytest.raises(TrialError, match="3 points are clicked; expected two"):
        wand_text(project, replace(clicks, px=np.nan_to_num(px)))


def test_sources_name_the_cameras_as_the_trial_looks_for_them(project):
    (project.folder / "board.toml").write_text(board_text(7, 5, 40.0, marker_mm=30.0, dictionary="DICT_4X4_50"))
    videos = {name: {"video": guess_video(project, name)} for name in ("left", "right")}
    assert videos == {"left": {"video": "board_LEFT.mp4"}, "right": {"video": "b.mp4"}}
    path = project.folder / "sources.toml"
    path.write_text(sources_text(project, {"board": {"file": "board.toml"}}, videos))
    sources = read_sources(path)
    assert (sources.names, list(sources.tables)) == (["left", "R"], ["board"])
    wand = {"wand": {"file": "wand.csv", "length_m": 0.5}}
    text = sources_text(project, wand, {name: {"size": [640, 480]} for name in videos})
    assert tomllib.loads(text)["camera"][1] == {"name": "R", "size": [640, 480]}


def test_a_court_is_calibrated_by_its_clicked_points(tmp_path):
    path = tmp_path / "court_women.csv"
    path.write_text(court_text("women"))
    clicked = read_clicked(path)
    assert clicked.world[clicked.names.index("net_left_top")] == pytest.approx([-4.5, 0, 2.25])
    camera = camera_looking_at("a", [-8, -17, 6], [0, -1, 1], focal_px=1100, size=(1920, 1080))
    for name, at in zip(clicked.names, clicked.world, strict=True):
        clicked = clicked.click(name, "a", camera.px_from_world(at))
    found = calibrate(clicked.control_points(["a"]), {"a": camera.size}).rig["a"]
    assert np.linalg.norm(found.centre - camera.centre) < 0.02


def test_lines_run_between_points_that_are_there():
    points = survey_points("men")
    assert set(points) <= set(court_points("men"))
    assert not any(name.startswith("post") for name in points)
    assert len(court_lines(points)) == 10
    (line,) = court_lines({name: points[name] for name in ("net_left_top", "net_right_top", "antenna_left_top")})
    assert np.ptp(line, axis=0) == pytest.approx([9, 0, 0])
    with pytest.raises(CalibrationError, match="net = 5"):
        survey_points(5.0)


def test_only_pictures_of_the_report_are_found(tmp_path):
    (tmp_path / REPORT).mkdir()
    (tmp_path / REPORT / "residuals_a.png").write_bytes(b"png")
    (tmp_path / "secret.png").write_bytes(b"png")
    assert find_picture(tmp_path, "residuals_a.png") == tmp_path / REPORT / "residuals_a.png"
    assert find_picture(tmp_path, "../secret.png") is None


def test_what_a_diagnosis_found_is_told_by_camera(tmp_path):
    assert read_findings(tmp_path, "calib.toml") == {}
    (tmp_path / "calib_report").mkdir()
    found = [(["a"], "turned"), ([], "far"), (["a", "b"], "swapped")]
    text = json.dumps({"findings": [{"kind": "", "cameras": cameras, "sentence": each} for cameras, each in found]})
    (tmp_path / "calib_report" / "report.json").write_text(text)
    assert read_findings(tmp_path, "calib.toml") == {"a": ["turned", "swapped"], "": ["far"], "b": ["swapped"]}
    (tmp_path / "calib_report" / "report.json").write_text("[]")
    with pytest.raises(TrialError, match="no report of a calibration"):
        read_findings(tmp_path, "calib.toml")


def test_a_camera_s_place_and_focal_length_have_the_deviations_of_its_report(tmp_path):
    assert read_deviations(tmp_path, "calib.toml") == {}
    (tmp_path / "calib_report").mkdir()
    sd = {"x_m": 0.0123, "z_m": 0.004, "fx_px": 2.5}
    text = json.dumps({"cameras": {"a": {"sd": sd}, "b": {"sd": {}}}, "findings": []})
    (tmp_path / "calib_report" / "report.json").write_text(text)
    known = read_deviations(tmp_path, "calib.toml")
    assert known == {"a": sd, "b": {}}
    camera = camera_looking_at("a", [3, -2, 1.5], [0, 0, 1], focal_px=700, size=(640, 480))
    assert _describe(camera, known["a"]) == (
        "at 3.000 ± 0.012, -2.00, 1.5000 ± 0.0040 m; focal length 700.0 ± 2.5 px; 640×480 px"
    )
    assert _describe(camera, known["b"]) == "at 3.00, -2.00, 1.50 m; focal length 700 px; 640×480 px"


def test_what_a_calibration_said_is_kept_in_the_folder_only(tmp_path):
    folder, other = tmp_path / "trial", tmp_path / "other"
    for each in (folder / REPORT, other):
        each.mkdir(parents=True)
    assert read_report(folder) == ""
    write_calibration_report(folder, "camera seen\n")
    assert read_report(folder) == "camera seen\n"
    (folder / REPORT / "report.txt").unlink()
    (folder / REPORT).rmdir()
    (folder / REPORT).symlink_to(other)
    (other / "residuals_a.png").write_bytes(b"png")
    with pytest.raises(TrialError, match="leads out of the folder"):
        write_calibration_report(folder, "")
    assert list_pictures(folder) == []
