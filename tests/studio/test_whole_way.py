"""From a folder of videos and what was surveyed to a report, in a real browser, by clicks and keys alone."""

import csv
import os
import shutil
from dataclasses import replace

import numpy as np
import pytest

from airborne.calibration.sources.control_points import read_control_points
from airborne.motion import read_motion
from tests.support.places import ROOT, THROWN_CROSS
from tests.support.studio import MINUTE, User, open_page, open_studio, wait_for_frame

MOST_CLICKS = 60
N_POINTS = 12  # surveyed points that are clicked in all three cameras
WORST_MM = 6.0  # RMS error of the cross's place


@pytest.fixture
def folder(tmp_path):
    """The thrown cross with nothing but videos, body and survey."""
    folder = tmp_path / "cross"
    folder.mkdir()
    for name in ("cam1.mp4", "cam2.mp4", "cam3.mp4", "cross.toml"):
        shutil.copyfile(THROWN_CROSS / name, folder / name)
    points = chosen_points()
    rows = [f"{name},{x},{y},{z}" for name, (x, y, z) in zip(points.names, points.world.tolist(), strict=True)]
    (folder / "survey.csv").write_text("point,x_m,y_m,z_m\n" + "\n".join(rows) + "\n")
    return folder


def chosen_points():
    """Return surveyed points that all cameras see, spread over the room."""
    points = read_control_points(THROWN_CROSS / "control_points.csv")
    seen = np.flatnonzero(np.isfinite(points.px[..., 0]).all(axis=1))
    kept = seen[np.linspace(0, len(seen) - 1, N_POINTS).astype(int)]
    return replace(
        points, names=tuple(points.names[k] for k in kept), world=points.world[kept], px=points.px[kept], sd_m=None
    )


def click_control_points(user, folder):
    points = chosen_points()
    for row, name in enumerate(points.names):
        user.page.locator(".point.here", has_text=name).wait_for()
        for pane in range(3):
            user.click_pixel(pane, points.px[row, pane])
        user.page.keyboard.press("n")
    user.page.get_by_text("12 points, residual").nth(2).wait_for()


def draw_docs(page):
    """Renew the docs' picture of the page, where that is asked for."""
    if os.environ.get("AIRBORNE_PICTURES"):
        canvas = page.locator("canvas.view")
        canvas.press("Home")
        for frame in range(1, 9):
            canvas.press("ArrowRight")
            wait_for_frame(page, frame)
        page.wait_for_timeout(3000)  # for the scene, which says nothing when it is drawn
        page.screenshot(path=ROOT / "docs" / "images" / "studio.jpg", type="jpeg", quality=72)


def draw_example(page, step):
    """Renew the picture of a step that is done well, where that is asked for."""
    if os.environ.get("AIRBORNE_PICTURES"):
        page.wait_for_function("!document.querySelector('.q-notification')")
        page.wait_for_timeout(2000)
        path = ROOT / "src" / "airborne" / "studio" / "examples" / f"{step}.jpg"
        page.locator(".main").screenshot(path=path, type="jpeg", quality=60)


def draw_digitising(page, folder):
    """Renew the picture of the step Digitise, which the way leaves out, with the clicks of the example."""
    if os.environ.get("AIRBORNE_PICTURES"):
        shutil.copyfile(THROWN_CROSS / "digitised.csv", folder / "digitised_A_1.csv")
        page.locator("nav a", has_text="Digitise").click()
        page.get_by_text("digitised_A_1.csv").first.wait_for()
        draw_example(page, "digitise")


def error_mm(folder):
    motion = read_motion(folder / "motion.csv")
    with (THROWN_CROSS / "truth.csv").open() as file:
        rows = list(csv.DictReader(file))
    truth = np.array([[float(rows[k][f"{axis}_m"]) for axis in "xyz"] for k in motion.index])
    return 1e3 * np.sqrt(np.mean(np.sum((motion.position - truth) ** 2, axis=1)))


def test_the_thrown_cross_from_videos_to_report(folder):
    requests = []
    with open_studio(folder) as address, open_page(address, requests) as page:
        user = User(page)
        page.get_by_text("Use these cameras").wait_for()
        user.press("Use these cameras")
        page.get_by_text("3 cameras", exact=True).wait_for()
        draw_example(page, "videos")
        user.go("Cameras")
        user.click(page.get_by_label("surveyed points"))
        user.click(page.get_by_role("option"))
        wait_for_frame(page, 0)
        click_control_points(user, folder)
        draw_example(page, "cameras")
        user.go("Body")
        user.press("Use this body")
        page.get_by_text("cross.toml", exact=True).nth(0).wait_for()
        draw_example(page, "body")
        user.go("First pose")
        wait_for_frame(page, 0)
        user.press("Find it")
        page.get_by_role("button", name="Use this pose").wait_for(timeout=10 * MINUTE)
        page.get_by_text("Not yet used: press Use this pose.").wait_for()
        user.press("Use this pose")
        page.get_by_text("The trial has it.").wait_for()
        page.get_by_text("frame 0", exact=True).wait_for()
        draw_example(page, "first_pose")
        user.go("Track")
        user.press("Track")
        page.get_by_text("tracked; the report is in the step Results").wait_for(timeout=10 * MINUTE)
        draw_example(page, "track")
        user.go("Review")
        wait_for_frame(page, page.locator("canvas.view").evaluate("canvas => canvas.view.frame"))
        draw_docs(page)
        draw_example(page, "review")
        user.go("Results")
        with page.expect_popup() as popup:
            user.click(page.get_by_text("Open the report"))
        draw_example(page, "results")
        draw_digitising(page, folder)
        popup.value.get_by_role("heading").first.wait_for()
    print(f"{user.clicks} clicks, {error_mm(folder / 'results'):.1f} mm")
    assert user.clicks <= MOST_CLICKS
    assert error_mm(folder / "results") < WORST_MM
    assert {request.split("/")[2] for request in requests} == {address.split("/")[2]}
