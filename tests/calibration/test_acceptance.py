"""A calibration that predicts absurdly, or that cannot be read back, gets another name."""

import re
from dataclasses import replace

import numpy as np
import pytest

import airborne
from airborne import cli
from airborne.calibration.acceptance import CalibrationErrors, write_accepted
from airborne.cameras import Rig, read_rig
from airborne.errors import AirborneError, CalibrationError
from tests.support.cameras import three_cameras
from tests.support.commands import in_process

RIG = three_cameras()
ERRORS = dict.fromkeys(RIG.names, 0.5)
GOOD = {name: np.full(20, 0.7) for name in RIG.names}


def test_a_good_calibration_is_written_under_its_name(tmp_path):
    written, reasons = write_accepted(tmp_path / "calib.toml", RIG, CalibrationErrors(ERRORS, GOOD))
    assert (written, reasons) == (tmp_path / "calib.toml", ())
    assert [path.name for path in tmp_path.iterdir()] == ["calib.toml"]
    assert read_rig(written).names == RIG.names


def test_an_absurd_left_out_error_is_named_and_the_old_file_stays(tmp_path):
    (tmp_path / "calib.toml").write_text("an older one")
    absurd = GOOD | {RIG.names[1]: np.r_[np.full(14, 0.5), np.full(6, 300.0)]}
    written, reasons = write_accepted(tmp_path / "calib.toml", RIG, CalibrationErrors(ERRORS, absurd))
    assert written == tmp_path / "calib.rejected.toml" and written.exists()
    assert (tmp_path / "calib.toml").read_text() == "an older one"
    assert len(reasons) == 1 and reasons[0].startswith(f"{RIG.names[1]}: what is left out of the fit lies 164 px")


def test_a_few_wrong_clicks_and_errors_that_are_unknown_are_no_reason(tmp_path):
    some = np.r_[np.full(17, 0.5), np.full(3, 300.0)]
    unknown = np.full(20, np.nan)
    held_out_px = dict(zip(RIG.names, (some, unknown, some), strict=True))
    assert write_accepted(tmp_path / "calib.toml", RIG, CalibrationErrors(ERRORS, held_out_px))[1] == ()


def test_one_point_that_spoils_a_fit_of_least_squares_is_a_reason(tmp_path):
    residual_px = {name: np.full((20, 2), 0.5) for name in RIG.names}
    residual_px[RIG.names[0]][3] = (90.0, 0.0)
    residual_px[RIG.names[1]][4] = np.nan
    written, reasons = write_accepted(tmp_path / "calib.toml", RIG, CalibrationErrors(ERRORS, GOOD, residual_px))
    assert written.name == "calib.rejected.toml"
    assert len(reasons) == 1 and reasons[0].startswith(f"{RIG.names[0]}: a control point lies 90 px from where")
    missed = CalibrationErrors(ERRORS, GOOD, residual_px, [f"P{k}" for k in range(20)])
    assert "that miss most (P3 by 90 px, P" in write_accepted(tmp_path / "calib.toml", RIG, missed)[1][0]


@pytest.mark.parametrize(
    ("output", "said"),
    [
        ("points.csv", "is what the cameras are calibrated from"),
        ("notes.txt", "give a name that ends with .toml"),
        ("none/calib.toml", "there is no folder"),
        ("trial.toml", "exists and is not a calibration"),
    ],
)
def test_no_other_file_is_written_over(tmp_path, monkeypatch, capsys, output, said):
    names = ("points.csv", "notes.txt", "trial.toml")
    for name in names:
        (tmp_path / name).write_text("mine")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["airborne", "calibrate", "points.csv", "--size", "640x480", "-o", output])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 2
    assert said in " ".join(capsys.readouterr().err.split())
    assert [(tmp_path / name).read_text() for name in names] == ["mine"] * 3


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("points.csv", "--size", "640x480", "--fisheye"), "--fisheye goes with --board"),
        (("points.csv", "--size", "640x480", "--timestamps", "points.csv"), "--timestamps goes with --board"),
        (
            ("points.csv", "--size", "640x480", "--court", "men", "--method", "annealing"),
            "--method annealing goes with",
        ),
        (("sources.toml", "--method", "annealing"), "--method annealing goes with a table"),
        (("points.csv", "--size", "640x480", "-o", "calib.yml"), "give a name that ends with .toml"),
    ],
)
def test_options_that_would_be_ignored_are_refused(tmp_path, monkeypatch, capsys, words, said):
    for name in ("points.csv", "sources.toml"):
        (tmp_path / name).write_text("mine")
    monkeypatch.chdir(tmp_path)
    assert in_process("calibrate", *words, *(() if "-o" in words else ("-o", "calib.toml"))) == 2
    assert said in " ".join(capsys.readouterr().err.split())


def test_a_video_that_is_given_twice_is_named(tmp_path, monkeypatch, capsys):
    for name in ("a.mp4", "b.mp4"):
        (tmp_path / name).write_bytes(b"the same")
    (tmp_path / "board.toml").write_text("columns = 5")
    monkeypatch.chdir(tmp_path)
    words = ("calibrate", "--board", "board.toml", "a.mp4", "b.mp4", "-o", "calib.toml")
    monkeypatch.setattr("sys.argv", ["airborne", *words])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 2
    assert "a.mp4 and b.mp4 are the same video" in " ".join(capsys.readouterr().err.split())


def write_mixed_up(thrown_cross, path):
    """Write the example's control points with two of them mixed up in one camera."""
    rows = [line.split(",") for line in (thrown_cross / "control_points.csv").read_text().splitlines()]
    u = rows[0].index("cam2_u")
    one, other = (next(row for row in rows if row[0] == name) for name in ("P13", "P14"))
    one[u : u + 2], other[u : u + 2] = other[u : u + 2], one[u : u + 2]
    path.write_text("\n".join(map(",".join, rows)) + "\n")


@pytest.mark.parametrize("words", [("check",), ("track", "-o", "run", "--no-pictures")])
def test_no_trial_is_tracked_with_two_points_mixed_up(thrown_cross, tmp_path, capsys, monkeypatch, words):
    for path in thrown_cross.iterdir():
        (tmp_path / path.name).symlink_to(path)
    (tmp_path / "control_points.csv").unlink()
    write_mixed_up(thrown_cross, tmp_path / "control_points.csv")
    monkeypatch.chdir(tmp_path)
    assert in_process(words[0], "trial.toml", *words[1:]) == 2
    assert re.search(r"'P1[34]' misses by .*'P1[34]' misses by", capsys.readouterr().err)
    assert not (tmp_path / "run").exists()


def test_two_points_mixed_up_are_named_by_the_python_interface(thrown_cross, tmp_path):
    write_mixed_up(thrown_cross, tmp_path / "mixed.csv")
    with pytest.raises(CalibrationError, match=r"'P1[34]' misses by .*'P1[34]' misses by"):
        airborne.calibrate(tmp_path / "mixed.csv", sizes=(768, 576))
    with pytest.raises(AirborneError, match=r"expected .width, height. in pixels"):
        airborne.calibrate(tmp_path / "mixed.csv", sizes=768)


def test_what_our_reader_refuses_is_rejected(tmp_path):
    far = Rig(tuple(replace(c, camera_from_world=c.camera_from_world) for c in RIG))
    scaled = Rig(tuple(_far(camera, 1000.0) for camera in far))
    written, reasons = write_accepted(tmp_path / "calib.toml", scaled, CalibrationErrors(ERRORS, GOOD))
    assert written.name == "calib.rejected.toml"
    assert "m apart at most: give lengths in metres" in reasons[0]


def _far(camera, scale):
    from scipy.spatial.transform import RigidTransform

    old = camera.camera_from_world
    return replace(camera, camera_from_world=RigidTransform.from_components(scale * old.translation, old.rotation))


def test_points_of_other_cameras_end_with_exit_code_1_and_another_file(tmp_path, monkeypatch, capsys):
    rng = np.random.default_rng(0)
    world, px = rng.uniform(-1, 1, (30, 3)), rng.uniform(5, 630, (30, 2))
    rows = [
        f"P{i},{x:.4f},{y:.4f},{z:.4f},{u:.2f},{v * 0.7:.2f}"
        for i, ((x, y, z), (u, v)) in enumerate(zip(world, px, strict=True))
    ]
    (tmp_path / "points.csv").write_text("\n".join(["point,x_m,y_m,z_m,cam_u,cam_v", *rows]))
    argv = ["airborne", "calibrate", str(tmp_path / "points.csv"), "--size", "640x480", "-o", str(tmp_path / "c.toml")]
    monkeypatch.setattr("sys.argv", argv)
    said = []  # on either stream
    monkeypatch.setattr("airborne.cli.calibrate.errors.print", lambda text, **_: said.append(text))
    monkeypatch.setattr("builtins.print", said.append)
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    *rejection, result = said
    assert all(text.startswith("airborne: ") for text in rejection)
    assert "do not measure with this calibration" in rejection[-1]
    assert result.startswith("camera ")
    assert not (tmp_path / "c.toml").exists()
    assert stopped.value.code == 1 and (tmp_path / "c.rejected.toml").exists(), capsys.readouterr().err


def test_a_path_that_cannot_be_written_is_named_as_it_was_asked_for(tmp_path, monkeypatch):
    def refuse(path, *_, **__):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr("airborne.calibration.acceptance.write_pose2sim", refuse)
    with pytest.raises(PermissionError) as caught:
        write_accepted(tmp_path / "calib.toml", RIG, CalibrationErrors(ERRORS, GOOD))
    assert caught.value.filename == str(tmp_path / "calib.toml")
