"""The sheet of keys lists all keys that the studio hears, and no other; Delete and Ctrl+Enter in a real browser."""

import re
from pathlib import Path

import numpy as np

from airborne import studio
from airborne.io.text import read_toml
from airborne.studio.clicks import read_clicked
from airborne.studio.pages import jumps
from airborne.studio.pages.layout import _KEYS
from tests.support.browser import open_page
from tests.support.players_trial import write_trial
from tests.support.studio import at_pixel, fork_studio, wait_for_frame

NAMES = {
    "←": ["ArrowLeft"],
    "→": ["ArrowRight"],
    "arrows": ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"],
    "Esc": ["Escape"],
    "Space": [" "],
}
POINTER = {"wheel", "drag", "Shift+drag", "click", "double-click"}
COMPARED = re.compile(r"event\.key (?:===?|in|not in) (\"[^\"]+\"|\([^)]*\))|\"(\w+)\"\.includes\(event\.key\)")
ARROWS = re.compile(r"\b(Arrow\w+):")


def heard():
    """Return the keys that the studio's sources compare with."""
    folder, found = Path(studio.__file__).parent, set(jumps._KEYS)
    for path in [*folder.glob("*.js"), *folder.glob("pages/*.py")]:
        text = path.read_text()
        for literals, letters in COMPARED.findall(text):
            found.update(re.findall(r'"([^"]+)"', literals) or letters)
        if "event.key" in text:
            found.update(ARROWS.findall(text))
    return found


def listed():
    """Return the keys of the sheet, as a browser names them."""
    found = set()
    for label in _KEYS:
        for key in label.split() if label != ", ." else [",", "."]:
            if key not in POINTER:
                key = key.rstrip(",").removeprefix("Ctrl+") or key
                found.update(NAMES.get(key, [key.lower() if len(key) == 1 else key]))
    return found


def test_the_sheet_lists_the_keys_that_are_heard_and_no_other():
    assert listed() == heard()


SURVEY = "point,x_m,y_m,z_m\n" + "".join(f"P{k},{k % 3},{k // 3},{k % 2}\n" for k in range(8))


def test_delete_removes_the_chosen_click_and_ctrl_enter_presses_the_blue_button(tmp_path):
    trial = write_trial(tmp_path / "block")
    table = trial.with_name("survey.csv")
    table.write_text(SURVEY)
    text = trial.read_text()
    trial.write_text(text.replace('file = "calib.toml"', 'control_points = "survey.csv"'))
    with fork_studio(trial) as address, open_page(address.replace("/?", "/cameras?")) as page:
        wait_for_frame(page, 0)
        page.mouse.click(*at_pixel(page, 0, 50.0, 60.0))
        page.wait_for_function("() => document.querySelector('canvas.view').view.selected != ''")
        assert np.isfinite(read_clicked(table).at("P0", "left")).all()
        page.locator("canvas.view").press("Delete")
        page.wait_for_function("() => document.querySelector('canvas.view').view.selected == ''")
        page.locator("canvas.view").press("Delete")  # none is chosen: nothing
        assert not np.isfinite(read_clicked(table).at("P0", "left")).any()
        page.goto("/".join([*address.split("/")[:3], "body"]))
        page.get_by_text("Use this person").wait_for()
        page.locator("h1").click()
        page.keyboard.press("Control+Enter")  # of several cards none
        page.get_by_label("stature [m]").fill("")
        page.get_by_label("stature [m]").press_sequentially("1,91")  # a decimal comma
        page.get_by_label("stature [m]").press("Control+Enter")
        page.get_by_text("the body is written into the trial").wait_for()
    body = read_toml(trial)["body"]
    assert (body["preset"], body["stature_m"]) == ("human18", 1.91)
