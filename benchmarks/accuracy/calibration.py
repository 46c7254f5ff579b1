"""Measure calibration on real recordings: `python benchmarks/accuracy/calibration.py` (some minutes).

`charuco`: four webcams, calibrated from their videos alone; another tool's calibration is looked at only afterwards.
Its cameras did not look at the same instant; it did not know. `balance`: a walking man's detections mend a rig.
The recordings are looked for beside the project.
"""

from __future__ import annotations

import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import ROOT, append

from airborne.calibration import RigCalibration, calibrate_from, sources_from
from airborne.calibration.report import calibration_to_dict
from airborne.cameras import Rig
from airborne.cameras.detections import Detections, read_detections

DATA = ROOT.parent / "shared" / "data"
SAVED = {"saved_scale": 1.00741, "saved_offset_px": [0.0, -7.11]}


def median_reprojection_px(rig: Rig, detections: Detections) -> float:
    """Return the median distance of all detections from their triangulated points' projections [px]."""
    points = rig.points_from_px(detections.px, detections.visibility)
    projected = np.stack([camera.px_from_world(points) for camera in rig], axis=-2)
    return float(np.nanmedian(np.linalg.norm(projected - detections.px, axis=-1)))


def silent(what: str, done: int, total: int | None) -> None:
    """Tell nothing."""


def charuco(sync: str) -> RigCalibration:
    """Calibrate the four webcams from their videos."""
    cameras = [{"name": f"cam_{k}", "video": f"cam_{k}.mp4"} for k in range(4)]
    board = {"file": "charuco.toml", "timestamps": "timestamps.csv", "sync": sync}
    return calibrate_from(sources_from({"camera": cameras, "board": board}, DATA / "charuco", "charuco"), silent)


def square_errors(found: RigCalibration) -> np.ndarray:
    """Compare triangulated squares with the board's (n,): corners as each camera would see them without its lag."""
    adjusted = found.adjustment
    source, residual = adjusted.sources[0], adjusted.residual_px[0]
    board = found.inputs.board_detections.views.board
    placed = source.world_from_target
    px = np.full((source.n_moments, len(source.points), len(found.rig), 2), np.nan)
    world = placed[source.moments].apply(source.points[source.point])
    for c, camera in enumerate(found.rig):
        own = source.camera == c
        px[source.moments[own], source.point[own], c] = camera.px_from_world(world[own]) + residual[own]
    corners = found.rig.points_from_px(px)
    one, other = board.neighbours().T
    lengths = np.linalg.norm(corners[:, one] - corners[:, other], axis=-1)
    return lengths[np.isfinite(lengths)] / board.square_m - 1


def shipped_centres() -> np.ndarray:
    """Read where the other tool has the cameras: (4, 3) [m]."""
    with (DATA / "charuco" / "camera_array.toml").open("rb") as file:
        table = tomllib.load(file)["cameras"]
    places = [(np.array(table[str(k)]["rotation"]), np.array(table[str(k)]["translation"])) for k in range(4)]
    return np.stack([-R.T @ t for R, t in places])


def off_aligned(ours: np.ndarray, theirs: np.ndarray) -> tuple[np.ndarray, float]:
    """Return distances after the best similarity, and its scale."""
    a, b = ours - ours.mean(axis=0), theirs - theirs.mean(axis=0)
    turn = Rotation.align_vectors(b, a)[0].apply(a)
    scale = float(np.sum(turn * b) / np.sum(a * a))
    return np.linalg.norm(scale * turn - b, axis=1), scale


def charuco_rows() -> list[dict]:
    """Measure the webcams, with the lags found and without."""
    rows = []
    theirs = shipped_centres()
    baseline = max(np.linalg.norm(a - b) for a in theirs for b in theirs)
    for sync, method in (("auto", "bundle"), ("exact", "no lags")):
        found = charuco(sync)
        told, errors = calibration_to_dict(found), square_errors(found)
        off, scale = off_aligned(np.stack([camera.centre for camera in found.rig]), theirs)
        base = {"data": "charuco, videos only", "method": method, "n": told["sources"]["board"]["n_observations"]}
        is_ours = sync == "auto"
        rows += [
            {
                **base,
                "metric": "reprojection RMS",
                "unit": "px",
                "value": told["rms_px"],
                "floor": 0.8 if is_ours else None,
            },
            {**base, "metric": "reprojection median", "unit": "px", "value": told["median_px"]},
            {**base, "metric": "held-out reprojection RMS", "unit": "px", "value": told["held_out_rms_px"]},
            {
                **base,
                "metric": "square length, mean error",
                "unit": "%",
                "value": 100 * float(errors.mean()),
                "n": len(errors),
                "floor": 0.5 if is_ours else None,
            },
            {
                **base,
                "metric": "square length, RMS error",
                "unit": "%",
                "value": 100 * float(np.sqrt(np.mean(errors**2))),
                "n": len(errors),
            },
            {
                **base,
                "metric": "centres against shipped, RMS of baseline",
                "unit": "%",
                "value": 100 * float(np.sqrt(np.mean(off**2))) / baseline,
                "n": 4,
                "floor": 1 if is_ours else None,
            },
            {
                **base,
                "metric": "centres against shipped, largest",
                "unit": "%",
                "value": 100 * float(off.max()) / baseline,
                "n": 4,
            },
            {**base, "metric": "scale against shipped", "unit": "", "value": f"{scale:.4f}", "n": 4},
        ]
        for name, lag_s in found.lag_s.items():
            rows.append(
                {
                    **base,
                    "metric": f"lag of {name}, median",
                    "unit": "ms",
                    "value": float(np.median(lag_s) * 1e3),
                    "n": len(lag_s),
                }
            )
    return rows


def balance_rows() -> list[dict]:
    """Measure the rig that a walking man's detections mend."""
    folder = DATA / "balance"
    names = ("cam01", "cam02", "cam03", "cam04")
    cameras = [{"name": n, "video": f"{n}.mp4", **(SAVED if n < "cam03" else {})} for n in names]
    document = {
        "camera": cameras,
        "start": {"file": "Calib.qca.txt"},
        "detections": {"file": "detections_2d.npz"},
    }
    found = calibrate_from(sources_from(document, folder, "balance"), silent)
    seen = read_detections(folder / "detections_2d.npz", names)
    seen = replace(seen, visibility=np.maximum(seen.visibility, 1e-3))
    before = median_reprojection_px(found.inputs.start_rig, seen)
    after = median_reprojection_px(found.rig, seen)
    base = {"data": "balance, detections", "method": "bundle", "n": int(np.isfinite(seen.px[..., 0]).sum())}
    wrong = ", ".join(mending.camera.name for mending in found.resections)
    rows = [
        {**base, "metric": "cameras named as wrong", "unit": "", "value": wrong or "none", "floor": "cam03"},
        {**base, "metric": "median reprojection as shipped", "unit": "px", "value": before},
        {**base, "metric": "median reprojection, refined", "unit": "px", "value": after, "floor": 7.5},
    ]
    for name, camera in calibration_to_dict(found)["cameras"].items():
        rows += [
            {**base, "metric": f"shift of {name}", "unit": "m", "value": camera["moved_m"]},
            {**base, "metric": f"turn of {name}", "unit": "deg", "value": camera["turned_deg"]},
        ]
    return rows


if __name__ == "__main__":
    append("calibration", [*charuco_rows(), *balance_rows()])
