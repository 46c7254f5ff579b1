"""Every format gives back what was written: to a billionth, over rigs of all kinds."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from airborne.cameras import PixelConvention, Rig, read_rig, write_rig
from airborne.errors import CalibrationError
from tests.support.cameras import LENS, three_cameras
from tests.support.format_rigs import PLAIN_NAMES, assert_same, rigs

FEW = settings(
    max_examples=25, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
BROWN = ("pinhole", "four", "brown")
PIXELS = st.builds(PixelConvention, st.sampled_from(["upper-left", "lower-left"]), st.sampled_from([0, 1]))
FISHEYE_LENS = np.array([0.05, -0.01, 0.002, -0.0003])


def fisheye_rig() -> Rig:
    return Rig(tuple(replace(camera, lens="fisheye", distortion=FISHEYE_LENS) for camera in three_cameras()))


def is_told(rig):
    """Whether the cameras are as far apart as cameras in metres are."""
    centres = np.stack([camera.centre for camera in rig])
    return len(rig) == 1 or np.linalg.norm(centres - centres[0], axis=1).max() > 0.1


@FEW
@given(rigs(*BROWN, "fisheye").filter(is_told))
def test_pose2sim_gives_every_rig_back(tmp_path, rig):
    assert write_rig(tmp_path / "calib.toml", rig) == ()
    assert_same(read_rig(tmp_path / "calib.toml"), rig)


def test_pose2sim_gives_back_how_well_the_cameras_are_known(tmp_path):
    covariance = np.cov(np.random.default_rng(3).normal(size=(7, 30)))
    errors = {"covariance": covariance, "shift_sd_px": 0.25}
    rig = Rig(
        tuple(
            replace(camera, **errors, world_sd=sd)
            for camera, sd in zip(three_cameras(), (None, 0.002, 0.001), strict=True)
        )
    )
    write_rig(tmp_path / "calib.toml", rig)
    found = read_rig(tmp_path / "calib.toml")
    assert found.states_errors and found.world_sd == 0.002
    for camera in found:
        np.testing.assert_array_equal(camera.covariance, covariance)
        assert camera.shift_sd_px == 0.25
    in_mm = read_rig(tmp_path / "calib.toml", unit="mm")  # only lengths have a unit
    np.testing.assert_allclose(in_mm.cameras[0].covariance[3:6, 3:6], 1e-6 * covariance[3:6, 3:6])
    np.testing.assert_array_equal(in_mm.cameras[0].covariance[:3, :3], covariance[:3, :3])
    text = (tmp_path / "calib.toml").read_text()
    for wrong, reason in (
        (text.replace("covariance = [[", "covariance = [[-"), "is no covariance matrix"),
        (text.replace("shift_sd_px = 0.25", "shift_sd_px = -1.0"), "shift_sd_px = -1"),
        (text.replace("world_sd = 0.002", "world_sd = 2"), "world_sd = 2"),
    ):
        (tmp_path / "wrong.toml").write_text(wrong)
        with pytest.raises(CalibrationError, match=reason):
            read_rig(tmp_path / "wrong.toml")
    assert write_rig(tmp_path / "cams.json", rig, format="caliscope")[-1] == "how well the cameras are known"


@FEW
@given(rigs(*BROWN, "fisheye", most=12).filter(is_told), st.sampled_from(["m", "mm"]))
def test_aniposelib_gives_every_rig_back_in_either_unit(tmp_path, rig, unit):
    assert write_rig(tmp_path / "calib.toml", rig, format="aniposelib", unit=unit) == ()
    assert_same(read_rig(tmp_path / "calib.toml", unit=unit), rig)


@FEW
@given(rigs(*BROWN, "fisheye").filter(is_told))
def test_caliscope_gives_all_but_names_back(tmp_path, rig):
    notes = write_rig(tmp_path / "camera_array.toml", rig, format="caliscope")
    found = read_rig(tmp_path / "camera_array.toml")
    assert_same(found, rig, with_names=False)
    assert all(f"{name} is " in notes[0] for name in rig.names if name not in found.names)


@FEW
@given(rigs(*BROWN).filter(is_told))
def test_qualisys_gives_every_rig_back(tmp_path, rig):
    assert write_rig(tmp_path / "rig.qca.txt", rig) == ()
    assert_same(read_rig(tmp_path / "rig.qca.txt"), rig)


@FEW
@given(rigs("pinhole", "radial", with_skew=False).filter(is_told))
def test_vicon_gives_every_rig_without_tangential_distortion_and_skew_back(tmp_path, rig):
    assert write_rig(tmp_path / "rig.xcp", rig) == ()
    assert_same(read_rig(tmp_path / "rig.xcp"), rig)


@FEW
@given(rigs(*BROWN, names=PLAIN_NAMES).filter(is_told), st.sampled_from(["m", "mm"]))
def test_opencv_gives_every_rig_back_from_one_file_and_from_two(tmp_path, rig, unit):
    assert write_rig(tmp_path / "rig.yml", rig, unit=unit) == ()
    write_rig(tmp_path / "two", rig, format="easymocap", unit=unit)
    assert_same(read_rig(tmp_path / "rig.yml", unit=unit), rig)
    for half in ("", "intri.yml", "extri.yml"):
        assert_same(read_rig(tmp_path / "two" / half, unit=unit), rig)


@FEW
@given(rigs("pinhole").filter(is_told), PIXELS, st.sampled_from(["m", "mm"]))
def test_dlt_coefficients_give_all_but_names_and_sizes_back(tmp_path, rig, pixels, unit):
    notes = write_rig(tmp_path / "dltCoefs.csv", rig, pixels=pixels, unit=unit)
    sizes = {f"cam{number}": camera.size for number, camera in enumerate(rig, 1)}
    found = read_rig(tmp_path / "dltCoefs.csv", size=sizes, pixels=pixels, unit=unit)
    assert_same(found, rig, with_names=False)
    assert notes == (f"names: cam1, cam2, ... for {', '.join(rig.names)}", "image sizes")


@pytest.mark.parametrize("kind", ["qualisys", "vicon", "opencv", "easymocap", "dlt"])
def test_a_fisheye_is_refused_where_there_is_no_place_for_it(tmp_path, kind):
    with pytest.raises(CalibrationError, match=r"camera 'left' has a fisheye lens, which .* cannot hold"):
        write_rig(tmp_path / "out", fisheye_rig(), format=kind)
    assert not list(tmp_path.glob("**/*.*"))


@pytest.mark.parametrize("kind", ["pose2sim", "aniposelib", "caliscope", "opencv", "qualisys", "vicon"])
def test_the_rational_model_comes_back_or_is_refused(tmp_path, kind):
    lens = np.array([0.31, -0.04, 0.001, -0.0007, 0.012, 0.62, 0.03, 0.004])
    rig = Rig(tuple(replace(camera, distortion=lens) for camera in three_cameras()))
    if kind in ("qualisys", "vicon"):
        with pytest.raises(CalibrationError, match=r"camera 'left' has a rational lens model, which .* cannot hold"):
            write_rig(tmp_path / "out", rig, format=kind)
    else:
        write_rig(tmp_path / "out", rig, format=kind)
        assert_same(read_rig(tmp_path / "out"), rig, with_names=kind != "caliscope")


def test_what_a_format_loses_is_said(tmp_path):
    rig = three_cameras(LENS)
    skewed = Rig(
        (replace(rig["left"], K=rig["left"].K + np.array([[0, 3, 0], [0, 0, 0], [0, 0, 0]])), *rig.cameras[1:])
    )
    vicon = write_rig(tmp_path / "rig.xcp", skewed)
    dlt = write_rig(tmp_path / "rig.csv", skewed)
    assert vicon == ("tangential distortion of left, right, side", "skew of left")
    corners = np.array([[0, 0], [767, 0], [0, 575], [767, 575]])
    moved = np.linalg.norm(rig["right"].distort_px(corners) - corners, axis=1).max()
    assert f"right (up to {moved:.1f} px)" in dlt[-1]
    assert "straighten pixels first" in dlt[-1]


def test_a_name_that_no_file_can_hold_is_refused(tmp_path):
    for name in ("a\nb", "../a", ".a", "", "a" * 81):
        with pytest.raises(CalibrationError, match=r"cameras: a name (has|must)"):
            Rig((replace(three_cameras()["left"], name=name),))
    spaced = Rig((replace(three_cameras()["left"], name="a b"),))
    with pytest.raises(CalibrationError, match="cannot be a key of OpenCV's YAML"):
        write_rig(tmp_path / "rig.yml", spaced)


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("rig.txt", {}, "the file name does not tell the format; end it in .toml, .qca.txt, .xcp"),
        ("rig.toml", {"format": "anipose"}, "no calibration format 'anipose'; choose from pose2sim, aniposelib"),
        ("rig.toml", {"unit": "mm"}, "pose2sim files are always in m"),
        ("rig.xcp", {"unit": "m"}, "vicon files are always in mm"),
    ],
)
def test_a_format_that_does_not_exist_or_fit_is_reported(tmp_path, name, options, message):
    with pytest.raises(CalibrationError) as error:
        write_rig(tmp_path / name, three_cameras(), **options)
    assert message in str(error.value)


@pytest.mark.parametrize(("written", "asked"), [("mm", "millimetres? Then say --unit mm"), ("m", None)])
def test_a_unit_is_asked_for_where_cameras_lie_too_far_apart(tmp_path, written, asked):
    write_rig(tmp_path / "calib.toml", three_cameras(), format="aniposelib", unit=written)
    if asked is None:
        assert_same(read_rig(tmp_path / "calib.toml"), three_cameras())
        return
    with pytest.raises(CalibrationError) as error:
        read_rig(tmp_path / "calib.toml")
    assert asked in str(error.value)
    assert_same(read_rig(tmp_path / "calib.toml", unit="mm"), three_cameras())


def test_a_size_that_contradicts_the_file_is_refused(tmp_path):
    write_rig(tmp_path / "calib.toml", three_cameras())
    assert len(read_rig(tmp_path / "calib.toml", size={"left": (768, 576)})) == 3
    with pytest.raises(CalibrationError, match="'left' has images of 768x576; leave --size out"):
        read_rig(tmp_path / "calib.toml", size=(640, 480))
