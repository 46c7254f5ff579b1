"""`airborne convert`: what goes in comes out in the other format, and losses are reported."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from airborne import cli
from airborne.cameras import Rig, read_detections, read_rig, write_pose2sim, write_rig
from airborne.errors import AirborneError
from airborne.export.conversion import FORMATS, ConversionOptions, convert
from tests.support.cameras import LENS, three_cameras
from tests.support.format_rigs import assert_same


@pytest.fixture
def airborne(monkeypatch, capsys):
    """Run a command line; return the exit code, what it printed, and its complaint."""

    def run(*words):
        monkeypatch.setattr("sys.argv", ["airborne", *map(str, words)])
        with pytest.raises(SystemExit) as left:
            cli.main()
        printed = capsys.readouterr()
        return left.value.code or 0, printed.out, " ".join(printed.err.split())

    return run


def test_every_calibration_format_becomes_every_other(tmp_path, airborne):
    plain = three_cameras()
    kinds = [kind for kind in FORMATS if kind not in ("digitised", "dltdv", "npz", "openpose")]
    for kind in kinds:
        write_rig(tmp_path / kind, plain, format=kind)
        size = ("--size", "768x576") if kind == "dlt" else ()
        for other in kinds:
            out = tmp_path / f"{kind} to {other}"
            code, output, complaint = airborne("convert", tmp_path / kind, out, "--to", other, *size)
            assert (code, complaint) == (0, "")
            assert output.startswith(f"read: {tmp_path / kind}, ")
            result = read_rig(out, size=(768, 576) if other == "dlt" else None)
            assert_same(result, plain, with_names="dlt" not in (kind, other) and "caliscope" not in (kind, other))


def test_the_name_of_the_file_says_the_format_and_what_is_lost_is_reported(tmp_path, airborne):
    write_rig(tmp_path / "calib.toml", three_cameras(LENS))
    code, output, _ = airborne("convert", tmp_path / "calib.toml", tmp_path / "rig.xcp")
    assert code == 0
    assert output.splitlines()[1:] == [
        f"written: {tmp_path / 'rig.xcp'}, vicon",
        "not in the new file: tangential distortion of left, right, side",
    ]
    _, output, _ = airborne("convert", tmp_path / "calib.toml", tmp_path / "d.csv", "--to-origin", "lower-left")
    assert f"written: {tmp_path / 'd.csv'}, dlt, lengths in m, pixels from the lower-left, the first is 1\n" in output


def test_reprojection_errors_stay_or_are_said_to_be_lost(tmp_path, airborne):
    rig, path = three_cameras(), tmp_path / "calib.toml"
    write_pose2sim(path, rig, errors_px={name: 0.25 + 0.5 * k for k, name in enumerate(rig.names)})
    assert "not in the new file" not in airborne("convert", path, tmp_path / "again.toml")[1]
    errors = [line for line in path.read_text().splitlines() if line.startswith("error")]
    assert [line for line in (tmp_path / "again.toml").read_text().splitlines() if line.startswith("error")] == errors
    assert len(errors) == 4  # each camera's, and the whole rig's
    assert "the cameras' reprojection errors" in airborne("convert", path, tmp_path / "calib.qca.txt")[1]


def test_coefficients_from_below_need_their_origin(tmp_path, airborne):
    write_rig(tmp_path / "calib.toml", three_cameras())
    airborne("convert", tmp_path / "calib.toml", tmp_path / "d.csv", "--to-origin", "lower-left", "--to-unit", "mm")
    wanted = ("convert", tmp_path / "d.csv", tmp_path / "back.toml", "--size", "768x576", "--unit", "mm")
    code, _, complaint = airborne(*wanted)
    assert code == 2
    assert "look away from each other; is it --origin lower-left" in complaint
    code, *_ = airborne(*wanted, "--origin", "lower-left")
    assert code == 0
    assert_same(read_rig(tmp_path / "back.toml"), three_cameras(), with_names=False)


def test_clicked_points_go_to_dltdv_and_back(tmp_path, thrown_cross, airborne):
    ours, names = thrown_cross / "digitised.csv", ("--cameras", "cam1,cam2,cam3")
    below, size = ("--to-origin", "lower-left"), ("--size", "768x576")
    assert airborne("convert", ours, tmp_path / "a_xypts.csv", *names, *below, *size)[0] == 0
    assert airborne("convert", tmp_path / "a_xypts.csv", tmp_path / "b.csv", "--origin", "lower-left", *size)[0] == 0
    first, second = (np.genfromtxt(path, delimiter=",", skip_header=1) for path in (ours, tmp_path / "b.csv"))
    np.testing.assert_allclose(first, second, atol=1e-9)


def test_a_calibration_triangulates_clicked_points(tmp_path, thrown_cross, airborne):
    calib = ("--calibration", thrown_cross / "calib_true.toml")
    code, output, _ = airborne("convert", thrown_cross / "digitised.csv", tmp_path / "a_xypts.csv", *calib)
    assert code == 0
    assert "a_xyzres.csv" in output
    residual = float(output.split("median residual of ")[1].split(" px")[0])
    assert 0.5 < residual < 3  # clicks of 1.2 px
    assert "names: pt1 to pt4 for long_minus, long_plus, short_minus, short_plus" in output
    positions = np.genfromtxt(tmp_path / "a_xyzpts.csv", delimiter=",", skip_header=1).reshape(-1, 4, 3)
    lengths = np.linalg.norm(positions[:, 0] - positions[:, 1], axis=-1)
    assert np.nanstd(lengths) < 0.05 * np.nanmean(lengths)  # a bar stays as long as it is


def test_a_wrong_origin_shows_as_a_large_residual(tmp_path, thrown_cross, airborne):
    calib = ("--calibration", thrown_cross / "calib_true.toml")
    airborne("convert", thrown_cross / "digitised.csv", tmp_path / "a_xypts.csv", *calib)
    _, output, _ = airborne("convert", tmp_path / "a_xypts.csv", tmp_path / "b.csv", *calib)
    assert "median residual" in output and "this is large" not in output
    _, output, _ = airborne("convert", tmp_path / "a_xypts.csv", tmp_path / "b.csv", *calib, "--origin", "lower-left")
    assert "this is large: are --origin" in output


def test_an_implausible_unit_is_questioned(tmp_path, airborne):
    write_rig(tmp_path / "calib.toml", three_cameras())
    write_rig(tmp_path / "mm.csv", three_cameras(), unit="mm")
    to = tmp_path / "out.toml"
    assert "is --unit mm right?" in airborne("convert", tmp_path / "calib.toml", to, "--unit", "mm")[1]
    assert "is --unit m right?" in airborne("convert", tmp_path / "mm.csv", to, "--unit", "m", "--size", "768x576")[1]
    assert "right?" not in airborne("convert", tmp_path / "mm.csv", to, "--unit", "mm", "--size", "768x576")[1]


OTHERS = {  # what is in a file that is not converted, and what the line says
    "control.csv": ("point,x_m,y_m,z_m,a_u,a_v\nP,1,2,3,4,5\n", "control points or a court's points"),
    "truth.csv": ("field,time_s,x_m\n0,0,1\n", "a table of motion"),
    "trial.toml": ('name = "x"\n[[camera]]\nname = "a"\n[body]\nfile = "b"\n', "a trial file"),
    "sources.toml": ('[[camera]]\nname = "a"\n', "a file of sources"),
    "body.toml": ('[[segment]]\nname = "a"\n', "a body file"),
    "words": ("some words\n", "(it begins with 'some words'); expected Pose2Sim"),
    "empty.toml": ("", "is empty; expected Pose2Sim"),
    "junk.npz": ("\0\1\2\xff", "expected Pose2Sim"),
    "board.toml": ("columns = 4\nrows = 5\n", "has no cameras (found columns, rows)"),
    "run/run.json": ("{}", "a run's folder, which `airborne export` hands on"),
}


@pytest.mark.parametrize("name", OTHERS)
def test_another_file_is_answered_with_what_it_looks_like(tmp_path, airborne, name):
    text, complaint = OTHERS[name]
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(text.encode("latin-1"))
    code, output, calls = airborne("convert", path.parent if name == "run/run.json" else path, tmp_path / "out.toml")
    assert (code, output) == (2, "")
    assert complaint in calls
    assert not (tmp_path / "out.toml").exists()


def test_a_camera_may_be_called_camera(tmp_path, airborne):
    rig = three_cameras()
    write_rig(tmp_path / "calib.toml", Rig((replace(rig.cameras[0], name="camera"), *rig.cameras[1:])))
    assert airborne("convert", tmp_path / "calib.toml", tmp_path / "out.xcp")[0] == 0


def test_detections_go_to_openpose_and_back(tmp_path, shared_data, airborne):
    source = shared_data("balance") / "detections_2d.npz"
    assert airborne("convert", source, tmp_path / "pose")[0] == 0
    assert airborne("convert", tmp_path / "pose", tmp_path / "back.npz")[0] == 0
    cameras = ("c01", "c02", "c03", "c04")
    first, second = read_detections(source, cameras), read_detections(tmp_path / "back.npz", cameras)
    np.testing.assert_array_equal(first.px, second.px)
    np.testing.assert_array_equal(first.visibility, second.visibility)


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("calib.toml", "x.txt"), "the file name does not tell the format"),
        (("calib.toml", "x.toml", "--origin", "lower-left"), "--origin does not apply to a pose2sim file to read"),
        (("calib.toml", "x.toml", "--to-unit", "mm"), "--to-unit does not apply to a pose2sim file to write"),
        (("calib.toml", "x.npz", "--to", "npz"), "holds cameras, which cannot be written as npz"),
        (("calib.toml", "x.toml", "--to", "bvh"), "--to bvh: no such format"),
        (("clicks.csv", "x_xypts.csv"), "say which cameras its columns are of: --cameras"),
        (("clicks.csv", "x.toml", "--cameras", "a"), "give a name ending in xypts.csv, .csv or .npz"),
        (("clicks.csv", "x.toml", "--cameras", "a", "--to", "vicon"), "holds points in images, not cameras"),
        (("none.toml", "x.toml"), "none.toml cannot be read"),
        (("coefficients.csv", "x.toml"), "does not say how large the images of 'cam1' are; give --size"),
        (("coefficients.csv", "x.toml", "--size", "768"), "--size 768: expected WIDTHxHEIGHT"),
    ],
)
def test_impossible_conversions_are_refused(tmp_path, monkeypatch, airborne, words, complaint):
    monkeypatch.chdir(tmp_path)
    write_rig(tmp_path / "calib.toml", three_cameras())
    write_rig(tmp_path / "coefficients.csv", three_cameras())
    (tmp_path / "clicks.csv").write_text("frame,p_a_u,p_a_v\n0,1,2\n")
    code, _, output = airborne("convert", *words)
    assert code == 2
    assert complaint in output
    assert not list(tmp_path.glob("x*"))


def test_a_file_is_not_written_over_itself(tmp_path, thrown_cross):
    path = shutil.copy(thrown_cross / "calib_true.toml", tmp_path / "calib.toml")
    with pytest.raises(AirborneError, match="is the file that is read"):
        convert(path, tmp_path / "." / "calib.toml", ConversionOptions())
    assert path.read_bytes() == (thrown_cross / "calib_true.toml").read_bytes()
