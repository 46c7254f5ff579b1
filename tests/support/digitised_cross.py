"""Someone who digitises the thrown cross in the studio, and a run that holds its truth, to compare the clicks with."""

import json
import shutil
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose
from airborne.body.files import read_body
from airborne.cameras import Rig, write_pose2sim
from airborne.evaluation import read_truth
from airborne.evaluation.digitised import body_points
from airborne.interface import calibrate
from airborne.motion import MotionWriter
from airborne.motion.run_folder import BODY, CALIBRATION, MOTION, SUMMARY
from airborne.tracking import Estimate, Status
from tests.support.places import THROWN_CROSS
from tests.support.studio import at_pixel, wait_for_frame

CLICK_SD_PX = 1.2  # right and down
MOST_MM, MOST_DEG = 10, 3  # the paper's
POINTS = ("long_bar_minus", "long_bar_plus", "short_bar_minus", "short_bar_plus")
TRUTH, MODEL = read_truth(THROWN_CROSS / "truth.csv"), read_body(THROWN_CROSS / "cross.toml")


def prepare_cross(folder: Path) -> Rig:
    """Copy the trial, without clicks, with a run that holds its truth; return its cameras."""
    shutil.copytree(THROWN_CROSS, folder)
    (folder / "digitised.csv").unlink()
    rig = calibrate(folder / "control_points.csv", sizes=(768, 576)).rig
    run = folder / "results"
    run.mkdir()
    write_pose2sim(run / CALIBRATION, rig)
    shutil.copyfile(folder / "cross.toml", run / BODY)
    n = len(TRUTH.index)
    counts = {"n_frames": n, "n_tracked": n, "n_uncertain": 0, "n_lost": 0}
    (run / SUMMARY).write_text(json.dumps({"name": "truth", **counts}))
    with MotionWriter(run / MOTION) as writer:
        for k, time_s, place, R in zip(TRUTH.index.tolist(), TRUTH.time_s, TRUTH.position, TRUTH.R, strict=True):
            root = RigidTransform.from_components(place, Rotation.from_matrix(R))
            pose = Pose(world_from_root=root, joint_angles=np.zeros((0, 3)))
            facts = {"covariance": 1e-6 * np.eye(6), "score": 5.0, "n_views": len(rig)}
            writer.append(Estimate(index=k, time_s=Fraction(time_s), status=Status.TRACKED, pose=pose, **facts))
    return rig


def digitise(page, rig: Rig, frames: Iterable[int]) -> None:
    """Click the ends of both bars in every camera, at the truth's places, CLICK_SD_PX off."""
    on_body, rng = body_points(MODEL, POINTS), np.random.default_rng(5)
    canvas = page.locator("canvas.view")
    for frame in frames:
        while (now := int(canvas.get_attribute("data-frame") or 0)) < frame:
            canvas.press(".")
            wait_for_frame(page, now + 1)
        wait_for_frame(page, frame)
        for name, point in zip(POINTS, on_body @ TRUTH.R[frame].T + TRUTH.position[frame], strict=True):
            page.locator(".point.here", has_text=name).wait_for()
            for pane, camera in enumerate(rig):
                px = camera.px_from_world(point) + CLICK_SD_PX * rng.standard_normal(2)
                page.mouse.click(*at_pixel(page, pane, *px))
                page.locator(".point", has_text=name).get_by_text("•").nth(pane).wait_for()


def compare(page, folder: Path) -> tuple[float, float]:
    """Press Compare, and return what the run's summary says: how far the clicks are off [mm] and [deg], RMS."""
    page.get_by_role("button", name="Compare", exact=True).click()
    page.get_by_text("digitised poses; rigid fit residual").wait_for()
    page.get_by_role("button", name="Close").last.click()
    found = json.loads((folder / "results" / SUMMARY).read_text())["digitised"]["tracked_minus_digitised"]
    return found["position"]["rms_3d_mm"], found["modulo_frame"]["geodesic_rms_deg"]
