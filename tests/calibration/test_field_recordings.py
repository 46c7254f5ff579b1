"""Real recordings: a board printed on both sides, and control points of fifteen wide cameras."""

import numpy as np
import pytest

from airborne.calibration import calibrate, calibrate_from, read_control_points, read_sources, sources_from
from airborne.calibration.report import calibration_to_dict
from airborne.calibration.sources import board_detection
from airborne.cameras import read_rig


def silent(what, done, total):
    pass


def test_four_cameras_around_a_two_sided_board_are_joined(shared_data, monkeypatch):
    monkeypatch.setattr(board_detection, "_MOST_MOMENTS", 50)  # half of the images are enough
    monkeypatch.setattr(board_detection, "_N_SAMPLES", 6)
    folder = shared_data("two_sided_board")
    cameras = [{"name": f"cam_{i}", "video": f"cam_{i}.mp4"} for i in range(4)]
    document = {"camera": cameras, "board": {"file": "charuco.toml"}}
    found = calibrate_from(sources_from(document, folder, "test"), silent)
    report = calibration_to_dict(found)
    assert report["held_out_rms_px"] < 3
    shipped = read_rig(folder / "camera_array.toml")
    ours, theirs = (np.stack([rig[name].centre for name in found.rig.names]) for rig in (found.rig, shipped))
    ours, theirs = ours - ours.mean(axis=0), theirs - theirs.mean(axis=0)
    U, _, Vt = np.linalg.svd(theirs.T @ ours)
    R = U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt
    assert np.sqrt(np.mean(np.sum((ours @ R.T - theirs) ** 2, axis=1))) < 0.010


@pytest.mark.parametrize("lens", ["any", "fisheye"])
def test_fifteen_wide_cameras_from_120_points_stand_where_they_stand(shared_data, lens, tmp_path):
    folder = shared_data("gopros")
    points = read_control_points(folder / "cp_small.csv")
    if lens == "any":
        found = calibrate(points, dict.fromkeys(points.cameras, (5312, 2988)))
        sd = np.array([[fit.sd[key] for key in ("x_m", "y_m", "z_m")] for fit in found.fits])
    else:
        text = (folder / "sources_fish.toml").read_text().replace('"cp_m.csv"', f'"{folder / "cp_small.csv"}"')
        (tmp_path / "sources.toml").write_text(text)
        found = calibrate_from(read_sources(tmp_path / "sources.toml"), silent)
        assert {camera.lens for camera in found.rig} == {"fisheye"}
        sd = found.adjustment.camera_sd[:, 3:6]
    truth = np.load(folder / "truth.npz")
    error = np.stack([camera.centre for camera in found.rig]) - truth["C"] / 100
    assert np.sqrt(np.mean(np.sum(error**2, axis=1))) < 0.015
    assert np.mean(np.abs(error) < 2 * sd) >= 0.88
