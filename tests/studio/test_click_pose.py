"""A person's first pose by clicks in a real browser: landmarks, a pixel off, become the pose that the command finds."""

import shutil
import time

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import SAMPLED, Pose, human18
from airborne.cameras import Rig, camera_looking_at, write_pose2sim
from airborne.run.first_pose import find_first_pose
from airborne.studio.fitting import FirstPoseFit
from airborne.studio.pages import fit_pose
from airborne.studio.starts import standing_pose
from airborne.trial.file import read_trial
from tests.support.browser import open_page
from tests.support.clips import write_clip
from tests.support.studio import at_pixel, fork_studio, wait_for_frame, wait_for_still_scene, wait_until

SIZE = (640, 480)
FRAME, N_FRAMES = 3, 6
MOST_OFF_M = 0.035  # four pixels at the body, each click having one as its deviation, right and down
NEAR_PX, MOVED_M, TURNED = 4.0, 0.25, np.radians(3)
TRUNK = """pane => {
    const { view } = document.querySelector("canvas.view");
    const { points } = view.nowItems().find((item) => item.grab && item.pane === pane);
    return [0, 1].map((axis) => {
        const all = points.map((point) => point[axis]);
        const share = axis ? 0.33 : 0.5; // the chest of a body that stands
        return (1 - share) * Math.min(...all) + share * Math.max(...all);
    });
}"""
MIDDLE = """() => {
    const { view } = document.querySelector("canvas.view");
    const points = view.nowItems().filter((item) => item.grab && item.pane === 0).flatMap((item) => item.points);
    const mean = (axis) => Math.round(points.reduce((sum, point) => sum + point[axis], 0) / points.length);
    return points.length ? [mean(0), mean(1)] : null;
}"""
GIZMO = """() => {
    const scene = getElement(Number(document.querySelector(".nicegui-scene").id.slice(1)));
    return [...scene.objects.values()].map((each) => each.component).find((each) => each?.handles && each.mesh.parent);
}"""
HANDLE = """([axis, turns]) => { // where on the page a handle is, and where it is dragged to
    const gizmo = (GIZMO)(), { camera, renderer } = gizmo.view, box = renderer.domElement.getBoundingClientRect();
    const spot = (...at) => {
        const { x, y } = gizmo.mesh.position.clone().set(...at).multiplyScalar(gizmo.size)
            .add(gizmo.mesh.position).project(camera);
        return [box.left + (box.width * (1 + x)) / 2, box.top + (box.height * (1 - y)) / 2];
    };
    const others = [axis[1], axis[2], axis[0]], round = (angle) => {
        const third = [axis[2], axis[0], axis[1]];
        return spot(...[0, 1, 2].map((n) => 0.7 * (Math.cos(angle) * others[n] + Math.sin(angle) * third[n])));
    };
    if (turns) return [round(0.8), round(1.3)];
    return [spot(...axis.map((a) => 0.9 * a)), spot(...axis.map((a) => 1.3 * a))];
}""".replace("GIZMO", GIZMO)
LANDMARKS = ("hip_left", "hip_right", "shoulder_left", "shoulder_right", "knee_left", "knee_right")
TRIAL = """name = "person"
camera = [{ name = "a", video = "a.mp4" }, { name = "b", video = "b.mp4" }]
calibration = { file = "calib.toml" }
body = { preset = "human18", stature_m = 1.75, mass_kg = 70.0 }
"""


@pytest.fixture(scope="module")
def rig():
    places = {"a": [3.0, -4.0, 1.5], "b": [-4.0, -3.0, 1.2]}
    return Rig(tuple(camera_looking_at(n, p, [0, 0, 1.1], focal_px=600, size=SIZE) for n, p in places.items()))


@pytest.fixture(scope="module")
def folder(rig, tmp_path_factory):
    """A trial without a start, whose videos show nothing."""
    folder = tmp_path_factory.mktemp("studio") / "person"
    folder.mkdir()
    grey = [np.full((SIZE[1], SIZE[0], 3), 110, np.uint8)] * N_FRAMES
    for name in rig.names:
        write_clip(folder / f"{name}.mp4", grey, codec="libx264", pix_fmt="yuv420p")
    write_pose2sim(folder / "calib.toml", rig)
    (folder / "trial.toml").write_text(TRIAL)
    return folder


def test_clicked_landmarks_become_the_first_pose(rig, folder):
    model = human18(1.75, 70.0, outfit=SAMPLED)
    true = Pose(world_from_root=RigidTransform.from_components([0.1, 0.0, 1.0], Rotation.from_rotvec([0, 0, 0.4])))
    names, points = [each.name for each in model.landmarks], model.with_pose(true).landmarks
    rng = np.random.default_rng(0)
    with fork_studio(folder) as address, open_page(address.replace("/?", "/start?")) as page:
        wait_for_frame(page, 0)
        for frame in range(1, FRAME + 1):
            page.locator("canvas.view").press(".")
            wait_for_frame(page, frame)
        page.get_by_text(f"No landmark is clicked in frame {FRAME} yet.").wait_for()
        for name in LANDMARKS:
            page.locator(".point", has_text=name).click()
            for pane, camera in enumerate(rig):
                px = camera.px_from_world(points[names.index(name)]) + rng.standard_normal(2)
                page.mouse.click(*at_pixel(page, pane, *px))
            page.locator(".point.here", has_text=name).get_by_text(".").nth(1).wait_for()
        page.get_by_role("button", name="Use this pose").click(timeout=120_000)
        page.get_by_text("the first pose is written into the trial").wait_for()
    trial = read_trial(folder / "trial.toml")
    assert (trial.start.frame, trial.start.points_px) == (FRAME, f"start_points_{FRAME}.csv")
    pose = find_first_pose(trial, trial.model(), rig, None).pose
    rows = [names.index(name) for name in LANDMARKS]
    off_m = np.linalg.norm(model.with_pose(pose).landmarks[rows] - points[rows], axis=1)
    assert off_m.max() < MOST_OFF_M


def drag_trunk(page, pane, by_px, *, held=None):
    """Drag the body by its trunk in a picture."""
    u, v = page.evaluate(TRUNK, pane)
    if held is not None:
        page.keyboard.down(held)
    page.mouse.move(*at_pixel(page, pane, u, v))
    page.mouse.down()
    page.mouse.move(*at_pixel(page, pane, u + by_px[0], v + by_px[1]), steps=8)
    page.mouse.up()
    if held is not None:
        page.keyboard.up(held)
    for what in ("pulling", "live"):
        page.wait_for_function(f"document.querySelector('canvas.view').view.{what} === null")


def drag_handle(page, axis, *, turns):
    """Drag a handle of the 3D scene by 40 px, along its arrow or around its ring."""
    page.wait_for_selector(".nicegui-scene")
    page.wait_for_function(f"() => ({GIZMO})() !== undefined")
    wait_for_still_scene(page)
    at = page.evaluate(HANDLE, [axis, turns])
    page.mouse.move(*at[0])
    page.mouse.down()
    page.mouse.move(*at[1], steps=6)
    page.mouse.up()


def use_pose(page, folder, before):
    """Write the pose that is shown until it is another than before, and stays; return it."""
    last = before
    for _ in range(60):
        page.get_by_role("button", name="Use this pose").click()
        page.wait_for_timeout(250)
        start = read_trial(folder / "trial.toml").start
        if start == last != before:
            return start
        last = start
    raise AssertionError("the pose does not change")


def middle(page):
    """Return where the middle of the outline is in the first picture, rounded [px]; None without one."""
    return page.evaluate(MIDDLE)


def fit_slowly():
    """Let a fit take a second, in which the user may do something else, and lift the body."""

    def fit(session, model, frame, pose):
        time.sleep(1)
        return FirstPoseFit(pose.move(np.array([0, 0, MOVED_M]), np.zeros(3)), True, np.full(3, 0.003), ())

    fit_pose.fit_to_frame = fit


def test_a_pose_set_by_hand_waits_in_its_frame_for_whoever_turns_away_reloads_or_undoes(folder, tmp_path):
    folder = shutil.copytree(folder, tmp_path / "person", ignore=shutil.ignore_patterns(".airborne", "start_*"))
    (folder / "trial.toml").write_text(TRIAL)
    studio = fork_studio(folder, before=fit_slowly)
    with studio as address, open_page(address.replace("/?", "/start?")) as page:
        wait_for_frame(page, 0)
        page.get_by_text("No landmark is clicked in frame 0 yet.").wait_for()
        page.get_by_role("button", name="Place it by hand").click()
        page.get_by_text("Drag the body or its limbs; Shift turns it.", exact=True).wait_for()
        page.wait_for_function("document.querySelector('canvas.view').view.nowItems().length >= 2")
        placed = middle(page)
        drag_trunk(page, 0, (40.0, -18.0))
        page.get_by_text("The pose was set by hand.").wait_for()
        dragged = middle(page)
        assert dragged[0] > placed[0] + 30
        page.locator("canvas.view").press(".")
        page.get_by_text("No landmark is clicked in frame 1 yet.").wait_for()
        assert middle(page) is None
        page.locator("canvas.view").press(",")
        page.get_by_text("made here last").wait_for()
        page.wait_for_function("document.querySelector('canvas.view').view.nowItems().length >= 2")
        np.testing.assert_allclose(middle(page), dragged, atol=1)
        page.reload()
        page.get_by_text("made here last").wait_for()
        page.wait_for_function("document.querySelector('canvas.view').view.nowItems().length >= 2")
        np.testing.assert_allclose(middle(page), dragged, atol=1)
        page.locator("canvas.view").press("Control+z")
        page.get_by_text("undone: pose set by hand (draft.json)").wait_for()
        wait_until(page, lambda: abs(middle(page)[0] - placed[0]) <= 1)
        np.testing.assert_allclose(middle(page), placed, atol=1)
        page.get_by_role("button", name="Fit it to the pictures").click()
        page.get_by_text("fitting the body …").wait_for()
        page.locator("canvas.view").press(".")  # the fit ends while another frame is in view
        page.get_by_text("Frame 0 is fitted.", exact=False).first.wait_for()
        page.get_by_text("No landmark is clicked in frame 1 yet.").wait_for()
        page.locator("canvas.view").press(",")
        page.get_by_text("made here last").wait_for()
        page.wait_for_function("document.querySelector('canvas.view').view.nowItems().length >= 2")
        assert middle(page)[1] < placed[1] - 20  # the fit of this test lifts the body
        page.locator("canvas.view").press("Control+z")
        page.get_by_text("undone: pose fitted to the pictures (draft.json)").wait_for()
        page.wait_for_function(f"document.querySelector('canvas.view') && ({MIDDLE})()[1] > {placed[1] - 5}")
        page.locator("canvas.view").press("Control+z")
        page.get_by_text("No landmark is clicked in frame 0 yet.").wait_for()


def test_a_body_placed_by_hand_goes_where_drags_put_it(rig, folder):
    first, second = np.array([40.0, -18.0]), np.array([-55.0, 6.0])
    with fork_studio(folder) as address, open_page(address.replace("/?", "/start?")) as page:
        page.wait_for_function("document.querySelector('canvas.view')?.dataset.frame !== undefined")  # it listens
        page.locator("canvas.view").press("End")
        page.get_by_text(f"No landmark is clicked in frame {N_FRAMES - 1} yet.").wait_for()
        page.get_by_role("button", name="Place it by hand").click()
        page.wait_for_function("document.querySelector('canvas.view').view.nowItems().length >= 2")
        drag_trunk(page, 0, first)
        page.get_by_text("The pose was set by hand.").wait_for()
        drag_trunk(page, 1, second)
        page.get_by_role("button", name="Use this pose").click()
        page.get_by_text("the first pose is written into the trial").wait_for()
        before = read_trial(folder / "trial.toml").start
        page.get_by_role("button", name="Move and turn it in 3D").click()
        drag_handle(page, [0, 0, 1], turns=False)
        lifted = use_pose(page, folder, before)
        drag_handle(page, [0, 1, 0], turns=True)
        turned = use_pose(page, folder, lifted)
        drag_trunk(page, 0, (25.0, 0.0), held="Shift")
        after = use_pose(page, folder, turned)
    np.testing.assert_allclose(np.array(lifted.position_m)[:2], before.position_m[:2], atol=1e-4)
    assert lifted.position_m[2] > before.position_m[2] + MOVED_M
    np.testing.assert_allclose(turned.position_m, lifted.position_m, atol=1e-4)
    axis = turned.rotation.as_rotvec()
    assert abs(axis[1]) > TURNED and np.abs(axis[[0, 2]]).max() < 1e-3
    assert before.frame == N_FRAMES - 1 and before.points_px is None
    standing = standing_pose(human18(1.75, 70.0, outfit=SAMPLED), rig).world_from_root.translation
    moved_px = rig["a"].px_from_world(np.array(before.position_m)) - rig["a"].px_from_world(standing)
    np.testing.assert_allclose(moved_px, first, atol=NEAR_PX)  # the second drag has kept what the first one set
    assert np.linalg.norm(np.array(before.position_m) - standing) > MOVED_M
    assert before.rotation.magnitude() < 1e-6 < TURNED < (turned.rotation.inv() * after.rotation).magnitude()
    np.testing.assert_allclose(after.position_m, turned.position_m, atol=1e-4)
