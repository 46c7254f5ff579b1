"""Two cameras put on one clock in a real browser: each stepped to the same event by itself, or by a flash."""

import re
from fractions import Fraction

import pytest

from airborne.cameras import write_pose2sim
from airborne.io.text import read_toml
from tests.support.browser import MINUTE, open_page
from tests.support.clips import plain_rig, write_clip
from tests.support.studio import burn_numbers, fork_studio

RATES, N = {"first": Fraction(25), "second": Fraction(50)}, 40
EVENTS = ((10, 30), (20, 50))  # pictures of each
FLASHES = {"first": 25, "second": 60}  # the first bright picture of each
TRIAL = """name = "clocks"   # two of them
camera = [{ name = "first", video = "first.mp4" }, { name = "second", video = "second.mp4" }]
calibration = { file = "calib.toml" }
body = { preset = "human18", stature_m = 1.75, mass_kg = 70.0 }
start = { find = true }
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two cameras of different rates, whose pictures carry their numbers; a lamp is switched on before both."""
    folder = tmp_path_factory.mktemp("studio") / "clocks"
    folder.mkdir()
    for name, rate in RATES.items():
        images = burn_numbers(2 * N)
        for image in images[FLASHES[name] :]:
            image[:40] = 250
        write_clip(folder / f"{name}.mp4", images, rate=rate, codec="libx264", pix_fmt="yuv420p")
    write_pose2sim(folder / "calib.toml", plain_rig(*RATES, size=(320, 240)))
    (folder / "trial.toml").write_text(TRIAL)
    return folder


def step_to(page, side, picture):
    """Step one camera to a picture of its own; the other stays."""
    canvas = page.locator("canvas.view").nth(side)
    canvas.evaluate("(canvas, picture) => canvas.view.go(picture)", picture - 1)
    canvas.press(".")
    page.wait_for_function(
        "([side, picture]) => document.querySelectorAll('canvas.view')[side].dataset.frame == picture",
        arg=[side, str(picture)],
    )


def test_two_events_give_the_offset_and_its_deviation(folder):
    with fork_studio(folder) as address, open_page(address.replace("/?", "/sync?")) as page:
        page.locator("canvas.view").nth(1).wait_for()
        for first, second in EVENTS:
            step_to(page, 0, first)
            step_to(page, 1, second)
            page.get_by_text(f"second: picture {second},").wait_for()
            page.get_by_text(f"first, the clock: picture {first},").wait_for()
            page.keyboard.press("e")
        page.get_by_text("2 events: -200.0 ± 9.1 ms").wait_for()
        page.get_by_role("button", name="Use this offset").click()
        page.get_by_text("written: offset of second: -200.0 ms").wait_for()
        by_hand = read_toml(folder / "trial.toml")["camera"][1]
        page.reload()
        page.get_by_text("2 events: -200.0 ± 9.1 ms").wait_for()  # they are kept
        for _ in range(2):
            page.get_by_role("button", name="Remove the last event").click()
        page.get_by_text("The trial has -200.0 ± 9.1 ms for second.").wait_for()
        page.get_by_label("from").click()
        page.get_by_role("option", name="a flash").click()
        page.get_by_role("button", name="Find the offsets").click()
        page.get_by_text(re.compile(r"second: offset -\d+")).wait_for(timeout=2 * MINUTE)
        page.get_by_text("mean brightness, one second of it").wait_for()
        assert page.locator("svg[aria-label='levels over time'] polyline").count() == 2
        step_to(page, 0, FLASHES["first"])
        page.get_by_text(f"first, the clock: picture {FLASHES['first']},").wait_for()
        page.get_by_role("button", name="Show the same moment").click()
        page.get_by_text(f"second: picture {FLASHES['second']},").wait_for()
    period_s = (0.04**2 + 0.02**2) ** 0.5
    assert (by_hand["name"], by_hand["offset_s"]) == ("second", -0.2)
    assert by_hand["offset_sd_s"] == pytest.approx(period_s / 12**0.5 / 2**0.5, rel=1e-3)
    camera = read_toml(folder / "trial.toml")["camera"][1]
    assert camera["offset_s"] == pytest.approx(-0.2, abs=period_s)
    assert camera["offset_sd_s"] != by_hand["offset_sd_s"]
    assert "# two of them" in (folder / "trial.toml").read_text()
