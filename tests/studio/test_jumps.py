"""In Review a key goes to the next frame in which the body, a joint or a player is in doubt; in a real browser."""

import time
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from airborne.motion import MotionWriter, read_motion
from airborne.motion.files import read_estimates
from airborne.studio.pages import review
from airborne.studio.strips import doubtful_frames
from airborne.tracking import Status
from tests.support.browser import open_page
from tests.support.person_run import write_person_run
from tests.support.players_trial import rig, write_run, write_trial
from tests.support.studio import fork_studio, go_home, wait_for_frame

N, STRAINED, LOST = 12, 3, 9


def write_doubtful_run(run):
    """Write a run of a person whose elbow is uncertain in one frame, and who is lost in another."""
    write_person_run(run, rig(), N, Fraction(50))
    estimates, joints = read_estimates(run / "motion.csv"), read_motion(run / "motion.csv").joints
    elbow = 6 + 3 * joints.index("forearm_left")
    estimates[STRAINED].covariance[elbow, elbow] = 0.3  # of its turn [rad²]
    estimates[LOST] = replace(estimates[LOST], status=Status.LOST)
    (run / "motion.csv").unlink()
    with MotionWriter(run / "motion.csv", joints) as writer:
        for each in estimates:
            writer.append(each)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A trial with a run of a person, and one of two players of whom one is uncertain in frames 3, 7 and 11."""
    folder = tmp_path_factory.mktemp("studio") / "two"
    write_trial(folder, N)
    write_run(folder / "players", N)
    write_doubtful_run(folder / "person")
    return folder


def test_frames_are_in_doubt_where_any_joint_or_player_is(folder):
    person, players = doubtful_frames(folder / "person"), doubtful_frames(folder / "players")
    np.testing.assert_array_equal(person["uncertain"], [STRAINED])
    np.testing.assert_array_equal(person["lost"], [LOST])
    np.testing.assert_array_equal(players["uncertain"], [3, 7, 11])
    assert len(players["lost"]) == 0


STICKS = """() => {
    const canvas = document.querySelector("canvas:not(.view):not(.curves)");
    const { scene } = canvas ? getElement(Number(canvas.closest("[id^=c]").id.slice(1))) : {};
    let n = 0;
    scene?.traverseVisible((each) => { n += each.geometry?.type === "CylinderGeometry"; });
    return n;
}"""
THINNED = """async (now) => {
    const { drawCurves } = await import("/parts/curves.js"), canvas = document.querySelector("canvas.curves");
    const series = [{ name: "x", unit: "m", value: [1, 1.25, 2, 2.5], sd: [0.05, 0.05, null, null] }];
    const status = Array(4).fill("tracked");
    drawCurves(canvas, { is_thinned: true, frame: [0, 50, 100, 150], time_s: [0, 1, 2, 3], status, series }, now);
    return canvas.getAttribute("aria-description");
}"""


def test_of_frames_that_share_a_point_the_cursor_says_the_least_and_the_greatest(folder):
    with fork_studio(folder) as address, open_page(address.replace("/?", "/review?")) as page:
        page.wait_for_selector("canvas.curves[aria-description]")
        found = [page.evaluate(THINNED, now) for now in (0, 70, 120)]
    assert found == ["x 1.000 to 1.250 ± 0.050 m"] * 2 + ["x 2.000 to 2.500 ± ? m"]


def choose_run(page, run):
    """Choose a run in the list."""
    page.get_by_label("run", exact=True).click()
    page.get_by_role("option", name=run).click()


def wait_for_run(page, run):
    """Wait until the pictures are those of a run."""
    page.wait_for_function("run => document.querySelector('canvas.view')?.view?.overlay.includes(`/${run}/`)", arg=run)


def slow_down():
    """Let a run take its time to be opened."""
    read = review.curve_kinds

    def wait(run):
        time.sleep(0.5)
        return read(run)

    review.curve_kinds = wait


def test_keys_go_to_the_next_frame_in_doubt_and_back_of_the_run_that_is_chosen(folder):
    with fork_studio(folder, before=slow_down) as address, open_page(address.replace("/?", "/review?")) as page:
        for run, ways in (
            ("person", [("a", STRAINED), ("r", LOST), ("a", STRAINED), ("Shift+R", LOST)]),
            ("players", [("a", 3), ("a", 7), ("a", 11), ("a", 3), ("Shift+A", 11)]),
        ):
            choose_run(page, run)
            wait_for_run(page, run)
            go_home(page)
            for key, frame in ways:
                page.keyboard.press(key)
                wait_for_frame(page, frame)
            if run == "person":
                says = "x 0.0450 ± 0.0032 m, y 0.0000 ± 0.0032 m, z 1.0000 ± 0.0032 m"
                page.locator(f'canvas.curves[aria-description="{says}"]').wait_for()
        page.wait_for_function(f"({STICKS})() === {2 * 5}")  # of two players, down both legs and across the hips
        assert page.get_by_role("button", name="next uncertain").is_enabled()
        assert not page.get_by_role("button", name="next lost or unseen").is_enabled()
        page.get_by_role("switch", name="Leave cameras out").click()
        page.get_by_role("button", name="Leave it out").click()
        page.get_by_text("left out of frame 11; players are tracked again from the start").wait_for()
        page.get_by_label("camera").click()
        page.get_by_role("option").last.click()
        page.get_by_role("button", name="Leave it out").click()
        page.get_by_text("left out of frame 11; no camera is left in frame 11; players are tracked again").wait_for()
        choose_run(page, "person")
        page.get_by_text("reading the run").first.wait_for()
        page.keyboard.press("r")  # before that run is there
        wait_for_run(page, "person")
        wait_for_frame(page, LOST)
        page.keyboard.press("Home")  # the pictures were not clicked
        wait_for_frame(page, 0)
        page.locator("h1").click()
        page.get_by_label("run", exact=True).focus()  # as a list does of itself, late after a choice
        page.keyboard.press("End")
        wait_for_frame(page, N - 1)
        page.keyboard.press("Tab")
        page.get_by_label("run", exact=True).focus()  # who comes by keys is in the list
        page.keyboard.press("Home")
        assert page.evaluate("document.querySelector('canvas.view').view.wanted") == N - 1
        page.get_by_role("button", name="next lost or unseen").press("Home")
        wait_for_frame(page, 0)
        page.get_by_role("button", name="next lost or unseen").press("ArrowRight")
        wait_for_frame(page, 1)
        page.get_by_role("button", name="next lost or unseen").press(" ")  # which has pressed it
        wait_for_frame(page, LOST)
