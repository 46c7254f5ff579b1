"""The studio killed while someone clicks and drags in a real browser: what is older than two seconds is there again."""

import contextlib
import random
import threading
import time

import pytest

from airborne.io.text import read_json
from airborne.studio.drafts import DRAFTS
from airborne.studio.things import parse_thing
from tests.support.browser import open_page
from tests.support.example_trial import copy_cross
from tests.support.studio import at_pixel, fork_studio, kill_studio

OLD_S, BUSY_S = 2.0, (0.3, 1.5)  # what may be lost; how much longer someone works until the studio is killed
PATIENCE_MS = 5000  # with a studio that may be killed
AGAIN_MS = 8000  # after which a click is lost
STEP_PX, PANE = 12.0, 0  # of each drag, to the right in this camera's picture
READY = "document.querySelector('canvas.view')?.dataset.frame !== undefined"
OUTLINE = """pane => {
    const { view } = document.querySelector("canvas.view");
    const points = view.nowItems().filter((item) => item.grab && item.pane === pane).flatMap((item) => item.points);
    const middle = (axis) => points.reduce((sum, point) => sum + point[axis], 0) / points.length;
    return points.length ? [middle(0), middle(1), ...points[0]] : null;
}"""
STILL = """() => {
    const { view } = document.querySelector("canvas.view");
    return view.pulling === null && view.live === null;
}"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The thrown cross."""
    return copy_cross(tmp_path_factory.mktemp("studio") / "cross")


@contextlib.contextmanager
def open_window(folder, path):
    """Open a page of the studio in a window whose complaints about a lost server do not count."""
    with fork_studio(folder) as address, open_page(address) as first:
        window = first.context.new_page()
        window.goto(f"http://{address.split('/')[2]}{path}")
        first.goto("about:blank")
        window.wait_for_function(READY)
        yield window


def work_until_killed(folder, window, do):
    """Do things, each given its number, until the studio is killed; return how many were done two seconds before."""
    from playwright.sync_api import Error

    do(window, 1)
    done_s, killed_s = [time.monotonic()], []

    def kill():
        kill_studio(folder)
        killed_s.append(time.monotonic())

    timer = threading.Timer(OLD_S + random.Random(len(window.url)).uniform(*BUSY_S), kill)
    timer.start()
    window.set_default_timeout(PATIENCE_MS)
    with contextlib.suppress(Error):
        while not killed_s:
            do(window, len(done_s) + 1)
            done_s.append(time.monotonic())
    timer.join()
    return sum(at_s < killed_s[0] - OLD_S for at_s in done_s)


def add_point(window, name, timeout_ms=None):
    window.get_by_label("new point").fill(name)
    window.get_by_role("button", name="Add", exact=True).click()
    window.locator(".point.here", has_text=name).wait_for(timeout=timeout_ms)


def add_and_click(window, number):
    """Name two points and click the second."""
    from playwright.sync_api import TimeoutError

    for name in (f"named{number}", f"clicked{number}"):
        try:
            add_point(window, name, AGAIN_MS if number == 1 else None)
        except TimeoutError:  # on a busy machine a click may come before the field's text does: as a user, once more
            add_point(window, name)
    window.mouse.click(*at_pixel(window, PANE, 60 + 25 * number % 600, 60 + 25 * number // 600))
    window.locator(".point", has_text=name).get_by_text("•").wait_for()


def test_points_named_and_clicked_are_there(folder):
    with open_window(folder, "/digitise") as window:
        old = work_until_killed(folder, window, add_and_click)
    with open_window(folder, "/digitise") as window:
        window.locator(".point", has_text=f"clicked{old}").first.wait_for()
        for number in range(1, old + 1):
            assert window.locator(".point", has_text=f"named{number}").count() >= 1
            window.locator(".point", has_text=f"clicked{number}").first.get_by_text("•").wait_for()


def drag_on(window, number):
    """Drag the body to the right."""
    u, v = window.evaluate(OUTLINE, PANE)[2:]
    window.mouse.move(*at_pixel(window, PANE, u, v))
    window.mouse.down()
    window.mouse.move(*at_pixel(window, PANE, u + STEP_PX, v), steps=4)
    window.mouse.up()
    window.wait_for_function(STILL)


def test_a_pose_that_is_dragged_is_there(folder):
    with open_window(folder, "/start") as window:
        window.get_by_role("button", name="Place it by hand").click()
        window.get_by_text("The pose was set by hand. Not yet used").wait_for()
        window.wait_for_function(OUTLINE, arg=PANE)
        before = window.evaluate(OUTLINE, PANE)[0]
        old = work_until_killed(folder, window, drag_on)
    with open_window(folder, "/start") as window:
        window.get_by_text("The outline is the pose that was made here last. Not yet used").wait_for()
        window.wait_for_function(OUTLINE, arg=PANE)
        assert window.evaluate(OUTLINE, PANE)[0] > before + STEP_PX * (old - 0.5)


def lengthen(window, number):
    """Make a thing longer, and say that two pictures show the same."""
    window.get_by_label("lengths [mm] y").fill(f"{100 + number}")
    window.wait_for_timeout(500)


def test_a_thing_that_is_described_is_there(folder):
    with open_window(folder, "/thing") as window:
        old = work_until_killed(folder, window, lengthen)
    text = read_json(folder / DRAFTS)["trial.toml"]["thing"]["text"]
    assert parse_thing(text, "thing.toml")[1][0].size_mm[1] >= 100 + old
    with open_window(folder, "/thing") as window:
        assert float(window.get_by_label("lengths [mm] y").input_value()) >= 100 + old


def add_event(window, number):
    """Say that both cameras show the same event."""
    window.keyboard.press("e")
    window.get_by_text(f"{number} event").wait_for()


def test_events_of_two_cameras_are_there(folder):
    with open_window(folder, "/sync") as window:
        old = work_until_killed(folder, window, add_event)
    with open_window(folder, "/sync") as window:
        said = window.get_by_text("event").filter(has_text="±").first.text_content()
        assert int(said.split()[0]) >= old
