"""The studio's server: its pages, its pictures, and nothing else; on the loopback alone."""

from __future__ import annotations

import asyncio
import gc
import math
import os
import secrets
import socket
import webbrowser
from collections.abc import Awaitable, Callable
from contextlib import suppress
from pathlib import Path
from threading import Thread

from nicegui import app, binding, ui
from nicegui.server import Server

from airborne.errors import AirborneError, TrialError
from airborne.io.folder_lock import InUseError, sole_writer
from airborne.io.text import read_text
from airborne.studio.curve_data import run_curves
from airborne.studio.folder import require_writable
from airborne.studio.guard import Guard
from airborne.studio.pages.body import body_page
from airborne.studio.pages.cameras import cameras_page
from airborne.studio.pages.digitise import digitise_page
from airborne.studio.pages.first_pose import first_pose_page
from airborne.studio.pages.results import results_page
from airborne.studio.pages.review import review_page
from airborne.studio.pages.ruler import ruler_page
from airborne.studio.pages.sync import sync_page
from airborne.studio.pages.thing import thing_page
from airborne.studio.pages.track import track_page
from airborne.studio.pages.videos import videos_page
from airborne.studio.project import find_trial, list_runs
from airborne.studio.routes import add_routes
from airborne.studio.session import Session
from airborne.studio.writing import FOLDER

_HOST = "127.0.0.1"
_ADDRESS, _LONGEST_ADDRESS = "address", 200  # the file that holds it; bytes
_SOON_S = 0.05  # between looks whether the server listens
# chosen: for a window whose computer is busy, which sooner would be taken for closed and begin anew, and for a page
# to be built there
_PATIENCE_S = 20.0
_STYLE = Path(__file__).with_name("studio.css")
_PAGES = {
    "/": videos_page,
    "/sync": sync_page,
    "/cameras": cameras_page,
    "/body": body_page,
    "/ruler": ruler_page,
    "/thing": thing_page,
    "/start": first_pose_page,
    "/track": track_page,
    "/review": review_page,
    "/digitise": digitise_page,
    "/results": results_page,
}


def serve(path: Path, *, port: int, browser: bool, is_guided: bool) -> None:
    """Serve a folder, or one of its trials, until the process is stopped. Raises AirborneError.

    A folder that another studio has open is refused: what one undoes, the other would not know.
    """
    session, port = Session(*find_trial(path), is_guided=is_guided), _free_port(port)
    require_writable(session.folder)
    home, token = f"http://{_HOST}:{port}", secrets.token_urlsafe(24)
    try:
        with sole_writer(session.folder / FOLDER, home):
            _keep_address(session.folder, f"{home}/?token={token}")
            _serve(session, port, token, browser=browser)
    except InUseError as error:
        known = _read_address(session.folder)
        where = f"open {known}" if known.partition("/?")[0] in error.holder.split() else "go on in its window"
        raise TrialError(
            f"{session.folder} is open in another studio ({error.holder or 'just started'}); {where}, or end it first"
        ) from None


def _keep_address(folder: Path, address: str) -> None:
    """Keep the address, with its token, where this user alone may read it: for whoever opens the folder again."""
    path = folder / FOLDER / _ADDRESS
    path.unlink(missing_ok=True)
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
        file.write(address)


def _read_address(folder: Path) -> str:
    try:
        return read_text(folder / FOLDER / _ADDRESS, _LONGEST_ADDRESS)
    except (OSError, ValueError):
        return ""


def _serve(session: Session, port: int, token: str, *, browser: bool) -> None:
    here = session.place.page if session.place.page in _PAGES else "/"
    address = f"http://{_HOST}:{port}{here}?token={token}"
    for url, build in _PAGES.items():
        page = ui.page(url, title=f"Airborne: {session.folder.name}", response_timeout=_PATIENCE_S)
        page(_page(url, build, session))
    add_routes(app, session)
    ui.add_css(_STYLE, shared=True)
    app.add_middleware(Guard, token=token, port=port)

    async def announce() -> None:
        Thread(target=_read_ahead, args=(session,), daemon=True).start()  # while the browser opens
        while not Server.instance.started:
            await asyncio.sleep(_SOON_S)
        gc.freeze()  # what was imported stays: to look through its 300,000 objects again took a quarter of a second
        print(f"airborne studio: {address}\nCtrl-C ends it", flush=True)
        if browser:
            webbrowser.open(address)
        session.pictures.prefetch.start()

    app.config.quasar_config["loadingBar"]["skipHijack"] = True  # it has no name; what takes long says so itself
    binding.MAX_PROPAGATION_TIME = math.inf  # [s]; beyond it NiceGUI writes a line for developers to the terminal
    app.on_startup(announce)
    app.on_shutdown(session.pictures.prefetch.close)
    app.on_shutdown(lambda: [command.stop() for command in session.commands.values() if command.is_own])
    ui.run(
        host=_HOST,
        port=port,
        show=False,
        reload=False,
        tailwind=False,
        title="Airborne",
        language="en-US",
        show_welcome_message=False,
        gzip_middleware_factory=None,
        reconnect_timeout=_PATIENCE_S,
        favicon=_STYLE.with_name("icon.svg"),
    )


def _read_ahead(session: Session) -> None:
    """Read what takes long of a long recording: when its pictures are shown, and the newest run."""
    with suppress(AirborneError, OSError):
        session.shown()
        for run in list_runs(session.folder)[:1]:
            run_curves(run)


def _page(url: str, build: Callable[[Session], Awaitable[None]], session: Session) -> Callable[[], Awaitable[None]]:
    """Bind a page to the session: NiceGUI takes a page's arguments from the address."""

    async def page() -> None:
        session.go(page=url)
        await build(session)

    return page


def _free_port(port: int) -> int:
    with socket.socket() as probe:
        try:
            probe.bind((_HOST, port))
        except OSError as error:
            raise AirborneError(f"port {port} cannot be used ({error.strerror}); give another, or none") from None
        return probe.getsockname()[1]
