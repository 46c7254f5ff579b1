"""Lenses of cameras that see few clicked points: distortion is fitted, or its error is in the deviations."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.calibration import calibrate_from, sources_from
from airborne.calibration.sources.court import court_points, survey_points
from airborne.cameras import Rig, camera_looking_at

WIDTH, HEIGHT = 1920, 1080
PLACES = {"a": (-7, -9, 3.0), "b": (8, -8, 4.0), "c": (1, 12, 2.5)}


def rig(k1):
    cameras = [
        camera_looking_at(name, place, [0, 0, 1.3], focal_px=1300, size=(WIDTH, HEIGHT))
        for name, place in PLACES.items()
    ]
    return Rig(tuple(replace(camera, distortion=np.array([k1, 0.8 * k1**2, 0, 0, 0])) for camera in cameras))


def calibrate(folder, rig, points, table, rng):
    """Click points, name -> (3,) [m], with an sd of 0.7 px, and calibrate from the table alone."""
    places = np.array(list(points.values()))
    px = np.concatenate([camera.px_from_world(places) + rng.normal(0, 0.7, (len(places), 2)) for camera in rig], axis=1)
    assert np.all((px > 0) & (px < np.tile([WIDTH, HEIGHT], len(rig))))
    columns = [f"{camera.name}_{axis}" for camera in rig for axis in "uv"]
    of_world = () if table == "court" else ("x_m", "y_m", "z_m")
    lines = [",".join(["point", *of_world, *columns])]
    for (name, place), row in zip(points.items(), px, strict=True):
        lines.append(",".join([name, *(map(repr, map(float, place)) if of_world else ()), *(f"{v:.2f}" for v in row)]))
    (folder / "points.csv").write_text("\n".join(lines) + "\n")
    cameras = [{"name": camera.name, "size": list(camera.size)} for camera in rig]
    found = calibrate_from(
        sources_from({"camera": cameras, table: {"file": "points.csv"}}, folder, "a test"), lambda *_: None
    )
    errors = np.stack([found.rig[camera.name].centre - camera.centre for camera in rig])
    return found, errors, found.adjustment.camera_sd[:, 3:6]


@pytest.mark.parametrize("n", [8, 14])
def test_a_distorting_lens_seen_by_few_points_does_not_move_its_camera(tmp_path, n):
    rng = np.random.default_rng(n)
    places = np.column_stack([rng.uniform(-2, 2, n), rng.uniform(-2, 2, n), rng.uniform(0, 2.5, n)])
    points = {f"P{k}": place for k, place in enumerate(places)}
    found, errors, sds = calibrate(tmp_path, rig(-0.2), points, "control_points", rng)
    assert set(found.inputs.lenses) == set(PLACES)
    assert np.mean(np.abs(errors) < 2 * sds) >= 0.88
    assert np.median(np.linalg.norm(errors, axis=1)) < 0.25


def test_points_of_a_court_tell_of_the_lens_too(tmp_path):
    named = court_points()
    points = {name: named[name].position_m for name in survey_points("men") if not name.startswith("corner")}
    found, errors, sds = calibrate(tmp_path, rig(-0.25), points, "court", np.random.default_rng(3))
    assert set(found.inputs.lenses) == set(PLACES)
    assert any(camera.distortion[0] < -0.1 for camera in found.rig)
    assert np.mean(np.abs(errors) < 2 * sds) >= 0.88


def test_points_in_one_plane_tell_of_no_lens(tmp_path):
    rng = np.random.default_rng(5)
    points = {f"P{k}": np.array([*rng.uniform(-2, 2, 2), 0.0]) for k in range(14)}
    found, _, _ = calibrate(tmp_path, rig(0.0), points, "control_points", rng)
    assert found.inputs.lenses == {}
