"""Two cameras put on one clock by hand, in a real browser: each stepped to the same event by itself."""

from fractions import Fraction

import pytest

from airborne.io.text import read_toml
from tests.support.clips import write_clip
from tests.support.studio import burn_numbers, fork_studio, open_page

RATES, N = {"first": Fraction(25), "second": Fraction(50)}, 40
EVENTS = ((10, 30), (20, 50))  # pictures of each
TRIAL = """name = "clocks"   # two of them
camera = [{ name = "first", video = "first.mp4" }, { name = "second", video = "second.mp4" }]
calibration = { file = "calib.toml" }
body = { preset = "human18", stature_m = 1.75, mass_kg = 70.0 }
start = { find = true }
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two cameras of different rates, whose pictures carry their numbers."""
    folder = tmp_path_factory.mktemp("studio") / "clocks"
    folder.mkdir()
    for name, rate in RATES.items():
        images = burn_numbers(2 * N)
        write_clip(folder / f"{name}.mp4", images, rate=rate, codec="libx264", pix_fmt="yuv420p")
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
        page.get_by_text("2 events: -200.0 ms, sd 9.1 ms").wait_for()
        page.get_by_role("button", name="Use this offset").click()
        page.get_by_text("written: second is -200.0 ms off").wait_for()
    camera = read_toml(folder / "trial.toml")["camera"][1]
    period_s = (0.04**2 + 0.02**2) ** 0.5
    assert (camera["name"], camera["offset_s"]) == ("second", -0.2)
    assert camera["offset_sd_s"] == pytest.approx(period_s / 12**0.5 / 2**0.5, rel=1e-3)
    assert "# two of them" in (folder / "trial.toml").read_text()
