"""Wand, court and throw as files, through `airborne calibrate`, against the true cameras."""

import json
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration import calibrate_from, read_sources, residual_figures
from airborne.calibration.report import calibration_to_dict, describe_calibration
from airborne.cameras import read_rig, write_pose2sim
from airborne.errors import CalibrationError
from tests.support import wand_waving as waving
from tests.support.commands import in_process
from tests.support.once import remember_calibration

CLICKED = (
    *("corner_near_left_outer", "corner_near_right_outer", "corner_far_left_outer", "corner_far_right_outer"),
    *("attack_near_left_inner_rear", "attack_near_right_inner_rear", "attack_far_left_inner_rear"),
    *("attack_far_right_inner_rear", "centre_left_outer", "centre_right_outer", "net_left_top", "net_right_top"),
    *("antenna_left_top", "antenna_right_top"),
)
RIG = waving.hall((1300.0, 1300.0, 1400.0, 1200.0))
COURT = '[court]\nfile = "court.csv"\nnet = "men"\n'
WAND = '[wand]\nfile = "wand_xypts.csv"\nlengths_m = [0.6, 0.4]\n'
RATE_HZ = 50
N = 80  # frames of the wand


def xypts(px):
    """DLTdv's table of our pixels (frames, markers, cameras, 2)."""
    _, markers, cameras, _ = px.shape
    head = ",".join(f"pt{m + 1}_cam{c + 1}_{axis}" for m in range(markers) for c in range(cameras) for axis in "UV")
    rows = [",".join("NaN" if np.isnan(v) else f"{v:.4f}" for v in row) for row in (px + 1).reshape(len(px), -1)]
    return "\n".join([head, *rows]) + "\n"


def clicks(names, px):
    """A table of clicked points (n, cameras, 2)."""
    head = "point," + ",".join(f"{name}_{axis}" for name in RIG.names for axis in "uv")
    cells = [["" if np.isnan(v) else f"{v:.3f}" for v in row] for row in px.reshape(len(px), -1)]
    return "\n".join([head, *(",".join([name, *row]) for name, row in zip(names, cells, strict=True))]) + "\n"


@pytest.fixture(scope="module", autouse=True)
def _once():
    with pytest.MonkeyPatch.context() as patch:
        remember_calibration(patch)
        yield


@pytest.fixture(scope="module")
def hall(tmp_path_factory):
    """A folder with a court's clicks, a wand's tracks, corners of a frame, a throw, and the true cameras."""
    folder, rng = tmp_path_factory.mktemp("hall"), np.random.default_rng(0)
    points = waving.click_court(rng, RIG, CLICKED)
    (folder / "court.csv").write_text(clicks(points.names, points.px))
    wand = waving.observe(rng, RIG, waving.wave_wand(rng, N, (0.6, 0.4)), stray_share=0.03)
    (folder / "wand_xypts.csv").write_text(xypts(wand))
    corners = np.array([[0.5, 0.3, 0], [2.5, 0.3, 0], [0.5, 1.8, 0]])
    (folder / "frame.csv").write_text(clicks("ABC", waving.observe(rng, RIG, corners)))
    times_s = np.arange(40) / RATE_HZ
    thrown = np.array([-1, 0, 1.0]) + times_s[:, None] * [2, 0.5, 3.9] + times_s[:, None] ** 2 / 2 * [0, 0, -9.81]
    (folder / "throw_xypts.csv").write_text(xypts(waving.observe(rng, RIG, thrown[:, None])))
    write_pose2sim(folder / "truth.toml", RIG)
    return folder


def written(folder, tables, name="sources.toml"):
    cameras = "".join(f'[[camera]]\nname = "{name}"\nsize = [1920, 1080]\n' for name in RIG.names)
    (folder / name).write_text(cameras + tables)
    return folder / name


@cache
def calibrated(folder, tables):
    """Calibrate from the tables in a folder, whose files stay as they are."""
    return calibrate_from(read_sources(written(folder, tables)), lambda what, done, total: None)


def off_m(rig):
    """How far points in the middle, triangulated from their true pixels, lie from the truth: RMS [m]."""
    points = np.random.default_rng(9).uniform((-3, -2, 0.4), (3, 2, 2.8), (200, 3))
    found = rig.points_from_px(np.stack([camera.px_from_world(points) for camera in RIG], axis=1))
    return float(np.sqrt(np.mean(np.sum((found - points) ** 2, axis=1))))


def test_the_court_alone_gives_cameras_in_its_world(hall):
    found = calibrated(hall, COURT)
    assert off_m(found.rig) < 0.025
    assert found.world == "that of the court"
    assert calibration_to_dict(found)["findings"] == []


def test_the_wand_alone_gives_cameras_and_the_scale(hall):
    found = calibrated(hall, WAND)
    sd_m = np.linalg.norm(found.adjustment.camera_sd[:, 3:6], axis=1)
    assert waving.misplaced_m(RIG, found.rig).max() < 3 * sd_m.max()
    assert sd_m.max() < 0.05
    assert calibration_to_dict(found)["findings"] == []


def test_all_sources_in_one_adjustment_are_better_than_each_alone(hall):
    both, court, wand = (calibrated(hall, tables) for tables in (COURT + WAND, COURT, WAND))
    assert set(calibration_to_dict(both)["sources"]) == {"court", "wand"}
    assert waving.misplaced_m(RIG, both.rig).max() < waving.misplaced_m(RIG, court.rig).max()
    assert np.abs(waving.focal_errors(RIG, both.rig)).max() < np.abs(waving.focal_errors(RIG, court.rig)).max()
    places = {
        name: np.linalg.norm(each.adjustment.camera_sd[:, 3:6], axis=1) for name, each in (("b", both), ("c", court))
    }
    assert (places["b"] < places["c"]).all()
    sds = [each.adjustment.camera_sd[:, 6] for each in (both, court, wand)]
    assert (sds[0] < sds[1]).all() and (sds[0] < 1.02 * sds[2]).all()
    assert off_m(both.rig) < 0.012


def test_three_clicked_points_set_the_world(hall):
    world = '[world]\npoints = "frame.csv"\norigin = "A"\nalong_x = "B"\nin_xy = "C"\n'
    found = calibrated(hall, WAND + world)
    assert off_m(found.adjustment.transform(RigidTransform.from_translation([0.5, 0.3, 0]))[0]) < 0.02


def test_a_throw_tells_which_way_is_up(hall):
    world = (
        f'[world]\npoints = "frame.csv"\norigin = "A"\nalong_x = "B"\nthrow = "throw_xypts.csv"\nrate_hz = {RATE_HZ}\n'
    )
    found = calibrated(hall, WAND + world)
    assert off_m(found.adjustment.transform(RigidTransform.from_translation([0.5, 0.3, 0]))[0]) < 0.03
    assert found.world.startswith("up from 1 throw: known to 0.")
    assert "lengths come out" not in found.world
    half = calibrated(hall, WAND + world.replace("= 50", "= 25"))
    assert "times as" in half.world


def test_the_command_writes_the_rig_and_says_how_good_it_is(hall, capsys):
    sources = written(hall, COURT + WAND, "command.toml")
    assert in_process("calibrate", sources, "-o", hall / "calib.toml") == 0
    assert off_m(read_rig(hall / "calib.toml")) < 0.012
    report = json.loads((hall / "calib_report" / "report.json").read_text())
    assert report["findings"] == []
    printed = capsys.readouterr().out
    assert "wand" in printed and "court" in printed


def test_one_table_needs_no_file_of_sources(hall, monkeypatch):
    monkeypatch.setattr(residual_figures, "write_residual_figures", lambda folder, _: folder.mkdir(exist_ok=True) or [])
    named = ",".join(f"{name}=1920x1080" for name in RIG.names)
    for table, options in (("court.csv", ("--court", "men", "--size", "1920x1080")), ("pair.csv", ("--wand", 0.6))):
        if options[0] == "--wand":
            px = waving.tracks(np.random.default_rng(6), RIG, 60, lengths_m=(0.6,)).px
            (hall / table).write_text(xypts(px))
            options = (*options, "--size", named)
        assert in_process("calibrate", hall / table, *options, "-o", hall / "short.toml") == 0
        assert waving.misplaced_m(RIG, read_rig(hall / "short.toml")).max() < 0.15


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--court", "men"), "--size is missing"),
        (("--court", "boys", "--size", "9x9"), "--court boys: expected men, women"),
        (("--court", "men", "--wand", "1", "--size", "9x9"), "go with one table each"),
        (("--wand", "1000", "--size", "1920x1080"), "metres, not millimetres"),
    ],
)
def test_wrong_options_are_answered_in_one_line(hall, options, said, capsys):
    table = "court.csv" if "--court" in options else "wand_xypts.csv"
    assert in_process("calibrate", hall / table, *options, "-o", hall / "no.toml") == 2
    complaint = capsys.readouterr().err
    assert re.search(said, complaint)
    assert len(complaint.strip().splitlines()) == 1


def test_a_wand_in_millimetres_is_refused(hall):
    with pytest.raises(CalibrationError, match=r"600 m long; .* metres, not millimetres"):
        calibrated(hall, WAND.replace("[0.6, 0.4]", "[600, 400]"))


def test_a_wand_of_another_length_contradicts_the_court(hall):
    found = calibrated(hall, COURT + WAND.replace("[0.6, 0.4]", "[1.8, 1.2]"))
    sentences = [each["sentence"] for each in calibration_to_dict(found)["findings"]]
    assert any("times as far apart by the wand as by the court" in sentence for sentence in sentences)
    assert "found: cameras are" in describe_calibration(found)


def test_names_of_left_and_right_exchanged_put_cameras_below_the_floor(hall, tmp_path):
    text = (hall / "court.csv").read_text()
    swapped = text.replace("left", "LEFT").replace("right", "left").replace("LEFT", "right")
    rows = [row for row in swapped.splitlines() if "net" not in row and "antenna" not in row]
    (tmp_path / "court.csv").write_text("\n".join(rows))
    report = calibration_to_dict(calibrated(tmp_path, COURT))
    kinds = {each["kind"] for each in report["findings"]}
    assert "mirrored" in kinds and "units" not in kinds
    assert not any("[start]" in each for each in report["warnings"])


def test_a_knocked_camera_is_named_by_the_report(hall, tmp_path):
    rng = np.random.default_rng(3)
    points = waving.wave_wand(rng, N, (0.6, 0.4))
    px = waving.observe(rng, RIG, points)
    turn = RigidTransform.from_rotation(Rotation.from_euler("y", 0.6, degrees=True))
    late = waving.observe(rng, type(RIG)(tuple(_rotate(camera, turn) for camera in RIG)), points)
    px[50:, :, 1] = late[50:, :, 1]
    (tmp_path / "wand_xypts.csv").write_text(xypts(px))
    (tmp_path / "court.csv").write_text((hall / "court.csv").read_text())
    findings = calibration_to_dict(calibrated(tmp_path, COURT + WAND))["findings"]
    moved = [each for each in findings if each["kind"] == "moved"]
    assert [each["cameras"] for each in moved] == [["cam2"]]
    assert "between frame 49 and frame 50" in moved[0]["sentence"]


def _rotate(camera, turn):
    return replace(camera, camera_from_world=turn * camera.camera_from_world)


def test_exchanged_columns_are_named_by_the_calibration_before(hall, tmp_path):
    rng = np.random.default_rng(4)
    px = waving.observe(rng, RIG, waving.wave_wand(rng, N, (0.6, 0.4)))[:, :, [0, 3, 2, 1]]
    (tmp_path / "wand_xypts.csv").write_text(xypts(px))
    (tmp_path / "truth.toml").write_text((hall / "truth.toml").read_text())
    start = '[start]\nfile = "truth.toml"\n'
    try:
        sentences = [each["sentence"] for each in calibration_to_dict(calibrated(tmp_path, start + WAND))["findings"]]
    except CalibrationError as error:
        sentences = [str(error)]
    assert any("the files of cam2 and cam4 are swapped" in sentence for sentence in sentences)


def test_a_court_with_another_net_fits_badly_and_this_is_said(hall):
    assert not [each for each in calibration_to_dict(calibrated(hall, COURT))["findings"] if each["kind"] == "misfit"]
    wrong = calibration_to_dict(calibrated(hall, COURT.replace("men", "women")))["findings"]
    assert any("court: the points fit to" in each["sentence"] and "another net" in each["sentence"] for each in wrong)
