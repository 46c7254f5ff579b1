"""Changes of a trial's TOML text: comments, order and everything else in it stay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import tomlkit
from tomlkit.items import Table

from airborne.errors import TrialError, count
from airborne.io.text import parse_editable_toml


def with_cameras(text: str, name: str, cameras: Sequence[Mapping[str, Any]]) -> str:
    """Return a trial's text with these cameras, `name` for a trial without one.

    Of a video that was a camera before, keys not given keep their values; None takes a key away.
    """
    document = _parse(text)
    if "name" not in document:
        document.add("name", tomlkit.item(name))
    present = document.get("camera")
    old = {str(table.get("video")): table for table in present if isinstance(table, dict)} if present else {}
    tables = tomlkit.aot()
    for camera in cameras:
        known = old.get(str(camera["video"]), {})
        table = known if isinstance(known, Table) else tomlkit.item(dict(known))
        for key, value in camera.items():
            _set(table, key, value)
        tables.append(table)
    if present is None:
        document.add("camera", tables)
    else:
        document["camera"] = tables
    return tomlkit.dumps(document)


def with_table(text: str, head: str, values: Mapping[str, Any]) -> str:
    """Return a trial's text with values in a table, made if need be; None takes a key away."""
    document = _parse(text)
    table = document.get(head)
    if table is None:
        table = tomlkit.table()
        document.add(head, table)
    if not isinstance(table, dict):
        raise TrialError(f"{head} is no table of the trial; correct the file by hand")
    for key, value in values.items():
        _set(table, key, value)
    return tomlkit.dumps(document)


def with_clicks(text: str, frame: int, camera: str, clicks: Mapping[str, Sequence[float]]) -> str:
    """Return a trial's text with points clicked in a camera: in the [[key]] of that frame, made if need be.

    Raises TrialError where that key has its clicks in a table of their own.
    """
    document = _parse(text)
    key = _key(document, frame)
    points = key.setdefault("points_px", tomlkit.table())
    if not isinstance(points, dict):
        raise TrialError(f"the key of frame {frame} has its clicks in {points}; correct them there")
    for point, px in clicks.items():
        old = {name: [float(n) for n in at] for name, at in points.get(point, {}).items()}
        inline = tomlkit.inline_table()
        inline.update({**old, camera: [round(float(n), 1) for n in px]})
        points[point] = inline
    return tomlkit.dumps(document)


def with_key(text: str, frame: int, values: Mapping[str, Any]) -> str:
    """Return a trial's text with values in the [[key]] of a frame, made if need be; None takes a key away."""
    document = _parse(text)
    key = _key(document, frame)
    for name, value in values.items():
        _set(key, name, value)
    return tomlkit.dumps(document)


def without_key(text: str, frame: int) -> str:
    """Return a trial's text without the [[key]] of a frame."""
    document = _parse(text)
    keys = document.get("key", [])
    numbers = [number for number, each in enumerate(keys) if each.get("frame") == frame]
    if not numbers:
        raise TrialError(f"the trial has no key of frame {frame}; reload this page")
    for number in reversed(numbers):
        del keys[number]
    if not keys:
        del document["key"]
    return tomlkit.dumps(document)


def with_mask(text: str, camera: str, first: int, last: int) -> str:
    """Return a trial's text with a camera left out from the first to the last frame."""
    document = _parse(text)
    mask = tomlkit.table()
    mask.update({"camera": camera, "first": first, "last": last})
    _append(document, "mask", mask)
    return tomlkit.dumps(document)


def without_mask(text: str, number: int) -> str:
    """Return a trial's text without one of its masks, counted from 0."""
    document = _parse(text)
    masks = document.get("mask", [])
    if not 0 <= number < len(masks):
        raise TrialError(f"the trial has {count(len(masks), 'mask')}; reload this page")
    del masks[number]
    if not masks:
        del document["mask"]
    return tomlkit.dumps(document)


def with_players(text: str, frame: int, start_of: Mapping[str, Mapping[str, Any]], *, keeps_found: bool = False) -> str:
    """Return a trial's text whose start is these players: name -> its `points_px` or `joints_m`.

    With `keeps_found`, others whose joints the text has in metres, as they are found, in the same frame stay.
    """
    document = _parse(text)
    before = document.get("start", {})
    if keeps_found and before.get("frame", 0) == frame:
        found = [each for each in before.get("player", []) if "joints_m" in each]
        start_of = {**{each["name"]: {"joints_m": each["joints_m"]} for each in found}, **start_of}
    start, players = tomlkit.table(), tomlkit.aot()
    start.add("frame", frame)
    for name, points in start_of.items():
        player = tomlkit.table()
        player.update({"name": name, **points})
        players.append(player)
    start.add("player", players)
    document.pop("start", None)
    document.add("start", start)
    return tomlkit.dumps(document)


def _key(document: tomlkit.TOMLDocument, frame: int) -> Any:
    """Return the [[key]] of a frame, made if need be."""
    key = next((each for each in document.get("key", []) if each.get("frame") == frame), None)
    if key is None:
        key = tomlkit.table()
        key.add("frame", frame)
        _append(document, "key", key)
    return key


def _append(document: tomlkit.TOMLDocument, name: str, table: Table) -> None:
    """Add a table to an array of tables, below an empty line."""
    if document and not tomlkit.dumps(document).endswith("\n\n"):
        table.trivia.indent = "\n"
    document.setdefault(name, tomlkit.aot()).append(table)


def _set(table: Any, key: str, value: Any) -> None:
    if value is None:
        table.pop(key, None)
    else:
        table[key] = value


def _parse(text: str) -> tomlkit.TOMLDocument:
    try:
        return parse_editable_toml(text)
    except ValueError as error:
        raise TrialError(f"the trial file cannot be edited: {error}; correct it by hand") from None
