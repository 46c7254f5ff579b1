"""Measure calibrations from few clicked points: `python benchmarks/accuracy/few_points.py` (two minutes).

Four cameras with lenses that distort, all seeing the same points of a volume 6 m wide and 2.5 m high, or three around a
volleyball court; clicks err by 0.7 or 1 px (sd), the court's points as its rules allow. Every lens is another.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append

from airborne.calibration import calibrate_from, sources_from
from airborne.calibration.sources.court import court_points, survey_points
from airborne.cameras import Camera, Rig, camera_looking_at
from airborne.types import Array

WIDTH, HEIGHT = 1920, 1080  # [px]; chosen as usual
SEEDS, N_POINTS = range(11, 21), (8, 12, 17)  # chosen: any; fewer points than were asked of a lens once


def around_a_volume(rng: np.random.Generator) -> Iterator[Camera]:
    """Yield four cameras 5 to 8 m off."""
    for k in range(4):
        angle, far = rng.uniform(0, 2 * np.pi), rng.uniform(5, 8)
        at = [far * np.cos(angle), far * np.sin(angle), rng.uniform(1, 4)]
        focal_px = rng.uniform(0.55, 1.2) * WIDTH
        camera = camera_looking_at(f"c{k}", at, [0, 0, 1], focal_px=focal_px, size=(WIDTH, HEIGHT))
        yield distort(camera, rng.uniform(-0.25, 0.03))


def around_a_court(rng: np.random.Generator) -> Iterator[Camera]:
    """Yield three cameras behind a volleyball court, on both sides."""
    for k, (x, y) in enumerate([(-9, -12), (9, -12), (0, 14)]):
        at = [x + rng.normal(0, 1), y + rng.normal(0, 1), rng.uniform(2, 5)]
        focal_px = rng.uniform(0.6, 1.0) * WIDTH
        camera = camera_looking_at(f"c{k}", at, [0, 0, 1.5], focal_px=focal_px, size=(WIDTH, HEIGHT))
        yield distort(camera, rng.uniform(-0.25, 0.025))


def distort(camera: Camera, k1: float) -> Camera:
    """Return a camera with radial distortion."""
    return replace(camera, distortion=np.array([k1, 0.8 * k1**2, 0, 0, 0]))


def calibrate(
    rng: np.random.Generator, rig: Rig, named: Mapping[str, Array], seen: Array, folder: Path, *, is_court: bool
) -> tuple[Array, Array]:
    """Click points, seen (n, 3) [m] where they are in truth; return errors and sds of the cameras' places (m, 3)."""
    columns = [f"{camera.name}_{axis}" for camera in rig for axis in "uv"]
    px = np.concatenate(
        [c.px_from_world(seen) + rng.normal(0, 1.0 if is_court else 0.7, (len(seen), 2)) for c in rig], 1
    )
    is_out = ~((px > 0) & (px < np.tile([WIDTH - 1, HEIGHT - 1], len(rig))))
    is_out = (is_out[:, ::2] | is_out[:, 1::2]).repeat(2, axis=1)
    lines = [",".join(["point", *(() if is_court else ("x_m", "y_m", "z_m")), *columns])]
    for (name, place), row, out in zip(named.items(), px, is_out, strict=True):
        cells = ["" if no else f"{value:.2f}" for value, no in zip(row, out, strict=True)]
        lines.append(",".join([name, *(() if is_court else map(repr, place.tolist())), *cells]))
    (folder / "points.csv").write_text("\n".join(lines) + "\n")
    table = {"court": {"file": "points.csv"}} if is_court else {"control_points": {"file": "points.csv"}}
    cameras = [{"name": camera.name, "size": list(camera.size)} for camera in rig]
    found = calibrate_from(sources_from({"camera": cameras, **table}, folder, "points"), lambda *_: None)
    errors = np.stack([found.rig[camera.name].centre - camera.centre for camera in rig])
    return errors, found.adjustment.camera_sd[:, 3:6]


def measure(n: int) -> list[dict]:
    """Calibrate with n points, or with a court's where n is 0, from every seed; return the rows."""
    found = []
    for seed in SEEDS:
        rng = np.random.default_rng([seed, n])
        if n:
            rig = Rig(tuple(around_a_volume(rng)))
            seen = np.column_stack([rng.uniform(-3, 3, n), rng.uniform(-3, 3, n), rng.uniform(0, 2.5, n)])
            named = {f"P{k}": place for k, place in enumerate(seen)}
        else:
            points, names = court_points(), [*survey_points("men")]
            named = {name: points[name].position_m for name in names}
            seen = np.array([named[name] + rng.normal(0, 1, 3) * points[name].sd_m for name in names])
            rig = Rig(tuple(around_a_court(rng)))
        with TemporaryDirectory() as folder:
            found.append(calibrate(rng, rig, named, seen, Path(folder), is_court=not n))
    errors, sds = (np.concatenate(each) for each in zip(*found, strict=True))
    far = np.linalg.norm(errors, axis=1)
    common = {"data": f"{n} points" if n else "a court", "method": "bundle", "n": len(far)}
    return [
        {**common, "metric": "place, RMS", "unit": "mm", "value": 1e3 * float(np.sqrt(np.mean(far**2)))},
        {**common, "metric": "place, median", "unit": "mm", "value": 1e3 * float(np.median(far))},
        {**common, "metric": "within two sds", "unit": "", "value": float(np.mean(np.abs(errors) < 2 * sds))},
    ]


if __name__ == "__main__":
    append("few_points", [row for n in (*N_POINTS, 0) for row in measure(n)])
