"""Players clicked in a real browser, one after the other, and a length measured: both are in the trial's folder."""

from functools import partial

import numpy as np
import pytest

from airborne.cameras import Rig, camera_looking_at, write_pose2sim
from airborne.io.text import read_toml
from airborne.run.players_tracker import player_starts
from airborne.trial.file import read_trial
from tests.support.browser import open_page
from tests.support.clips import write_clip
from tests.support.studio import User, fork_studio, wait_for_frame

LEGS = {
    "torso": [0.0, 0.0, 1.2], "hip_left": [0.1, 0.0, 0.95], "hip_right": [-0.1, 0.0, 0.95],
    "knee_left": [0.12, 0.02, 0.5], "knee_right": [-0.12, 0.02, 0.5],
    "ankle_left": [0.12, 0.0, 0.1], "ankle_right": [-0.12, 0.0, 0.1],
}  # fmt: skip
ASIDE, OFF_M = np.array([0.9, 0.3, 0.0]), 0.05  # the bystander; clicks are a pixel off
TRIAL = """name = "block"
camera = [{ name = "a", video = "a.mp4" }, { name = "b", video = "b.mp4" }]
calibration = { file = "calib.toml" }
"""


def two_cameras(width=640):
    """Return cameras whose pictures have a width, and three quarters of it as their height [px]."""
    places, size = {"a": [3.0, -4.0, 1.5], "b": [-4.0, -3.0, 1.2]}, (width, 3 * width // 4)
    look = partial(camera_looking_at, target=[0.2, 0, 0.8], focal_px=width * 15 / 16, size=size)
    return Rig(tuple(look(name, place) for name, place in places.items()))


def write_block(folder, rig, n=4):
    """Write a trial without a body, whose videos show nothing, and return its folder."""
    folder.mkdir()
    for camera in rig:
        grey = [np.full((camera.size[1], camera.size[0], 3), 110, np.uint8)] * n
        write_clip(folder / f"{camera.name}.mp4", grey, codec="libx264", pix_fmt="yuv420p")
    write_pose2sim(folder / "calib.toml", rig)
    (folder / "trial.toml").write_text(TRIAL)
    return folder


@pytest.fixture(scope="module")
def rig():
    return two_cameras()


@pytest.fixture(scope="module")
def folder(rig, tmp_path_factory):
    return write_block(tmp_path_factory.mktemp("studio") / "block", rig)


def click_everywhere(user, rig, name, point):
    """Click a point in all cameras, once it is its turn."""
    user.choose_point(name)
    for pane, camera in enumerate(rig):
        user.click_pixel(pane, camera.px_from_world(np.array(point)))
        left = f"document.querySelector('.point.here').textContent.split('–').length - 1 == {len(rig) - pane - 1}"
        user.page.wait_for_function(left)  # so many cameras are not clicked yet


def test_players_are_clicked_and_a_length_is_measured(rig, folder):
    with fork_studio(folder) as address, open_page(address.replace("/?", "/body?")) as page:
        user = User(page)
        user.press("Use players")
        page.get_by_text("the body is written into the trial").wait_for()
        user.go("First pose")
        wait_for_frame(page, 0)
        for name, point in LEGS.items():
            click_everywhere(user, rig, name, point)
        page.get_by_text("Ready to use: player1.").wait_for()
        page.get_by_label("another player's name").fill("player3")
        user.press("Add")
        page.locator(".point.here", has_text="torso").wait_for()  # the new player's list
        click_everywhere(user, rig, "torso", LEGS["torso"] + ASIDE)
        page.get_by_text("Ready to use: player1, player3.").wait_for()
        user.press("Add")  # of those without a name, the first that is none of these
        page.get_by_label("player", exact=True).and_(page.locator("[value=player2]")).wait_for()
        user.press("Use these players")
        page.get_by_text("the first poses are written into the trial").wait_for()
        page.get_by_text("The trial's start, frame 0: player1, player3.").wait_for()  # also where nobody was clicked
        page.goto(address.split("?")[0] + "ruler")
        wait_for_frame(page, 0)
        click_everywhere(user, rig, "from", LEGS["ankle_left"])
        click_everywhere(user, rig, "to", LEGS["hip_left"])
        says = page.get_by_text("mm", exact=False).first.text_content()
    length_m, sd_mm = (float(word) for word in says.replace(" m, sd", "").replace(" mm", "").split())
    assert abs(length_m - np.linalg.norm(np.subtract(LEGS["hip_left"], LEGS["ankle_left"]))) < 4e-3 * sd_mm
    assert read_toml(folder / "trial.toml")["track"]["method"] == "blocker"
    trial = read_trial(folder / "trial.toml")
    starts = {start.name: start for start in player_starts(trial, rig)}
    assert {name: start.has_legs for name, start in starts.items()} == {"player1": True, "player3": False}
    for name, point in LEGS.items():
        assert np.linalg.norm(starts["player1"].joints_m[name] - point) < OFF_M
    assert np.linalg.norm(starts["player3"].joints_m["torso"] - (LEGS["torso"] + ASIDE)) < OFF_M
