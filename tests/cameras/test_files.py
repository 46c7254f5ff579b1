from dataclasses import replace

import cv2
import numpy as np
import pytest

from airborne.cameras import Rig, read_rig, write_pose2sim
from airborne.errors import CalibrationError
from tests.support.cameras import LENS, scattered, three_cameras
from tests.support.tolerances import EXACT, ROUNDTRIP

TOML = """
[left]
name = "cam one"
size = [ 768.0, 576.0]
matrix = [ [ 1000.0, 0.0, 383.5], [ 0.0, 1000.0, 287.5], [ 0.0, 0.0, 1.0]]
distortions = [ 0.1, 0.2, 0.3, 0.4]
rotation = [ 0.0, 0.0, 0.0]
translation = [ 1.0, 2.0, 3.0]
fisheye = false

[capture_volume]
points = 3
[metadata]
adjusted = false
error = 0.0
"""

QUALISYS = """<?xml version='1.0' encoding='ASCII'?>
<calibration type="regular"><cameras><camera model="none" serial="cam01">
<fov_video bottom="575" left="0" right="767" top="0"/>
<transform r11="1" r12="0" r13="0" r21="0" r22="1" r23="0" r31="0" r32="0" r33="1" x="1000" y="0" z="0"/>
<intrinsic centerPointU="24544" centerPointV="18400" focalLengthU="64000" focalLengthV="64000"
 radialDistortion1="0.64" radialDistortion2="0" radialDistortion3="0" skew="0"
 tangentalDistortion1="0" tangentalDistortion2="0"/></camera></cameras></calibration>
"""


def written(tmp_path, content, name="calibration"):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def test_a_pose2sim_file_is_read_by_name_without_its_other_tables(tmp_path):
    [camera] = read_rig(written(tmp_path, TOML))
    assert camera.name == "cam one"
    assert camera.size == (768, 576)
    assert np.array_equal(camera.distortion, [0.1, 0.2, 0.3, 0.4, 0])
    assert np.allclose(camera.centre, [-1, -2, -3], atol=EXACT)


def test_a_camera_without_a_name_has_its_key(tmp_path):
    assert read_rig(written(tmp_path, TOML.replace('name = "cam one"', ""))).names == ("left",)


def test_the_bundled_rig_sees_the_middle_of_its_images(thrown_cross):
    rig = read_rig(thrown_cross / "calib_true.toml")
    assert rig.names == ("cam1", "cam2", "cam3")
    for camera in rig:
        assert np.all(np.abs(camera.px_from_world(np.array([0, 0, 1.5])) - [383.5, 287.5]) < 100)


def test_the_two_files_of_the_balance_trial_describe_the_same_cameras(shared_data):
    folder = shared_data("balance")
    qualisys, pose2sim = read_rig(folder / "Calib.qca.txt"), read_rig(folder / "Pose2Sim_cameras.toml")
    assert qualisys.names == ("cam01", "cam02", "cam03", "cam04")
    assert pose2sim.names == ("cam_01", "cam_02", "cam_03", "cam_04")
    points = scattered(20) * [0.5, 0.5, 1]
    picture = np.mgrid[0:1088:16, 0:1920:16].reshape(2, -1).T
    for ours, theirs in zip(qualisys, pose2sim, strict=True):
        assert ours.size == theirs.size == (1088, 1920)
        assert np.allclose(ours.K, theirs.K, rtol=EXACT)
        assert np.allclose(ours.distortion, 64 * theirs.distortion, atol=EXACT)  # it divides what has no unit
        assert np.allclose(ours.centre, theirs.centre, atol=EXACT)
        straight = ours.without_distortion().px_from_world(points)
        assert np.allclose(straight, theirs.without_distortion().px_from_world(points), atol=1e3 * ROUNDTRIP)
        apart = np.linalg.norm(ours.undistort_px(picture) - theirs.undistort_px(picture), axis=1)
        assert 1.8 < np.sqrt(np.mean(apart**2)) < 2.2  # pixels, from that division alone


def test_images_of_a_board_bear_out_the_distortion_of_the_qualisys_file(shared_data):
    """Corners 60 mm apart fit better with the terms as written than with a 64th of them."""
    folder = shared_data("balance")
    camera = read_rig(folder / "Calib.qca.txt")["cam01"]
    grid = np.zeros((28, 3), np.float32)
    grid[:, :2] = 0.06 * np.mgrid[:4, :7].T.reshape(-1, 2)
    found = []
    for path in sorted((folder / "board" / "int_cam01_img").glob("*.jpg")):
        picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        is_found, corners = cv2.findChessboardCorners(picture, (4, 7), flags=cv2.CALIB_CB_FAST_CHECK)
        if is_found:
            found.append(cv2.cornerSubPix(picture, corners, (9, 9), (-1, -1), (3, 50, 1e-4)))
    fixed = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_TANGENT_DIST
    fixed |= cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3
    as_written, divided = (
        cv2.calibrateCamera([grid] * len(found), found, camera.size, camera.K.copy(), distortion, flags=fixed)[0]
        for distortion in (camera.distortion, camera.distortion / 64)
    )
    assert len(found) >= 4
    assert as_written < 0.9 * divided


@pytest.mark.parametrize("distortion", [None, LENS, LENS * [1, 1, 1, 1, 0]])
def test_a_written_rig_comes_back(tmp_path, distortion):
    rig = three_cameras(distortion)
    named = Rig((replace(rig["left"], name='odd "näme" 1'), *rig.cameras[1:]))
    write_pose2sim(tmp_path / "calib.toml", named)
    back = read_rig(tmp_path / "calib.toml")
    assert back.names == ('odd "näme" 1', "right", "side")
    for ours, theirs in zip(named, back, strict=True):
        assert ours.size == theirs.size
        assert np.array_equal(ours.K, theirs.K)
        assert np.array_equal(ours.distortion, theirs.distortion)
        assert np.allclose(ours.P, theirs.P, rtol=ROUNDTRIP, atol=1e3 * ROUNDTRIP)


def test_a_fifth_distortion_term_is_written_only_where_there_is_one(tmp_path):
    write_pose2sim(tmp_path / "four.toml", three_cameras())
    write_pose2sim(tmp_path / "five.toml", three_cameras(LENS))
    assert "distortions = [0.0, 0.0, 0.0, 0.0]\n" in (tmp_path / "four.toml").read_text()
    assert "-0.01]\n" in (tmp_path / "five.toml").read_text()


def test_the_real_error_is_written_and_no_other(tmp_path):
    write_pose2sim(tmp_path / "with.toml", three_cameras(), errors_px={"left": 3.0, "right": 4.0, "side": 0.0})
    write_pose2sim(tmp_path / "without.toml", three_cameras())
    text = (tmp_path / "with.toml").read_text()
    assert "error = 4.0\n" in text
    assert f"error = {(25 / 3) ** 0.5}\n" in text
    assert "error" not in (tmp_path / "without.toml").read_text()


def test_files_are_told_apart_by_content_not_by_name(tmp_path):
    assert read_rig(written(tmp_path, QUALISYS, "calibration.toml")).names == ("cam01",)
    assert read_rig(written(tmp_path, TOML, "calibration.qca.txt")).names == ("cam one",)


def test_a_qualisys_camera_looks_down_its_own_negative_z(tmp_path):
    [camera] = read_rig(written(tmp_path, QUALISYS))
    assert np.allclose(camera.centre, [1, 0, 0], atol=EXACT)
    assert np.allclose(camera.px_from_world(np.array([1.0, 0.0, -2.0])), [383.5, 287.5], atol=ROUNDTRIP)
    assert camera.px_from_world(np.array([1.0, 0.5, -2.0]))[1] < 287.5
    assert np.array_equal(camera.K[:2, :2], 1000 * np.eye(2))
    assert camera.distortion[0] == 0.64


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "is empty; expected Pose2Sim"),
        ("[metadata]\nerror = 0\n", "has no cameras"),
        ("title = 'x'\n", "has no cameras"),
        (b"\xff\xfe\x00", "is not a text file"),
        ("just words", "(it begins with 'just words'); expected Pose2Sim"),
        (TOML.replace("false", "true").replace(", 0.4]", "]"), "distortions = [0.1, 0.2, 0.3], expected 4 numbers"),
        (TOML.replace("matrix", "matrx"), "[left]: no matrix; expected 3×3 numbers"),
        (TOML.replace("[ 0.0, 0.0, 1.0]]", "]"), "expected 3×3 numbers"),
        (TOML.replace("1000.0", "-1000.0"), "with positive fx and fy"),
        (TOML.replace("768.0", "nan"), "size = [nan, 576.0], expected 2 numbers"),
        (TOML.replace("768.0", "768.5"), "expected width and height in whole pixels"),
        (TOML.replace(", 0.4]", "]"), "distortions = [0.1, 0.2, 0.3], expected 4 or 5 or 8 numbers"),
        (TOML.replace("[ 1.0, 2.0, 3.0]", '"far"'), "translation = far, expected 3 numbers"),
        (TOML.replace("[ 1.0, 2.0, 3.0]", "[1, 2]"), "translation = [1, 2], expected 3 numbers"),
        (TOML.replace("[capture", TOML.split("[capture")[0].replace("left", "right") + "[capture"), "share a name"),
        ("<html></html>", "is XML with the root <html>; expected Pose2Sim"),
        (QUALISYS[:200], "is not a calibration: as XML"),
        (QUALISYS.replace("transform", "transfrom"), "camera 'cam01': no <transform>"),
        (QUALISYS.replace('r12="0"', ""), "r12 of <transform> is missing, expected a number"),
        (QUALISYS.replace('r12="0"', 'r12="zero"'), "r12 of <transform> is 'zero', expected a number"),
        (QUALISYS.replace('r12="0"', 'r12="0.5"'), "r11..r33 is not a rotation"),
        (QUALISYS.replace('"64000"', '"0"'), "must be positive"),
        (QUALISYS.replace('"none"', '"fisheye"'), "a fisheye lens, whose terms Qualisys does not publish"),
    ],
)
def test_a_malformed_file_is_reported_in_one_line(tmp_path, content, message):
    with pytest.raises(CalibrationError) as error:
        read_rig(written(tmp_path, content))
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(CalibrationError, match=r"none\.toml cannot be read"):
        read_rig(tmp_path / "none.toml")
