"""A season of synthetic athletes: videos as a lab films them, and finished runs without any video."""

import csv
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from airborne.synthetic.throw.writing import write_trial
from tests.support.synthetic import small_scene

ATHLETES = {"anna": 0.0, "berta": 0.8, "carla": -0.6}  # how much faster each turns [rad/s]
CONDITIONS = {"slow": 0.0, "fast": 3.0}  # how much faster all turn [rad/s]
SEED = 11


def season_scenes(n_trials=2, n_pictures=10):
    """Yield the name and the scene of every throw: the same start, turning as athlete, condition and chance have it."""
    rng = np.random.default_rng(SEED)
    scene = small_scene(n_pictures=n_pictures, is_interlaced=False, is_surveyed=False)
    launch = scene.flight.launch
    for athlete, more in ATHLETES.items():
        for condition, turning in CONDITIONS.items():
            for number in range(1, n_trials + 1):
                speed = launch.angular_velocity + np.array([more + turning + rng.normal(0, 0.2), 0.0, 0.0])
                flight = replace(scene.flight, launch=replace(launch, angular_velocity=speed))
                yield f"{athlete}_{condition}_{number}", replace(scene, flight=flight)


def write_season(folder: Path, **options) -> None:
    """Write videos/<athlete>_<condition>_<number>_<camera>.mp4, calib.toml, body.toml, and one throw's start."""
    (folder / "videos").mkdir(parents=True)
    for name, scene in season_scenes(**options):
        with tempfile.TemporaryDirectory() as place:
            write_trial(scene, Path(place), overwrite=True)
            for video in Path(place).glob("*.mp4"):
                shutil.move(video, folder / "videos" / f"{name}_{video.name}")
            shutil.copy(Path(place) / "calib_true.toml", folder / "calib.toml")
            shutil.copy(Path(place) / "cross.toml", folder / "body.toml")
            text = (Path(place) / "trial.toml").read_text()
    (folder / "start.toml").write_text("[start]" + text.split("[start]")[1].split("[track]")[0])


def write_results(folder: Path, rows, curves=None) -> Path:
    """Write what a batch leaves: rows of trials.csv, and of each trial's angles.csv the somersault (n,) [deg]."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = [{"status": "done", "error": "", "folder": row["trial"]} | row for row in rows]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with (folder / "trials.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, columns, restval="")
        writer.writeheader()
        writer.writerows(rows)
    for name, values in (curves or {}).items():
        (folder / name / "tables").mkdir(parents=True, exist_ok=True)
        lines = [f"{k},{k / 100},{value},1.0" for k, value in enumerate(values)]
        header = "frame,time_s,somersault_deg,somersault_deg_sd"
        (folder / name / "tables" / "angles.csv").write_text("\n".join([header, *lines]) + "\n")
    return folder
