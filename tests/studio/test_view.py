"""In a real browser: the frame that is asked for is the one that is shown, and clicks land to a tenth of a pixel."""

import shutil
from fractions import Fraction

import pytest

from airborne.io.text import read_toml
from airborne.studio.clicks import read_clicked
from airborne.video import VideoSource, VideoWriter, weave
from airborne.video.seeking import index_images
from tests.support.clips import write_clip
from tests.support.studio import at_pixel, burn_numbers, fork_studio, go_home, open_page, read_number, wait_for_frame

N = 60
IRREGULAR = [40 * k + (k * k) % 19 for k in range(N)]  # ms
SURVEY = "point,x_m,y_m,z_m\n" + "".join(f"P{k},{k % 3},{k // 3},{k % 2}\n" for k in range(8))
TRIAL = """name = "numbers"
camera = [
    { name = "b frames", video = "b.mp4" },
    { name = "fields", video = "fields.mp4", fields = "top-first" },
    { name = "variable", video = "variable.mp4" },
]
calibration = { control_points = "survey.csv" }
"""
HOLD_IMAGES = """() => { // all but the first, coarse ones
    const { fetch } = window;
    window.held = [];
    const wait = () => new Promise((go) => held.push(go));
    window.fetch = (url, options) =>
        /image.*near/.test(url) || !/image/.test(url) ? fetch(url, options) : wait().then(() => fetch(url, options));
}"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A trial whose cameras carry their image numbers, on a clock of 25 pictures a second."""
    folder = tmp_path_factory.mktemp("studio") / "numbers"
    folder.mkdir()
    images = burn_numbers(N)
    h264 = {"codec": "libx264", "pix_fmt": "yuv420p", "options": {"g": "12", "bf": "3", "crf": "10"}}
    write_clip(folder / "b.mp4", images, rate=Fraction(25), **h264)
    write_clip(
        folder / "variable.mp4", images, rate=Fraction(25), time_base=Fraction(1, 1000), stamps=IRREGULAR, **h264
    )
    with VideoWriter(folder / "fields.mp4", size=(320, 240), rate=Fraction(25), fields="top-first", crf=4) as writer:
        for top, bottom in zip(images[::2], images[1::2], strict=True):
            writer.write(weave(top[::2], bottom[1::2]))
    (folder / "trial.toml").write_text(TRIAL)
    (folder / "survey.csv").write_text(SURVEY)
    return folder


@pytest.fixture(scope="module")
def address(folder):
    with fork_studio(folder) as address:
        yield address.replace("/?", "/cameras?")


def expected(frame):
    """What each camera's picture carries at a frame of the first camera: 25 Hz, 50 fields/s, a variable rate."""
    stamps = [abs(stamp - 40 * frame) for stamp in IRREGULAR]
    return [frame, 2 * frame if 2 * frame < N else None, stamps.index(min(stamps)) if min(stamps) <= 20 else None]


def test_the_frame_shown_is_the_one_asked_for(address):
    requests = []
    with open_page(address, requests) as page:
        go_home(page)
        frame, canvas = 0, page.locator("canvas.view")
        canvas.focus()
        keys = ["ArrowRight"] * 5 + ["Shift+ArrowRight"] * 2 + [".", ",", "Shift+ArrowLeft", "End", "ArrowLeft", "Home"]
        steps = {"ArrowRight": 1, "ArrowLeft": -1, "Shift+ArrowRight": 10, "Shift+ArrowLeft": -10, ".": 1, ",": -1}
        for key in keys:
            canvas.press(key)
            frame = {"End": N - 1, "Home": 0}.get(key, frame + steps.get(key, 0))
            wait_for_frame(page, frame)
            for pane, number in enumerate(expected(frame)):
                if number is not None:
                    assert read_number(page, pane) == number, (key, frame, pane)
        page.get_by_label("all frames").fill("31")
        wait_for_frame(page, 31)
        page.get_by_label("frame in view").fill("54")
        page.get_by_label("frame in view").press("Enter")
        wait_for_frame(page, 54)
        assert read_number(page, 0) == 54
        page.get_by_text("(0 to 59), 2.160 s").wait_for()
        canvas.press(" ")
        page.get_by_label("stop").wait_for()
        wait_for_frame(page, N - 1)
        page.get_by_label("play").wait_for()
    assert {request.split("/")[2] for request in requests} == {address.split("/")[2]}


def test_until_a_far_frame_is_decoded_the_key_frame_before_it_is_shown_and_said_to_be_none(address, folder):
    index = index_images(VideoSource("b frames", folder / "b.mp4"))
    frame = max(range(20, N), key=lambda frame: frame - index.key_before(frame))  # the farthest behind its key frame
    before = (folder / "survey.csv").read_text()
    with open_page(address) as page:
        go_home(page)
        page.wait_for_function("document.querySelector('canvas.view').view.underway.size == 0")
        page.evaluate(HOLD_IMAGES)
        page.evaluate("frame => { document.querySelector('canvas.view').view.go(frame); }", frame)
        page.wait_for_function("document.querySelector('canvas.view').view.coarse !== null")
        assert read_number(page, 0) == 0  # what was in view, below a veil
        page.locator("canvas.view[data-coarse-ms]").wait_for()
        assert read_number(page, 0) == index.key_before(frame)
        assert page.locator("canvas.view").get_attribute("data-frame") == "0"
        page.mouse.click(*at_pixel(page, 0, 100.0, 120.0))
        page.evaluate("held.forEach((go) => go())")
        wait_for_frame(page, frame)
        assert read_number(page, 0) == frame != index.key_before(frame)
        assert page.evaluate("document.querySelector('canvas.view').view.coarse") is None
        page.evaluate("held.length = 0")
        other = frame + 12  # the last frame is where the page may have been opened: it is there already
        page.evaluate("frames => frames.forEach((n) => document.querySelector('canvas.view').view.go(n))", [0, other])
        page.wait_for_function("document.querySelector('canvas.view').view.coarse !== null")
        assert read_number(page, 0) == index.key_before(other)  # one jump overtakes another: at once
        page.evaluate("held.forEach((go) => go())")
        wait_for_frame(page, other)
    assert (folder / "survey.csv").read_text() == before  # what is on its way is not clicked


def test_a_click_lands_to_the_tenth_of_a_pixel_and_arrows_move_it_by_one(address, folder):
    with open_page(address) as page:
        go_home(page)
        canvas = page.locator("canvas.view")
        page.mouse.move(*at_pixel(page, 0, 200, 160))
        page.mouse.wheel(0, -1200)  # about twenty times
        page.mouse.click(*at_pixel(page, 0, 203.37, 158.62))
        page.get_by_text("P0 –").or_(page.locator(".point.here")).first.wait_for()
        page.wait_for_function("() => document.querySelector('canvas.view').view.selected != ''")
        u, v = read_clicked(folder / "survey.csv").at("P0", "b frames")
        assert (u, v) == (pytest.approx(203.37, abs=0.06), pytest.approx(158.62, abs=0.06))
        for key in ("ArrowLeft", "ArrowLeft", "ArrowUp", "Shift+ArrowDown"):
            canvas.press(key)
            page.wait_for_timeout(300)
        moved = read_clicked(folder / "survey.csv").at("P0", "b frames")
        assert moved == pytest.approx([u - 0.2, v + 0.9], abs=0.02)
        page.keyboard.press("Control+z")
        page.wait_for_timeout(1500)
        assert read_clicked(folder / "survey.csv").at("P0", "b frames") == pytest.approx([u - 0.2, v - 0.1], abs=0.02)
        canvas.press("0")
        page.set_viewport_size({"width": 3840, "height": 2160})  # 4K, all of it enlarged
        page.wait_for_function("document.querySelector('canvas.view').view.zoom() === 1.5")
        page.mouse.move(*at_pixel(page, 0, 150, 60))
        page.mouse.wheel(0, -1200)
        page.mouse.click(*at_pixel(page, 0, 150.37, 60.62))
        page.wait_for_timeout(1000)
        assert read_clicked(folder / "survey.csv").at("P0", "b frames") == pytest.approx([150.37, 60.62], abs=0.06)


def test_two_windows_see_the_same(address, folder):
    with open_page(address) as page:
        go_home(page)
        other = page.context.new_page()
        other.goto(address)
        go_home(other)
        page.mouse.click(*at_pixel(page, 1, 100.0, 120.0))
        marks = "() => document.querySelector('canvas.view').view.marks"
        other.wait_for_function(f"{marks[6:]}.some(mark => mark.id?.endsWith('|fields'))")


def test_a_run_leads_the_view_only_while_nobody_looks_at_another_frame(address):
    with open_page(address) as page:
        go_home(page)
        canvas = page.locator("canvas.view")
        canvas.evaluate("canvas => canvas.view.lead(3, true)")
        wait_for_frame(page, 3)
        canvas.evaluate("canvas => canvas.view.lead(4, false)")
        wait_for_frame(page, 4)
        canvas.press(",")
        wait_for_frame(page, 3)
        canvas.evaluate("canvas => canvas.view.lead(5, false)")
        assert canvas.evaluate("canvas => canvas.view.wanted") == 3
        canvas.evaluate("canvas => canvas.view.go(5)")
        canvas.evaluate("canvas => canvas.view.lead(6, false)")
        wait_for_frame(page, 6)  # who is at the newest frame goes on with it


def test_fields_that_are_read_by_the_files_flags_stay_so_when_the_cameras_are_written(folder, tmp_path):
    folder = shutil.copytree(folder, tmp_path / "numbers", ignore=shutil.ignore_patterns(".airborne"))
    (folder / "trial.toml").write_text(TRIAL.replace('"top-first"', '"auto"'))
    with fork_studio(folder) as address, open_page(address) as page:
        page.get_by_text("as the file's flags say").wait_for()
        page.get_by_role("button", name="Use these cameras").click()
        page.get_by_text("trial.toml is written").wait_for()
    assert [camera.get("fields") for camera in read_toml(folder / "trial.toml")["camera"]] == [None, "auto", None]
