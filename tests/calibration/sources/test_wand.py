"""A wand's tables, and the wand as evidence."""

import numpy as np
import pytest

from airborne.calibration.bundle import FreeParameters, adjust
from airborne.calibration.sources.wand import WandTracks, read_wand, wand_source
from airborne.cameras import PixelConvention
from airborne.cameras.formats.options import FileOptions
from airborne.errors import CalibrationError
from tests.support import wand_waving as waving
from tests.support.tolerances import ROUNDTRIP

NAMES = ("left", "right")
TIDY = "frame,marker,camera,u_px,v_px\n4,1,left,10,20\n4,1,right,11,21\n4,2,left,12,22\n9,1,right,,\n"


def written(tmp_path, text, name="wand.csv"):
    path = tmp_path / name
    path.write_text(text)
    return path


def xypts(px):
    """DLTdv's table of our pixels (frames, markers, cameras, 2), counted from 1."""
    _, markers, cameras, _ = px.shape
    head = ",".join(f"pt{m + 1}_cam{c + 1}_{axis}" for m in range(markers) for c in range(cameras) for axis in "UV")
    rows = [",".join("NaN" if np.isnan(v) else f"{v:.17g}" for v in row) for row in (px + 1).reshape(len(px), -1)]
    return "\n".join([head, *rows]) + "\n"


def test_rows_of_frame_marker_and_camera_are_put_in_their_places(tmp_path):
    tracks = read_wand(written(tmp_path, TIDY), NAMES, FileOptions(), [0.5])
    assert tracks.px.shape == (2, 2, 2, 2)
    assert tracks.px[0].tolist()[0] == [[10, 20], [11, 21]]
    assert tracks.px[0, 1, 0].tolist() == [12, 22]
    assert np.isnan(tracks.px[0, 1, 1]).all()
    assert np.isnan(tracks.px[1]).all()
    assert tracks.lengths_m == {(0, 1): 0.5}


def test_dltdv_tables_give_our_pixels(tmp_path):
    px = waving.tracks(np.random.default_rng(0), waving.hall(), 20, lengths_m=(0.6, 0.4)).px
    tracks = read_wand(written(tmp_path, xypts(px)), tuple(waving.SIZES), FileOptions(), [0.6, 0.4])
    assert np.allclose(tracks.px, px, atol=ROUNDTRIP, equal_nan=True)
    assert tracks.lengths_m == {(0, 1): 0.6, (1, 2): 0.4}


def test_pixels_from_the_lower_left_are_turned_over(tmp_path):
    px = np.full((1, 2, 1, 2), 5.0)
    given = FileOptions(size={"cam1": (100, 50)}, pixels=PixelConvention("lower-left", 1))
    tracks = read_wand(written(tmp_path, xypts(px)), ("cam1",), given, [1.0])
    assert tracks.px[0, 0, 0].tolist() == [5.0, 50 - 6]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "expected frame,marker,camera"),
        ("a,b\n1,2\n", "found a,b; expected frame,marker,camera"),
        (TIDY + "4,1,left,1,2\n", "stand twice"),
        (TIDY + "5,1,middle,1,2\n", "camera 'middle' is not one of left, right"),
        (TIDY + "5,0,left,1,2\n", "count the wand's markers from 1"),
        (TIDY + "5,1,left,1,\n", "must both be pixels, or both blank"),
        (TIDY + "x,1,left,1,2\n", "whole numbers for frame and marker"),
        (TIDY + "5,1\n", "row 6: 2 values, expected 5"),
        (TIDY + "5,1,left,inf,2\n", "must both be pixels"),
    ],
)
def test_a_table_that_is_wrong_is_refused_in_one_line(tmp_path, text, said):
    with pytest.raises(CalibrationError, match=said) as error:
        read_wand(written(tmp_path, text), NAMES, FileOptions(), [0.5])
    assert "\n" not in str(error.value)


def test_a_file_that_is_no_text_or_not_there_is_refused(tmp_path):
    (tmp_path / "x.csv").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(CalibrationError, match="not a text file"):
        read_wand(tmp_path / "x.csv", NAMES, FileOptions(), [0.5])
    with pytest.raises(CalibrationError, match="cannot be read"):
        read_wand(tmp_path / "no.csv", NAMES, FileOptions(), [0.5])


def test_other_points_beside_the_wand_are_refused(tmp_path):
    px = np.full((1, 4, 1, 2), 5.0)
    with pytest.raises(CalibrationError, match="holds 4 markers; expected 2, one more than lengths"):
        read_wand(written(tmp_path, xypts(px)), ("cam1",), FileOptions(), [1.0])


@pytest.mark.parametrize(
    ("lengths", "said"),
    [({}, "has no length"), ({(0, 2): 1.0}, "between markers 1 and 3"), ({(0, 1): 1000.0}, "not millimetres")],
)
def test_lengths_that_cannot_be_are_refused(lengths, said):
    with pytest.raises(CalibrationError, match=said):
        WandTracks(cameras=("a",), px=np.zeros((1, 2, 1, 2)), lengths_m=lengths)


def test_outliers_are_no_evidence():
    rng, rig = np.random.default_rng(1), waving.hall()
    points = waving.wave_wand(rng, 100)
    px = waving.observe(rng, rig, points)
    true = px.copy()
    is_stray = rng.random(px.shape[:-1]) < 0.1
    px[is_stray] = rng.uniform((0, 0), waving.SIZE, (is_stray.sum(), 2))
    source = wand_source(rig, WandTracks(cameras=rig.names, px=px, lengths_m={(0, 1): 1.0}))
    kept = {tuple(uv) for uv in source.px}
    sound = [tuple(uv) for uv in px[~is_stray & np.isfinite(true[..., 0])]]
    strays = [tuple(uv) for uv in px[is_stray]]
    assert np.mean([uv in kept for uv in strays]) < 0.05
    assert np.mean([uv in kept for uv in sound]) > 0.95
    n_seen = np.isfinite(px[..., 0]).sum(axis=-1)
    assert source.n_rejected == n_seen[n_seen > 1].sum() - len(source.px)


def test_lengths_join_the_markers_of_one_frame():
    rng, rig = np.random.default_rng(2), waving.hall()
    source = wand_source(rig, waving.tracks(rng, rig, 50, lengths_m=(0.6, 0.4), noise_px=0.0))
    lengths = source.lengths
    found = np.linalg.norm(source.points[lengths.first] - source.points[lengths.second], axis=1)
    assert len(found) > 90
    assert np.abs(found - lengths.length_m).max() < 1e-6


def test_the_length_gives_the_scale():
    rng, rig = np.random.default_rng(3), waving.hall()
    tracks = waving.tracks(rng, rig, 80)
    half = WandTracks(cameras=tracks.cameras, px=tracks.px, lengths_m={(0, 1): 0.5})
    spread = adjust(rig, [wand_source(rig, tracks)], FreeParameters()).rig
    small, _ = adjust(spread, [wand_source(rig, tracks)], FreeParameters()).transform(
        spread["cam1"].camera_from_world, 0.5
    )
    narrow = adjust(small, [wand_source(small, half)], FreeParameters()).rig
    ratio = np.linalg.norm(narrow["cam1"].centre - narrow["cam3"].centre) / np.linalg.norm(
        spread["cam1"].centre - spread["cam3"].centre
    )
    assert ratio == pytest.approx(0.5, rel=1e-3)
