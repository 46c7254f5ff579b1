"""The report opened from Results, in a real browser: it shows any frame, and can ask neither the studio nor others."""

import re
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

import numpy as np
import pytest

from airborne.export.film import Film
from airborne.export.players_report import write_players_report
from airborne.export.report import write_report
from airborne.export.summary import headline
from airborne.export.viewer import body_viewer
from airborne.motion.run_folder import JOINTS, MOTION, PICTURES, REPORT, videos_of
from tests.export.test_players_report import summary_of
from tests.support import jumping
from tests.support.browser import open_page
from tests.support.export_scenes import PERSON, person_run
from tests.support.studio import fork_studio

ASK = """async ([own, other]) => {
    const tries = {}, once = (element, name) => new Promise((done) => {
        element.onload = () => done(true);
        element.onerror = () => done(false);
        setTimeout(() => done(false), 3000);
        Object.assign(element, name);
        document.body.append(element);
    });
    const make = (tag) => document.createElement(tag);
    for (const to of [own, other]) {
        tries[`fetch ${to}`] = fetch(to).then(() => true, () => false);
        tries[`blind fetch ${to}`] = fetch(to, { mode: "no-cors" }).then(() => true, () => false);
        tries[`request ${to}`] = new Promise((done) => {
            const request = new XMLHttpRequest();
            request.onload = () => done(true);
            request.onerror = () => done(false);
            request.open("GET", to);
            request.send();
        });
        tries[`image ${to}`] = once(make("img"), { src: to });
        tries[`script ${to}`] = once(make("script"), { src: to });
        tries[`style ${to}`] = once(make("link"), { rel: "stylesheet", href: to });
        tries[`module ${to}`] = import(to).then(() => true, () => false);
        tries[`socket ${to}`] = new Promise((done) => {
            try {
                const socket = new WebSocket(to.replace("http", "ws"));
                socket.onopen = () => done(true);
                socket.onerror = () => done(false);
            } catch { done(false); }
        });
        once(make("iframe"), { src: to });
        navigator.sendBeacon(to);
    }
    const found = [];
    for (const [name, asked] of Object.entries(tries)) if (await asked) found.push(name);
    try { document.cookie; found.push("cookie"); } catch { /* it has no origin */ }
    try { localStorage; found.push("storage"); } catch { /* it has no origin */ }
    if (window.opener) found.push("opener");
    return [found, self.origin];
}"""


@contextmanager
def other_server():
    """Another server on this computer, which answers everybody: its address, and what it was asked."""
    asked: list[str] = []

    class Answers(BaseHTTPRequestHandler):
        def do_GET(self):
            asked.append(self.path)
            self.send_response(200)
            self.send_header("access-control-allow-origin", "*")
            self.end_headers()

        do_POST = do_GET

        def log_message(self, *_):
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Answers) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/", asked
        server.shutdown()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the report of a person and that of players."""
    folder = tmp_path_factory.mktemp("studio") / "reports"
    run, players = folder / "results", folder / "players"
    for each, file in ((run, MOTION), (players, JOINTS)):
        each.mkdir(parents=True)
        (each / file).write_text("frame\n0\n")  # a run has a frame
    motion = person_run()
    film = Film(videos_of(run) / PICTURES, ["left", "right"])
    for frame in motion.index.tolist():
        film.add(frame, [np.full((90, 160, 3), 90, np.uint8)] * 2)
    film.write()
    summary = {"name": "a person", **headline(motion), "warnings": []}
    write_report(run, summary, body_viewer(run, motion, PERSON))
    write_players_report(players, summary_of([]), jumping.motion_of(jumping.Jumper()))
    for report in (run / REPORT, players / REPORT):  # a stranger's report forbids itself nothing
        text = report.read_text(encoding="utf-8")
        assert "<meta http-equiv" in text
        report.write_text(re.sub("<meta http-equiv=.*>", "", text), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def results(folder):
    """The page Results, the requests that left it, and the studio's address."""
    requests: list[str] = []
    with fork_studio(folder) as address, open_page(address.replace("/?", "/results?"), requests) as page:
        yield page, requests, "/".join(address.split("/")[:3])


def open_report(page, name):
    with page.expect_popup() as popup:
        page.locator(f"a[href='/file/{name}/{REPORT}']").click()
    popup.value.locator("#viewer").wait_for()
    return popup.value


@pytest.mark.parametrize("name", ["results", "players"])
def test_the_report_steps_a_frame_and_shows_its_3d(name, results):
    report = open_report(results[0], name)
    view, solid = report.locator("#viewer"), report.locator(".in-3d")
    first = view.get_attribute("data-frame")
    before = report.locator("#viewer").screenshot()
    if name == "results":
        alone = solid.screenshot()
        assert len(set(alone)) > 50  # it is drawn
    report.locator("#viewer .curves").press("Shift+ArrowRight")
    report.wait_for_function("first => document.getElementById('viewer').dataset.frame !== first", arg=first)
    assert report.locator("#viewer").screenshot() != before
    if name == "results":
        assert solid.screenshot() != alone
        report.wait_for_function("() => [...document.querySelectorAll('.film img')].every((each) => each.naturalWidth)")
        with report.expect_download() as saved:
            report.get_by_role("link", name="Save the body in motion").click()
        assert saved.value.path().read_bytes()[:4] == b"glTF"
    report.close()


@pytest.mark.parametrize("name", ["results", "players"])
def test_the_report_can_ask_for_nothing(name, results):
    page, requests, studio = results
    report, n_before = open_report(page, name), len(requests)
    with other_server() as (other, asked_there):
        found, origin = report.evaluate(ASK, [f"{studio}/file/results/{REPORT}", other])
    asked = [request for request in requests[n_before:] if "socket.io" not in request]  # of the page Results
    assert (found, origin, asked, asked_there) == ([], "null", [], [])
    report.close()
