"""Digitised points in DLTdv's layout: there and back, from either corner, with their siblings."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airborne.cameras import Detections, PixelConvention
from airborne.cameras.formats.dltdv import (
    Digitisation,
    is_xypts,
    read_digitisation,
    triangulate_digitisation,
    write_digitisation,
)
from airborne.cameras.formats.options import FileOptions
from airborne.errors import CalibrationError
from tests.support.cameras import LENS, scattered, three_cameras
from tests.support.tolerances import EXACT, ROUNDTRIP

RIG = three_cameras(LENS)
SIZES = {f"cam{k}": (768, 576) for k in (1, 2, 3)}
PLACES = scattered(4 * 2).reshape(4, 2, 3)


def clicked(cameras=("cam1", "cam2", "cam3")):
    """Two points in four frames, one of them not seen by the second camera in the third frame."""
    px = np.stack([camera.px_from_world(PLACES) for camera in RIG], axis=2)
    px[2, 0, 1] = np.nan
    return Detections.from_clicks(cameras, ("pt1", "pt2"), px)


@settings(max_examples=40, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    px=arrays(float, (3, 2, 3, 2), elements=st.floats(-5e3, 5e3) | st.just(np.nan)),
    corner=st.sampled_from(["upper-left", "lower-left"]),
    base=st.sampled_from([0, 1]),
    unit=st.sampled_from(["m", "mm"]),
)
def test_all_tables_come_back(tmp_path, px, corner, base, unit):
    convention = FileOptions(unit=unit, size=SIZES, pixels=PixelConvention(corner, base))
    rng = np.random.default_rng(0)
    whole = Digitisation(
        points=Detections.from_clicks(SIZES, ("pt1", "pt2"), px),
        world=rng.normal(size=(3, 2, 3)),
        residual_px=np.array([[0.1, np.nan], [2.5, 1 / 3], [0, 7]]),
        offset_frames=rng.integers(-3, 3, (3, 3)).astype(float),
        interval=rng.uniform(size=(3, 2, 3)),
    )
    files = write_digitisation(tmp_path / "throw_xypts.csv", whole, convention)
    assert [path.name for path in files] == [
        f"throw_{s}.csv" for s in ("xypts", "xyzpts", "xyzres", "offsets", "xyzCI")
    ]
    back = read_digitisation(tmp_path / "throw_xypts.csv", convention)
    np.testing.assert_allclose(back.points.px, whole.points.px, atol=1e3 * ROUNDTRIP)
    np.testing.assert_array_equal(back.points.visibility, whole.points.visibility)
    for name in ("world", "residual_px", "offset_frames", "interval"):
        np.testing.assert_allclose(getattr(back, name), getattr(whole, name), rtol=ROUNDTRIP)


def test_the_layout_is_point_outer_camera_inner_with_nan_for_missing(tmp_path):
    write_digitisation(tmp_path / "xypts.csv", Digitisation(points=clicked()), FileOptions())
    header, *rows = (tmp_path / "xypts.csv").read_text().splitlines()
    assert header.startswith("pt1_cam1_U,pt1_cam1_V,pt1_cam2_U,pt1_cam2_V,pt1_cam3_U,pt1_cam3_V,pt2_cam1_U")
    assert rows[2].split(",")[2:4] == ["NaN", "NaN"]
    assert len(list(tmp_path.iterdir())) == 1


def test_dltdv_8_counts_the_first_pixel_as_one_from_above_and_dltdv_7_from_below(tmp_path):
    ours = clicked().px[0, 0, 0]
    for corner, expected in (("upper-left", ours + 1), ("lower-left", [ours[0] + 1, 576 - ours[1]])):
        convention = FileOptions(size=(768, 576), pixels=PixelConvention(corner))
        write_digitisation(tmp_path / "xypts.csv", Digitisation(points=clicked()), convention)
        first = np.array((tmp_path / "xypts.csv").read_text().splitlines()[1].split(",")[:2], float)
        np.testing.assert_allclose(first, expected, rtol=EXACT)


def test_names_of_argus_and_of_older_dltdv_are_read(tmp_path):
    for header in (
        "nose_cam_1_x,nose_cam_1_y,nose_cam_2_x,nose_cam_2_y",
        "pt1_cam1_X,pt1_cam1_Y,pt1_cam2_X,pt1_cam2_Y",
    ):
        assert is_xypts(header)
        (tmp_path / "xypts.csv").write_text(f"{header}\n1,2,3,4\n,,NaN,NaN\n")
        found = read_digitisation(tmp_path / "xypts.csv", FileOptions(), ("left", "right")).points
        assert found.cameras == ("left", "right")
        np.testing.assert_array_equal(found.px[0, 0], [[0, 1], [2, 3]])
        assert np.isnan(found.px[1]).all()
    assert not is_xypts("field,long_minus_cam1_u")


def test_points_are_placed_where_they_were_and_residuals_are_those_of_dltdv():
    found = triangulate_digitisation(clicked(RIG.names), RIG)
    np.testing.assert_allclose(found.world, PLACES, atol=1e3 * ROUNDTRIP)
    assert np.all(found.residual_px < 1e-5)
    off = clicked(RIG.names)
    off.px[..., 0] += np.random.default_rng(0).normal(0, 1, off.px.shape[:-1])
    found = triangulate_digitisation(off, RIG)
    error = np.stack([c.px_from_world(found.world) for c in RIG], axis=2) - off.px
    np.testing.assert_allclose(found.residual_px[0, 0], np.sqrt(np.sum(error[0, 0] ** 2) / (2 * 3 - 3)))
    np.testing.assert_allclose(found.residual_px[2, 0], np.sqrt(np.nansum(error[2, 0] ** 2) / (2 * 2 - 3)))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "found the columns none"),
        ("a,b\n1,2\n", "found the columns a,b"),
        ("pt1_cam1_U,pt1_cam1_V,pt1_cam2_U\n1,2,3\n", "not every point has one U and one V in every camera"),
        ("pt1_cam1_U,pt1_cam1_V\n1,x\n", "row 2: expected 2 numbers"),
        ("pt1_cam1_U,pt1_cam1_V\n1,2\n1\n", "row 3: expected 2 numbers"),
    ],
)
def test_another_table_is_reported_in_one_line(tmp_path, text, message):
    (tmp_path / "xypts.csv").write_text(text)
    with pytest.raises(CalibrationError) as error:
        read_digitisation(tmp_path / "xypts.csv", FileOptions())
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_what_does_not_fit_together_is_reported(tmp_path):
    write_digitisation(tmp_path / "t_xypts.csv", triangulate_digitisation(clicked(RIG.names), RIG), FileOptions())
    with pytest.raises(CalibrationError, match="has 3 cameras; name as many"):
        read_digitisation(tmp_path / "t_xypts.csv", FileOptions(), ("left", "right"))
    with pytest.raises(CalibrationError, match="does not say how large the images of 'cam1' are; give --size"):
        read_digitisation(tmp_path / "t_xypts.csv", FileOptions(pixels=PixelConvention("lower-left")))
    (tmp_path / "t_xyzres.csv").write_text("pt1_dltres\n1\n")
    with pytest.raises(CalibrationError, match="has 1 rows of 1; expected 4 of 2"):
        read_digitisation(tmp_path / "t_xypts.csv", FileOptions())
    with pytest.raises(CalibrationError, match=r"wants a name that ends in xypts\.csv"):
        write_digitisation(tmp_path / "t.csv", Digitisation(points=clicked()), FileOptions())
