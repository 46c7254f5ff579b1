"""What takes longer than a tenth of a second says so on the page until it ends; in a real browser."""

import time

import pytest

from airborne.studio import commands
from airborne.studio.commands import Command
from airborne.studio.pages import body, cameras, results
from airborne.studio.session import Session
from tests.support.browser import open_page
from tests.support.players_trial import write_run, write_trial
from tests.support.studio import fork_studio, wait_for_frame

SLOW_S = 0.5  # what a read takes in these tests


def slow(function):
    """Return what does the same, but slowly."""

    def wait(*arguments):
        time.sleep(SLOW_S)
        return function(*arguments)

    return wait


def slow_down():
    """Let what the studio reads, and the end of a command, take their time; a command goes on until it is stopped."""
    commands._RUN = "import time; time.sleep(600)"
    body.list_bodies, body.list_measurements = slow(body.list_bodies), slow(body.list_measurements)
    cameras.list_calibrations = slow(cameras.list_calibrations)
    results._read_run = slow(results._read_run)
    Command.stop = slow(Command.stop)
    Session.rig = slow(Session.rig)


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    folder = tmp_path_factory.mktemp("studio") / "slow"
    write_trial(folder)
    write_run(folder / "results")
    with fork_studio(folder, before=slow_down) as address:
        yield address


def wait_for_note(page, text):
    """Wait until a note is there, and gone."""
    note = page.locator(".q-notification", has_text=f"{text} …")
    note.wait_for()
    note.wait_for(state="detached")


@pytest.mark.parametrize(
    ("step", "notes", "then"),
    [
        ("body", ["reading the bodies", "reading the measurements"], "Use players"),
        ("cameras", ["reading the calibrations"], "volleyball court"),
        ("results", ["reading results"], "Tables"),
    ],
)
def test_a_slow_read_is_announced_until_it_ends(address, step, notes, then):
    with open_page(address.replace("/?", f"/{step}?")) as page:
        shown = [page.locator(".q-notification", has_text=f"{note} …") for note in notes]
        for each in shown:  # a busy machine may see one go only when the next has come
            each.wait_for()
        for each in shown:
            each.wait_for(state="detached")
        page.get_by_text(then).first.wait_for()


def test_a_slow_stop_and_slow_help_are_announced_and_quick_ones_are_not(address):
    with open_page(address.replace("/?", "/digitise?")) as page:
        wait_for_frame(page, 0)
        page.get_by_role("switch", name="epipolar help").click()
        wait_for_note(page, "calibrating the cameras")
        page.evaluate("""() => {
            window.notes = 0;
            const added = (records) => records.flatMap((each) => [...each.addedNodes]);
            const isNote = (node) => node.classList?.contains("q-notification");
            new MutationObserver((records) => { window.notes += added(records).filter(isNote).length; })
                .observe(document.body, { childList: true, subtree: true });
        }""")
        page.get_by_role("switch", name="epipolar help").click()  # off: nothing to read
        page.wait_for_timeout(500)
        assert page.evaluate("window.notes") == 0
        page.goto("/".join([*address.split("/")[:3], "sync"]))
        page.get_by_role("button", name="Find the offsets").click()
        page.get_by_role("button", name="Stop", exact=True).click()
        wait_for_note(page, "stopping")
