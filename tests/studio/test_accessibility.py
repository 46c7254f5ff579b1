"""Every page and dialog in a real browser: axe looks at it, and whether it fits on small and on large screens."""

from fractions import Fraction

import numpy as np
import pytest

from airborne.cameras import Rig, camera_looking_at, write_pose2sim
from airborne.evaluation import DigitisedPoints, format_clicked_frames
from tests.support.browser import SIZE, open_page
from tests.support.clips import write_clip
from tests.support.layout_faults import layout_faults
from tests.support.person_run import PERSON, PERSON_TABLE, write_person_run
from tests.support.studio import fork_studio

VIDEO, N = (320, 240), 6  # [px], pictures
SIZES = ((1024, 700), (3840, 2160))  # of the window, the smallest and the largest
HAS_GROWN = """height => [...document.querySelectorAll(".q-layout, .q-page")].every(
    (each) => parseFloat(each.style.minHeight) === height
)"""  # Quasar gives these the height of the window, a moment after it has it: on a busy machine a later one
IS_STILL = "!document.querySelector('.q-notification')"  # those fade in and out
END_ANIMATIONS = """Promise.allSettled(document.getAnimations().map(
    async (each) => each.effect.getComputedTiming().endTime < Infinity ? each.finish() : each.finished
))"""
MOVING = """() => [...document.querySelectorAll("*")].filter((each) => {
    const style = getComputedStyle(each);
    return parseFloat(style.transitionDuration) || parseFloat(style.animationDuration);
}).length"""
ARE_LOADED = "[...document.querySelectorAll('[role=dialog] img')].every((each) => each.naturalWidth)"
PAGES = {  # and what is there when a page is built
    "": "Use these cameras", "sync": "Same event", "cameras": "focal length", "body": "Use this person",
    "ruler": "How long", "thing": "Use this thing", "start": "Place it by hand", "track": "Track again",
    "review": "Next uncertain", "digitise": "Agreement", "results": "Export",
}  # fmt: skip
DIALOGS = {  # of a page: the button that opens each, and what is in it
    "cameras": {
        "Keys": "this sheet", "An example": "the thrown cross", "With a board or a wand": "Calibrate with the wand",
    },
    "digitise": {"Compare": "matched", "Agreement": "95 % limits"},
}  # fmt: skip
TRIAL = f"""name = "person"
calibration = {{ file = "calib.toml" }}
{PERSON_TABLE}
camera = [{{ name = "left", video = "left.mp4" }}, {{ name = "behind the goal", video = "behind the goal.mp4" }}]
start = {{ find = true }}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A trial with a run, and a person's landmarks digitised in two of its frames."""
    folder = tmp_path_factory.mktemp("studio") / "person"
    folder.mkdir()
    places = {"left": [3.0, -4.0, 1.5], "behind the goal": [-4.0, -3.0, 1.2]}
    rig = Rig(tuple(camera_looking_at(n, p, [0, 0, 1.1], focal_px=300, size=VIDEO) for n, p in places.items()))
    grey = [np.full((VIDEO[1], VIDEO[0], 3), 110, np.uint8)] * N
    for name in rig.names:
        write_clip(folder / f"{name}.mp4", grey, rate=Fraction(50), codec="libx264", pix_fmt="yuv420p")
    write_pose2sim(folder / "calib.toml", rig)
    write_person_run(folder / "results", rig, N, Fraction(50))
    points = tuple(landmark.name for landmark in PERSON.landmarks)
    at = np.random.default_rng(0).uniform([-0.3, -0.3, 0.5], [0.3, 0.3, 1.7], (2, len(points), 3))
    px = np.stack([camera.px_from_world(at) for camera in rig], axis=2)
    table = DigitisedPoints(index=np.array([1, 2]), points=points, px=px)
    (folder / "digitised_A_1.csv").write_text(format_clicked_frames(table, rig.names))
    (folder / "trial.toml").write_text(TRIAL)
    return folder


@pytest.fixture(scope="module")
def found(folder):
    """Visit every page and open every dialog: what axe finds there, None without it, and what does not fit."""
    axe, found = _axe(), {}

    def look(page, name):
        page.wait_for_function(IS_STILL)
        page.evaluate(END_ANIMATIONS)
        assert page.evaluate(MOVING) == 0, "for who asks for less motion nothing moves"
        found[name] = (None if axe is None else violations(axe, page)), faults_by_size(page)

    with fork_studio(folder) as address, open_page(address) as page:
        for name, text in PAGES.items():
            go(page, address, name, text)
            look(page, name)
            for button, inside in DIALOGS.get(name, {}).items():
                page.get_by_role("button", name=button).first.click()
                page.get_by_role("dialog").get_by_text(inside).first.wait_for()
                look(page, button)
                assert page.evaluate(ARE_LOADED)
                page.keyboard.press("Escape")
                page.get_by_role("dialog").wait_for(state="detached")
        (folder / "trial.toml").write_text(TRIAL.replace(PERSON_TABLE, 'body = { preset = "legs" }'))
        go(page, address, "start", "another player's name")
        look(page, "start, of players")
    return found


def _axe():
    try:
        from axe_playwright_python.sync_playwright import Axe
    except ImportError:
        return None
    return Axe()


def violations(axe, page):
    response = axe.run(page).response
    assert len(response["passes"]) > 20
    return [(each["id"], [node["html"] for node in each["nodes"]]) for each in response["violations"]]


def faults_by_size(page):
    """Return what does not fit at each size of the window."""
    faults = {}
    for width, height in SIZES:
        page.set_viewport_size({"width": width, "height": height})
        page.wait_for_function(HAS_GROWN, arg=height)
        page.evaluate("new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go)))")
        faults[width, height] = layout_faults(page)
    page.set_viewport_size(SIZE)
    return faults


def go(page, address, name, text):
    page.goto("/".join([*address.split("/")[:3], name]))
    page.get_by_text(text).first.wait_for()


def test_axe_finds_nothing_on_any_page_nor_in_any_dialog(found):
    if any(by_axe is None for by_axe, _ in found.values()):
        pytest.skip("THE STUDIO'S ACCESSIBILITY IS NOT TESTED: axe is not installed; pip install -e '.[test]'")
    assert {name: by_axe for name, (by_axe, _) in found.items() if by_axe} == {}


def test_on_small_and_large_screens_no_text_is_cut_and_no_control_lies_over_another(found):
    faults = {(name, size): each for name, (_, faults) in found.items() for size, each in faults.items()}
    assert {where: each for where, each in faults.items() if each} == {}
