"""What we write, others read: their own readers, or the format's formula written out by hand, give our pixels.

Pose2Sim's, aniposelib's and Caliscope's readers are an extra: `pip install --no-deps pose2sim aniposelib caliscope` and
`pip install airborne[readers]`; without them these tests are skipped.
"""

import warnings
from dataclasses import replace
from xml.etree import ElementTree

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.cameras import PixelConvention, Rig, read_rig, write_rig
from airborne.errors import CalibrationError
from tests.cameras.formats.test_round_trips import FISHEYE_LENS, fisheye_rig
from tests.support.cameras import LENS, three_cameras
from tests.support.format_rigs import assert_same, visible_points
from tests.support.tolerances import ROUNDTRIP

PX = 1e3 * ROUNDTRIP  # of pixels that count in hundreds
RIG = three_cameras(LENS)
POINTS = visible_points(RIG)


def imported(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip(
            name, reason=f"{name} is not installed: see the head of this file", exc_type=ImportError
        )


def opencv_px(K, distortion, rotation, translation, points=POINTS):
    """OpenCV's own projection (n, 2) [px]."""
    given = (np.asarray(rotation, float), np.asarray(translation, float), np.asarray(K, float))
    return cv2.projectPoints(points, *given, np.asarray(distortion, float))[0][:, 0]


@pytest.mark.parametrize("distortion", [None, LENS, LENS * [1, 1, 1, 1, 0]])
def test_pose2sim_reads_our_pose2sim_file(tmp_path, distortion):
    common = imported("Pose2Sim.common")
    rig = three_cameras(distortion)
    write_rig(tmp_path / "calib.toml", rig, errors_px={"left": 0.5, "right": 0.4, "side": 0.3})
    read = common.retrieve_calib_params(tmp_path / "calib.toml")
    for k, camera in enumerate(rig):
        assert tuple(read["S"][k]) == camera.size
        found = opencv_px(read["K"][k], read["dist"][k], read["R"][k], read["T"][k])
        np.testing.assert_allclose(found, camera.px_from_world(POINTS), atol=PX)
    np.testing.assert_allclose(common.computeP(tmp_path / "calib.toml"), rig.P, rtol=ROUNDTRIP, atol=PX)


@pytest.mark.parametrize("rig", [RIG, fisheye_rig()], ids=["brown", "fisheye"])
def test_aniposelib_reads_our_aniposelib_file_and_we_its(tmp_path, rig):
    group = imported("aniposelib.cameras").CameraGroup
    write_rig(tmp_path / "ours.toml", rig, format="aniposelib", unit="mm")
    read = group.load(tmp_path / "ours.toml")
    assert tuple(read.get_names()) == rig.names
    px = np.stack([camera.px_from_world(POINTS) for camera in rig])
    np.testing.assert_allclose(read.project(1e3 * POINTS), px, atol=PX)
    read.dump(tmp_path / "theirs.toml")
    assert_same(read_rig(tmp_path / "theirs.toml", unit="mm"), rig)


def test_twelve_cameras_keep_their_order_in_aniposelib(tmp_path):
    group = imported("aniposelib.cameras").CameraGroup
    rig = Rig(tuple(replace(RIG["left"], name=f"cam_{k}") for k in range(12)))
    write_rig(tmp_path / "calib.toml", rig, format="aniposelib")
    assert tuple(group.load(tmp_path / "calib.toml").get_names()) == rig.names


@pytest.mark.parametrize("rig", [RIG, fisheye_rig()], ids=["brown", "fisheye"])
def test_caliscope_reads_our_caliscope_file_and_we_its(tmp_path, rig):
    array = imported("caliscope.cameras.camera_array").CameraArray
    write_rig(tmp_path / "ours.toml", rig, format="caliscope", errors_px=dict.fromkeys(rig.names, 0.4))
    read = array.from_toml(tmp_path / "ours.toml")
    for number, camera in enumerate(rig):
        theirs = read.cameras[number]
        assert theirs.size == camera.size
        assert theirs.fisheye is (camera.lens == "fisheye")
        assert theirs.error == 0.4
        np.testing.assert_allclose(theirs.matrix, camera.K)
        np.testing.assert_allclose(theirs.distortions, camera.distortion)
        np.testing.assert_allclose(theirs.transformation[:3], camera.camera_from_world.as_matrix()[:3], atol=ROUNDTRIP)
    for name, write in (("own", read.to_toml), ("aniposelib", read.to_aniposelib_toml)):
        write(tmp_path / f"{name}.toml")
        found = read_rig(tmp_path / f"{name}.toml")
        assert found.names == ("cam_0", "cam_1", "cam_2")
        assert_same(found, rig, with_names=False)


def test_the_recorded_caliscope_session_reads_as_caliscope_reads_it(shared_data):
    array = imported("caliscope.cameras.camera_array").CameraArray
    path = shared_data("charuco") / "camera_array.toml"
    theirs = array.from_toml(path).cameras
    for number, camera in enumerate(read_rig(path)):
        np.testing.assert_allclose(camera.P, theirs[number].matrix @ theirs[number].transformation[:3], rtol=ROUNDTRIP)


def test_opencv_reads_our_yaml(tmp_path):
    write_rig(tmp_path / "rig.yml", RIG)
    storage = cv2.FileStorage(str(tmp_path / "rig.yml"), cv2.FILE_STORAGE_READ)
    names = storage.getNode("names")
    assert [names.at(k).string() for k in range(names.size())] == list(RIG.names)
    for name in RIG.names:
        K, distortion, R, T = (storage.getNode(f"{key}_{name}").mat() for key in ("K", "dist", "R", "T"))
        np.testing.assert_allclose(opencv_px(K, distortion, R, T), RIG[name].px_from_world(POINTS), atol=PX)
        np.testing.assert_allclose(cv2.Rodrigues(R)[0], storage.getNode(f"Rot_{name}").mat(), atol=ROUNDTRIP)
        assert (storage.getNode(f"W_{name}").real(), storage.getNode(f"H_{name}").real()) == RIG[name].size
    storage.release()


def test_we_read_what_opencv_writes(tmp_path):
    for half, keys in {"intri": ("K", "dist"), "extri": ("R", "T")}.items():
        storage = cv2.FileStorage(str(tmp_path / f"{half}.yml"), cv2.FILE_STORAGE_WRITE)
        storage.startWriteStruct("names", cv2.FileNode_SEQ)
        for name in RIG.names:
            storage.write("", name)
        storage.endWriteStruct()
        for camera in RIG:
            place = camera.camera_from_world
            values = {"K": camera.K, "dist": camera.distortion[None], "T": place.translation[:, None]}
            values["R"] = place.rotation.as_rotvec()[:, None]
            for key in keys:
                storage.write(f"{key}_{camera.name}", values[key])
        storage.release()
    for path in (tmp_path, tmp_path / "intri.yml"):
        assert_same(read_rig(path, size=(768, 576)), RIG)


def test_pose2sim_reads_our_easymocap_files(tmp_path):
    calibration = imported("Pose2Sim.calibration")
    rig = three_cameras(LENS * [1, 1, 1, 1, 0])
    write_rig(tmp_path, rig, format="easymocap")
    files = [str(tmp_path / "extri.yml"), str(tmp_path / "intri.yml")]
    _, names, _, distortions, K, R, T = calibration.calib_easymocap_fun(files)
    assert tuple(names) == rig.names
    for k, camera in enumerate(rig):
        found = opencv_px(K[k], distortions[k], R[k], T[k])
        np.testing.assert_allclose(found, camera.px_from_world(POINTS), atol=PX)


def test_we_read_the_easymocap_files_of_pose2sim_which_numbers_what_it_lists_by_name(tmp_path):
    written = imported("Pose2Sim.Utilities.calib_toml_to_easymocap")
    rig = three_cameras(LENS * [1, 1, 1, 1, 0])
    write_rig(tmp_path / "calib.toml", rig)
    C, _, D, K, R, T = written.read_toml(str(tmp_path / "calib.toml"))
    written.write_intrinsic_yml(str(tmp_path / "intri.yml"), C, D, K)
    written.write_extrinsic_yml(str(tmp_path / "extri.yml"), C, R, T)
    assert_same(read_rig(tmp_path, size=(768, 576)), rig)


def test_pose2sim_reads_our_qualisys_file_but_for_the_distortion_that_it_divides(tmp_path):
    calibration = imported("Pose2Sim.calibration")
    rig = three_cameras(LENS * [1, 1, 1, 1, 0])
    write_rig(tmp_path / "rig.qca.txt", rig)
    errors, names, sizes, distortions, K, R, T = calibration.calib_qca_fun(str(tmp_path / "rig.qca.txt"))
    assert np.isnan(errors).all()
    for name, size, distortion, *rest in zip(names, sizes, distortions, K, R, T, strict=True):
        found = opencv_px(rest[0], 64 * distortion, *rest[1:])
        assert tuple(size) == rig[name].size
        np.testing.assert_allclose(found, rig[name].px_from_world(POINTS), atol=PX)


def test_qualisys_formula_by_hand_gives_our_pixels(tmp_path):
    """`Xc = diag(1, -1, -1) M (X - C)`, C in mm, intrinsics in 64ths of a pixel."""
    write_rig(tmp_path / "rig.qca.txt", RIG)
    for element in ElementTree.parse(tmp_path / "rig.qca.txt").findall("cameras/camera"):
        place, lens = element.find("transform").attrib, element.find("intrinsic").attrib
        M = np.array([[float(place[f"r{i}{j}"]) for j in (1, 2, 3)] for i in (1, 2, 3)])
        C = np.array([float(place[axis]) for axis in "xyz"]) / 1000
        x, y, z = (np.diag([1, -1, -1]) @ M @ (POINTS - C).T).tolist()
        x, y = np.divide(x, z), np.divide(y, z)
        k1, k2, k3 = (float(lens[f"radialDistortion{n}"]) for n in (1, 2, 3))
        p1, p2 = (float(lens[f"tangentalDistortion{n}"]) for n in (1, 2))
        r2 = x**2 + y**2
        radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
        bent_x = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2)
        bent_y = y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y
        u = (float(lens["focalLengthU"]) * bent_x + float(lens["centerPointU"])) / 64
        v = (float(lens["focalLengthV"]) * bent_y + float(lens["centerPointV"])) / 64
        np.testing.assert_allclose(np.column_stack([u, v]), RIG[element.get("serial")].px_from_world(POINTS), atol=PX)


def test_a_cropped_qualisys_image_has_its_centre_moved(tmp_path):
    write_rig(tmp_path / "whole.qca.txt", RIG)
    text = (tmp_path / "whole.qca.txt").read_text()
    (tmp_path / "cropped.qca.txt").write_text(text.replace('left="0" top="0"', 'left="100" top="50"'))
    whole, cropped = read_rig(tmp_path / "whole.qca.txt"), read_rig(tmp_path / "cropped.qca.txt")
    assert cropped["left"].size == (668, 526)
    moved = whole["left"].px_from_world(POINTS) - cropped["left"].px_from_world(POINTS)
    np.testing.assert_allclose(moved, [[100, 50]] * len(POINTS), atol=PX)


def test_pose2sim_reads_our_vicon_file(tmp_path):
    calibration = imported("Pose2Sim.calibration")
    rig = three_cameras(LENS * [1, 1, 0, 0, 0])
    write_rig(tmp_path / "rig.xcp", rig)
    _, names, sizes, distortions, K, R, T = calibration.calib_vicon_fun(str(tmp_path / "rig.xcp"))
    by_name = sorted(rig.names)
    for k in range(len(names)):
        found = opencv_px(K[k], distortions[k], R[k], T[k])
        assert tuple(sizes[k]) == rig[by_name[k]].size
        np.testing.assert_allclose(found, rig[by_name[k]].px_from_world(POINTS), atol=PX)


def test_vicon_formula_by_hand_gives_our_pixels(tmp_path):
    """`Xc = R(q) (X - C)`, q scalar last, C in mm; FOCAL_LENGTH and the principal point in pixels."""
    rig = three_cameras(LENS * [1, 1, 0, 0, 1])
    write_rig(tmp_path / "rig.xcp", rig)
    for element in ElementTree.parse(tmp_path / "rig.xcp").findall("Camera"):
        frame = {key: text.split() for key, text in element.find("KeyFrames/KeyFrame").attrib.items()}
        a, b, c, w = (float(text) for text in frame["ORIENTATION"])
        vector, about = POINTS - np.array(frame["POSITION"], float) / 1000, np.array([a, b, c])
        inner = np.cross(about, vector) + w * vector
        turned = vector + 2 * np.cross(about, inner)  # q v q*, written out
        x, y = turned[:, 0] / turned[:, 2], turned[:, 1] / turned[:, 2]
        k1, k2, k3 = (float(text) for text in frame["VICON_RADIAL2"][3:])
        r2 = x**2 + y**2
        radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
        focal, (u0, v0) = float(frame["FOCAL_LENGTH"][0]), map(float, frame["PRINCIPAL_POINT"])
        found = np.column_stack([focal * x * radial + u0, focal * y * radial + v0])
        np.testing.assert_allclose(found, rig[element.get("DEVICEID")].px_from_world(POINTS), atol=PX)


def test_an_old_vicon_file_has_its_distortion_in_the_older_attribute(tmp_path):
    rig = three_cameras(LENS * [1, 1, 0, 0, 0])
    write_rig(tmp_path / "rig.xcp", rig)
    root = ElementTree.parse(tmp_path / "rig.xcp")
    for frame in root.iter("KeyFrame"):
        del frame.attrib["VICON_RADIAL2"]
    root.write(tmp_path / "old.xcp")
    assert_same(read_rig(tmp_path / "old.xcp"), rig)


@pytest.mark.parametrize(
    ("corner", "base"), [("upper-left", 1), ("upper-left", 0), ("lower-left", 1), ("lower-left", 0)]
)
def test_dlt_formula_by_hand_gives_our_pixels(tmp_path, corner, base):
    """`u = (L1 X + L2 Y + L3 Z + L4) / (L9 X + L10 Y + L11 Z + 1)`, v with L5 to L8."""
    rig = three_cameras()
    write_rig(tmp_path / "dltCoefs.csv", rig, pixels=PixelConvention(corner, base), unit="mm")
    coefficients = np.loadtxt(tmp_path / "dltCoefs.csv", delimiter=",")
    assert coefficients.shape == (11, 3)
    x, y, z = 1e3 * POINTS.T
    for L, camera in zip(coefficients.T, rig, strict=True):
        depth = L[8] * x + L[9] * y + L[10] * z + 1
        u, v = (L[0] * x + L[1] * y + L[2] * z + L[3]) / depth, (L[4] * x + L[5] * y + L[6] * z + L[7]) / depth
        ours = camera.px_from_world(POINTS)
        rows_below = 575 - ours[:, 1]
        np.testing.assert_allclose(u, ours[:, 0] + base, atol=PX)
        np.testing.assert_allclose(v, (ours[:, 1] if corner == "upper-left" else rows_below) + base, atol=PX)


@pytest.mark.parametrize("corner", ["upper-left", "lower-left"])
def test_the_wrong_corner_is_told_from_cameras_that_look_away(tmp_path, corner):
    other = {"upper-left": "lower-left", "lower-left": "upper-left"}[corner]
    write_rig(tmp_path / "dltCoefs.csv", three_cameras(), pixels=PixelConvention(corner))
    told = f"from the {other} the cameras look away from each other; is it --origin {corner}"
    with pytest.raises(CalibrationError, match=told):
        read_rig(tmp_path / "dltCoefs.csv", size=(768, 576), pixels=PixelConvention(other))


def test_fisheye_cameras_are_those_of_opencv():
    camera = fisheye_rig()["left"]
    place = camera.camera_from_world
    rotation, translation = place.rotation.as_rotvec(), place.translation
    found = cv2.fisheye.projectPoints(POINTS[None], rotation, translation, camera.K, FISHEYE_LENS)[0][0]
    np.testing.assert_allclose(found, camera.px_from_world(POINTS), atol=PX)


def test_a_rotation_as_a_matrix_and_a_row_of_distortions_are_read(tmp_path):
    write_rig(tmp_path / "calib.toml", RIG)
    text = (tmp_path / "calib.toml").read_text()
    for camera in RIG:
        vector = camera.camera_from_world.rotation.as_rotvec().tolist()
        matrix = Rotation.from_rotvec(vector).as_matrix().tolist()
        text = text.replace(f"rotation = {vector}", f"rotation = {matrix}")
    text = text.replace("distortions = [", "distortions = [[").replace("]\nrotation", "]]\nrotation")
    (tmp_path / "matrix.toml").write_text(text)
    assert "[[[" not in text
    assert_same(read_rig(tmp_path / "matrix.toml"), RIG)
