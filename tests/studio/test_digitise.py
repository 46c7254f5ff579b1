"""One person's digitising of the thrown cross in a real browser, 1.2 px off, is as good as the paper's: 10 mm, 3°."""

import json

import numpy as np
import pytest

from airborne.evaluation import read_digitised
from tests.support.browser import open_page
from tests.support.digitised_cross import MOST_DEG, MOST_MM, POINTS, compare, digitise, prepare_cross
from tests.support.example_trial import copy_cross
from tests.support.studio import at_pixel, fork_studio, wait_for_frame

FRAMES = range(0, 12, 4)
GREY = "#c8cdd3"  # of marks where a point is expected
MARKS = "document.querySelector('canvas.view').view.marks"


def test_the_cross_digitised_by_one_person(tmp_path):
    folder = tmp_path / "cross"
    rig = prepare_cross(folder)
    with fork_studio(folder) as address, open_page(address.replace("/?", "/digitise?")) as page:
        digitise(page, rig, FRAMES)
        page.locator("canvas.view").press(".")
        page.get_by_text(f"frame {FRAMES[-1] + 1}; 36 clicks in 3 frames").wait_for()
        grey = page.evaluate(f"{MARKS}.filter((mark) => mark.colour === '{GREY}').map(({{ u, v }}) => [u, v])")
        found_mm, found_deg = compare(page, folder)
        page.get_by_role("button", name="Agreement").click()
        page.get_by_text("95 % limits").first.wait_for()
        page.get_by_role("button", name="Close").last.click()
        page.get_by_role("switch", name="epipolar help").click()
        page.locator("canvas.view").press(",")
        page.locator(".point .n", has_text=".").first.wait_for()
        page.get_by_role("button", name="Add", exact=True).click()
        page.get_by_text("a point's name is 1 to 40 letters").wait_for()
        try_points(page)
        page.get_by_role("button", name="Remove", exact=True).click()
        page.get_by_text("choose a click first").wait_for()
        assert page.locator(".q-notification.bg-warning").count() == 1  # in the place of the one before
    assert json.loads((folder / "digitised_A_1.json").read_text())["epipolar_help"]
    assert 0 < found_mm <= MOST_MM
    assert 0 < found_deg <= MOST_DEG
    clicks = read_digitised(folder / "digitised_A_1.csv", rig)
    assert clicks.index.tolist() == list(FRAMES)
    last, before = clicks.px[-1], clicks.px[-2]  # a step of four: on one more is a quarter
    expected = last + (last - before) / 4
    assert np.array(grey) == pytest.approx(expected.reshape(-1, 2), abs=0.01)
    assert len(grey) == 3 * len(POINTS)


def try_points(page):
    """Add a point, once more, and drop it; one of the body with clicks is not dropped."""
    own, add = page.locator(".point", has_text="hand"), page.get_by_role("button", name="Add", exact=True)
    page.get_by_label("new point").fill("hand")
    add.click()
    own.wait_for()
    page.mouse.click(*at_pixel(page, 0, 300, 200))
    own.get_by_text("•").wait_for()
    page.get_by_role("button", name="Compare", exact=True).click()
    page.get_by_text("not compared, as the body has no such points: hand").wait_for()
    page.get_by_role("button", name="Close").last.click()
    assert page.get_by_label("new point").input_value() == ""
    page.get_by_label("new point").fill("hand")
    add.click()
    page.get_by_text("hand is among the points already").wait_for()
    drop = page.get_by_role("button", name="Drop", exact=True)
    drop.click()
    page.get_by_text("hand has 1 click; remove").wait_for()
    page.get_by_role("button", name="Undo").click()
    own.get_by_text("•").wait_for(state="detached")
    drop.click()
    own.wait_for(state="detached")
    drop.click()
    page.get_by_text(f"{POINTS[0]} is a point of the body").wait_for()


def test_a_click_belongs_to_the_frame_that_it_was_made_in(tmp_path):
    """Also where it is made before the page has heard of the frame."""
    folder = copy_cross(tmp_path / "cross")
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
