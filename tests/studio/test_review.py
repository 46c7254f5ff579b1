"""The page Review in a real browser: the next uncertain frame, a second run, the camera that disagrees."""

import csv
import io
import shutil
from fractions import Fraction

import numpy as np
import pytest

from airborne.cameras import Rig, camera_looking_at
from airborne.io.writing import replace_text
from airborne.studio.outlines import BESIDE_COLOUR
from tests.support.browser import open_page
from tests.support.clips import write_clip
from tests.support.person_run import PERSON_TABLE, write_person_run
from tests.support.studio import fork_studio, go_home, wait_for_frame

SIZE, N, RATE = (320, 240), 10, Fraction(50)
UNCERTAIN = 7  # the only such frame
HIGHER_M = 0.02  # the second run
TRIAL = f"""name = "person"
calibration = {{ file = "results/calib.toml" }}
{PERSON_TABLE}
camera = [{{ name = "a", video = "a.mp4" }}]
"""


def edit_rows(path, change):
    """Change the rows of a table, which is there whole at every moment: a studio may look at it meanwhile."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        change(row)
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    replace_text(path, text.getvalue(), is_durable=False)


@pytest.fixture
def folder(tmp_path):
    """A run with one uncertain frame, and another that is higher in all of them."""
    folder = tmp_path / "person"
    folder.mkdir()
    grey = [np.full((SIZE[1], SIZE[0], 3), 110, np.uint8)] * N
    write_clip(folder / "a.mp4", grey, rate=RATE, codec="libx264", pix_fmt="yuv420p")
    camera = camera_looking_at("a", [3.0, -4.0, 1.5], [0, 0, 1.1], focal_px=300, size=SIZE)
    write_person_run(folder / "results", Rig((camera,)), N, RATE)
    shutil.copytree(folder / "results", folder / "second")
    edit_rows(folder / "second" / "motion.csv", lambda row: row.update(z_m=str(float(row["z_m"]) + HIGHER_M)))
    doubt = {str(UNCERTAIN): "uncertain"}
    edit_rows(folder / "results" / "motion.csv", lambda row: row.update(status=doubt.get(row["frame"], row["status"])))
    (folder / "trial.toml").write_text(TRIAL)
    return folder


def test_a_run_is_searched_for_doubt_and_compared_with_another(folder):
    with fork_studio(folder) as address, open_page(address.replace("/?", "/review?")) as page:
        page.get_by_role("button", name="Next uncertain").wait_for()
        page.get_by_label("run").click()
        page.get_by_role("option", name="results").click()
        go_home(page)
        assert page.get_by_role("button", name="Next lost or unseen").is_disabled()
        page.get_by_role("button", name="Next uncertain").click()
        wait_for_frame(page, UNCERTAIN)
        page.get_by_role("button", name="Which camera disagrees?").click()
        page.get_by_text(f"Frame {UNCERTAIN}: ").wait_for()
        colours = "() => document.querySelector('canvas.view').view.shown?.overlay.items.map((item) => item.colour)"
        assert BESIDE_COLOUR not in page.evaluate(colours)
        page.get_by_label("Compare with").click()
        page.get_by_role("option", name="second").click()
        page.get_by_text(
            f"positions are {1e3 * HIGHER_M:.0f} mm apart, the median; at most {1e3 * HIGHER_M:.0f} mm"
        ).wait_for()
        page.wait_for_function(f"(({colours})() || []).includes('{BESIDE_COLOUR}')")
        shutil.copytree(folder / "second", folder / "third")
        page.get_by_label("Compare with").click()
        page.get_by_role("option", name="third").wait_for()  # as soon as it is there
        page.keyboard.press("Escape")
        doubt = {str(UNCERTAIN - 1): "lost", str(UNCERTAIN): "uncertain"}
        edit_rows(folder / "results" / "motion.csv", lambda row: row.update(status=doubt.get(row["frame"], "tracked")))
        page.get_by_role("button", name="Next lost or unseen: 1").wait_for()  # the file was tracked anew
        page.get_by_role("button", name="Next lost or unseen: 1").click()
        wait_for_frame(page, UNCERTAIN - 1)
        page.wait_for_function("document.querySelector('canvas.view').view.shown.overlay.label.endsWith('lost')")


def test_on_a_small_screen_pictures_are_the_largest_part_of_the_page(folder):
    shutil.rmtree(folder / "second")
    with fork_studio(folder) as address, open_page(address.replace("/?", "/review?")) as page:
        page.set_viewport_size({"width": 1024, "height": 700})
        page.get_by_role("button", name="Next uncertain").wait_for()
        page.locator("canvas.view").wait_for()
        page.wait_for_function(
            "['view', 'curves'].map((name) => document.querySelector(`canvas.${name}`)?.clientHeight)"
            ".every((height, at) => at ? height <= 150 : height >= 260)",
            timeout=30_000,
        )
