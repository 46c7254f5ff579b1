"""A film and an export made on the page Results, in a real browser, as the commands make them."""

import os
from fractions import Fraction

import numpy as np
import pytest

from airborne.cameras import Rig, camera_looking_at
from airborne.video import VideoWriter
from tests.support.browser import MINUTE, open_page
from tests.support.person_run import write_person_run
from tests.support.studio import fork_studio

SIZE, N, RATE = (320, 240), 12, Fraction(50)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a run of one camera."""
    folder = tmp_path_factory.mktemp("studio") / "films"
    folder.mkdir()
    run = folder / "results"
    camera = camera_looking_at("a", [3.0, -4.0, 1.5], [0, 0, 1.1], focal_px=300, size=SIZE)
    write_person_run(run, Rig((camera,)), N, RATE)
    (run / "run.json").write_text('{"inputs": {}, "settings": {}, "version": "1"}')
    (run / "videos").mkdir()
    with VideoWriter(run / "videos" / "overlay_a.mp4", size=SIZE, rate=RATE) as writer:
        for k in range(N):
            writer.write(np.full((SIZE[1], SIZE[0], 3), 20 * k, np.uint8))
    return folder


def test_a_film_and_an_export_are_made_and_linked(folder):
    with fork_studio(folder) as address, open_page(address.replace("/?", "/results?")) as page:
        page.get_by_role("button", name="Export").click()
        page.get_by_text("results.c3d").wait_for(timeout=2 * MINUTE)
        page.get_by_label("first frame").fill("7")
        page.get_by_label("last frame").fill("6")
        page.get_by_role("button", name="Make a film").click()
        page.get_by_text("frames 7 to 6: the first frame must come before the last").wait_for()
        page.get_by_label("first frame").fill("3")
        page.get_by_role("button", name="Make a film").click()
        page.get_by_text("film_first3_last6.mp4", exact=True).wait_for(timeout=2 * MINUTE)
        link = page.get_by_role("link", name="film_first3_last6.mp4").get_attribute("href")
        answer = page.request.get("/".join(address.split("/")[:3]) + link)
        assert answer.ok and answer.body() == (folder / "results" / "videos" / "film_first3_last6.mp4").read_bytes()
        page.get_by_label("kind").click()
        page.get_by_role("option", name="gif").click()
        page.get_by_role("button", name="Make a film").click()
        page.get_by_text("film_first3_last6.gif", exact=True).wait_for(timeout=2 * MINUTE)
        exported = folder / "results" / "export" / "results.c3d"
        assert exported.stat().st_size > 0
        os.utime(exported, (1, 1))  # before the run was tracked
        page.reload()
        page.get_by_text("results.c3d (of the run before)").wait_for()
        page.get_by_text("film_first3_last6.gif", exact=True).wait_for()
    assert (folder / "results" / "videos" / "film_first3_last6.gif").read_bytes().startswith(b"GIF8")
