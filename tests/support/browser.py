"""One real browser a process, which looks at pages; each page is that of a user who was never there."""

import asyncio
import atexit
import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import pytest

# the first needs three quarters of the others' time: it is the same without a window
BROWSERS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
SIZE = {"width": 1280, "height": 720}
MINUTE = 60_000  # ms
TIMEOUT_MS = 3 * MINUTE  # of a busy machine
NO_PROXY = "http://127.0.0.1:9"  # where nothing listens; the loopback itself needs none
NO_SMOOTHING = "--webgl-antialiasing-mode=none"  # of 3D scenes, which a processor draws here
BROWSER_FLAGS = ["--no-sandbox", "--enable-unsafe-swiftshader", NO_SMOOTHING, f"--proxy-server={NO_PROXY}"]


@contextmanager
def open_page(address: str, requests: list[str] | None = None) -> Iterator:
    """Open an address in a real browser; skip without one. A request or socket to elsewhere fails the test.

    `requests` takes the addresses that are asked for.
    """
    with open_blank(address, requests) as page:
        page.goto(address)
        yield page


@contextmanager
def open_blank(address: str, requests: list[str] | None = None) -> Iterator:
    """Open a page that has not yet gone anywhere, and may go to the server of an address alone; as `open_page`."""
    host = address.split("/")[2]
    with _browser_page(lambda url: url.split("/")[2] == host, [] if requests is None else requests) as page:
        yield page


@contextmanager
def open_file(path: Path) -> Iterator:
    """Open a page from a file in a real browser; skip without one. Any request fails the test."""
    with _browser_page(lambda url: False, []) as page:
        page.goto(path.absolute().as_uri())
        yield page


@contextmanager
def _browser_page(is_allowed: Callable[[str], bool], requests: list[str]) -> Iterator:
    errors: list[str] = []

    def note(url: str) -> None:
        if re.match("https?:|wss?:", url):
            requests.append(url)
            if not is_allowed(url):
                errors.append(f"a request to {url}")

    with _fresh_context() as context:
        # listen only: a route would keep caches from use; what a policy of the page stops leaves nothing
        context.on("response", lambda response: note(response.url))
        context.on("requestfailed", lambda request: None if request.failure == "csp" else note(request.url))
        context.on("page", lambda each: each.on("websocket", lambda socket: note(socket.url)))
        context.set_default_timeout(TIMEOUT_MS)
        page = context.new_page()
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        yield page
        assert not errors, errors


@contextmanager
def _fresh_context() -> Iterator:
    """Yield what keeps cookies and caches apart from those of other pages, in the process's one browser."""
    reason = "THE STUDIO IS NOT TESTED IN A BROWSER: playwright is not installed; pip install -e '.[test]'"
    pytest.importorskip("playwright.sync_api", reason=reason)
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        pytest.skip("THE STUDIO IS NOT TESTED IN A BROWSER: no Chromium is installed; apt-get install chromium")
    chromium, loop = _launch(program)
    if not chromium.is_connected():  # it crashed under another test
        _launch.cache_clear()
        chromium, loop = _launch(program)
    asyncio._set_running_loop(loop)
    context = chromium.new_context(viewport=SIZE, reduced_motion="reduce")  # nothing is waited for that fades
    try:
        yield context
    finally:
        context.close()
        asyncio._set_running_loop(None)  # the driver's loop waits for the next page: others may run theirs


@cache
def _launch(program: str):
    """Start the browser, which runs until the process ends; return it with the loop that its driver runs."""
    from playwright.sync_api import sync_playwright

    driver = sync_playwright().start()
    loop = asyncio.get_running_loop()

    def stop() -> None:
        asyncio._set_running_loop(loop)
        driver.stop()

    atexit.register(stop)
    return driver.chromium.launch(executable_path=program, args=BROWSER_FLAGS), loop
