"""One person's digitising of the thrown cross in a real browser, 1.2 px off, is as good as the paper's: 10 mm, 3°."""

import json
import shutil

import numpy as np
from scipy.spatial.transform import Rotation

from airborne.body.files import read_body
from airborne.body.symmetry import symmetries
from airborne.evaluation import fit_digitised_poses, read_digitised, read_truth
from airborne.evaluation.digitised import body_points
from airborne.interface import calibrate
from tests.support.places import THROWN_CROSS
from tests.support.studio import at_pixel, fork_studio, open_page, wait_for_frame

CLICK_SD_PX = 1.2  # right and down
FRAMES = range(0, 32, 8)
POINTS = ("long_bar_minus", "long_bar_plus", "short_bar_minus", "short_bar_plus")


def test_the_cross_digitised_by_one_person(tmp_path):
    folder = tmp_path / "cross"
    shutil.copytree(THROWN_CROSS, folder)
    rig = calibrate(folder / "control_points.csv", sizes=(768, 576)).rig
    model, truth = read_body(folder / "cross.toml"), read_truth(folder / "truth.csv")
    on_body, rng = body_points(model, POINTS), np.random.default_rng(5)
    with fork_studio(folder) as address, open_page(address.replace("/?", "/digitise?")) as page:
        canvas = page.locator("canvas.view")
        for frame in FRAMES:
            while int(canvas.get_attribute("data-frame") or 0) < frame:
                now = int(canvas.get_attribute("data-frame") or 0)
                canvas.press(".")
                wait_for_frame(page, now + 1)
            wait_for_frame(page, frame)
            for name, point in zip(POINTS, on_body @ truth.R[frame].T + truth.position[frame], strict=True):
                page.locator(".point.here", has_text=name).wait_for()
                for pane, camera in enumerate(rig):
                    px = camera.px_from_world(point) + CLICK_SD_PX * rng.standard_normal(2)
                    page.mouse.click(*at_pixel(page, pane, *px))
                    page.locator(".point", has_text=name).get_by_text("•").nth(pane).wait_for()
        page.get_by_role("switch", name="epipolar help").click()
        page.locator(".point .n", has_text=".").first.wait_for()
    assert json.loads((folder / "digitised_A_1.json").read_text())["epipolar_help"]
    poses = fit_digitised_poses(read_digitised(folder / "digitised_A_1.csv", rig), rig, model)
    assert poses.index.tolist() == list(FRAMES)
    errors_mm = 1e3 * np.linalg.norm(poses.position - truth.position[poses.index], axis=1)
    turns = [
        min(Rotation.from_matrix(R @ S @ true.T).magnitude() for S in symmetries(model))
        for R, true in zip(poses.R, truth.R[poses.index], strict=True)
    ]
    assert np.sqrt(np.mean(errors_mm**2)) <= 10
    assert np.degrees(np.sqrt(np.mean(np.square(turns)))) <= 3


def test_a_click_belongs_to_the_frame_that_it_was_made_in(tmp_path):
    """Also where it is made before the page has heard of the frame."""
    folder = tmp_path / "cross"
    shutil.copytree(THROWN_CROSS, folder)
    script = """async ([pane, place, frames]) => {
        const canvas = document.querySelector("canvas.view"), box = canvas.getBoundingClientRect();
        const [x, y] = canvas.view.toScreen(canvas.view.layout()[pane], ...place);
        for (const frame of frames) {
            canvas.view.go(frame);
            while (canvas.dataset.frame != frame) await new Promise(requestAnimationFrame);
        }
        for (const name of ["pointerdown", "pointerup"]) {
            const at = { clientX: box.left + x, clientY: box.top + y, pointerId: 1, button: 0 };
            canvas.view["on_" + name](new PointerEvent(name, at));
        }
    }"""
    with fork_studio(folder) as address, open_page(address.replace("/?", "/digitise?")) as page:
        wait_for_frame(page, 0)
        page.wait_for_function("document.querySelector('canvas.view').view.underway.size == 0")  # the next are here
        page.evaluate("document.querySelector('canvas.view').setPointerCapture = () => {}")  # no pointer is down
        page.evaluate(script, [0, [300.0, 200.0], [1, 2, 3]])
        page.get_by_text("frame 3; 1 click in 1 frame").wait_for()
    lines = (folder / "digitised_A_1.csv").read_text().splitlines()[1:]
    assert [int(line.split(",")[0]) for line in lines] == [3]
