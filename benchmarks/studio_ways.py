"""From a folder with only videos and what was surveyed to a report, in a real browser, by clicks and keys alone.

    python benchmarks/studio_ways.py block_jump|somersault_1 RECORDING [--rows]

Every click is a pixel off (one sd, right and down), at the truth's place. The result is compared with that of the
prepared trial in the recording's folder, tracked with the same code: RMS distances from the truth. Prints JSON: clicks,
minutes, both errors. `--rows` appends to benchmarks/results/studio.csv.
"""

from __future__ import annotations

import argparse
import csv
import json
import shutil
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from rows import append

from airborne.calibration.sources.control_points import read_control_points
from airborne.cameras import read_rig
from airborne.run.track import track_trial
from airborne.trial.file import read_trial
from tests.support.browser import MINUTE, open_page
from tests.support.studio import User, open_studio, wait_for_frame

SURVEYED = (  # of the court, spread over length, width and height
    "far_corner_L", "near_attack_x_sideline_L", "post_foot_L", "post_top_L", "antenna_top_L", "far_corner_R",
    "near_attack_x_sideline_R", "post_foot_R", "post_top_R", "antenna_top_R", "centre_x_sideline_L",
    "centre_x_sideline_R",
)  # fmt: skip
PLAYER_POINTS = ("torso", *(f"{joint}_{side}" for joint in ("hip", "knee", "ankle") for side in ("left", "right")))
PERSON_POINTS = [
    f"{joint}_{side}" for joint in ("hip", "shoulder", "knee", "ankle", "foot", "elbow", "wrist", "hand")
    for side in ("left", "right")
] + ["head"]  # fmt: skip
FLOORS = {"block_jump": 90, "somersault_1": 120}  # clicks
MOST_WORSE = 1.1  # times the error of the prepared trial
STATURE, MASS = "1.74", "70"


def truth_of(recording: Path) -> dict[str, np.ndarray]:
    """Return the true places of joints: joint -> (frames, 3) [m]."""
    if (recording / "truth_joints.csv").is_file():
        found: dict[str, list] = {}
        with (recording / "truth_joints.csv").open() as file:
            for row in csv.DictReader(file):
                found.setdefault(row["joint"], []).append([float(row[f"{axis}_m"]) for axis in "xyz"])
        return {name: np.array(rows) for name, rows in found.items()}
    with (recording / "truth.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["player"] == "blocker1"]
    names = {  # of the columns
        f"{joint}_{side}": f"{side[0]}_{joint}" for joint in ("hip", "knee", "ankle") for side in ("left", "right")
    }
    names["torso"] = "torso"
    return {
        name: np.array([[float(row[f"{column}_{axis}"]) for axis in "xyz"] for row in rows])
        for name, column in names.items()
    }


def error_mm(run: Path, truth: dict[str, np.ndarray]) -> float:
    """Return the RMS distance of a run's joints from the truth."""
    off = []
    with (run / "joints.csv").open() as file:
        for row in csv.DictReader(file):
            if row["joint"] in truth and row["joint"] != "torso" and row["x_m"] not in ("", "nan"):
                place = truth[row["joint"]][int(row["frame"])]
                off.append(np.sum((np.array([float(row[f"{axis}_m"]) for axis in "xyz"]) - place) ** 2))
    return float(1e3 * np.sqrt(np.mean(off)))


def prepare(recording: Path, folder: Path) -> None:
    """Copy videos and what was surveyed: points on the court, or a calibration."""
    folder.mkdir()
    for path in [*recording.glob("*.mp4"), *recording.glob("Calib.toml")]:
        shutil.copyfile(path, folder / path.name)
    if (recording / "control_points.csv").is_file():
        points = read_control_points(recording / "control_points.csv")
        rows = [f"{name},{','.join(map(str, points.world[points.names.index(name)].tolist()))}" for name in SURVEYED]
        (folder / "survey.csv").write_text("point,x_m,y_m,z_m\n" + "\n".join(rows) + "\n")


def click_survey(user: User, recording: Path) -> None:
    """Calibrate by clicking surveyed points in every camera."""
    points = read_control_points(recording / "control_points.csv")
    user.click(user.page.get_by_label("surveyed points"))
    user.click(user.page.get_by_role("option"))
    wait_for_frame(user.page, 0)
    for name in SURVEYED:
        user.page.locator(".point.here", has_text=name).wait_for()
        for pane in range(len(points.cameras)):
            user.click_pixel(pane, points.px[points.names.index(name), pane])
        user.page.keyboard.press("n")
    user.page.get_by_text(f"{len(SURVEYED)} points, residual").nth(len(points.cameras) - 1).wait_for(timeout=5 * MINUTE)


def click_points(user: User, names: list[str], truth: dict[str, np.ndarray], rig, cameras: int) -> None:
    """Click points at the first frame, each in the first cameras."""
    for name in names:
        user.choose_point(name)
        for pane in range(cameras):
            user.click_pixel(pane, rig.cameras[pane].px_from_world(truth[name][0]))
            user.page.locator(".point.here", has_text=name).get_by_text("•").or_(
                user.page.locator(".point.here", has_text=name).get_by_text(".")
            ).nth(pane).wait_for()


def go_way(name: str, recording: Path, folder: Path, truth: dict[str, np.ndarray]) -> tuple[int, float]:
    """Go from the folder to the report; return clicks and minutes."""
    begun = time.monotonic()
    rig = read_rig(next(path for path in (recording / "calib.toml", recording / "Calib.toml") if path.is_file()))
    with open_studio(folder) as address, open_page(address) as page:
        page.set_default_timeout(3 * MINUTE)
        user = User(page)
        page.get_by_text("Use these cameras").wait_for()
        user.press("Use these cameras")
        page.get_by_text(f"{len(rig)} cameras", exact=True).wait_for()
        user.go("Cameras")
        if name == "block_jump":
            click_survey(user, recording)
        else:
            user.click(page.get_by_label("calibration file"))
            user.click(page.get_by_role("option"))
            page.get_by_text("focal length").first.wait_for()
        user.go("Body")
        if name == "block_jump":
            user.press("Use players")
        else:
            page.get_by_label("stature [m]").fill(STATURE)
            page.get_by_label("mass [kg]").fill(MASS)
            user.press("Use this person")
        page.get_by_text("the body is written into the trial").wait_for()
        user.go("First pose")
        wait_for_frame(page, 0)
        points = list(PLAYER_POINTS if name == "block_jump" else PERSON_POINTS)
        click_points(user, points, truth, rig, 3)
        user.press("Use these players" if name == "block_jump" else "Use this pose")
        page.get_by_text("written into the trial").first.wait_for()
        user.go("Track")
        user.press("Track")
        page.get_by_text("tracked; the report is in the step Results").wait_for(timeout=60 * MINUTE)
        user.go("Results")
        with page.expect_popup() as popup:
            user.click(page.get_by_text("Open the report"))
        popup.value.get_by_role("heading").first.wait_for()
    return user.clicks, (time.monotonic() - begun) / 60


def rows_of(name: str, found: dict[str, float]) -> list[dict[str, object]]:
    """Return what is kept of a way: clicks, minutes, and the error beside that of the prepared trial."""
    by_hand, prepared = (
        {"data": name, "method": method, "n": 1} for method in ("studio, from videos", "prepared trial")
    )
    most_mm = round(MOST_WORSE * found["prepared [mm]"], 1)
    error = {"metric": "RMS error", "unit": "mm"}
    return [
        {**by_hand, "metric": "clicks to the report", "unit": "", "value": found["clicks"], "floor": FLOORS[name]},
        {**by_hand, "metric": "time to the report", "unit": "min", "value": found["minutes"]},
        {**by_hand, **error, "value": found["by hand [mm]"], "floor": most_mm},
        {**prepared, **error, "value": found["prepared [mm]"]},
    ]


def main() -> None:
    """Go the way, track the prepared trial, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", choices=list(FLOORS))
    parser.add_argument("recording", type=Path)
    parser.add_argument("--rows", action="store_true")
    given = parser.parse_args()
    truth = truth_of(given.recording)
    with tempfile.TemporaryDirectory() as name:
        folder, prepared = Path(name) / "clicked", Path(name) / "prepared"
        prepare(given.recording, folder)
        clicks, minutes = go_way(given.name, given.recording, folder, truth)
        track_trial(read_trial(given.recording / "trial.toml"), prepared, pictures=False)
        found = {
            "clicks": clicks, "minutes": minutes, "by hand [mm]": error_mm(folder / "results", truth),
            "prepared [mm]": error_mm(prepared, truth),
        }  # fmt: skip
    print(json.dumps(found), flush=True)
    if given.rows:
        append("studio", rows_of(given.name, found))


if __name__ == "__main__":
    main()
