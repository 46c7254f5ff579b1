"""A wand's markers are found in videos where other things move; where there are none, that is said."""

import re

import cv2
import numpy as np
import pytest

from airborne.calibration import sources_from
from airborne.calibration.sources import wand_detection
from airborne.calibration.sources.wand_blobs import NO_BLOBS, Blobs, background_of, find_blobs
from airborne.calibration.sources.wand_detection import detect_wand
from airborne.calibration.sources.wand_matching import match_markers
from airborne.cameras import read_rig
from airborne.errors import CalibrationError
from tests.support import wand_videos as filmed
from tests.support import wand_waving as waving
from tests.support.commands import in_process

RIG = filmed.hall()
SIZES = {camera.name: filmed.SIZE for camera in RIG}


def sources(folder):
    cameras = [{"name": name, "video": f"{name}.mp4"} for name in RIG.names]
    return sources_from({"camera": cameras, "wand": {"length_m": filmed.LENGTH_M}}, folder, "test")


def find(folder):
    return detect_wand(sources(folder), filmed.LENGTH_M, SIZES, lambda done, n: None)


def off_px(found, px):
    """How far the worse of two markers is off (frames, cameras), one order of the two for all cameras of a frame."""
    apart = np.stack([np.linalg.norm(each - px, axis=-1).max(axis=1) for each in (found, found[:, ::-1])])
    order = np.argmin(np.nan_to_num(apart, nan=1e6).sum(axis=2), axis=0)
    return apart[order, np.arange(len(px))]


def test_two_balls_of_one_colour_calibrate_the_cameras(tmp_path, capsys, monkeypatch):
    detections = []
    monkeypatch.setattr(
        wand_detection, "detect_wand", lambda *args: detections.append(detect_wand(*args)) or detections[0]
    )
    px = filmed.film_wand(tmp_path, RIG, n=48)
    videos = [tmp_path / f"{name}.mp4" for name in RIG.names]
    assert in_process("calibrate", *videos, "--wand", filmed.LENGTH_M, "-o", tmp_path / "calib.toml") == 0
    rig = read_rig(tmp_path / "calib.toml")
    assert waving.misplaced_m(RIG, rig).max() < 0.02
    assert np.abs(waving.focal_errors(RIG, rig)).max() < 0.01
    assert re.search(r"the wand is seen by two cameras or more in \d+ of 48 frames", capsys.readouterr().out)
    assert all((tmp_path / "calib_report" / f"residuals_{name}.png").is_file() for name in RIG.names)
    found = detections[0].tracks.px
    is_seen = np.isfinite(found[:, 0, :, 0])
    assert is_seen.sum(axis=0).min() > 0.3 * len(px)
    is_right = off_px(found, px)[is_seen] < 1  # where one is hidden, no place is
    assert np.mean(is_right) > 0.95  # what is wrong is left out by its length


def test_without_a_wand_no_wand_is_found(tmp_path):
    filmed.film_wand(tmp_path, RIG, n=16, seed=2, with_wand=False, stray=0.8)
    with pytest.raises(CalibrationError, match="no wand is found; frames with two round") as error:
        find(tmp_path)
    assert "\n" not in str(error.value) and "digitise them" in str(error.value)


def test_two_videos_are_asked_for(tmp_path):
    table = {"camera": [{"name": "a", "video": "a.mp4"}, {"name": "b", "size": [64, 48]}], "wand": {"length_m": 0.5}}
    with pytest.raises(CalibrationError, match="to two cameras at least"):
        detect_wand(sources_from(table, tmp_path, "test"), 0.5, {}, lambda done, n: None)
    table["wand"] = {"lengths_m": [0.5, 0.3]}
    with pytest.raises(CalibrationError, match="found in videos has two markers: give length_m"):
        sources_from(table, tmp_path, "test")


@pytest.mark.parametrize("colour", [filmed.RED, filmed.GREEN, filmed.WHITE])
def test_a_blob_s_centre_is_good_to_a_tenth_of_a_pixel(colour):
    rng = np.random.default_rng(3)
    wall = cv2.GaussianBlur(rng.integers(40, 150, (120, 160, 3), dtype=np.uint8), (0, 0), 4)
    background = background_of([wall] * 3)
    cv2.circle(wall, (20, 20), 6, colour, -1)  # stands there always
    for at in rng.integers((30 * 8, 30 * 8), (115 * 8, 90 * 8), (20, 2)) / 8:
        image = wall.copy()
        cv2.circle(image, (at * 8).astype(int).tolist(), 6 * 8, colour, -1, cv2.LINE_AA, 3)
        cv2.rectangle(image, (130, 10), (155, 115), colour, -1)  # moves too, and is no ball
        blobs = find_blobs(image, background_of([wall] * 3))
        assert len(blobs.px) == 1 and np.linalg.norm(blobs.px[0] - at) < 0.1
    assert len(find_blobs(wall, background).px) == 1


@pytest.mark.parametrize("shares", [(0.8, 0.8), (0.8, 0.2)])
def test_markers_in_any_order_are_put_in_one_order_for_all_cameras(shares):
    rng, rig = np.random.default_rng(4), waving.hall()
    px = waving.tracks(rng, rig, 60).px
    is_seen = np.isfinite(px).all(axis=(1, 3))
    wrong = is_seen & (rng.random(is_seen.shape) < 0.15)
    blobs = []
    for i in range(4):
        row = [NO_BLOBS] * 60
        for k in np.flatnonzero(is_seen[:, i]):
            at = rng.uniform((0, 0), waving.SIZE, (2, 2)) if wrong[k, i] else px[k, :, i]
            colour = np.column_stack([shares, [0.1, 0.1], [1.0, 1.0]]) + rng.normal(0, 0.01, (2, 3))
            order = rng.permutation(2)
            row[k] = Blobs(at[order], colour[order])
        blobs.append(row)
    best = match_markers(blobs, [waving.SIZE] * 4)[0]
    is_found = np.isfinite(best[:, 0, :, 0])
    assert (is_found & wrong).sum() <= 2
    assert (is_found & ~wrong).sum() > 0.95 * (is_seen & ~wrong & ((is_seen & ~wrong).sum(axis=1) > 1)[:, None]).sum()
    assert np.all(off_px(best, px)[is_found & ~wrong] < 1e-6)
