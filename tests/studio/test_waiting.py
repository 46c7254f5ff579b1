"""What takes longer than a tenth of a second says so on the page until it ends; in a real browser."""

import time
from contextlib import contextmanager

import pytest

from airborne.studio import commands
from airborne.studio.commands import Command
from airborne.studio.pages import body, cameras, results
from airborne.studio.session import Session
from tests.support.browser import open_blank
from tests.support.players_trial import write_run, write_trial
from tests.support.studio import fork_studio, wait_for_frame

SLOW_S = 0.5  # what a read takes in these tests
REMEMBER = """window.said = [];
    const remember = (records) => records.forEach((each) => each.addedNodes.forEach((node) => {
        const notes = [node, ...(node.querySelectorAll?.("*") ?? [])].filter((one) => one.matches?.(".q-notification"));
        window.said.push(...notes.map((note) => note.textContent));
    }));
    new MutationObserver(remember).observe(document, { childList: true, subtree: true });"""
WERE_SAID = "(notes) => notes.every((note) => window.said.some((text) => text.includes(note)))"


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


@contextmanager
def open_listening(address):
    """Open a page that remembers its notes: on a busy machine one comes and goes while nobody looks."""
    with open_blank(address) as page:
        page.add_init_script(REMEMBER)
        page.goto(address)
        yield page


def wait_for_notes(page, *texts):
    """Wait until each note was there, and is gone."""
    notes = [f"{text} …" for text in texts]
    page.wait_for_function(WERE_SAID, arg=notes)
    for note in notes:
        page.locator(".q-notification", has_text=note).wait_for(state="detached")


@pytest.mark.parametrize(
    ("step", "notes", "then"),
    [
        ("body", ["reading the bodies", "reading the measurements"], "Use players"),
        ("cameras", ["reading the calibrations"], "volleyball court"),
        ("results", ["reading results"], "Tables"),
    ],
)
def test_a_slow_read_is_announced_until_it_ends(address, step, notes, then):
    with open_listening(address.replace("/?", f"/{step}?")) as page:
        wait_for_notes(page, *notes)
        page.get_by_text(then).first.wait_for()


def test_a_slow_stop_and_slow_help_are_announced_and_quick_ones_are_not(address):
    with open_listening(address.replace("/?", "/digitise?")) as page:
        wait_for_frame(page, 0)
        page.get_by_role("switch", name="epipolar help").click()
        wait_for_notes(page, "calibrating the cameras")
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
        wait_for_notes(page, "stopping")
