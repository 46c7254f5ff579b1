"""A search that is undecided: its candidates are pictures to choose from, in a real browser."""

import json
import shutil

import numpy as np
import pytest

from airborne.errors import UNDECIDED
from airborne.export.pictures import encode_png
from airborne.io.text import parse_editable_toml, read_toml
from airborne.studio import commands
from airborne.studio.starts import FOUND_LIST, FOUND_PICTURE
from tests.support.places import THROWN_CROSS
from tests.support.studio import User, fork_studio, open_page, wait_for_frame

SHARES = (0.6, 0.4)
SIZE = (60, 40)


def undecided():
    """Let every command end as a search does that could not decide."""
    commands._RUN = f"raise SystemExit({UNDECIDED})"


@pytest.fixture
def folder(tmp_path):
    """The thrown cross without a start, and what an undecided search leaves."""
    folder = shutil.copytree(THROWN_CROSS, tmp_path / "cross")
    trial = parse_editable_toml((folder / "trial.toml").read_text())
    start = dict(trial.pop("start"))
    (folder / "trial.toml").write_text(trial.as_string())
    (folder / FOUND_LIST).parent.mkdir(parents=True)
    turned = [[0, 0, 0, 1], [0, 0, 1, 0]]
    candidates = [
        {"number": k, "probability": share, "position_m": list(start["position_m"]), "quaternion_xyzw": turn}
        for k, (share, turn) in enumerate(zip(SHARES, turned, strict=True), start=1)
    ]
    (folder / FOUND_LIST).write_text(json.dumps({"frame": 2, "candidates": candidates}))
    (folder / FOUND_PICTURE).write_bytes(encode_png(np.full((*SIZE[::-1], 3), 200, np.uint8)))
    return folder


def test_candidates_are_pictures_with_a_button_each(folder):
    with fork_studio(folder, before=undecided) as address, open_page(address.replace("/?", "/start?")) as page:
        user = User(page)
        wait_for_frame(page, 0)
        user.press("Find it")
        page.get_by_text("The pictures do not decide", exact=False).wait_for()
        picture = page.get_by_role("img", name="the candidates")
        picture.wait_for()
        page.wait_for_function("() => document.querySelector('.found img').naturalWidth")
        assert picture.evaluate("image => [image.naturalWidth, image.naturalHeight]") == list(SIZE)
        assert picture.bounding_box()["y"] < page.get_by_role("button", name="candidate 1, 60 %").bounding_box()["y"]
        user.press("candidate 2, 40 %")
        wait_for_frame(page, 2)
        user.press("Use this pose")
        page.get_by_text("The trial begins with this pose.").wait_for()
        with page.expect_popup() as popup:
            user.click(picture)
        popup.value.locator("img").wait_for()
    assert read_toml(folder / "trial.toml")["start"]["quaternion_xyzw"] == [0, 0, 1, 0]
