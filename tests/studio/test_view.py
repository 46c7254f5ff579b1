"""In a real browser: the frame that is asked for is the one that is shown, and clicks land to a tenth of a pixel."""

import shutil
from fractions import Fraction

import pytest

from airborne.io.text import read_toml
from airborne.studio.clicks import read_clicked
from airborne.video import VideoSource, VideoWriter, weave
from airborne.video.image_index import index_images
from tests.support.browser import open_page
from tests.support.clips import write_clip
from tests.support.studio import at_pixel, burn_numbers, fork_studio, go_home, read_number, wait_for_frame, wait_until

N = 120  # fields, which are the clock
N_PLAIN = 100  # pictures of the file without B frames, which ends before the others
FIELDS, B_FRAMES, VARIABLE, PLAIN = range(4)  # panes
IRREGULAR = [40 * k + (k * k) % 19 for k in range(N // 2)]  # ms
SURVEY = "point,x_m,y_m,z_m\n" + "".join(f"P{k},{k % 3},{k // 3},{k % 2}\n" for k in range(8))
TRIAL = """name = "numbers"
camera = [
    { name = "fields", video = "fields.mp4", fields = "top-first" },
    { name = "b frames", video = "b.mp4" },
    { name = "variable", video = "variable.mp4" },
    { name = "plain", video = "plain.mp4" },
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
    """A trial whose cameras carry their image numbers, on a clock of 50 fields a second."""
    folder = tmp_path_factory.mktemp("studio") / "numbers"
    folder.mkdir()
    images = burn_numbers(N)
    h264 = {"codec": "libx264", "pix_fmt": "yuv420p", "options": {"g": "12", "bf": "3", "crf": "10"}}
    without_b = {**h264, "options": {**h264["options"], "bf": "0"}}
    half = images[: N // 2]
    write_clip(folder / "b.mp4", half, rate=Fraction(25), **h264)
    write_clip(folder / "variable.mp4", half, rate=Fraction(25), time_base=Fraction(1, 1000), stamps=IRREGULAR, **h264)
    write_clip(folder / "plain.mp4", images[:N_PLAIN], rate=Fraction(50), **without_b)
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
    """What each camera's picture carries at a field: none where it is taken more than half a field's time away."""
    off_ms, number = min((abs(stamp - 20 * frame), number) for number, stamp in enumerate(IRREGULAR))
    return [
        frame,
        frame // 2 if frame % 2 == 0 else None,
        number if off_ms < 10 else None,
        frame if frame < N_PLAIN else None,
    ]


def number_shown(page, pane):
    """Read the number that a camera's picture carries; None where the page says that there is no picture."""
    is_there = page.evaluate("pane => document.querySelector('canvas.view').view.shown.pictures[pane] !== null", pane)
    number = read_number(page, pane)
    assert is_there or number == 0  # the ground is dark
    return number if is_there else None


_SHOWN_AGAIN = """() => {
    const from = getElement(Number(document.querySelector("canvas.view").closest("[id^=c]").id.slice(1)));
    window.dispatchEvent(new CustomEvent("airborne-shown", { detail: { from, frame: 31, time_s: 0.619 } }));
}"""


def test_the_frame_shown_is_the_one_asked_for(address):
    requests = []
    with open_page(address, requests) as page:
        go_home(page)
        frame, canvas, seen = 0, page.locator("canvas.view"), []
        canvas.focus()
        keys = ["ArrowRight"] * 5 + ["Shift+ArrowRight"] * 2 + [".", ",", "Shift+ArrowLeft", "End", "ArrowLeft", "Home"]
        steps = {"ArrowRight": 1, "ArrowLeft": -1, "Shift+ArrowRight": 10, "Shift+ArrowLeft": -10, ".": 1, ",": -1}
        for key in keys:
            canvas.press(key)
            frame = {"End": N - 1, "Home": 0}.get(key, frame + steps.get(key, 0))
            wait_for_frame(page, frame)
            assert [number_shown(page, pane) for pane in range(4)] == expected(frame), (key, frame)
            seen.append(expected(frame))
        page.get_by_label("all frames").fill("31")
        wait_for_frame(page, 31)
        page.get_by_label("frame in view").fill("91")
        page.evaluate(_SHOWN_AGAIN)  # a picture comes while one types
        page.get_by_label("frame in view").press("Enter")
        wait_for_frame(page, 91)
        assert read_number(page, FIELDS) == 91
        page.get_by_text(f"(0 to {N - 1}), 1.820 s").wait_for()
        canvas.press(" ")
        page.get_by_label("stop").wait_for()
        wait_for_frame(page, N - 1)
        page.get_by_label("play").wait_for()
    assert {fields % 2 for fields, *_ in seen} == {0, 1}
    assert all(None in numbers and set(numbers) != {None} for numbers in list(zip(*seen, strict=True))[B_FRAMES:])
    assert {request.split("/")[2] for request in requests} == {address.split("/")[2]}


def test_until_a_far_frame_is_decoded_the_key_frame_before_it_is_shown_and_said_to_be_none(address, folder):
    index = index_images(VideoSource("b frames", folder / "b.mp4"))
    picture = max(range(20, N // 2), key=lambda number: number - index.key_before(number))  # far behind its key frame
    frame, other = 2 * picture, 2 * picture + 24
    before = (folder / "survey.csv").read_text()
    with open_page(address) as page:
        go_home(page)
        page.wait_for_function("document.querySelector('canvas.view').view.underway.size == 0")
        page.evaluate(HOLD_IMAGES)
        page.evaluate("frame => { document.querySelector('canvas.view').view.go(frame); }", frame)
        page.wait_for_function("document.querySelector('canvas.view').view.coarse !== null")
        # what was in view, below a veil; to a busy machine's question the key frame has come meanwhile
        assert read_number(page, B_FRAMES) in (0, index.key_before(picture))
        page.locator("canvas.view[data-coarse-ms]").wait_for()
        assert read_number(page, B_FRAMES) == index.key_before(picture)
        assert page.locator("canvas.view").get_attribute("data-frame") == "0"
        page.mouse.click(*at_pixel(page, B_FRAMES, 100.0, 120.0))
        page.evaluate("held.forEach((go) => go())")
        wait_for_frame(page, frame)
        assert read_number(page, B_FRAMES) == picture != index.key_before(picture)
        assert page.evaluate("document.querySelector('canvas.view').view.coarse") is None
        page.evaluate("held.length = 0")
        page.evaluate("frames => frames.forEach((n) => document.querySelector('canvas.view').view.go(n))", [0, other])
        page.wait_for_function("document.querySelector('canvas.view').view.coarse !== null")
        assert read_number(page, B_FRAMES) == index.key_before(other // 2)  # one jump overtakes another: at once
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
        u, v = read_clicked(folder / "survey.csv").at("P0", "fields")
        assert (u, v) == (pytest.approx(203.37, abs=0.06), pytest.approx(158.62, abs=0.06))
        for key in ["ArrowLeft"] * 12 + ["ArrowUp", "Shift+ArrowDown"]:  # faster than the server answers
            canvas.press(key)

        def clicked_is(u, v, abs_px=0.02):
            at = read_clicked(folder / "survey.csv").at("P0", "fields")
            return at == pytest.approx([u, v], abs=abs_px)

        wait_until(page, lambda: clicked_is(u - 1.2, v + 0.9))
        place = "document.querySelector('canvas.view').view.marks.map((mark) => [mark.u, mark.v])[0]"
        wait_until(page, lambda: page.evaluate(place) == pytest.approx([u - 1.2, v + 0.9], abs=0.02))
        page.wait_for_function("document.querySelector('canvas.view').view.dragged === null")
        page.keyboard.press("Control+z")
        wait_until(page, lambda: clicked_is(u - 1.2, v - 0.1))
        canvas.press("0")
        page.set_viewport_size({"width": 3840, "height": 2160})  # 4K, all of it enlarged
        page.wait_for_function("document.querySelector('canvas.view').view.zoom() === 1.5")
        page.mouse.move(*at_pixel(page, 0, 150, 60))
        page.mouse.wheel(0, -1200)
        page.mouse.click(*at_pixel(page, 0, 150.37, 60.62))
        wait_until(page, lambda: clicked_is(150.37, 60.62, abs_px=0.06))


def test_two_windows_see_the_same(address, folder):
    with open_page(address) as page:
        go_home(page)
        other = page.context.new_page()
        other.goto(address)
        go_home(other)
        page.mouse.click(*at_pixel(page, B_FRAMES, 100.0, 120.0))
        marks = "() => document.querySelector('canvas.view').view.marks"
        other.wait_for_function(f"{marks[6:]}.some(mark => mark.id?.endsWith('|b frames'))")


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
    assert [camera.get("fields") for camera in read_toml(folder / "trial.toml")["camera"]] == ["auto", None, None, None]
