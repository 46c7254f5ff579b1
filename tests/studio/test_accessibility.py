"""Every page by axe in a real browser: names, roles and contrast, for those who use a keyboard or a screen reader."""

from fractions import Fraction

import numpy as np
import pytest

from airborne.cameras import Rig, camera_looking_at, write_pose2sim
from tests.support.clips import write_clip
from tests.support.person_run import PERSON_TABLE, write_person_run
from tests.support.studio import fork_studio, open_page

SIZE, N = (320, 240), 6
PAGES = {  # and what is there when a page is built
    "": "Use these cameras", "sync": "Same event", "cameras": "focal length", "body": "Use this person",
    "ruler": "How long", "thing": "Use this thing", "start": "Place it by hand", "track": "Track again",
    "review": "next uncertain", "digitise": "Agreement", "results": "Export",
}  # fmt: skip
TRIAL = f"""name = "person"
calibration = {{ file = "calib.toml" }}
{PERSON_TABLE}
camera = [{{ name = "a", video = "a.mp4" }}, {{ name = "b", video = "b.mp4" }}]
start = {{ find = true }}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A trial with a run."""
    folder = tmp_path_factory.mktemp("studio") / "person"
    folder.mkdir()
    places = {"a": [3.0, -4.0, 1.5], "b": [-4.0, -3.0, 1.2]}
    rig = Rig(tuple(camera_looking_at(n, p, [0, 0, 1.1], focal_px=300, size=SIZE) for n, p in places.items()))
    grey = [np.full((SIZE[1], SIZE[0], 3), 110, np.uint8)] * N
    for name in rig.names:
        write_clip(folder / f"{name}.mp4", grey, rate=Fraction(50), codec="libx264", pix_fmt="yuv420p")
    write_pose2sim(folder / "calib.toml", rig)
    write_person_run(folder / "results", rig, N, Fraction(50))
    (folder / "trial.toml").write_text(TRIAL)
    return folder


def test_axe_finds_nothing_on_any_page(folder):
    reason = "THE STUDIO'S ACCESSIBILITY IS NOT TESTED: axe is not installed; pip install -e '.[test]'"
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason=reason).Axe()
    found = {}
    with fork_studio(folder) as address, open_page(address) as page:
        for name, text in PAGES.items():
            page.goto("/".join([*address.split("/")[:3], name]))
            page.get_by_text(text).first.wait_for()
            page.wait_for_function("!document.querySelector('.q-notification')")  # those fade in and out
            page.evaluate("Promise.allSettled(document.getAnimations().map((each) => each.finished))")
            response = axe.run(page).response
            assert len(response["passes"]) > 20
            found[name] = [(each["id"], [node["html"] for node in each["nodes"]]) for each in response["violations"]]
    assert found == {name: [] for name in PAGES}
