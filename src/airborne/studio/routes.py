"""What pages fetch beside themselves: pictures, thumbnails, outlines and curves of runs, files of runs."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from threading import Event
from typing import Any, NamedTuple

from fastapi import FastAPI, Request
from fastapi.responses import FileResponse, JSONResponse, Response

from airborne import export
from airborne.body import BodyModel
from airborne.errors import AirborneError, ResultError
from airborne.export.pictures import thumbnail
from airborne.motion.run_folder import REPORT, SUMMARY
from airborne.studio.calibrating import find_picture
from airborne.studio.curve_data import run_curves
from airborne.studio.field_order import ORDERS, order_jpeg
from airborne.studio.guard import FILE_POLICY, REPORT_POLICY
from airborne.studio.not_found import not_found_html
from airborne.studio.outlines import BESIDE_COLOUR, run_overlay
from airborne.studio.pictures import SHRINKS
from airborne.studio.project import find_run, list_videos
from airborne.studio.runs import last_frame, run_body
from airborne.studio.session import Session
from airborne.studio.stage import part_stl
from airborne.studio.starts import FOUND_PICTURE
from airborne.video import VideoSource
from airborne.video.decoding import decode, inspect, rgb_from_decoded

_WORKERS = ThreadPoolExecutor(4, thread_name_prefix="answers")  # more would only hold more pictures at once
_PREVIEWERS = ThreadPoolExecutor(2, thread_name_prefix="previews")  # beside all of those, which may decode for long
_THUMBNAIL_PX = 240  # wide
_SCRIPTS = (  # that components import
    Path(export.__file__).parent / "templates" / "curves.js",  # drawn alike in the report
    *(Path(__file__).with_name(name) for name in ("view_drawing.js", "view_frames.js", "page_keys.js")),
)
_EXAMPLES = Path(__file__).with_name("examples")  # pictures of each step, which a test draws
_KEEP = {"cache-control": "private, max-age=3600"}


class PictureQuery(NamedTuple):
    """How a picture is asked for."""

    shrink: int  # times smaller than the video
    is_near: bool  # the last key frame before it is enough
    is_wanted: Callable[[], bool]  # whether the browser still waits


def add_routes(app: FastAPI, session: Session) -> None:
    """Add the routes of a session; every name in an address is one of a list, none is a path."""

    @app.exception_handler(404)
    async def not_found(request: Request, error: Exception) -> Response:
        is_page = "text/html" in request.headers.get("accept", "")
        text = not_found_html(session, request.url.path) if is_page else "not found"
        return Response(text, status_code=404, media_type="text/html" if is_page else "text/plain")

    @app.get("/image/{camera}/{frame}")
    async def image(request: Request, camera: int, frame: int, *, shrink: int = 1, near: bool = False) -> Response:
        async with _waiting(request) as is_wanted:
            query = PictureQuery(shrink, near, is_wanted)
            return await _answer(lambda: _jpeg(session, camera, frame, query), _PREVIEWERS if near else _WORKERS)

    @app.get("/picture/{camera}/{number}")
    async def own_picture(
        request: Request, camera: int, number: int, *, shrink: int = 1, near: bool = False
    ) -> Response:
        async with _waiting(request) as is_wanted:
            query = PictureQuery(shrink, near, is_wanted)
            return await _answer(lambda: _picture(session, camera, number, query), _PREVIEWERS if near else _WORKERS)

    @app.get("/thumbnail/{name}")
    async def first_picture(name: str) -> Response:
        return await _answer(lambda: _thumbnail(session.folder, name))

    @app.get("/fields/{order}/{name}")
    async def fields(order: str, name: str) -> Response:
        return await _answer(lambda: _fields(session.folder, name, order))

    @app.get("/example/{name}")
    async def example(name: str) -> Response:
        path = next((path for path in _EXAMPLES.glob("*.jpg") if path.name == name), None)
        return FileResponse(path, headers=_KEEP) if path else Response(status_code=404)

    @app.get("/parts/{name}")
    async def script(name: str) -> Response:
        path = next((path for path in _SCRIPTS if path.name == name), None)
        headers = {"cache-control": "no-store"}  # another version may be served at the same address
        return FileResponse(path, media_type="text/javascript", headers=headers) if path else Response(status_code=404)

    @app.get("/overlay/{run}/{frame}")
    async def overlay(run: str, frame: int, beside: str = "") -> Response:
        return await _answer(lambda: _json(_overlay(session, run, frame, beside)))

    @app.get("/curves/{run}")
    async def curves(run: str, beside: str = "", of: str = "") -> Response:
        return await _answer(lambda: _json(_curves(session, run, beside, of)))

    @app.get("/mesh/{run}/{part}")
    async def mesh(run: str, part: int) -> Response:
        return await _answer(lambda: _mesh(run_body(_run(session.folder, run)), part))

    @app.get("/body/mesh/{part}")
    async def body_mesh(part: int) -> Response:
        return await _answer(lambda: _mesh(session.project().model(), part))

    @app.get("/calibration/{name}")
    async def calibration(name: str) -> Response:
        return await _answer(lambda: _calibration(session.folder, name))

    @app.get("/candidates")
    async def candidates() -> Response:
        return await _answer(lambda: _candidates(session))

    @app.get("/file/{run}/{name:path}")
    async def file(run: str, name: str) -> Response:
        return await _answer(lambda: _file(_run(session.folder, run), name))


def _run(folder: Path, name: str) -> Path:
    """Return a run of the folder by its name; raises ResultError."""
    run = find_run(folder, name)
    if run is None:
        raise ResultError(f"there is no run {name} any more; reload this page")
    return run


def _overlay(session: Session, name: str, frame: int, beside: str) -> dict[str, Any]:
    """Return what a run, and another one beside it, draw over a frame; nothing where it has not begun."""
    run, cameras = find_run(session.folder, name), session.shown().names
    if run is None:
        return {"items": [], "label": ""}
    own = run_overlay(run, frame, cameras)
    if not beside:
        return own
    other = run_overlay(_run(session.folder, beside), frame, cameras, colour=BESIDE_COLOUR)
    return {"items": [*other["items"], *own["items"]], "label": own["label"]}


def _curves(session: Session, name: str, beside: str, what: str) -> dict[str, Any]:
    run = _run(session.folder, name)
    own = run_curves(run, what)
    if not (run / SUMMARY).is_file():  # it goes on, or will
        with suppress(AirborneError):
            own["last"] = last_frame(session.project().trial(), len(session.shown().clock))
    return {**own, "beside": run_curves(_run(session.folder, beside), what)} if beside else own


async def _answer(make: Callable[[], Response], workers: ThreadPoolExecutor = _WORKERS) -> Response:
    """Make an answer in a thread; what is not there is a plain line."""
    try:
        return await asyncio.get_running_loop().run_in_executor(workers, make)
    except (AirborneError, OSError) as error:
        reason = str(error) if isinstance(error, AirborneError) else "it cannot be read"
        return Response(reason, status_code=404, media_type="text/plain")


@asynccontextmanager
async def _waiting(request: Request) -> AsyncIterator[Callable[[], bool]]:
    """Give what says whether the browser still waits for an answer: it gives up what a jump has overtaken."""
    has_gone = Event()

    async def watch() -> None:
        while (await request.receive())["type"] != "http.disconnect":
            pass
        has_gone.set()

    watcher = asyncio.create_task(watch())
    try:
        yield lambda: not has_gone.is_set()
    finally:
        watcher.cancel()


def _json(value: Any) -> Response:
    return JSONResponse(value, headers={"cache-control": "no-store"})


def _mesh(model: BodyModel, part: int) -> Response:
    return Response(part_stl(model, part), media_type="model/stl", headers={"cache-control": "no-store"})


def _jpeg(session: Session, camera: int, frame: int, query: PictureQuery) -> Response:
    shown = session.shown()
    if not (0 <= camera < len(shown.sources) and 0 <= frame < len(shown.clock)):
        return Response(status_code=404)
    answer = _picture(session, camera, int(shown.clock.images[frame, camera]), query)
    answer.headers["x-time-s"] = repr(float(shown.clock.times_s[frame]))
    return answer


def _picture(session: Session, camera: int, number: int, query: PictureQuery) -> Response:
    """Return a picture of a camera by its number in the file."""
    shown = session.shown()
    if not (0 <= camera < len(shown.sources) and number < len(shown.indexes[camera]) and query.shrink in SHRINKS):
        return Response(status_code=404)
    if query.is_near and number >= 0:
        number = shown.indexes[camera].key_before(number)
    source, make = shown.sources[camera], session.pictures.jpeg
    jpeg = None if number < 0 else make(source, number, query.shrink, query.is_wanted, is_passing=query.is_near)
    if jpeg is None:
        return Response(status_code=204)  # this camera has no picture then
    return Response(jpeg, media_type="image/jpeg", headers=_KEEP)


def _find_video(folder: Path, name: str) -> Path | None:
    return next((path for path in list_videos(folder) if path.name == name), None)


def _fields(folder: Path, name: str, order: str) -> Response:
    path = _find_video(folder, name)
    if path is None or order not in ORDERS:
        return Response(status_code=404)
    return Response(order_jpeg(path, order), media_type="image/jpeg", headers=_KEEP)


def _thumbnail(folder: Path, name: str) -> Response:
    path = _find_video(folder, name)
    if path is None:
        return Response(status_code=404)
    source = VideoSource(name, path)
    facts = inspect(source)
    first = next(decode(source, facts))
    jpeg = thumbnail(rgb_from_decoded(first, facts), _THUMBNAIL_PX)
    return Response(jpeg, media_type="image/jpeg", headers=_KEEP)


def _calibration(folder: Path, name: str) -> Response:
    path = find_picture(folder, name)
    return Response(status_code=404) if path is None else FileResponse(path, headers=_KEEP)


def _candidates(session: Session) -> Response:
    path = session.file(FOUND_PICTURE)
    headers = {"cache-control": "no-store"}
    return FileResponse(path, headers=headers) if path.is_file() else Response(status_code=404)


def _file(run: Path, name: str) -> Response:
    path = (run / name).resolve()
    if not (path.is_relative_to(run.resolve()) and path.is_file()):
        return Response(status_code=404)
    policy = REPORT_POLICY if name == REPORT else FILE_POLICY
    return FileResponse(path, headers={"content-security-policy": policy, "cache-control": "no-store"})
