"""A joint dragged in a view, in a real browser: a key at that frame, from which the run is tracked again."""

import re
import shutil

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.cameras import read_rig
from airborne.io.text import read_toml
from airborne.motion import MotionWriter, read_motion
from airborne.motion.files import read_estimates
from airborne.motion.run_folder import read_summary
from airborne.run.track import track_trial
from airborne.tracking.estimate import lost_estimate
from airborne.trial.file import read_trial
from tests.support.browser import MINUTE, open_page
from tests.support.example_trial import copy_cross
from tests.support.studio import at_pixel, fork_studio, go_home, wait_for_frame, wait_for_still_scene

FRAME, TURNED, LOST, LAST, CAMERA, DRAGGED_PX = 3, 4, 5, 6, 1, (16.0, -12.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The thrown cross, its first frames tracked."""
    folder = copy_cross(tmp_path_factory.mktemp("studio") / "cross")
    trial = folder / "trial.toml"
    trial.write_text(f"{trial.read_text()}\nstop = {LAST}\n")
    track_trial(read_trial(trial), folder / "results", pictures=False)
    return folder


def lose_frame(path, frame):
    """Let the body be lost in a frame of a run."""
    estimates, joints = read_estimates(path), read_motion(path).joints
    estimates[frame] = lost_estimate(frame, estimates[frame].time_s)
    path.unlink()
    with MotionWriter(path, joints) as writer:
        for each in estimates:
            writer.append(each)


def wait_for_mark(page, mark, u):
    """Wait until a joint is shown where it is in the frame."""
    script = """([id, u]) => {
        const { view } = document.querySelector("canvas.view");
        return view.marks.some((mark) => mark.id === id && Math.abs(mark.u - u) < 1);
    }"""
    page.wait_for_function(script, arg=[mark, float(u)])


def times_smaller(page):
    """How many times smaller than its video each picture is."""
    return page.evaluate("""() => {
        const { shown, panes } = document.querySelector("canvas.view").view;
        return shown.pictures.map((picture, pane) => panes[pane].width / picture.width);
    }""")


def drag_body(page, middle_px, key=None):
    """Drag the end of the body that is farthest from its middle, with a key down."""
    script = """([pane, u0, v0]) => {
        const { view } = document.querySelector("canvas.view");
        const points = view.nowItems().filter((item) => item.grab && item.pane === pane).flatMap((item) => item.points);
        const far = ([u, v]) => Math.hypot(u - u0, v - v0);
        return points.length ? points.reduce((a, b) => far(a) > far(b) ? a : b) : null;
    }"""
    arguments = [CAMERA, *map(float, middle_px)]
    page.wait_for_function(script, arg=arguments)
    u, v = page.evaluate(script, arguments)
    if key is not None:
        page.keyboard.down(key)
    page.mouse.move(*at_pixel(page, CAMERA, u, v))
    page.mouse.down()
    page.mouse.move(*at_pixel(page, CAMERA, u + 12, v + 12), steps=4)
    page.mouse.up()
    if key is not None:
        page.keyboard.up(key)


def test_a_correction_is_of_its_own_windows_frame_whatever_another_window_shows(folder, tmp_path):
    folder = shutil.copytree(folder, tmp_path / "cross")
    rows, rig = read_motion(folder / "results" / "motion.csv"), read_rig(folder / "results" / "calib.toml")
    model, camera = read_trial(folder / "trial.toml").model(), rig.names[CAMERA]
    name = model.landmarks[0].name
    here, there = (rig[camera].px_from_world(model.with_pose(rows.pose(n)).landmarks[0]) for n in (FRAME, FRAME - 2))
    with fork_studio(folder / "trial.toml") as address, open_page(address.replace("/?", "/review?")) as page:
        open_correction(page, FRAME)
        wait_for_mark(page, f"{name}|{camera}", here[0])
        other = page.context.new_page()
        other.goto(page.url)
        open_correction(other, FRAME - 2)
        wait_for_mark(other, f"{name}|{camera}", there[0])
        drag_joint(page, here)
        page.get_by_text(f"{name} corrected in {camera}, frame {FRAME}").first.wait_for()
        other.get_by_text("Not tracked yet: ").wait_for()
        wait_for_mark(other, f"{name}|{camera}", there[0])
        other.get_by_role("button", name="Leave it out").click()
        other.get_by_text(f"left out of frame {FRAME - 2}").first.wait_for()
        page.get_by_text(re.compile(f"{rig.names[0]}: {FRAME - 2} +✕")).wait_for()
        wait_for_mark(page, f"{name}|{camera}", here[0] + DRAGGED_PX[0])  # not the other's, drawn over this picture
    (key,) = read_toml(folder / "trial.toml")["key"]
    assert key["frame"] == FRAME


def open_correction(page, frame):
    """Go to a frame in Review, its joints to be grabbed."""
    page.wait_for_function("document.querySelector('canvas.view')?.dataset.frame !== undefined")
    go_home(page)
    page.get_by_role("switch", name="Correct").click()
    for number in range(1, frame + 1):
        page.locator("canvas.view").press(".")
        wait_for_frame(page, number)


def drag_joint(page, px):
    """Drag what is at a pixel of the camera."""
    page.bring_to_front()
    page.mouse.move(*at_pixel(page, CAMERA, *px))
    page.mouse.down()
    page.mouse.move(*at_pixel(page, CAMERA, *(px + DRAGGED_PX)), steps=5)
    page.mouse.up()


def test_a_dragged_joint_and_a_turned_body_are_keys_and_their_frames_are_tracked_again(folder):
    run = folder / "results"
    before, rig = read_motion(run / "motion.csv"), read_rig(run / "calib.toml")
    lose_frame(run / "motion.csv", LOST)
    model = read_trial(folder / "trial.toml").model()
    name = model.landmarks[0].name
    u, v = rig.cameras[CAMERA].px_from_world(model.with_pose(before.pose(FRAME)).landmarks[0])
    with fork_studio(folder / "trial.toml") as address, open_page(address.replace("/?", "/review?")) as page:
        wait_for_frame(page, 0)
        go_home(page)
        still = wait_for_still_scene(page)
        assert min(times_smaller(page)) >= 2  # pictures are no larger than they are drawn
        page.mouse.move(*at_pixel(page, 0, 200, 160))
        page.mouse.wheel(0, -1200)
        page.wait_for_function("document.querySelector('canvas.view').view.shown.shrinks[0] === 1")
        assert times_smaller(page)[0] == 1
        page.locator("canvas.view").press("0")
        open_correction(page, FRAME)
        assert wait_for_still_scene(page) > still  # drawn when the body moved, and not all the time
        wait_for_mark(page, f"{name}|{rig.names[CAMERA]}", u)
        drag_joint(page, np.array([u, v]))
        page.get_by_text(f"{name} corrected in {rig.names[CAMERA]}, frame {FRAME}").first.wait_for()
        again = page.get_by_role("button", name="Track again around it")
        page.get_by_label("frame in view").press("Control+z")  # heard there too
        again.wait_for(state="hidden")  # nothing is left of it
        wait_for_mark(page, f"{name}|{rig.names[CAMERA]}", u)
        page.get_by_label("all frames").press("Control+y")
        page.get_by_text("Not tracked yet: ").wait_for()
        wait_for_mark(page, f"{name}|{rig.names[CAMERA]}", u + DRAGGED_PX[0])
        page.locator("canvas.view").press(".")
        wait_for_frame(page, TURNED)
        later = rig.cameras[CAMERA].px_from_world(model.with_pose(before.pose(TURNED)).landmarks[0])
        wait_for_mark(page, f"{name}|{rig.names[CAMERA]}", later[0])
        drag_body(page, rig.cameras[CAMERA].px_from_world(before.position[TURNED]), "Shift")
        page.get_by_text(f"body turned, frame {TURNED}").first.wait_for()
        page.get_by_role("button", name="Leave it out").click()  # the first camera, of the frame in view
        page.get_by_text(f"{rig.names[0]} left out of frame {TURNED}").first.wait_for()
        assert page.get_by_role("button", name="Next lost or unseen: 1").is_enabled()
        page.keyboard.press("r")
        wait_for_frame(page, LOST)
        page.get_by_text(f"Frame {LOST} is lost. The white outline is a guess").wait_for()
        drag_body(page, rig.cameras[CAMERA].px_from_world(before.position[LOST]))
        page.get_by_text(re.compile(f"corrected in {rig.names[CAMERA]}, frame {LOST}")).first.wait_for()
        again.click()
        page.get_by_text(f"frames {FRAME - 2} to {LAST - 1} tracked again; at frame ").wait_for(timeout=5 * MINUTE)
        page.get_by_role("button", name="Next lost or unseen: none").wait_for()
        label = "document.querySelector('canvas.view').view.shown.overlay.label"
        page.wait_for_function(f"{label}.endsWith('tracked')")
    key, turned, found = read_toml(folder / "trial.toml")["key"]
    assert (found["frame"], list(found)) == (LOST, ["frame", "points_px"])
    assert turned["frame"] == TURNED
    assert read_toml(folder / "trial.toml")["mask"] == [{"camera": rig.names[0], "first": TURNED, "last": TURNED}]
    assert read_summary(run)["masks"] == [{"camera": rig.names[0], "first": TURNED, "last": TURNED}]
    assert "no image" not in (run / "summary.json").read_text()  # it was not the camera that failed
    was, now = Rotation.from_quat(before.quaternion[TURNED]), Rotation.from_quat(turned["quaternion_xyzw"])
    assert np.radians(2) < (was.inv() * now).magnitude() < np.radians(40)
    assert key["frame"] == FRAME
    np.testing.assert_allclose(key["points_px"][name][rig.names[CAMERA]], np.add([u, v], DRAGGED_PX), atol=1.5)
    after = read_motion(run / "motion.csv")
    assert after.index.tolist() == before.index.tolist() == list(range(LAST))
    assert np.array_equal(after.position[0], before.position[0])
    assert not np.array_equal(after.position[FRAME], before.position[FRAME])
    assert np.linalg.norm(after.position - before.position, axis=1).max() < 0.02
