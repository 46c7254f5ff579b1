"""The studio killed while someone clicks and drags in a real browser: what is older than two seconds is there again."""

import contextlib
import random
import threading
import time

from airborne.io.text import read_json
from airborne.studio.drafts import DRAFTS
from airborne.studio.things import parse_thing
from tests.support.browser import open_blank
from tests.support.example_trial import copy_cross
from tests.support.studio import at_pixel, fork_studio, kill_studio

OLD_S, BUSY_S = 2.0, (0.3, 1.5)  # what may be lost; how much longer someone works until the studio is killed
PATIENCE_MS = 2000  # with a studio that may be killed
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


@contextlib.contextmanager
def open_windows(folder, paths):
    """Open pages of the studio, each in a window whose complaints about a lost server do not count."""
    with fork_studio(folder) as address, open_blank(address) as blank:
        server, token = address.split("/")[2], address.partition("?")[2]
        windows = [blank.context.new_page() for _ in paths]
        for window, path in zip(windows, paths, strict=True):
            window.goto(f"http://{server}{path}?{token}")
            window.wait_for_function(READY)
        yield windows


def work_until_killed(folder, windows, edits):
    """Do each window's edit in turn, given its number, until the studio is killed.

    Return how many of each were done two seconds before.
    """
    from playwright.sync_api import Error

    done_s, killed_s = [[] for _ in windows], []

    def edit_all():
        for window, edit, at_s in zip(windows, edits, done_s, strict=True):
            window.bring_to_front()
            edit(window, len(at_s) + 1)
            at_s.append(time.monotonic())

    def kill():
        kill_studio(folder)
        killed_s.append(time.monotonic())

    edit_all()
    timer = threading.Timer(OLD_S + random.Random(7).uniform(*BUSY_S), kill)
    timer.start()
    for window in windows:
        window.set_default_timeout(PATIENCE_MS)
    with contextlib.suppress(Error):
        while not killed_s:
            edit_all()
    timer.join()
    return [sum(each < killed_s[0] - OLD_S for each in at_s) for at_s in done_s]


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


def drag_on(window, number):
    """Drag the body to the right."""
    u, v = window.evaluate(OUTLINE, PANE)[2:]
    window.mouse.move(*at_pixel(window, PANE, u, v))
    window.mouse.down()
    window.mouse.move(*at_pixel(window, PANE, u + STEP_PX, v), steps=4)
    window.mouse.up()
    window.wait_for_function(STILL)


def lengthen(window, number):
    """Make a thing longer."""
    window.get_by_label("lengths [mm] y").fill(f"{100 + number}")


def add_event(window, number):
    """Say that both cameras show the same event."""
    window.keyboard.press("e")
    window.get_by_text(f"{number} event").wait_for()


def middle(window):
    """Return how far right the middle of the outline is, once it is drawn [px]."""
    window.wait_for_function(OUTLINE, arg=PANE)
    return window.evaluate(OUTLINE, PANE)[0]


def place_by_hand(window):
    window.get_by_role("button", name="Place it by hand").click()
    window.get_by_text("The pose was set by hand. Not yet used").wait_for()


def test_points_a_pose_a_thing_and_events_are_there_again(tmp_path):
    folder = copy_cross(tmp_path / "cross")
    edits = {"/digitise": add_and_click, "/start": drag_on, "/thing": lengthen, "/sync": add_event}
    with open_windows(folder, edits) as windows:
        place_by_hand(windows[1])
        before = middle(windows[1])
        clicked, dragged, lengthened, events = work_until_killed(folder, windows, edits.values())
    text = read_json(folder / DRAFTS)["trial.toml"]["thing"]["text"]
    assert parse_thing(text, "thing.toml")[1][0].size_mm[1] >= 100 + lengthened
    with open_windows(folder, edits) as (digitise, start, thing, sync):
        for number in range(1, clicked + 1):
            assert digitise.locator(".point", has_text=f"named{number}").count() >= 1
            digitise.locator(".point", has_text=f"clicked{number}").first.get_by_text("•").wait_for()
        start.get_by_text("The outline is the pose that was made here last. Not yet used").wait_for()
        assert middle(start) > before + STEP_PX * (dragged - 0.5)
        assert float(thing.get_by_label("lengths [mm] y").input_value()) >= 100 + lengthened
        said = sync.get_by_text("event").filter(has_text="±").first.text_content()
        assert int(said.split()[0]) >= events
