"""Cameras from nothing but a waved wand, against their true places."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.calibration.bundle import FreeParameters, adjust
from airborne.calibration.initial.wand import initial_rig_from_wand
from airborne.calibration.initial.wand_fisheyes import initial_rig_from_wand_and_fisheyes
from airborne.calibration.sources.wand import wand_source
from airborne.cameras import Rig
from airborne.errors import CalibrationError
from tests.support import wand_waving as waving


@pytest.mark.parametrize("focals_px", [(1500.0,) * 4, waving.FOCALS_PX])
@pytest.mark.parametrize("stray_share", [0.0, 0.25])
def test_cameras_are_placed_without_knowing_their_focal_lengths(focals_px, stray_share):
    rng, rig = np.random.default_rng(1), waving.hall(focals_px)
    start = initial_rig_from_wand(waving.tracks(rng, rig, 300, stray_share=stray_share), waving.SIZES)
    assert start.names == rig.names
    assert waving.misplaced_m(rig, start).max() < 0.2  # of some 20 m between them
    assert np.abs(waving.focal_errors(rig, start)).max() < 0.025


@pytest.mark.parametrize("lengths_m", [(1.0,), (0.6, 0.4)])
def test_the_adjustment_then_finds_them_as_well_as_it_says(lengths_m):
    rng, rig = np.random.default_rng(4), waving.hall(k1=-0.1)
    tracks = waving.tracks(rng, rig, 400, lengths_m=lengths_m, stray_share=0.1)
    start = initial_rig_from_wand(tracks, waving.SIZES)
    found = adjust(start, [wand_source(start, tracks)], FreeParameters(n_terms=1))
    source = found.sources[0]
    lengths = np.linalg.norm(source.points[source.lengths.first] - source.points[source.lengths.second], axis=1)
    sd_m = np.linalg.norm(found.camera_sd[:, 3:6], axis=1)
    assert (waving.misplaced_m(rig, found.rig) < 3 * sd_m).all()
    assert sd_m.max() < 0.02
    assert np.abs(waving.focal_errors(rig, found.rig)).max() < 4e-3
    assert np.abs(np.median(lengths / source.lengths.length_m) - 1) < 1e-3
    assert found.noise_px[0] * 0.5 == pytest.approx(0.5, rel=0.1)


def test_with_known_lenses_cameras_are_found_within_millimetres():
    rng, rig = np.random.default_rng(5), waving.hall(k1=-0.2)
    tracks = waving.tracks(rng, rig, 400, stray_share=0.1)
    start = initial_rig_from_wand(tracks, waving.SIZES, {camera.name: camera for camera in rig})
    assert all(np.array_equal(camera.K, rig[camera.name].K) for camera in start)
    assert all(np.array_equal(camera.distortion, rig[camera.name].distortion) for camera in start)
    assert waving.misplaced_m(rig, start).max() < 0.2
    found = adjust(start, [wand_source(start, tracks)], FreeParameters(focal=False))
    sd_m = np.linalg.norm(found.camera_sd[:, 3:6], axis=1)
    assert (waving.misplaced_m(rig, found.rig) < 3 * sd_m).all()
    assert sd_m.max() < 0.004


def test_the_same_tracks_give_the_same_cameras():
    rng, rig = np.random.default_rng(6), waving.hall()
    tracks = waving.tracks(rng, rig, 100, stray_share=0.1)
    one, other = (initial_rig_from_wand(tracks, waving.SIZES) for _ in range(2))
    assert all(np.array_equal(a.centre, b.centre) for a, b in zip(one, other, strict=True))


def test_a_camera_that_shares_nothing_with_the_others_is_named():
    rng, rig = np.random.default_rng(7), waving.hall()
    tracks = waving.tracks(rng, rig, 200)
    px = tracks.px.copy()
    px[:100, :, 3] = np.nan
    px[100:, :, :3] = np.nan
    with pytest.raises(
        CalibrationError, match=r"does not tie cam4 to cam1, cam2, cam3: .* in 0 frames at most; at least 10"
    ):
        initial_rig_from_wand(replace(tracks, px=px), waving.SIZES)


def test_a_wand_seen_in_a_few_frames_is_refused():
    tracks = waving.tracks(np.random.default_rng(11), waving.hall(), 9)
    with pytest.raises(CalibrationError, match="in 9 frames at most; at least 10 are needed"):
        initial_rig_from_wand(tracks, waving.SIZES)
    with pytest.raises(CalibrationError, match="only cam1 saw the wand"):
        initial_rig_from_wand(tracks.select(["cam1"]), waving.SIZES)


def test_cameras_are_chained_where_only_neighbours_share_views():
    rng, rig = np.random.default_rng(8), waving.hall()
    tracks = waving.tracks(rng, rig, 450)
    px = tracks.px.copy()
    for k, shown in enumerate([(0, 150), (0, 300), (150, 450), (300, 450)]):
        px[: shown[0], :, k] = px[shown[1] :, :, k] = np.nan
    assert waving.misplaced_m(rig, initial_rig_from_wand(replace(tracks, px=px), waving.SIZES)).max() < 0.6


@pytest.mark.parametrize("mirrored", [0, 2])
def test_a_mirrored_camera_is_named(mirrored):
    rng, rig = np.random.default_rng(9), waving.hall()
    tracks = waving.tracks(rng, rig, 300, stray_share=0.05)
    px = tracks.px.copy()
    px[:, :, mirrored, 0] = waving.SIZE[0] - 1 - px[:, :, mirrored, 0]
    with pytest.raises(CalibrationError, match=rf"cam{mirrored + 1} fits .* only as in a mirror"):
        initial_rig_from_wand(replace(tracks, px=px), waving.SIZES)


def test_two_cameras_out_of_step_are_refused():
    rng, rig = np.random.default_rng(10), waving.hall()
    tracks = waving.tracks(rng, rig, 100).select(("cam1", "cam2"))
    px = tracks.px.copy()
    px[:, :, 1] = np.roll(px[:, :, 1], 10, axis=0)
    with pytest.raises(CalibrationError, match=r"does not tie cam2 to cam1|the wand's length varies"):
        initial_rig_from_wand(replace(tracks, px=px), waving.SIZES)


def test_fisheyes_whose_focal_length_nobody_knows_are_placed():
    rng = np.random.default_rng(8)
    rig = Rig(tuple(replace(each, lens="fisheye", distortion=np.zeros(4)) for each in waving.hall((900.0,) * 4)))
    tracks = waving.tracks(rng, rig, 200, stray_share=0.05)
    start = initial_rig_from_wand_and_fisheyes(tracks, waving.SIZES, {}, rig.names)
    assert all(camera.lens == "fisheye" for camera in start)
    assert np.abs(waving.focal_errors(rig, start)).max() < 0.15, "one of a few focal lengths for all of them"
    assert waving.misplaced_m(rig, start).max() < 1.5  # of some 20 m between them


def test_where_no_focal_length_fits_the_first_refusal_is_said():
    rng, rig = np.random.default_rng(9), waving.hall()
    few = waving.tracks(rng, rig, 4)
    with pytest.raises(CalibrationError, match="frames"):
        initial_rig_from_wand_and_fisheyes(few, waving.SIZES, {}, rig.names)
