"""A search that is undecided: its candidates are pictures to choose from, in a real browser."""

import json

import numpy as np
import pytest

from airborne.errors import UNDECIDED
from airborne.export.pictures import encode_png
from airborne.io.text import parse_editable_toml, read_toml
from airborne.run.first_pose import find_first_pose
from airborne.studio import commands
from airborne.studio.session import Session
from airborne.studio.starts import FOUND_LIST, FOUND_PICTURE, pose_of
from tests.support.browser import open_page
from tests.support.example_trial import copy_cross
from tests.support.studio import User, fork_studio, wait_for_frame

SHARES = (0.6, 0.4)
SIZE = (60, 40)
LANDMARKS = {"top": [0, 0.45, 0], "bottom": [0, -0.45, 0], "left": [-0.3, 0.18, 0]}  # of the cross [m]
LANDMARK = '\n[[landmark]]\nname = "{}"\nsegment = "cross"\nposition_m = {}\n'
TRUE = {"position_m": [0.0, 0.0, 1.6], "quaternion_xyzw": [0.0, 0.0, 0.0, 1.0]}
MOST_OFF_M = 0.03  # four pixels at the body, each click having one as its deviation, right and down


def undecided():
    """Let every command end as a search does that could not decide."""
    commands._RUN = f"raise SystemExit({UNDECIDED})"


@pytest.fixture
def folder(tmp_path):
    """The thrown cross without a start, and what an undecided search leaves."""
    folder = copy_cross(tmp_path / "cross")
    trial = parse_editable_toml((folder / "trial.toml").read_text())
    start = dict(trial.pop("start"))
    (folder / "trial.toml").write_text(trial.as_string())
    (folder / FOUND_LIST).parent.mkdir(parents=True)
    turned = [[0, 0, 0, 1], [0, 0, 1, 0]]
    candidates = [
        {"number": k, "probability": share, "position_m": list(start["position_m"]), "quaternion_xyzw": turn}
        for k, (share, turn) in enumerate(zip(SHARES, turned, strict=True), start=1)
    ]
    (folder / FOUND_LIST).write_text(json.dumps({"frame": 2, "candidates": candidates}))
    (folder / FOUND_PICTURE).write_bytes(encode_png(np.full((*SIZE[::-1], 3), 200, np.uint8)))
    return folder


def test_candidates_are_pictures_with_a_button_each(folder):
    with fork_studio(folder, before=undecided) as address, open_page(address.replace("/?", "/start?")) as page:
        user = User(page)
        wait_for_frame(page, 0)
        user.press("Find it")
        page.get_by_text("The pictures do not decide", exact=False).wait_for()
        picture = page.get_by_role("img", name="the candidates")
        picture.wait_for()
        page.wait_for_function("() => document.querySelector('.found img').naturalWidth")
        assert picture.evaluate("image => [image.naturalWidth, image.naturalHeight]") == list(SIZE)
        assert picture.bounding_box()["y"] < page.get_by_role("button", name="candidate 1, 60 %").bounding_box()["y"]
        user.press("candidate 2, 40 %")
        wait_for_frame(page, 2)
        user.press("Use this pose")
        page.get_by_text("The trial begins with this pose.").wait_for()
        with page.expect_popup() as popup:
            user.click(picture)
        popup.value.locator("img").wait_for()
        assert read_toml(folder / "trial.toml")["start"]["quaternion_xyzw"] == [0, 0, 1, 0]
        assert page.get_by_text("To click points of this thing too").count() == 1
        with (folder / "cross.toml").open("a") as file:
            file.writelines(LANDMARK.format(name, at) for name, at in LANDMARKS.items())
        page.reload()
        user.click(page.get_by_role("button", name="Click the points"))
        page.get_by_text("Three landmarks that are not on one line are needed.", exact=False).wait_for()
        clicks_give_the_pose(user, folder)


def clicks_give_the_pose(user, folder):
    """Click a thing's landmarks where its cameras see them at its true pose, a pixel off; the body goes there."""
    session = Session(folder, folder / "trial.toml")
    model, rig = session.project().model(), session.rig()
    posed = model.with_pose(pose_of(model, TRUE))
    wait_for_frame(user.page, 2)
    for name, point in zip(LANDMARKS, posed.landmarks, strict=True):
        user.choose_point(name)
        for pane, camera in enumerate(rig):
            user.click_pixel(pane, camera.px_from_world(point))
        user.page.locator(".point.here", has_text=name).get_by_text(".").nth(2).wait_for()
    user.press("Use this pose")
    user.page.get_by_text("the first pose is written into the trial").wait_for()
    trial = session.project().trial()
    assert trial.start.points_px == "start_points_2.csv"
    found = find_first_pose(trial, model, rig, None).pose
    off_m = np.linalg.norm(model.with_pose(found).landmarks - posed.landmarks, axis=1)
    assert off_m.max() < MOST_OFF_M
